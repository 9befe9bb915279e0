"""Spike times of a population of units over trials, wherever they come from."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from afferents.errors import InputError

CLASSES = ("SA", "RA", "PC")
"""Classes of afferents: slowly adapting type I, rapidly adapting type I, and Pacinian (RA-II)."""


def checked_units(units: Any, where: object) -> pd.DataFrame:
    """Return the units' table by name, whole: `class`, `resolution_s`, `receptive_field`.

    Raises
    ------
    InputError
        If a column is missing, a class is none of `CLASSES` or two units have one name.
    """
    table: pd.DataFrame = pd.DataFrame(units)
    if "name" in table:
        table = table.set_index("name")
    table.index = table.index.astype(str).rename("unit")
    if "class" not in table:
        raise InputError(
            f"{where}: expected a column 'class' of units, found columns {list(table)}"
        )
    other = sorted(set(table["class"]) - set(CLASSES))
    if other:
        raise InputError(f"{where}: expected classes of {', '.join(CLASSES)}, found '{other[0]}'")
    twice = table.index[table.index.duplicated()]
    if len(twice):
        raise InputError(
            f"{where}: expected units of different names, found two of the name '{twice[0]}'"
        )
    if "resolution_s" not in table:
        table["resolution_s"] = 0.0
    if "receptive_field" not in table:
        table["receptive_field"] = [()] * len(table)
    return table


def checked_trials(trials: Any, where: object) -> pd.DataFrame:
    """Return the trials' table, whole: `texture`, `speed_mm_s`, `repetition`, `duration_s`.

    Raises
    ------
    InputError
        If a column is missing, or a duration is no positive number.
    """
    table: pd.DataFrame = pd.DataFrame(trials).reset_index(drop=True)
    missing = {"texture", "duration_s"} - set(table)
    if missing:
        raise InputError(
            f"{where}: expected a column '{min(missing)}' of trials, found columns {list(table)}"
        )
    table["texture"] = table["texture"].astype(str)
    table["duration_s"] = table["duration_s"].astype(np.float64)
    if not (np.isfinite(table["duration_s"]) & (table["duration_s"] > 0)).all():
        raise InputError(
            f"{where}: expected trials of a positive duration in s, found one that is not"
        )
    table["speed_mm_s"] = (
        table["speed_mm_s"].astype(np.float64) if "speed_mm_s" in table else np.nan
    )
    if "repetition" not in table:
        table["repetition"] = table.groupby(["texture", "speed_mm_s"], dropna=False).cumcount()
    return table


def _require_times(
    times: NDArray[np.float64],
    offsets: NDArray[np.int64],
    units: pd.DataFrame,
    trials: pd.DataFrame,
    where: object,
) -> None:
    """Refuse times that can't be; say where units of ms are the likely reason."""
    train = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    trial, unit = np.divmod(train, max(len(units), 1))
    beyond = times > trials["duration_s"].to_numpy(np.float64)[trial]
    faults = {
        "finite times": ~np.isfinite(times),
        "times of 0 s or more, from the trial's start": times < 0,
        "times in ascending order": (np.diff(times, prepend=0) < 0)
        & (np.diff(train, prepend=-1) == 0),
        "times within the trial": beyond,
    }
    for expected, wrong in faults.items():
        if wrong.any():
            at, do = int(wrong.argmax()), ""
            if wrong is beyond:
                do = f"; {beyond.sum()} spikes lie beyond: give the trial's true duration"
                if beyond.mean() > 0.5:
                    do = "; most spikes lie beyond: if times are in ms, divide them by 1000"
            found = f"{times[at]:g} s in trial {trial[at]} of unit {units.index[unit[at]]}"
            raise InputError(f"{where}: expected {expected}, found {found}{do}")


def _offsets(lengths: ArrayLike) -> NDArray[np.int64]:
    """Return where each train begins among the spikes of all, and where the last ends."""
    return np.append(0, np.cumsum(lengths)).astype(np.int64)


