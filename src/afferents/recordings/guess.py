"""What names of files say of recordings: a first guess, to be checked by a person."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

from afferents.errors import InputError
from afferents.recordings.media import is_sound
from afferents.recordings.pattern import SPEED, TEXTURE, Pattern, parse_speed

TRIAL = "trial"
_PATTERNS = (
    *("{texture}/{speed}/{trial}", "{texture}/{speed}_{trial}", "{texture}/{trial}/{speed}"),
    *("{texture}/{trial}_{speed}", "{texture}_{speed}_{trial}", "{texture}_{trial}_{speed}"),
    *("{texture}/{speed}", "{texture}_{speed}"),
    *("{texture}/{trial}", "{texture}_{trial}"),
)
"""Tried in this order, with each of `_JOINTS` and, for the speed, each of `_SPEEDS`; first those
with a speed that does not only count, as trials do."""
_JOINTS = "_- "
_MARKED = (
    *("{speed}mms", "{speed}mm_s", "{speed}mm-s", "{speed}mmps", "{speed} mm_s"),
    *("speed{speed}", "speed_{speed}", "Speed{speed}"),
)
_SPEEDS = (*_MARKED, "v{speed}", "V{speed}", "{speed}")
"""How a speed is written. The last three say least: numbers that only count are no speeds there."""
_NUMBERED = re.compile(r"[A-Za-z]{0,12}\d{1,4}")
_SPEED = re.compile(r"(?<!\d)(\d+(?:[.,]\d+)?) ?mm[ _-]?p?s(?![A-Za-z])")
_DATE = (
    r"(?<!\d)(?:19|20)\d\d(?:[01]\d[0-3]\d(?:[-_ T]?[0-2]\d[0-5]\d(?:[0-5]\d)?)?"
    r"|(?P<joint>[-_.])[01]\d(?P=joint)[0-3]\d"
    r"(?:[-_ T][0-2]\d(?:(?P=joint)|[-.h])?[0-5]\d(?:(?:(?P=joint)|[-.h])?[0-5]\d)?)?)(?!\d)"
)
"""A date, alone or with a time of day: 20241027, 2024-10-27-14-30-05."""
_NUMBERED_END = re.compile(r"(.+[_\- ])[A-Za-z]*(\d+(?:\.\d+)?)[A-Za-z]*")
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_LABEL = re.compile(r"([A-Za-z]+)[^A-Za-z0-9/]*$")
_BETWEEN = "_- /"
_PART = re.compile(rf"(?:^|(?<=[_\- /])){_DATE}(?=[_\- /]|$)|[^_\- /]+|[_\- /]+")
_WITH_UNIT = re.compile(r"(?P<word>[A-Za-z]*)\d+(?:[.,]\d+)?(?P<unit>[A-Za-z/]*)")
_MM_S = re.compile(r"mmp?s")
_UNITS = {"N": "force", "mN": "force", "g": "force", "kPa": "pressure", "deg": "direction"}
"""What a number of such a unit is called; another is called trial."""
_FASTEST_MM_S = 1e4
NEARLY_ALL = 0.8
"""Share of names: so few others are strays."""


@dataclass(frozen=True)
class Guess:
    """One recording by its files, and what its name seems to say."""

    video: str | None
    audio: str | None
    texture: str
    speed_mm_s: float | None = None
    repetition: str | None = None


def guess_pattern(paths: Sequence[str], share: float = 1.0) -> str | None:
    """Return the pattern that all paths of videos (or of sound) fit, None if none does.

    Parameters
    ----------
    paths
        A name that ends in ``/`` is a folder of images.
    share
        Of them, at least, that must fit. If not all must, the pattern says the speed by a word or
        a unit.
    """
    if len({_end(path).lower() for path in paths}) != 1:
        return None
    speeds = _SPEEDS if share == 1 else _MARKED
    for strict, speed, text, joint in product((True, False), speeds, _PATTERNS, _JOINTS):
        if "{speed}" not in text and (strict or speed != _SPEEDS[-1]):
            continue
        wanted = text.replace("_", joint).replace("{speed}", speed) + _end(paths[0])
        if _fits(Pattern(wanted), paths, share, speed in _MARKED, strict):
            return wanted
    return None


def guess_rule(paths: Sequence[str]) -> str | None:
    """Return the pattern that nearly all paths fit, by `guess_pattern` or by parts of the names."""
    return (
        guess_pattern(paths)
        or _guess_labelled(paths)
        or _guess_by_parts(paths)
        or guess_pattern(paths, NEARLY_ALL)
    )


def _end(path: str) -> str:
    return "/" if path.endswith("/") else Path(path).suffix


def _fits(
    pattern: Pattern, paths: Sequence[str], share: float, is_marked: bool, strict: bool
) -> bool:
    """Return whether a pattern fits so many of the paths, with numbers where numbers should be.

    Parameters
    ----------
    share
        Of the paths, at least.
    is_marked
        Whether the names say by a word or a unit which number is the speed.
    strict
        Whether speeds that only count are refused; else they may, if trials do as well.
    """
    try:
        found = [pattern.values(path.rstrip("/")) for path in paths]
    except InputError:  # in two ways
        return False
    values = [one for one in found if one is not None]
    if len(values) < share * len(paths):
        return False
    textures = {one[TEXTURE] for one in values}
    if any(re.search(_DATE, texture) for texture in textures) or _hold_conditions(textures):
        return False
    if TRIAL in pattern.names and not all(_NUMBERED.fullmatch(one[TRIAL]) for one in values):
        return False
    if SPEED not in pattern.names or is_marked:
        return True
    by_texture: dict[str, set[float]] = {}
    for one in values:
        by_texture.setdefault(one[TEXTURE], set()).add(parse_speed(one[SPEED]))
    every = set().union(*by_texture.values())
    trials = {float(re.sub(r"\D", "", one[TRIAL])) for one in values if TRIAL in one}
    may_count = not strict and trials and _counts(trials)
    return max(every) <= _FASTEST_MM_S and (
        may_count or not (_counts(every) or all(map(_counts, by_texture.values())))
    )


def _hold_conditions(textures: Collection[str]) -> bool:
    """Return whether textures end in a condition: several words, each with the same numbers."""
    numbers: dict[str, set[str]] = {}
    for texture in textures:
        if (ending := _NUMBERED_END.fullmatch(texture)) is None:
            return False
        numbers.setdefault(ending[1], set()).add(ending[2])
    first, *others = numbers.values()
    return len(first) > 1 and bool(others) and all(one == first for one in others)


def _counts(numbers: Collection[float]) -> bool:
    """Return whether numbers only count: 1, 2, 3 are trials rather than speeds."""
    first = min(numbers)
    return first in (0, 1) and sorted(numbers) == [first + n for n in range(len(numbers))]


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
    return Guess(video, audio, first, parse_speed(speed[1]) if speed else None, repetition)


def _guess_labelled(names: Sequence[str]) -> str | None:
    """Return the pattern of names that differ in their numbers alone, those after words named."""
    end, stems = _end(names[0]), [_bare(name) for name in names]
    if len({_NUMBER.sub("#", stem) for stem in stems}) > 1:
        return None
    texts, numbers = _NUMBER.split(stems[0]), _NUMBER.findall(stems[0])
    words = [_LABEL.search(text) for text in texts[: len(numbers)]]
    named = [f"{{{word[1].lower()}}}" if word else "{*}" for word in words]
    if f"{{{TEXTURE}}}" not in named:
        return None
    # Of several of one name the last counts.
    named = ["{*}" if name in named[n + 1 :] else name for n, name in enumerate(named)]
    return "".join(a + b for a, b in zip(texts, [*named, end], strict=True))


def _guess_by_parts(names: Sequence[str]) -> str | None:
    """Return the pattern of names whose parts, between separators, are numbers with units or words.

    ``denim_015mms_1N_take1.csv`` is ``{texture}_{speed}mms_{force}N_take{take}.csv``.
    """
    cut = [
        ["", *(part[0] for part in _PART.finditer(_bare(name)))] for name in names
    ]  # between separators, both
    cut = [parts[1:] if parts[1][0] not in _BETWEEN else parts for parts in cut]
    if len({tuple(parts[1::2]) for parts in cut}) > 1 or not len(cut[0]) % 2:
        return None
    columns = list(zip(*(parts[::2] for parts in cut), strict=True))
    fast = [n for n, column in enumerate(columns) if _is_fast(column)]
    for chosen in (None, *fast[: len(fast) == 1]):
        pattern: list[str] = []
        for n, column in enumerate(columns):
            speed = f"{{{SPEED}}}" if n == chosen else None
            pattern.append(speed or _name_part(column, "".join(pattern)))
        ends = [*cut[0][1::2], _end(names[0])]
        found = "".join(a + b for a, b in zip(pattern, ends, strict=True))
        if f"{{{TEXTURE}}}" in found and f"{{{SPEED}}}" in found:
            return found
    return None


def _is_fast(column: Sequence[str]) -> bool:
    """Return whether the parts are numbers that may be speeds and do more than count."""
    if len(set(column)) == 1 or not all(map(_NUMBER.fullmatch, column)):
        return False
    numbers = set(map(float, column))
    return max(numbers) <= _FASTEST_MM_S and not _counts(numbers)


def _name_part(column: Sequence[str], before: str) -> str:
    """Return what stands for one part of all names: itself, a named number, or a word."""
    if len(set(column)) == 1:
        return column[0]
    if all(re.fullmatch(_DATE, text) for text in column):
        return "{date}"
    numbers = [_WITH_UNIT.fullmatch(text) for text in column]
    around = {(one["word"], one["unit"]) for one in numbers if one}
    if not all(numbers) or len(around) > 1:
        return (
            f"{{{TEXTURE}}}" if f"{{{TEXTURE}}}" not in before else f"{{part{before.count('{')}}}"
        )
    ((word, unit),) = around
    is_speed = _MM_S.fullmatch(unit) or word.lower() in ("v", "speed")
    name = SPEED if is_speed else word.lower() or _UNITS.get(unit, TRIAL)
    name = name if f"{{{name}}}" not in before else f"{name}{before.count('{')}"
    return f"{word}{{{name}}}{unit}"


def guess_plainest(names: Sequence[str]) -> str:
    """Return a pattern that takes the first folder, or else the name, for the texture."""
    depth = max(name.count("/") for name in names)
    end = Path(names[0]).suffix
    return "/".join(["{texture}", *(f"{{run{n}}}" for n in range(1, depth + 1))]) + end
