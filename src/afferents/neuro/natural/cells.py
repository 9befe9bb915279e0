"""Cells of a MATLAB file as `Spikes`: each trial of each fibre by its place along the axes."""

from collections.abc import Hashable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from afferents.errors import InputError, reading, then
from afferents.neuro.natural.description import (
    AXES,
    MM_S,
    SECONDS,
    Cells,
    Fibres,
    Labels,
    NaturalFile,
    Trials,
    as_text,
    classes_of,
)
from afferents.neuro.natural.matlab import read_variables
from afferents.spikes.population import Spikes

Place = tuple[int, ...]
"""A number along each axis, in the order of `Cells.axes`."""


def trains_in(content: Any, cells: Cells, where: Path, rates: Any = None) -> xr.DataArray:
    """Return the spike times that a variable holds, s; None where nothing was recorded.

    Parameters
    ----------
    rates
        What the variable `cells.rates` holds; it is used if that is named.

    Returns
    -------
    xarray.DataArray
        Of arrays; its dims are the cells' axes.

    Raises
    ------
    InputError
        If levels are not nested as described, times are no numbers, it is not said what empty
        cells are, or rates contradict the times.
    """
    if not cells.levels:
        raise InputError(
            f"{where}: expected levels of the cells in [spikes] of the description, found none; "
            'such as levels = [["fibre"], ["texture", "repetition"]]'
        )
    found = list(_leaves(content, cells, (), 0, where))
    trains = np.full(np.max([place for place, _ in found], axis=0) + 1, None, object)
    for place, leaf in found:
        trains[place] = _times(leaf, place, cells, where)
    empty = [at for at, _ in found if _is_empty(trains[at])]  # before any spike is cut off
    for place, _ in found:
        trains[place] = _in_seconds(trains[place], cells)
    if cells.rates is not None:
        empty = [at for at, _ in found if _is_empty(trains[at])]
        _leave_out_unrecorded(trains, rates, empty, cells, where)
    elif empty and cells.empty is None:
        raise InputError(
            f"{where}: expected in [spikes] of the description what empty cells are, found "
            f"{len(empty)} empty cells, the first at {_named(empty[0], cells.axes)}; add empty = "
            "'silence' (recorded, no spike) or empty = 'gap' (not recorded)"
        )
    elif cells.empty == "gap":
        for at in empty:
            trains[at] = None
    if all(train is None for train in trains.flat):
        raise InputError(f"{where}: expected spikes in '{cells.variable}', found gaps alone")
    return xr.DataArray(trains, dims=cells.axes)


_OTHERWISE = "or leave out rates in [spikes], and say what empty cells are"


def _leave_out_unrecorded(
    trains: NDArray[Any], rates: Any, empty: list[Place], cells: Cells, where: Path
) -> None:
    """Make gaps of the empty trials whose rate is NaN; refuse rates that contradict the times."""
    sizes = iter(trains.shape)
    levels = [[next(sizes) for _ in names] for names in cells.levels]
    try:
        found = _numbers_in(rates, levels)
    except (TypeError, ValueError):
        expected = f"a number for each of {' x '.join(map(str, trains.shape))} trials"
        raise InputError(
            f"{where}: expected {expected} in '{cells.rates}', nested as '{cells.variable}', found "
            f"others; {_OTHERWISE}"
        ) from None
    for at in np.ndindex(trains.shape):
        n = 0 if trains[at] is None else len(trains[at])
        if (n > 0) != (found[at] > 0) and (n > 0 or cells.cut is None):  # all may be cut off
            raise InputError(
                f"{where}: expected spikes where '{cells.rates}' is above 0 and none elsewhere, "
                f"found {n} spikes and a rate of {found[at]:g}{_at(at, cells.axes)}; {_OTHERWISE}"
            )
    gaps = [at for at in empty if np.isnan(found[at])]
    if empty and not gaps:
        raise InputError(
            f"{where}: expected NaN in '{cells.rates}' for trials that were not recorded, found "
            f"none in {len(empty)} empty cells; {_OTHERWISE}"
        )
    for at in gaps:
        trains[at] = None


