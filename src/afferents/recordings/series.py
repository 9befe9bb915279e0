"""Channels of files of a data set of time series, checked against the clock."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import xarray as xr

from afferents import dims
from afferents.errors import InputError
from afferents.quality.sound import require_finite
from afferents.recordings import columns
from afferents.recordings.description import UNITS_MS, Signal
from afferents.recordings.tables import Numbers, Table, read_columns, read_table
from afferents.store.trimming import require_reached

_ROUNDING = 1e-6
"""Share of a step that times in floating point may be off."""

_BRIDGED = 5
"""Median steps without a row that are bridged where `longest_gap_ms` says nothing."""


@dataclass(frozen=True)
class SeriesFile:
    """The channels of a file, parsed when read.

    Implements `afferents.store.recording.Vibration`.

    Parameters
    ----------
    path
        The file.
    signal
        What is in it.
    expected_hz
        Sample rate of the data set, Hz; None where this file is the one that tells.
    """

    path: Path
    signal: Signal
    expected_hz: float | None = None

    @property
    def files(self) -> tuple["SeriesFile", ...]:
        """Itself, as of a recording of one file."""
        return (self,)

    @cached_property
    def _known(self) -> tuple[int, int, columns.Rows | None]:
        table, rows = self._table()
        return len(table.values), len(table.columns), rows

    @property
    def n_samples(self) -> int:
        """Samples in each channel; reads the file."""
        return self._known[0]

    @property
    def n_channels(self) -> int:
        """Channels that are read."""
        return self._known[1]

    @property
    def rows(self) -> columns.Rows | None:
        """What rows were resampled, None where none were; reads the file."""
        return self._known[2]

    @cached_property
    def sample_rate_hz(self) -> float:
        """Sample rate, Hz: as declared, else by the file's header, else by its time column."""
        return self.expected_hz or self.signal.rate_hz or self._own_rate(self._table()[0])

    def read(self) -> xr.DataArray:
        """Read all channels.

        Returns
        -------
        xarray.DataArray
            `(audio_time, channel)` float32, with the attributes `sample_rate_hz` and `units`.

        Raises
        ------
        InputError
            Naming the file, and in a CSV the line: if it can't be read, lacks a column, or its
            clock is not regular, goes back, or is not the data set's; where it is resampled, if a
            gap is too long or too many rows are out of order.
        """
        table, _ = self._table()
        rate_hz = self.sample_rate_hz
        least, least_s = math.ceil(self.signal.least_s * rate_hz - 1e-9), self.signal.least_s
        if len(table.values) < least:
            expected = f"at least {least} rows of data below the header, {least_s:g} s"
            raise InputError(f"{self.path}: expected {expected}, found {len(table.values)}")
        self._check_clock(table, rate_hz)
        if isinstance(steady_s := self.signal.steady_s, tuple):
            length_s = len(table.values) / rate_hz
            require_reached(self.path, length_s, steady_s, "correct [signal] steady_s")
        require_finite(table.values, self.path, rate_hz)
        return xr.DataArray(
            table.values.astype(np.float32),
            dims=(dims.AUDIO_TIME, dims.CHANNEL),
            coords={dims.CHANNEL: list(table.columns)},
            attrs={dims.SAMPLE_RATE: rate_hz, dims.UNITS: self.signal.units},
        )

    def _table(self) -> tuple[Table, columns.Rows | None]:
        """Return the file's table, with repeated rows once and resampled where that is wanted."""
        table = read_table(self.path, self.signal)
        if self.signal.duplicates == "once":
            assert table.time is not None  # which it needs
            steps = np.diff(np.c_[table.time, table.values], axis=0)
            new = np.append(True, (steps != 0).any(axis=1))
            table = table._replace(
                values=table.values[new], place=table.place[new], time=table.time[new]
            )
        rate_hz = self.signal.resample_hz
        return (table, None) if rate_hz is None else self._resample(table, rate_hz)

    def _resample(self, table: Table, rate_hz: float) -> tuple[Table, columns.Rows]:
        """Resample rows to a clock; refuse too many out of order, and too long a gap."""
        time_ms = self._time_ms(table)
        assert time_ms is not None  # resampling needs the column
        require_finite(table.values, self.path, rate_hz)
        kept = columns.find_rows_in_order(time_ms)
        if (share := 1 - kept.mean()) > self.signal.out_of_order:
            row = int(np.argmin(kept))
            raise InputError(
                f"{self.path}, {table.unit} {table.place[row]}: expected at most "
                f"{self.signal.out_of_order:.3g} of the rows out of order (out_of_order), found "
                f"{share:.3g}, the first here: {time_ms[row - 1]:g} ms, then {time_ms[row]:g} ms; "
                "allow a larger share in [signal], or leave the time out and say sample_rate_hz"
            )
        time_ms = time_ms[kept]
        usual_ms, longest_ms = self._usual_step_ms(time_ms), float(np.diff(time_ms).max())
        bridged_ms = self.signal.longest_gap_ms or _BRIDGED * usual_ms
        if longest_ms > bridged_ms * (1 + _ROUNDING):
            row = int(np.argmax(np.diff(time_ms))) + 1
            raise InputError(
                f"{self.path}, {table.unit} {table.place[kept][row]}: expected rows at most "
                f"{bridged_ms:.4g} ms apart (longest_gap_ms), found {longest_ms:.4g} ms; say in "
                "[signal] how long a gap may be bridged"
            )
        is_finer = columns.find_oversampling(time_ms, rate_hz) > 1
        allowed_hz = rate_hz * (columns.PASSED if is_finer else 0.5)
        limit_hz = min(allowed_hz, 500 / usual_ms)
        rows = columns.Rows(len(kept), int((~kept).sum()), usual_ms, longest_ms, limit_hz)
        cubic = self.signal.interpolation == "cubic"
        values = columns.resample(time_ms, table.values[kept], rate_hz, cubic)
        return table._replace(values=values, place=np.arange(len(values)), time=None), rows

    def _time_ms(self, table: Table) -> Numbers | None:
        """Return the times of all rows, ms; None where no column says."""
        return None if table.time is None else table.time * self.signal.time_ms

    def _own_rate(self, table: Table) -> float:
        """Return the sample rate that the file itself tells, Hz."""
        if table.rate_hz is not None:
            return table.rate_hz
        time_ms = self._time_ms(table)
        if time_ms is None:
            raise InputError(
                f"{self.path}: expected a sample rate, found none; say sample_rate_hz or the time "
                "column in [signal]"
            )
        step, usual_ms = np.diff(time_ms), self._usual_step_ms(time_ms)
        if (np.abs(step - usual_ms) <= usual_ms / 2).all():
            usual_ms = float(step.mean())
        declared, each = self.signal.time_unit, usual_ms / self.signal.time_ms
        other = columns.find_unit(each, len(time_ms), declared)
        if other != declared or not 1e-4 <= usual_ms <= 1000:
            as_other = f", in {other} {each * UNITS_MS[other]:.3g} ms" * (other != declared)
            raise InputError(
                f"{self.path}: expected rows at most {columns.SLOWEST_S:g} s apart, and "
                f"{columns.SHORTEST_S:g} s to an hour of them, found {len(time_ms)} rows "
                f"{usual_ms:.3g} ms apart{as_other}; "
                "correct [signal] time_unit, or say sample_rate_hz, at least 1, where it is right"
            )
        # To six digits: float times add noise, and all recordings must share one axis.
        return float(f"{1000 / usual_ms:.6g}")

    def _usual_step_ms(self, time_ms: Numbers) -> float:
        """Return the median step between rows, ms; refuse times that don't go on."""
        usual_ms = float(np.median(np.diff(time_ms))) if len(time_ms) > 1 else 0.0
        if usual_ms <= 0:
            raise InputError(
                f"{self.path}: expected times that go on, found steps of {usual_ms:g} ms (median); "
                "say sample_rate_hz in [signal] and leave the time column out of it, or resample"
            )
        return usual_ms

    def _check_clock(self, table: Table, rate_hz: float) -> None:
        """Refuse a file whose rate, over all its time, or whose steps are not the data set's."""
        if self.signal.resample_hz is not None:
            return
        if table.rate_hz is not None and abs(table.rate_hz / rate_hz - 1) > columns.AGREES:
            raise self._other_rate(rate_hz, table.rate_hz)
        time_ms = self._time_ms(table)
        if time_ms is None or len(time_ms) < 2:
            return
        period_ms, step = 1000 / rate_hz, np.diff(time_ms)
        jitter_ms = period_ms / 2 if self.signal.jitter_ms is None else self.signal.jitter_ms
        usual_ms = self._usual_step_ms(time_ms)
        if abs(usual_ms - period_ms) > max(jitter_ms, columns.AGREES * period_ms):
            raise self._other_rate(rate_hz, 1000 / usual_ms)
        uneven = np.abs(step - period_ms) > jitter_ms + _ROUNDING * period_ms
        irregular = np.flatnonzero(uneven | (step < 0))
        if len(irregular):
            row = int(irregular[0]) + 1
            before, now = time_ms[row - 1 : row + 1]
            expected = f"a timestamp {period_ms:g} ms after the one before (within {jitter_ms:g})"
            found = f"{now - before:g} ms"
            if now < before:
                expected, found = "times that go on", f"{before:g} ms, then {now:g} ms"
            raise InputError(
                f"{self.path}, {table.unit} {table.place[row]}: expected {expected}, found "
                f"{found}; say resample_hz in [signal] if the sensor writes rows unevenly"
            )
        mean_ms = (time_ms[-1] - time_ms[0]) / len(step)
        if abs(mean_ms / period_ms - 1) > columns.AGREES:
            raise self._other_rate(rate_hz, 1000 / mean_ms, " over its whole time")

    def _other_rate(self, expected_hz: float, found_hz: float, over: str = "") -> InputError:
        expected = f"the sample rate of the data set, {expected_hz:g} Hz"
        return InputError(
            f"{self.path}: expected {expected}, found {found_hz:g} Hz{over}; correct [signal], "
            "say resample_hz there if rows come unevenly, or describe files of another rate as "
            "another data set"
        )


