"""Drums to print: a surface wrapped round a cylinder with a bore, as a watertight STL.

The mesh is a closed loop of rings: along the surface from one end of the drum to the other, back
along the bore. All rings have as many points, and each is joined to the next.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.files import write_aside
from afferents.core.outputs import MARK, has_mark
from afferents.rig.surface import Drum, Surface

Ring = NDArray[np.float32]
"""Shape (n_along, 3), mm: x, y round the axis, z along it."""

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary STL."""
_LEAST_WALL_MM = 2.0
_HEADER = f"{MARK}: a textured drum, binary STL in mm, axis along z".encode()


def is_drum(path: Path) -> bool:
    """Tell whether a file is a drum that `write_stl` wrote."""
    return path.is_file() and has_mark(path, _HEADER.decode())


def write_stl(path: Path, surface: Surface, drum: Drum, bore_mm: float, every: int = 1) -> None:
    """Write a drum as a binary STL in mm, its axis along z.

    Parameters
    ----------
    surface
        What is wrapped round the cylinder; both ends of the drum are plain.
    bore_mm
        Diameter of the hole for the spindle.
    every
        Use every n-th sample of the surface along and across, from 0.05 mm.

    Raises
    ------
    InputError
        If the bore leaves no wall.
    """
    widest = drum.diameter_mm - 2 * _LEAST_WALL_MM
    if not 0 < bore_mm <= widest:
        raise InputError("--bore", f"a diameter above 0 and up to {widest:g} mm", f"{bore_mm:g}")
    heights = surface.height_mm[::every, ::every]
    n_along, n_across = heights.shape
    n_rings = n_across + 4
    with write_aside(path) as partial, partial.open("wb") as file:
        file.write(_HEADER.ljust(80))
        file.write(np.uint32(2 * n_along * n_rings).tobytes())
        first_mm, pitch_mm = surface.pitch_mm[1] / 2, surface.pitch_mm[1] * every
        place_mm = first_mm + pitch_mm * np.arange(n_across)
        rings = _rings(heights, place_mm, surface.width_mm, drum.diameter_mm / 2, bore_mm / 2)
        first = previous = next(rings)
        for ring in rings:
            _join(previous, ring).tofile(file)
            previous = ring
        _join(previous, first).tofile(file)


def _rings(
    heights: NDArray[np.float32],
    place_mm: NDArray[np.floating],
    width_mm: float,
    radius_mm: float,
    bore_mm: float,
) -> Iterator[Ring]:
    n_along = len(heights)
    angle = 2 * np.pi * (np.arange(n_along) + 0.5) / n_along
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(n_along)], axis=1)

    def ring(radius: NDArray[np.float32] | float, z: float) -> Ring:
        points = around * np.reshape(radius, (-1, 1))
        points[:, 2] = z
        return np.asarray(points, np.float32)

    yield ring(radius_mm, 0)
    for column, place in enumerate(place_mm):
        yield ring(radius_mm + heights[:, column], place)
    yield ring(radius_mm, width_mm)
    yield ring(bore_mm, width_mm)
    yield ring(bore_mm, 0)


def _join(near: Ring, far: Ring) -> NDArray[np.void]:
    """Return the triangles between two rings, seen from outside against the clock."""
    near_next, far_next = np.roll(near, -1, axis=0), np.roll(far, -1, axis=0)
    corners = np.concatenate(
        [np.stack([near, near_next, far], axis=1), np.stack([far, near_next, far_next], axis=1)]
    )
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets = np.zeros(len(corners), _FACET)
    facets["corners"] = corners
    facets["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    return facets