def _numbers_in(content: Any, levels: list[list[int]]) -> NDArray[np.float64]:
    """Return numbers in cells of these sizes, a list a level, as one array."""
    array = np.asarray(content)
    sizes = [n for level in levels for n in level]
    if array.dtype.kind != "O":
        return array.astype(np.float64).reshape(sizes)
    return np.stack([_numbers_in(one, levels[1:]) for one in array.ravel()]).reshape(sizes)


def _leaves(
    content: Any, cells: Cells, place: Place, level: int, where: Path
) -> Iterator[tuple[Place, Any]]:
    """Yield what stands after the last level, and where; what is empty before was not recorded."""
    if level == len(cells.levels):
        yield place, content
        return
    names = cells.levels[level]
    array = _as_level(content, names, place, cells, where)
    if array is None:
        whole = sum(map(len, cells.levels[level:]))
        yield place + (0,) * whole, np.array([np.nan])
        return
    for at in np.ndindex(array.shape[: len(names)]):
        yield from _leaves(array[at], cells, place + at, level + 1, where)


def _as_level(
    content: Any, names: tuple[str, ...], place: Place, cells: Cells, where: Path
) -> NDArray[Any] | None:
    """Return a cell array with a dimension a name; None where nothing is in it.

    Numbers with one dimension more are as good: their last is that of spikes, filled up with NaN.
    """
    array = np.asarray(content)
    if not array.size:
        return None
    is_cells = array.dtype.kind == "O"
    n = len(names) if is_cells else len(names) + 1
    if is_cells and n == 1 and max(array.shape) == array.size:
        return array.ravel()
    shape = array.shape
    while len(shape) > n and shape[-1] == 1:
        shape = shape[:-1]
    is_numbers = array.dtype.kind in "iuf"
    if len(shape) > n or not (is_cells or (is_numbers and len(shape) == n)):
        kind = "cells" if is_cells else "numbers" if is_numbers else "text or a struct"
        size = " x ".join(map(str, array.shape))
        expected = f"a cell array of {' x '.join(names)} in '{cells.variable}'"
        found = f"{kind} of {size or 1}{_at(place, cells.axes)}"
        raise InputError(
            f"{where}: expected {expected}, found {found}; put levels in [spikes] right"
        )
    return array.reshape(shape + (1,) * (n - len(shape)))


def _times(leaf: Any, place: Place, cells: Cells, where: Path) -> NDArray[np.float64] | None:
    """Return the times of a trial; None for NaN alone, which stands for what is missing."""
    array = np.asarray(leaf)
    while array.dtype.kind == "O" and array.size == 1:
        array = np.asarray(array.ravel()[0])
    if array.size and array.dtype.kind not in "iufb":
        found = f"cells or text{_at(place, cells.axes)}"
        do = "name all levels in [spikes]"
        raise InputError(
            f"{where}: expected times of spikes in '{cells.variable}', found {found}{then(do)}"
        )
    times = np.asarray(array, np.float64).ravel() if array.size else np.empty(0)
    known = times[~np.isnan(times)]
    if times.size and not known.size:
        return None
    return np.sort(known) if cells.unsorted == "sort" else known


def _is_empty(times: NDArray[np.float64] | None) -> bool:
    return times is not None and not len(times)


def _in_seconds(times: NDArray[np.float64] | None, cells: Cells) -> NDArray[np.float64] | None:
    """Return the times that lie in the cut, s from its start."""
    if times is None:
        return None
    if cells.cut is not None:
        start, stop = cells.cut
        times = times[(times >= start) & (times < stop)] - start
    return times * SECONDS[cells.unit]


def _at(place: Place, axes: tuple[str, ...]) -> str:
    return f", at {_named(place, axes)}" if place else ""


def _named(place: Place, axes: tuple[str, ...]) -> str:
    """Return a place in words, counted from 1 as MATLAB does."""
    return ", ".join(f"{axis} {n + 1}" for axis, n in zip(axes, place, strict=False))


# Cells of a MATLAB file, with what is known of fibres and trials, as `Spikes`.


