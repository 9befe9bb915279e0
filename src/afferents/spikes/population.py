"""Spike times of a population of units over trials, wherever they come from."""

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from afferents.errors import InputError, reading

CLASSES = ("SA", "RA", "PC")
"""Classes of afferents: slowly adapting type I, rapidly adapting type I, and Pacinian (RA-II)."""
REFRACTORY_S = 0.5e-3
"""A fibre does not fire again sooner. The shortest of 458,270 intervals between spikes of the
monkey's fibres (docs/neuroscience.md) is 1.0 ms."""
_FEW = 30
"""Fewer spikes or intervals prove nothing: 30 at random miss the last third of a trial once in
200,000 cases."""
_INSTANT = 1 / 500
"""Share of a trial: spikes that are all earlier are in another unit of time."""


def check_tables(units: Any, trials: Any, where: object) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the tables of units, by name, and of trials, with all columns that `Spikes` has.

    Raises
    ------
    InputError
        If a column is missing, a class is none of `CLASSES` or two units have one name.
    """
    unit_table, trial_table = pd.DataFrame(units), pd.DataFrame(trials).reset_index(drop=True)
    for table, name, what in ((unit_table, "class", "units"), (trial_table, "texture", "trials")):
        if name not in table:
            raise InputError(
                f"{where}: expected a column '{name}' of {what}, found columns {list(table)}"
            )
    if "name" in unit_table:
        unit_table = unit_table.set_index("name")
    unit_table.index = unit_table.index.astype(str).rename("unit")
    if other := sorted(set(unit_table["class"]) - set(CLASSES)):
        raise InputError(f"{where}: expected classes of {', '.join(CLASSES)}, found '{other[0]}'")
    if len(twice := unit_table.index[unit_table.index.duplicated()]):
        raise InputError(
            f"{where}: expected units of different names, found two of the name '{twice[0]}'"
        )
    if "resolution_s" not in unit_table:
        unit_table["resolution_s"] = 0.0
    if "receptive_field" not in unit_table:
        unit_table["receptive_field"] = [()] * len(unit_table)
    trial_table["texture"] = trial_table["texture"].astype(str)
    speed_mm_s = trial_table.get("speed_mm_s", pd.Series(np.nan, trial_table.index))
    trial_table["speed_mm_s"] = speed_mm_s.astype(np.float64)
    if "repetition" not in trial_table:
        same = trial_table.groupby(["texture", "speed_mm_s"], dropna=False)
        trial_table["repetition"] = same.cumcount()
    return unit_table, trial_table


def _require_times(spikes: "Spikes", where: object) -> None:
    """Refuse times that can't be; say where a wrong unit is the likely reason."""
    times, (train, trial, unit) = spikes.times, spikes.places()
    lasting = spikes.durations_s.ravel()[train]
    beyond = times > lasting
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
            if expected == "times in ascending order":
                do = "; sort them, if they are of one trial"
            elif wrong is beyond and beyond.mean() > 0.5:
                do = "; most spikes lie beyond: if times are in ms, divide them by 1000 (or name a "
                do += "table's column time_ms)"
            elif wrong is beyond:
                do = f"; {beyond.sum()} spikes lie beyond: give the trial's true duration"
            found = f"{times[at]:g} s in trial {trial[at]} of unit {spikes.units.index[unit[at]]}"
            raise InputError(f"{where}: expected {expected}, found {found}{do}")
    if len(times) >= _FEW and (times < _INSTANT * lasting).all():
        raise InputError(
            f"{where}: expected spikes all through the trials, found all {len(times)} in the first "
            f"{1e3 * times.max():.2g} ms; if times are in s, don't divide them by 1000 (and name "
            "a table's column time_s)"
        )
    by_unit = _intervals(spikes).groupby("unit", sort=False)["short"].agg(["size", "sum"])
    twice = by_unit[(by_unit["size"] >= _FEW) & (by_unit["sum"] > by_unit["size"] / 3)]
    if len(twice):
        n, short = twice.sum()
        raise InputError(
            f"{where}: expected spikes of a fibre {1e3 * REFRACTORY_S:g} ms apart or more, its "
            f"refractory time, found {short} of {n} intervals shorter in {len(twice)} of "
            f"{spikes.n_units} units ({_list(twice.index)}); remove duplicate spikes, or "
            "give times in s"
        )