@dataclass(frozen=True)
class JoinedFiles:
    """The files of one recording, side by side: channels are called after each file's part.

    Implements `afferents.store.recording.Vibration`.

    Parameters
    ----------
    parts
        The files by what their names call them, such as ``x``.
    """

    parts: Mapping[str, SeriesFile]

    @property
    def files(self) -> tuple[SeriesFile, ...]:
        """The files, in the order of their parts' names."""
        return tuple(self.parts.values())

    @property
    def path(self) -> Path:
        """The first file."""
        return self.files[0].path

    @cached_property
    def n_samples(self) -> int:
        """Samples in each channel; reads the files, which must be about equally long."""
        lengths = {file.path.name: file.n_samples for file in self.files}
        least, most = min(lengths.values()), max(lengths.values())
        if most - least > max(1, columns.AGREES * most):
            found = " and ".join(f"{n} in {name}" for name, n in lengths.items())
            raise InputError(
                f"{self.path}: expected files of one recording to have as many rows, found {found}"
            )
        return least

    @property
    def n_channels(self) -> int:
        """Channels of all files."""
        return sum(file.n_channels for file in self.files)

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate, Hz."""
        return self.files[0].sample_rate_hz

    def read(self) -> xr.DataArray:
        """Read all channels, as `SeriesFile.read`; what some files have at the end is left out."""
        n, parts = self.n_samples, []
        for part, file in self.parts.items():
            one = file.read().isel({dims.AUDIO_TIME: slice(n)})
            names = [f"{part} {name}" for name in one[dims.CHANNEL].values]
            names = names if len(names) > 1 else [part]
            parts.append(one.assign_coords({dims.CHANNEL: names}))
        whole = xr.concat(parts, dims.CHANNEL, combine_attrs="override")
        return whole.transpose(dims.AUDIO_TIME, dims.CHANNEL)


def describe_files(files: Sequence[SeriesFile]) -> list[str]:
    """Return what the clock rests on, and which columns are channels where none is named."""
    return [*(_describe_resampling(files) or _doubt_rate(files)), *_describe_channels(files)]


def _describe_resampling(files: Sequence[SeriesFile]) -> list[str]:
    """Return what was resampled, and how much of files is not their own; reads them."""
    found: list[tuple[SeriesFile, columns.Rows]] = []
    for file in files:
        with suppress(InputError):  # which reading it says
            if file.rows is not None:
                found.append((file, file.rows))
    if not found:
        return []
    signal = found[0][0].signal
    step_ms = float(np.median([rows.step_ms for _, rows in found]))
    gap_file, gap = max(found, key=lambda one: one[1].longest_ms)
    sentence = (
        f"Rows, {step_ms:.3g} ms apart (median), are resampled to {signal.resample_hz:g} Hz, "
        f"{signal.interpolation} between them: frequencies are kept up to "
        f"{min(rows.limit_hz for _, rows in found):.3g} Hz. The longest gap that is bridged lasts "
        f"{gap.longest_ms:.3g} ms ({gap_file.path.name})."
    )
    dropped, n = sum(rows.n_dropped for _, rows in found), sum(rows.n for _, rows in found)
    if dropped:
        most = max(rows.n_dropped / rows.n for _, rows in found)
        sentence += (
            f" {dropped} of {n} rows are out of order and dropped, at most {most:.2%} of a file."
        )
    return [sentence]


def _doubt_rate(files: Sequence[SeriesFile]) -> list[str]:
    """Say that nothing confirms a rate, where no column of times and no header does."""
    if not files or files[0].signal.rate_hz is None or files[0].signal.time is not None:
        return []
    try:
        table = read_columns(files[0].path, files[0].signal)
    except InputError:  # which reading it says
        return []
    if table.rate_hz is not None:
        return []
    sentence = (
        f"Nothing confirms the {files[0].signal.rate_hz:g} Hz declared: no time column is named."
    )
    does = columns.describe_columns(table)
    if rising := [name for name, course in does.items() if course == columns.RISES]:
        sentence += (
            f" Column {rising[0]} rises from row to row: if it holds times, name it as time."
        )
    return [sentence]


def _describe_channels(files: Sequence[SeriesFile]) -> list[str]:
    """Return which columns are channels where no description names them; reads files."""
    if not files or files[0].signal.channels:
        return []
    found: list[columns.Courses] = []
    for file in files:
        with suppress(InputError):  # which reading it says
            found.append(columns.describe_columns(read_table(file.path, file.signal)))
    why = columns.find_non_signals(found) if found else {}
    if not why and len(found[0] if found else ()) < 2:
        return []
    sentence = (
        f"[signal] names no channels, so all columns but the time are: {', '.join(found[0])}."
    )
    doubts = ", ".join(f"{name} ({reason})" for name, reason in why.items())
    return [sentence + f" Name them without what is no signal: {doubts}." * bool(doubts)]