def spikes_of_cells(file: Path, described: NaturalFile, description: Path) -> Spikes:
    """Return the spikes of a MATLAB file.

    Raises
    ------
    InputError
        See `read_natural`.
    """
    cells, trials = described.spikes, described.trials
    labels = (
        described.fibres.classes, described.fibres.names, trials.textures, trials.speeds_mm_s,
        trials.duration_s, *trials.conditions.values(),
    )  # fmt: skip
    names = {cells.variable, *(one for one in (*labels, cells.rates) if isinstance(one, str))}
    variables = read_variables(file, *sorted(names))
    content, rates = variables[cells.variable], variables.get(cells.rates or "")
    if _has_one_struct(described, variables):
        content, rates = _in_a_cell(content), _in_a_cell(rates)
    trains = trains_in(content, cells, file, rates)
    axes = [str(axis) for axis in trains.dims if axis != "fibre"]
    known = _Conditions(dict(trains.sizes), variables, description)
    units, table = known.units(described.fibres), known.trials(trials, cells, axes)
    rows = trains.transpose(*axes, "fibre").values.reshape(-1, len(units))
    there = [any(train is not None for train in row) for row in rows]
    return Spikes.from_trains(rows[there].tolist(), units, table[there], file)


def _has_one_struct(described: NaturalFile, variables: dict[str, Any]) -> bool:
    """Tell whether fibres are an array of one struct, which MATLAB keeps as that struct alone."""
    cells, classes = described.spikes, described.fibres.classes
    known = variables[classes] if isinstance(classes, str) else classes
    return "." in cells.variable and cells.levels[:1] == (("fibre",),) and np.size(known) == 1


def _in_a_cell(content: Any) -> Any:
    """Return what one fibre has as an array of fibres has it; as it is, if it is one of one."""
    if content is None or np.size(content) == 1:
        return content
    array = np.empty(1, object)
    array[0] = content
    return array