@dataclass(frozen=True, eq=False)
class Spikes:
    """Spike times of units over trials: one ragged array, and what units and trials are.

    Artificial units and natural fibres are held alike, so each analysis takes either. A unit
    that was not recorded in a trial has no spikes there, which is not the same as silence.

    >>> spikes = Spikes.from_trains(
    ...     [[[0.1, 0.3], []], [[0.2], None]],
    ...     units={"name": ["a", "b"], "class": ["SA", "PC"]},
    ...     trials={"texture": ["1", "2"], "speed_mm_s": [40, 40], "duration_s": [1, 0.5]},
    ... )
    >>> spikes.train(0, 0)
    array([0.1, 0.3])
    >>> spikes.rates()
    array([[ 2.,  0.],
           [ 2., nan]])

    Attributes
    ----------
    times
        `(spike,)`, s from its trial's start, ascending within a trial and unit.
    offsets
        `(trial * unit + 1,)`: spikes of trial `t` and unit `u` are
        ``times[offsets[i] : offsets[i + 1]]`` with ``i = t * n_units + u``.
    units
        A row a unit, by name: `class` (of `CLASSES`), `resolution_s` (times are no finer than
        this, 0 where nothing limits them) and `receptive_field` (tuple of markers or channels).
    trials
        A row a trial: `texture`, `speed_mm_s` (NaN where it is not known), `repetition`,
        `duration_s`, and any further conditions.
    recorded
        `(trial, unit)`, whether the unit was there.
    """

    times: NDArray[np.float64]
    offsets: NDArray[np.int64]
    units: pd.DataFrame
    trials: pd.DataFrame
    recorded: NDArray[np.bool_]

    @classmethod
    def from_trains(
        cls,
        trains: Sequence[Sequence[ArrayLike | None]],
        units: Any,
        trials: Any,
        where: object = "spikes",
    ) -> Self:
        """Return the spikes of trains given trial by trial, unit by unit.

        Parameters
        ----------
        trains
            For each trial, for each unit, its times in s from the trial's start; None where the
            unit was not recorded.
        units, trials
            Anything that `pandas.DataFrame` takes. Units need `name` and `class`, trials
            `texture` and `duration_s`.
        where
            Named in errors: the file or variable they were read from.

        Raises
        ------
        InputError
            If a time is not finite, negative, before its predecessor or after the trial's end, if
            two units have one name, or if a column is missing.
        """
        unit_table, trial_table = checked_units(units, where), checked_trials(trials, where)
        shape = (len(trial_table), len(unit_table))
        if len(trains) != shape[0] or any(len(row) != shape[1] for row in trains):
            found = f"{len(trains)} of {sorted({len(row) for row in trains})}"
            raise InputError(
                f"{where}: expected trains of {shape[0]} trials of {shape[1]} units, found {found}"
            )
        recorded = np.array([[train is not None for train in row] for row in trains], bool)
        flat = [
            np.asarray([] if train is None else train, np.float64).ravel()
            for row in trains
            for train in row
        ]
        times, offsets = np.concatenate([*flat, np.empty(0)]), _offsets([*map(len, flat)])
        _require_times(times, offsets, unit_table, trial_table, where)
        return cls(times, offsets, unit_table, trial_table, recorded.reshape(shape))

    @property
    def n_units(self) -> int:
        """How many units there are."""
        return len(self.units)

    @property
    def n_trials(self) -> int:
        """How many trials there are."""
        return len(self.trials)

    def train(self, trial: int, unit: int) -> NDArray[np.float64]:
        """Return one unit's times in one trial, by their places; s, ascending."""
        at = trial * self.n_units + unit
        return self.times[self.offsets[at] : self.offsets[at + 1]]

    def counts(self) -> NDArray[np.float64]:
        """Return `(trial, unit)`, how many spikes; NaN where a unit was not recorded."""
        counts = np.diff(self.offsets).reshape(self.recorded.shape).astype(np.float64)
        counts[~self.recorded] = np.nan
        return counts

    def rates(self) -> NDArray[np.float64]:
        """Return `(trial, unit)`, spikes/s over whole trials; NaN where not recorded."""
        duration_s: NDArray[np.float64] = self.trials["duration_s"].to_numpy(np.float64)
        return self.counts() / duration_s[:, None]

    def binned(self, width_s: float, stop_s: float | None = None) -> xr.DataArray:
        """Return `(trial, unit, time)`, counts in bins of one width from each trial's start.

        Parameters
        ----------
        stop_s
            Where the last bin ends at the latest; without it, the shortest trial's end. Bins that
            don't fit whole are left out, and NaN stands where a unit was not recorded.

        Raises
        ------
        InputError
            If no whole bin fits.
        """
        shortest = float(self.trials["duration_s"].min())
        stop_s = shortest if stop_s is None else min(stop_s, shortest)
        n = int(np.floor(stop_s / width_s + 1e-9))
        if n < 1:
            raise InputError(f"bins: expected a width of at most {stop_s:g} s, found {width_s:g} s")
        # places of spikes in a flat (trial, unit, bin) array
        cells = np.repeat(np.arange(self.recorded.size), np.diff(self.offsets))
        inside = self.times < n * width_s
        bins = np.minimum(np.floor(self.times / width_s + 1e-9), n - 1).astype(np.int64)
        flat = np.bincount(cells[inside] * n + bins[inside], minlength=self.recorded.size * n)
        counts = flat.reshape(*self.recorded.shape, n).astype(np.float64)
        counts[~self.recorded] = np.nan
        coords = {"time": np.arange(n) * width_s, "unit": self.units.index.to_numpy(str)}
        return xr.DataArray(counts, coords, ("trial", "unit", "time"), attrs={"units": "spikes"})

    def select(
        self,
        trials: ArrayLike | None = None,
        units: ArrayLike | None = None,
    ) -> Self:
        """Return the spikes of some trials and units, by places or by a mask, in that order."""
        rows = np.arange(self.n_trials)[slice(None) if trials is None else np.asarray(trials)]
        columns = np.arange(self.n_units)[slice(None) if units is None else np.asarray(units)]
        cells = (rows[:, None] * self.n_units + columns).ravel()
        lengths = np.diff(self.offsets)[cells]
        offsets = _offsets(lengths)
        at = np.repeat(self.offsets[cells] - offsets[:-1], lengths) + np.arange(offsets[-1])
        return replace(
            self,
            times=self.times[at],
            offsets=offsets,
            units=self.units.iloc[columns],
            trials=self.trials.iloc[rows].reset_index(drop=True),
            recorded=self.recorded[np.ix_(rows, columns)],
        )

    def of_class(self, *classes: str) -> Self:
        """Return the units of some classes."""
        return self.select(units=self.units["class"].isin(classes).to_numpy())

    def window(self, start_s: float, stop_s: float) -> Self:
        """Return the spikes of a stretch of every trial, with times from its start.

        Raises
        ------
        InputError
            If a trial does not last so long.
        """
        shortest = float(self.trials["duration_s"].min())
        if not 0 <= start_s < stop_s <= shortest + 1e-9:
            raise InputError(
                f"window: expected a stretch of 0 to {shortest:g} s, found {start_s:g} to "
                f"{stop_s:g}"
            )
        kept = (self.times >= start_s) & (self.times < stop_s)
        before = np.concatenate([[0], np.cumsum(kept)])
        return replace(
            self,
            times=self.times[kept] - start_s,
            offsets=before[self.offsets],
            trials=self.trials.assign(duration_s=stop_s - start_s),
        )

    def stretched(self, factors: ArrayLike) -> Self:
        """Return trials with times and durations multiplied by a factor each.

        A drum at half the speed passes the same bumps in twice the time: by ``speed / other``, a
        train becomes what it would be at the other speed if spikes followed the surface alone.
        What the units' times resolve is stretched by the greatest factor.
        """
        factor = np.broadcast_to(np.asarray(factors, np.float64), self.n_trials)
        per_spike = np.repeat(np.repeat(factor, self.n_units), np.diff(self.offsets))
        return replace(
            self,
            times=self.times * per_spike,
            units=self.units.assign(resolution_s=self.units["resolution_s"] * factor.max()),
            trials=self.trials.assign(duration_s=self.trials["duration_s"] * factor),
        )

    def to_table(self) -> pd.DataFrame:
        """Return a row a spike: `trial`, `unit`, `class`, `texture`, `speed_mm_s`, `time_s`."""
        cells = np.repeat(np.arange(self.recorded.size), np.diff(self.offsets))
        trial, unit = np.divmod(cells, max(self.n_units, 1))
        return pd.DataFrame(
            {
                "trial": trial,
                "unit": self.units.index.to_numpy(str)[unit],
                "class": self.units["class"].to_numpy(str)[unit],
                "texture": self.trials["texture"].to_numpy(str)[trial],
                "speed_mm_s": self.trials["speed_mm_s"].to_numpy(np.float64)[trial],
                "time_s": self.times,
            }
        )


def joined(parts: Iterable[Spikes]) -> Spikes:
    """Return one population of the trials of several, which have the same units.

    Times of a unit are as fine as in the part where they are coarsest.

    Raises
    ------
    InputError
        If there is none, or units differ.
    """
    parts = list(parts)
    if not parts:
        raise InputError("spikes: expected at least one part, found none")
    if any(not part.units.index.equals(parts[0].units.index) for part in parts):
        raise InputError("spikes: expected parts of the same units, found units that differ")
    coarsest = np.max([part.units["resolution_s"] for part in parts], axis=0)
    return Spikes(
        np.concatenate([part.times for part in parts]),
        _offsets(np.concatenate([np.diff(part.offsets) for part in parts])),
        parts[0].units.assign(resolution_s=coarsest),
        pd.concat([part.trials for part in parts], ignore_index=True),
        np.concatenate([part.recorded for part in parts]),
    )
