"""Drums by their names, and to print: letters of the paper, bump spacings, maps of heights.

A drum to print is its surface wrapped round a cylinder with a bore, as a watertight STL. The mesh
is a closed loop of rings: along the surface from one end of the drum to the other, back along the
bore. All rings have as many points, and each is joined to the next.
"""

import re
from collections.abc import Collection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.files import MARK, has_mark, require_free, write_aside
from afferents.rig.surface import Drum, Surface, bumped_surface, read_height_map
from afferents.store.recording import LETTERS, name_folder

Ring = NDArray[np.float32]
"""Shape (n_along, 3), mm: x, y round the axis, z along it."""

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""One triangle of a binary STL."""
_LEAST_WALL_MM = 2.0
_SAMPLES_A_BUMP = 4
_COARSEST = 4
"""The surface's samples lie 0.05 mm apart; no drum is printed finer than every fourth needs."""
_HEADER = f"{MARK}: a textured drum, binary STL in mm, axis along z".encode()


def is_drum(path: Path) -> bool:
    """Return whether a file is a drum that `write_stl` wrote."""
    return has_mark(path, _HEADER.decode())


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
        raise InputError(
            f"--bore: expected a diameter above 0 and up to {widest:g} mm, found {bore_mm:g}"
        )
    heights = surface.height_mm[::every, ::every]
    n_along, n_across = heights.shape
    angle = 2 * np.pi * (np.arange(n_along) + 0.5) / n_along
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    first_mm, pitch_mm = surface.pitch_mm[1] / 2, surface.pitch_mm[1] * every
    place_mm = first_mm + pitch_mm * np.arange(n_across)
    outer_mm, end_mm = drum.diameter_mm / 2, surface.width_mm
    profile = [  # radius and place along the axis, of each ring
        (outer_mm, 0.0),
        *zip(outer_mm + heights.T, place_mm, strict=True),
        *((outer_mm, end_mm), (bore_mm / 2, end_mm), (bore_mm / 2, 0.0)),
    ]
    rings = [
        np.column_stack([around * np.reshape(radius, (-1, 1)), np.full(n_along, place)])
        for radius, place in profile
    ]
    with write_aside(path) as partial, partial.open("wb") as file:
        file.write(_HEADER.ljust(80))
        file.write(np.uint32(2 * n_along * len(rings)).tobytes())
        for near, far in zip(rings, [*rings[1:], rings[0]], strict=True):
            _join(near.astype(np.float32), far.astype(np.float32)).tofile(file)


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


def texture_name(texture: str, maps: Collection[str]) -> str:
    """Return the name of a texture's folder: its bump spacing in mm, or its map's name.

    Raises
    ------
    InputError
        If there is no such drum.
    """
    if texture in maps:
        return texture
    if len(texture) == 1 and texture in LETTERS:
        return name_folder(texture)
    try:
        spacing = float(texture)
    except ValueError:
        spacing = -1.0
    if not (spacing == 0 or 0.3 <= spacing <= 20):
        spells_several = len(texture) > 1 and set(texture) <= set(LETTERS)
        raise InputError(
            "a texture: expected a letter from a to m, or a bump spacing of 0 or 0.3 to 20 mm, "
            f"found '{texture}'" + ("; set several apart by commas" if spells_several else "")
        )
    return f"{spacing:g}"


def height_map(text: str, drum: Drum) -> tuple[str, Surface]:
    """Return name and surface of ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.

    Raises
    ------
    InputError
        If the text or the file is not what it should be.
    """
    match = re.fullmatch(r"([\w-]+)=(.+),([\d.]+),([\d.]+)", text)
    if match is None:
        raise InputError(f"a height map: expected NAME=FILE,LENGTH_MM,HEIGHT_MM, found '{text}'")
    name, file, length, height = match.groups()
    if name in [*LETTERS] or re.fullmatch(r"[\d.]+", name):
        raise InputError(f"a height map: expected a name that is no printed drum's, found '{name}'")
    try:
        size = float(length), float(height)
    except ValueError:
        raise InputError(f"a height map: expected lengths in mm, found '{text}'") from None
    return name, read_height_map(Path(file), *size, drum)


def write_drum(texture: str, out: Path, bore_mm: float = 8.0, force: bool = False) -> Path:
    """Write a textured drum as an STL file for a 3-D printer.

    The diameter of its bumps, 0.36 of their spacing, is a guess: Figure 3 of the paper prints it.

    Parameters
    ----------
    texture
        Its texture: a letter a to m, a bump spacing in mm, or NAME=FILE,LENGTH_MM,HEIGHT_MM.
    out
        STL file to write, such as drum.stl.
    bore_mm
        Diameter of the hole for the spindle, mm.
    force
        Overwrite what this command wrote there before (nothing else).

    Raises
    ------
    InputError
        If there is no such drum, the bore leaves no wall, or `out` is not free.
    """
    require_free(out, is_drum, force=force)
    drum = Drum(print_sd_mm=0, patch_sd_mm=0)
    if "=" in texture:
        write_stl(out, height_map(texture, drum)[1], drum, bore_mm, every=2)
        return out
    spacing = float(texture_name(texture, {}))
    surface = bumped_surface(spacing, drum)
    bump = drum.bump_ratio * spacing / surface.pitch_mm[0]
    every = min(max(int(bump // _SAMPLES_A_BUMP), 1), _COARSEST) if spacing else _COARSEST
    write_stl(out, surface, drum, bore_mm, every)
    return out