class _Conditions:
    """What variables and description say of fibres and trials, checked against the cells."""

    def __init__(self, sizes: dict[Hashable, int], variables: dict[str, Any], where: Path) -> None:
        self._sizes, self._variables, self._where = sizes, variables, where

    def units(self, fibres: Fibres) -> pd.DataFrame:
        """Return name and class of each fibre."""
        words = self._labels("fibre", fibres.classes, "classes in [fibres]")
        classes = classes_of(words, fibres.words, self._where)
        if fibres.names:
            names = [as_text(one) for one in self._labels("fibre", fibres.names, "names")]
        else:
            number = pd.Series(classes).groupby(classes).cumcount() + 1
            names = [f"{name}-{n}" for name, n in zip(classes, number, strict=True)]
        return pd.DataFrame({"name": names, "class": classes})

    def trials(self, trials: Trials, cells: Cells, axes: list[str]) -> pd.DataFrame:
        """Return a row a trial: texture, speed, duration, repetition and conditions."""
        sizes = [self._sizes[axis] for axis in axes]
        places = pd.DataFrame(np.indices(sizes).reshape(len(axes), -1).T, columns=axes)
        named = trials.textures or tuple(range(1, self._sizes["texture"] + 1))
        textures = [as_text(one) for one in self._labels("texture", named, "textures")]
        if twice := sorted({name for name in textures if textures.count(name) > 1}):
            raise InputError(
                f"{self._where}: expected textures of different names, found two named '{twice[0]}'"
            )
        speeds = self._speeds(trials)
        found: dict[str, Any] = {
            "texture": np.array(textures, object)[places["texture"]],
            "speed_mm_s": speeds[places["speed"]] if "speed" in places else speeds[0],
            "duration_s": self._durations(trials, cells, places),
            "repetition": places.get("repetition", 0),
        }
        self._require_axes(trials.conditions, axes, "conditions")
        for axis in (axis for axis in axes if axis not in AXES):
            given = trials.conditions.get(axis, tuple(range(self._sizes[axis])))
            values = [_plain(one) for one in self._labels(axis, given, f"{axis} in conditions")]
            found[axis] = pd.Series(values).to_numpy()[places[axis]]
        return pd.DataFrame(found, index=places.index)

    def _speeds(self, trials: Trials) -> NDArray[np.float64]:
        """Return a speed for each that there is along the axis, mm/s."""
        given = trials.speeds_mm_s
        if trials.speed_unknown and "speed" not in self._sizes:
            return np.full(1, np.nan)
        if given == ():
            do = "add speeds_mm_s to [trials], or speed_unknown = true if nobody knows it"
            raise InputError(f"{self._where}: expected the speed of trials, found none{then(do)}")
        labels = (given,) if isinstance(given, float) else given
        speeds = self._numbers(self._labels("speed", labels, "speeds_mm_s in [trials]"), "speeds")
        if len(set(speeds)) < len(speeds) or not (np.isfinite(speeds) & (speeds > 0)).all():
            found = ", ".join(f"{v:g}" for v in speeds)
            raise InputError(
                f"{self._where}: expected different speeds of more than 0, found {found}"
            )
        return speeds * MM_S[trials.speed_unit] if isinstance(given, str) else speeds

    def _durations(
        self, trials: Trials, cells: Cells, places: pd.DataFrame
    ) -> NDArray[np.float64] | float:
        """Return the duration of each trial, s."""
        given = trials.duration_s
        if cells.cut is not None:
            return (cells.cut[1] - cells.cut[0]) * SECONDS[cells.unit]
        if given is None:
            do = "add duration_s to [trials], or cut to [spikes]"
            raise InputError(
                f"{self._where}: expected how long trials last, found nothing{then(do)}"
            )
        if isinstance(given, float):
            return given
        axes = trials.durations_by if isinstance(given, str) else ("speed",)
        self._require_axes(axes, map(str, places), "durations_by")
        sizes = tuple(self._sizes.get(axis, 1) for axis in axes)
        content = self._variables[given] if isinstance(given, str) else given
        values = self._numbers(content, "durations")
        if values.size == 1:
            return float(values.ravel()[0])
        if [n for n in values.shape if n > 1] != [n for n in sizes if n > 1]:
            expected = f"durations of {' x '.join(axes)} ({' x '.join(map(str, sizes))})"
            raise InputError(
                f"{self._where}: expected {expected}, found {' x '.join(map(str, values.shape))}"
            )
        at = tuple(places[axis].to_numpy() for axis in axes)
        return np.asarray(values.reshape(sizes)[at])

    def _require_axes(self, named: Iterable[str], axes: Iterable[str], what: str) -> None:
        """Refuse names that are no axes of trials."""
        axes = list(axes)
        if other := [name for name in named if name not in axes]:
            expected = f"axes of trials ({', '.join(axes)}) in {what} of [trials]"
            raise InputError(f"{self._where}: expected {expected}, found '{other[0]}'")

    def _labels(self, axis: str, given: Labels, what: str) -> list[Any]:
        """Return the labels along an axis, as many as there are."""
        found = self._variables[given] if isinstance(given, str) else given
        labels = [_single(one) for one in np.asarray(found, object).ravel()]
        if any(isinstance(one, np.ndarray | dict) for one in labels):
            raise InputError(
                f"{self._where}: expected a text or a number for each of {what}, found others"
            )
        n = self._sizes.get(axis, 1)
        if len(labels) != n:
            found = f"{len(labels)} in '{given}'" if isinstance(given, str) else f"{len(labels)}"
            raise InputError(
                f"{self._where}: expected {n} {what}, as the cells have, found {found}"
            )
        return labels

    def _numbers(self, values: Any, what: str) -> NDArray[np.float64]:
        with reading(self._where, f"numbers for {what}", TypeError, ValueError):
            return np.asarray(values, np.float64)


def _single(value: Any) -> Any:
    """Return what is in a cell of one value."""
    return value.ravel()[0] if isinstance(value, np.ndarray) and value.size == 1 else value


def _plain(value: Any) -> str | float:
    """Return a condition as a number where it is one."""
    return float(value) if isinstance(value, int | float | np.number) else as_text(value)