def _intervals(spikes: "Spikes") -> pd.DataFrame:
    """Return a row for each interval in a train: `s`, `unit`, and whether it is `short`."""
    train, _, unit = spikes.places()
    within = np.diff(train) == 0
    apart_s = np.diff(spikes.times)[within]
    unit_names = spikes.units.index.to_numpy(str)[unit[1:][within]]
    return pd.DataFrame({"s": apart_s, "unit": unit_names, "short": apart_s < REFRACTORY_S})


def doubts_about(spikes: "Spikes") -> list[str]:
    """Return what is likely wrong with durations and times, a sentence each.

    A unit whose trains all end early was recorded for a shorter time than is given, and its rates
    come out too low. Intervals below the refractory time are duplicate spikes, or those of
    two fibres. Where all intervals are as long as a refractory time whose ms were read as s, times
    and durations are in ms.
    """
    train, trial, unit = spikes.places()
    speed = spikes.trials["speed_mm_s"].map("{:g}".format).to_numpy(str)
    table = pd.DataFrame({
        "share": spikes.times / spikes.durations_s.ravel()[train],
        "unit": spikes.units.index.to_numpy(str)[unit],
        "speed": speed[trial],
    })  # fmt: skip
    last = table.groupby(["speed", "unit"], sort=False)["share"].agg(["size", "max"])
    early = last[(last["size"] >= _FEW) & (last["max"] < 2 / 3)].reset_index()
    found = []
    if len(early):
        names = early["unit"].unique()
        found.append(
            f"no train of {len(names)} of {spikes.n_units} units ({_list(names)}) reaches the last "
            f"third of its trial at {_list(early['speed'].unique())} mm/s: where recordings were "
            "shorter, rates come out too low; give each train its own duration (durations_s)"
        )
    intervals = _intervals(spikes)
    if len(short := intervals[intervals["short"]]):
        names = short["unit"].unique()
        found.append(
            f"{len(short)} of {len(intervals)} intervals between spikes are below the refractory "
            f"time of a fibre, {1e3 * REFRACTORY_S:g} ms, in {len(names)} units ({_list(names)}): "
            "look for duplicate spikes, and for two fibres in one unit"
        )
    if len(intervals) >= _FEW and intervals["s"].min() >= 1e3 * REFRACTORY_S:
        found.append(
            f"all spikes of a train are {intervals['s'].min():.2g} s apart or more: if times and "
            "durations are in ms, divide both by 1000"
        )
    return found


def _list(names: Iterable[str], most: int = 5) -> str:
    shown = list(names)
    return ", ".join(shown[:most]) + (", ..." if len(shown) > most else "")


