"""What the names of files say of recordings: a first guess, to be checked by a person."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from afferents.core.errors import InputError
from afferents.recordings.media import is_sound
from afferents.recordings.pattern import SPEED, TEXTURE, Pattern

TRIAL = "trial"
_PATTERNS = (
    *("{texture}/{speed}/{trial}", "{texture}/{speed}_{trial}", "{texture}/{trial}/{speed}"),
    *("{texture}_{speed}_{trial}", "{texture}/{speed}", "{texture}_{speed}"),
    *("{texture}/{trial}", "{texture}_{trial}"),
)
"""Tried in this order, with each of `_JOINTS` and, for the speed, each of `_SPEEDS`."""
_JOINTS = "_- "
_SAID = (
    *("{speed}mms", "{speed}mm_s", "{speed}mm-s", "{speed}mmps", "{speed} mm_s"),
    *("speed{speed}", "speed_{speed}", "Speed{speed}"),
)
_SPEEDS = (*_SAID, "v{speed}", "V{speed}", "{speed}")
"""How a speed is written. The last three say least: numbers that only count are no speeds there."""
_NUMBERED = re.compile(r"[A-Za-z]{0,12}\d{1,4}")
_SPEED = re.compile(r"(?<!\d)(\d+(?:\.\d+)?) ?mm[ _-]?p?s(?![A-Za-z])")
_MOST_TRIALS = 20


@dataclass(frozen=True)
class Guess:
    """One recording by its files, and what its name seems to say."""

    video: str | None
    audio: str | None
    texture: str
    speed_mm_s: float | None = None
    repetition: str | None = None


def guess_pattern(paths: Sequence[str]) -> str | None:
    """Return the pattern that all paths of videos (or of sound) fit, None if none does.

    A name that ends in ``/`` is a folder of images.
    """
    ends = {_end(path) for path in paths}
    if len(ends) != 1:
        return None
    end = ends.pop()
    for speed, text, joint in product(_SPEEDS, _PATTERNS, _JOINTS):
        if speed != _SPEEDS[-1] and "{speed}" not in text:
            continue
        wanted = text.replace("_", joint).replace("{speed}", speed) + end
        if _fits(Pattern(wanted), paths, said=speed in _SAID):
            return wanted
    return None


def _end(path: str) -> str:
    return "/" if path.endswith("/") else Path(path).suffix


def _fits(pattern: Pattern, paths: Sequence[str], said: bool) -> bool:
    """Tell whether a pattern fits all paths, with numbers where numbers should be.

    Parameters
    ----------
    said
        Whether the names say by a word or a unit which number is the speed.
    """
    try:
        found = [pattern.values(path.rstrip("/")) for path in paths]
    except InputError:  # in two ways
        return False
    values = [one for one in found if one is not None]
    if len(values) < len(paths):
        return False
    if TRIAL in pattern.names:
        return all(_NUMBERED.fullmatch(one[TRIAL]) for one in values)
    if said:
        return True
    by_texture: dict[str, list[float]] = {}
    for one in values:
        by_texture.setdefault(one[TEXTURE], []).append(float(one[SPEED]))
    every = sorted({number for numbers in by_texture.values() for number in numbers})
    return not (_counts(every) or all(_counts(numbers) for numbers in by_texture.values()))


def _counts(numbers: Sequence[float]) -> bool:
    """Tell whether numbers only count: 1, 2, 3 are trials rather than speeds."""
    first = min(numbers)
    return (
        first in (0, 1)
        and len(numbers) <= _MOST_TRIALS
        and sorted(numbers) == [first + n for n in range(len(numbers))]
    )


def guess_recordings(paths: Sequence[str]) -> list[Guess]:
    """Return a recording for each video, with the sound of its name; else for each sound file."""
    sounds = {str(Path(path).with_suffix("")): path for path in paths if is_sound(Path(path))}
    videos = [path for path in paths if not is_sound(Path(path))]
    found = [_guess(path, path, sounds.get(_bare(path))) for path in videos]
    return found or [_guess(path, None, path) for path in paths]


def _bare(path: str) -> str:
    """Return a path without its ending."""
    return path.rstrip("/") if path.endswith("/") else str(Path(path).with_suffix(""))


def _guess(path: str, video: str | None, audio: str | None) -> Guess:
    """Take the first folder, or else the name, for the texture; what follows, as repetition."""
    first, *others = Path(_bare(path)).parts
    speed = _SPEED.search(_bare(path))
    repetition = "_".join(others) or None
    return Guess(video, audio, first, float(speed[1]) if speed else None, repetition)
