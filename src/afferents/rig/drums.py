"""Drums by their names: letters of the paper, bump spacings, and maps of heights."""

import re
from collections.abc import Mapping
from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.outputs import require_free
from afferents.core.recording import LETTERS, folder_of
from afferents.rig import Drum, Surface, bumped_surface, is_drum, read_height_map, write_stl

_SAMPLES_A_BUMP = 4
_COARSEST = 4
"""The surface's samples lie 0.05 mm apart; no drum is printed finer than every fourth needs."""


def texture_name(texture: str, maps: Mapping[str, Surface]) -> str:
    """Return the name of a texture's folder: its bump spacing in mm, or its map's name.

    Raises
    ------
    InputError
        If there is no such drum.
    """
    if texture in maps:
        return texture
    if len(texture) == 1 and texture in LETTERS:
        return folder_of(texture)
    try:
        spacing = float(texture)
    except ValueError:
        spacing = -1.0
    if not (spacing == 0 or 0.3 <= spacing <= 20):
        raise InputError(
            "a texture",
            "a letter from a to m, or a bump spacing of 0 or 0.3 to 20 mm",
            f"'{texture}'",
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
        raise InputError("a height map", "NAME=FILE,LENGTH_MM,HEIGHT_MM", f"'{text}'")
    name, file, length, height = match.groups()
    try:
        size = float(length), float(height)
    except ValueError:
        raise InputError("a height map", "lengths in mm", f"'{text}'") from None
    return name, read_height_map(Path(file), *size, drum)


def write_drum(texture: str, path: Path, bore_mm: float, force: bool = False) -> Path:
    """Write a drum for a 3-D printer, at its nominal heights.

    Parameters
    ----------
    texture
        A letter, a bump spacing in mm, or ``NAME=FILE,LENGTH_MM,HEIGHT_MM``.
    force
        Whether a drum that was written there before may be replaced.

    Raises
    ------
    InputError
        If there is no such drum, the bore leaves no wall, or `path` is not free.
    """
    require_free(path, "a drum", is_drum, force=force)
    drum = Drum(print_sd_mm=0, patch_sd_mm=0)
    if "=" in texture:
        write_stl(path, height_map(texture, drum)[1], drum, bore_mm, every=2)
        return path
    spacing = float(texture_name(texture, {}))
    surface = bumped_surface(spacing, drum)
    bump = drum.bump_ratio * spacing / surface.pitch_mm[0]
    every = min(max(int(bump // _SAMPLES_A_BUMP), 1), _COARSEST) if spacing else _COARSEST
    write_stl(path, surface, drum, bore_mm, every)
    return path