def _set_durations(trials: pd.DataFrame, durations_s: NDArray[np.float64]) -> pd.DataFrame:
    """Return trials that last as long as the shortest of their trains; as before where none is."""
    shortest = np.fmin.reduce(durations_s, axis=1, initial=np.inf)
    before = trials.get("duration_s", np.nan)
    return trials.assign(duration_s=np.where(np.isfinite(shortest), shortest, before))


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
        `duration_s` (which all its trains last: the shortest), and any further conditions.
    durations_s
        `(trial, unit)`, how long each train was recorded; NaN where the unit was not.
    """

    times: NDArray[np.float64]
    offsets: NDArray[np.int64]
    units: pd.DataFrame
    trials: pd.DataFrame
    durations_s: NDArray[np.float64]

    @classmethod
    def from_trains(
        cls,
        trains: Sequence[Sequence[ArrayLike | None]],
        units: Any,
        trials: Any,
        where: object = "spikes",
        durations_s: ArrayLike | None = None,
    ) -> Self:
        """Return the spikes of trains given trial by trial, unit by unit.

        Warns of what `doubts_about` finds: durations that are longer than the trains, and intervals
        that no fibre has.

        Parameters
        ----------
        trains
            For each trial, for each unit, its times in s from the trial's start; None where the
            unit was not recorded.
        units, trials
            Anything that `pandas.DataFrame` takes. Units need `name` and `class`, trials
            `texture`, and `duration_s` unless `durations_s` is given.
        where
            Named in errors: the file or variable they were read from.
        durations_s
            Of each train, `(trial, unit)` or what broadcasts to it, where fibres were recorded for
            different times.

        Raises
        ------
        InputError
            If a time is not finite, negative, before its predecessor or after its train's end, if
            times are in another unit or duplicated, two units have one name, a column is missing,
            or a duration is no positive number.
        """
        found = cls.unchecked(trains, units, trials, where, durations_s)
        _require_times(found, where)
        for doubt in doubts_about(found):
            warnings.warn(f"{where}: {doubt}", stacklevel=2)
        return found

    @classmethod
    def unchecked(
        cls,
        trains: Sequence[Sequence[ArrayLike | None]],
        units: Any,
        trials: Any,
        where: object = "spikes",
        durations_s: ArrayLike | None = None,
    ) -> Self:
        """Return what `from_trains` does of times that were checked already."""
        unit_table, trial_table = check_tables(units, trials, where)
        shape = (len(trial_table), len(unit_table))
        if len(trains) != shape[0] or any(len(row) != shape[1] for row in trains):
            found = f"{len(trains)} of {sorted({len(row) for row in trains})}"
            raise InputError(
                f"{where}: expected trains of {shape[0]} trials of {shape[1]} units, found {found}"
            )
        if durations_s is None:
            if "duration_s" not in trial_table:
                raise InputError(
                    f"{where}: expected how long trials last, found columns {list(trial_table)}; "
                    "give trials a column duration_s, or each train its own (durations_s)"
                )
            durations_s = trial_table["duration_s"].to_numpy(np.float64)[:, None]
        with reading(where, f"durations_s of {shape[0]} trials x {shape[1]} units", ValueError):
            lasting = np.broadcast_to(np.asarray(durations_s, np.float64), shape).copy()
        recorded = np.array([[train is not None for train in row] for row in trains], bool)
        lasting[~recorded.reshape(shape)] = np.nan
        if not (np.isfinite(lasting) & (lasting > 0))[recorded.reshape(shape)].all():
            raise InputError(
                f"{where}: expected trains of a positive duration in s, found one that is not"
            )
        flat = [
            np.asarray([] if train is None else train, np.float64).ravel()
            for row in trains
            for train in row
        ]
        times = np.concatenate([*flat, np.empty(0)])
        offsets = np.append(0, np.cumsum([*map(len, flat)])).astype(np.int64)
        return cls(times, offsets, unit_table, _set_durations(trial_table, lasting), lasting)

    @property
    def recorded(self) -> NDArray[np.bool_]:
        """`(trial, unit)`, whether the unit was there."""
        return ~np.isnan(self.durations_s)

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

    def places(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Return for each spike the places of its train (as in `offsets`), trial and unit."""
        train = np.repeat(np.arange(self.durations_s.size), np.diff(self.offsets))
        trial, unit = np.divmod(train, max(self.n_units, 1))
        return train, trial, unit

    def counts(self) -> NDArray[np.float64]:
        """Return `(trial, unit)`, how many spikes; NaN where a unit was not recorded."""
        counts = np.diff(self.offsets).reshape(self.durations_s.shape).astype(np.float64)
        counts[~self.recorded] = np.nan
        return counts

    def rates(self) -> NDArray[np.float64]:
        """Return `(trial, unit)`, spikes/s over whole trains; NaN where not recorded."""
        return self.counts() / self.durations_s

    def binned(self, width_s: float, stop_s: float | None = None) -> xr.DataArray:
        """Return `(trial, unit, time)`, counts in bins of one width from each trial's start.

        Parameters
        ----------
        stop_s
            Where the last bin ends at the latest; without it, the shortest trial's end. Bins that
            don't fit whole are left out, and a unit that was not recorded has NaN.

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
        train, inside = self.places()[0], self.times < n * width_s
        bins = np.minimum(np.floor(self.times / width_s + 1e-9), n - 1).astype(np.int64)
        flat = np.bincount(train[inside] * n + bins[inside], minlength=self.durations_s.size * n)
        counts = flat.reshape(*self.durations_s.shape, n).astype(np.float64)
        counts[~self.recorded] = np.nan
        coords = {"time": np.arange(n) * width_s, "unit": self.units.index.to_numpy(str)}
        return xr.DataArray(counts, coords, ("trial", "unit", "time"), attrs={"units": "spikes"})

    def select(self, trials: ArrayLike | None = None, units: ArrayLike | None = None) -> Self:
        """Return the spikes of some trials and units, by places or by a mask, in that order."""
        rows = np.arange(self.n_trials)[slice(None) if trials is None else np.asarray(trials)]
        columns = np.arange(self.n_units)[slice(None) if units is None else np.asarray(units)]
        cells = (rows[:, None] * self.n_units + columns).ravel()
        lengths = np.diff(self.offsets)[cells]
        offsets = np.append(0, np.cumsum(lengths))
        at = np.repeat(self.offsets[cells] - offsets[:-1], lengths) + np.arange(offsets[-1])
        durations_s = self.durations_s[np.ix_(rows, columns)]
        return replace(
            self,
            times=self.times[at],
            offsets=offsets,
            units=self.units.iloc[columns],
            trials=_set_durations(self.trials.iloc[rows].reset_index(drop=True), durations_s),
            durations_s=durations_s,
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
            durations_s=np.where(self.recorded, stop_s - start_s, np.nan),
        )

    def stretched(self, factors: ArrayLike) -> Self:
        """Return trials with times and durations multiplied by a factor each.

        A drum at half the speed passes the same bumps in twice the time: by ``speed / other``, a
        train becomes what it would be at the other speed if spikes followed the surface alone.
        What the units' times resolve is stretched by the greatest factor.
        """
        factor = np.broadcast_to(np.asarray(factors, np.float64), self.n_trials)
        return replace(
            self,
            times=self.times * factor[self.places()[1]],
            units=self.units.assign(resolution_s=self.units["resolution_s"] * factor.max()),
            trials=self.trials.assign(duration_s=self.trials["duration_s"] * factor),
            durations_s=self.durations_s * factor[:, None],
        )

    def to_table(self) -> pd.DataFrame:
        """Return a row a spike, as `read_spikes` reads it; a train without spikes has one of NaN.

        Columns are `trial`, `unit`, `class`, `texture`, `speed_mm_s`, `repetition`, `duration_s`
        (of the train) and `time_s`.
        """
        silent = self.recorded.ravel() & (np.diff(self.offsets) == 0)
        train = np.repeat(np.arange(silent.size), np.diff(self.offsets) + silent)
        trial, unit = np.divmod(train, max(self.n_units, 1))
        time_s = np.full(len(train), np.nan)
        time_s[~silent[train]] = self.times
        of_trial = self.trials[["texture", "speed_mm_s", "repetition"]].iloc[trial]
        return of_trial.reset_index(drop=True).assign(
            trial=trial,
            unit=self.units.index.to_numpy(str)[unit],
            duration_s=self.durations_s.ravel()[train],
            time_s=time_s,
            **{"class": self.units["class"].to_numpy(str)[unit]},
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
        np.append(0, np.cumsum(np.concatenate([np.diff(part.offsets) for part in parts]))),
        parts[0].units.assign(resolution_s=coarsest),
        pd.concat([part.trials for part in parts], ignore_index=True),
        np.concatenate([part.durations_s for part in parts]),
    )
