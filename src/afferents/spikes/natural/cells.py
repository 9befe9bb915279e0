"""Spike times in nested cells: each trial of each fibre by its place along the axes."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.spikes.natural.description import SECONDS, Cells

Place = tuple[int, ...]
"""A number along each axis, in the order of `Cells.axes`."""


@dataclass(frozen=True)
class Trains:
    """Spike times of cells.

    Attributes
    ----------
    axes
        Names of the axes of `times`.
    sizes
        How many there are along each axis.
    times
        s, by place; a place that is missing was not recorded.
    """

    axes: tuple[str, ...]
    sizes: tuple[int, ...]
    times: dict[Place, NDArray[np.float64]]

    def size(self, axis: str) -> int:
        """Return how many there are along an axis; 1 where there is no such axis."""
        return self.sizes[self.axes.index(axis)] if axis in self.axes else 1


def trains_in(content: Any, cells: Cells, where: Path) -> Trains:
    """Return the spike times that a variable holds.

    Raises
    ------
    InputError
        If levels are not nested as described, times are no numbers, or it is not said what empty
        cells are.
    """
    if not cells.levels:
        raise InputError(
            where, "levels of the cells in [spikes] of the description", "none",
            'such as levels = [["fibre"], ["texture", "repetition"]]',
        )  # fmt: skip
    found = list(_leaves(content, cells, (), 0, where))
    sizes = tuple(max(place[i] for place, _ in found) + 1 for i in range(len(cells.axes)))
    times = {place: _times(leaf, place, cells, where) for place, leaf in found}
    empty = [place for place, one in times.items() if one is not None and not len(one)]
    if empty and cells.empty is None:
        raise InputError(
            where,
            "in [spikes] of the description what empty cells are",
            f"{len(empty)} empty cells, the first at {_named(empty[0], cells.axes)}",
            "add empty = 'silence' (recorded, no spike) or empty = 'gap' (not recorded)",
        )
    gaps = set(empty) if cells.empty == "gap" else set()
    kept = {at: one for at, one in times.items() if one is not None and at not in gaps}
    if not kept:
        raise InputError(where, f"spikes in '{cells.variable}'", "gaps alone")
    return Trains(cells.axes, sizes, kept)


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
        raise InputError(where, expected, found, "put levels in [spikes] right")
    return array.reshape(shape + (1,) * (n - len(shape)))


def _times(leaf: Any, place: Place, cells: Cells, where: Path) -> NDArray[np.float64] | None:
    """Return the times of a trial, s; None for NaN alone, which stands for what is missing."""
    array = np.asarray(leaf)
    while array.dtype.kind == "O" and array.size == 1:
        array = np.asarray(array.ravel()[0])
    if array.size and array.dtype.kind not in "iufb":
        found = f"cells or text{_at(place, cells.axes)}"
        do = "name all levels in [spikes]"
        raise InputError(where, f"times of spikes in '{cells.variable}'", found, do)
    times = np.asarray(array, np.float64).ravel() if array.size else np.empty(0)
    known = times[~np.isnan(times)]
    if times.size and not known.size:
        return None
    if cells.unsorted == "sort":
        known = np.sort(known)
    if cells.cut is not None:
        start, stop = cells.cut
        known = known[(known >= start) & (known < stop)] - start
    return known * SECONDS[cells.unit]


def _at(place: Place, axes: tuple[str, ...]) -> str:
    return f", at {_named(place, axes)}" if place else ""


def _named(place: Place, axes: tuple[str, ...]) -> str:
    """Return a place in words, counted from 1 as MATLAB does."""
    return ", ".join(f"{axis} {n + 1}" for axis, n in zip(axes, place, strict=False))
