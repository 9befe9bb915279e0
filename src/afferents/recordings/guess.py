"""What names of files say of recordings: a first guess, to be checked by a person."""

import json
import math
import re
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from afferents.errors import InputError
from afferents.files import walk
from afferents.recordings import series
from afferents.recordings.media import SPEED, TEXTURE, Pattern, as_speed, is_sound
from afferents.recordings.tables import UNITS_MS, Numbers, Signal, Table, find_dialect, read_columns

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
_SAID = (
    *("{speed}mms", "{speed}mm_s", "{speed}mm-s", "{speed}mmps", "{speed} mm_s"),
    *("speed{speed}", "speed_{speed}", "Speed{speed}"),
)
_SPEEDS = (*_SAID, "v{speed}", "V{speed}", "{speed}")
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
    speeds = _SPEEDS if share == 1 else _SAID
    for strict, speed, text, joint in product((True, False), speeds, _PATTERNS, _JOINTS):
        if "{speed}" not in text and (strict or speed != _SPEEDS[-1]):
            continue
        wanted = text.replace("_", joint).replace("{speed}", speed) + _end(paths[0])
        if _fits(Pattern(wanted), paths, share, speed in _SAID, strict):
            return wanted
    return None


def guess_rule(paths: Sequence[str]) -> str | None:
    """Return the pattern that nearly all paths fit, by `guess_pattern` or by parts of the names."""
    return (
        guess_pattern(paths)
        or _labelled(paths)
        or _by_parts(paths)
        or guess_pattern(paths, NEARLY_ALL)
    )


def _end(path: str) -> str:
    return "/" if path.endswith("/") else Path(path).suffix


def _fits(pattern: Pattern, paths: Sequence[str], share: float, said: bool, strict: bool) -> bool:
    """Tell whether a pattern fits so many of the paths, with numbers where numbers should be.

    Parameters
    ----------
    share
        Of the paths, at least.
    said
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
    if SPEED not in pattern.names or said:
        return True
    by_texture: dict[str, set[float]] = {}
    for one in values:
        by_texture.setdefault(one[TEXTURE], set()).add(as_speed(one[SPEED]))
    every = set().union(*by_texture.values())
    trials = {float(re.sub(r"\D", "", one[TRIAL])) for one in values if TRIAL in one}
    may_count = not strict and trials and _counts(trials)
    return max(every) <= _FASTEST_MM_S and (
        may_count or not (_counts(every) or all(map(_counts, by_texture.values())))
    )


def _hold_conditions(textures: Collection[str]) -> bool:
    """Tell whether textures end in a condition: several words, each with the same numbers."""
    numbers: dict[str, set[str]] = {}
    for texture in textures:
        if (ending := _NUMBERED_END.fullmatch(texture)) is None:
            return False
        numbers.setdefault(ending[1], set()).add(ending[2])
    first, *others = numbers.values()
    return len(first) > 1 and bool(others) and all(one == first for one in others)


def _counts(numbers: Collection[float]) -> bool:
    """Tell whether numbers only count: 1, 2, 3 are trials rather than speeds."""
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
    return Guess(video, audio, first, as_speed(speed[1]) if speed else None, repetition)


# A first `dataset.toml` for a folder of tables, guessed from names and from one file.

TABLES = frozenset({".csv", ".parquet", ".npy", ".npz", ".h5", ".hdf5", ".mat"})
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_LABEL = re.compile(r"([A-Za-z]+)[^A-Za-z0-9/]*$")
_TIME = re.compile(r"(?i)t|(?:time|timestamps?|seconds?)(?:[_ (\[]*(?P<unit>s|ms|us|ns)\W*)?")
_BETWEEN = "_- /"
_PART = re.compile(rf"(?:^|(?<=[_\- /])){_DATE}(?=[_\- /]|$)|[^_\- /]+|[_\- /]+")
_WITH_UNIT = re.compile(r"(?P<word>[A-Za-z]*)\d+(?:[.,]\d+)?(?P<unit>[A-Za-z/]*)")
_MM_S = re.compile(r"mmp?s")
_UNITS = {"N": "force", "mN": "force", "g": "force", "kPa": "pressure", "deg": "direction"}
"""What a number of such a unit is called; another is called trial."""
_MOST_DROPPED = 0.25
"""Share of rows; where more repeat a time or go back, the times are no clock."""
_SHORT_S = 5.0


def tables_in(folder: Path) -> list[Path]:
    """Return the tables below a folder, of the kind that most are of; hidden ones never."""
    files = (path for _, files in walk(folder) for path in files)
    shown = [path for path in files if path.suffix.lower() in TABLES and path.is_file()]
    usual = Counter(path.suffix.lower() for path in shown).most_common(1)
    return sorted(path for path in shown if path.suffix.lower() == usual[0][0])


def guess_data_set(folder: Path, tables: Sequence[Path]) -> tuple[list[str], list[str]]:
    """Return the lines of a `dataset.toml`, and sentences on what was guessed."""
    names = [path.relative_to(folder).as_posix() for path in tables]
    pattern = guess_rule(names) or _plainest(names)
    said = [f"Guessed from the names: {pattern}, with the speed in mm/s."]
    lines = ["", "[files]", f"pattern = {json.dumps(pattern, ensure_ascii=False)}"]
    if f"{{{SPEED}}}" in pattern:
        lines.append('# speed_unit = "mm/min"  # where it is not mm/s')
    else:
        said = [f"Guessed from the names: {pattern}; no speed was found in them."]
        if len(names) > 1 and "/" not in pattern and pattern == _plainest(names):
            such = f"{{texture}}_{{speed}}mms_{{trial}}{Path(names[0]).suffix}"
            said = [
                "No rule was found in the names, so each file is taken for a texture of its own: "
                f"write the pattern, such as {such}."
            ]
        lines.append("# speed_mm_s = 30")
    signal, more = _signal(tables)
    return [*lines, "", "[signal]", *signal], [*said, *more]


def _labelled(names: Sequence[str]) -> str | None:
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


def _by_parts(names: Sequence[str]) -> str | None:
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
            pattern.append(speed or _part(column, "".join(pattern)))
        ends = [*cut[0][1::2], _end(names[0])]
        found = "".join(a + b for a, b in zip(pattern, ends, strict=True))
        if f"{{{TEXTURE}}}" in found and f"{{{SPEED}}}" in found:
            return found
    return None


def _is_fast(column: Sequence[str]) -> bool:
    """Tell whether the parts are numbers that may be speeds and do more than count."""
    if len(set(column)) == 1 or not all(map(_NUMBER.fullmatch, column)):
        return False
    numbers = set(map(float, column))
    return max(numbers) <= _FASTEST_MM_S and not _counts(numbers)


def _part(column: Sequence[str], before: str) -> str:
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


def _plainest(names: Sequence[str]) -> str:
    """Return a pattern that takes the first folder, or else the name, for the texture."""
    depth = max(name.count("/") for name in names)
    end = Path(names[0]).suffix
    return "/".join(["{texture}", *(f"{{run{n}}}" for n in range(1, depth + 1))]) + end


def _signal(tables: Sequence[Path]) -> tuple[list[str], list[str]]:
    """Return lines and sentences on what is in the files."""
    files: list[series.Courses] = []
    times: list[Numbers] = []
    broken: list[InputError] = []
    form, time = Signal(), None
    for path in tables:
        try:
            if not files:
                form = find_dialect(path) if path.suffix.lower() == ".csv" else Signal()
            table = read_columns(path, form)
        except InputError as error:
            broken.append(error)
            continue
        time = time if files else _time_in(table)
        files.append(series.courses(table))
        if time in table.columns:
            rising = table.values[:, table.columns.index(time)]
            times.append(rising[np.isfinite(rising)])
    if not files:
        return ["# channels = []", "# sample_rate_hz = 100"], []
    said = [f"Can't be read, {len(broken)} of {len(tables)} files: {broken[0]}."] if broken else []
    lines = [f"separator = {json.dumps(form.separator)}"] * (form.separator != ",")
    lines += ['decimal = ","'] * (form.decimal == ",") + ["header = false"] * (not form.header)
    said += ["Numbers are read with decimal commas."] * (form.decimal == ",")
    others = [name for name in files[0] if name != time]
    why = {name: reason for name, reason in series.no_signals(files).items() if name in others}
    chosen = [name for name in others if why.get(name) in (None, series.DEAD)] or others
    lines.append(f"channels = [{', '.join(map(_key, chosen))}]")
    for title, keeps in (("Left out of the channels", False), ("Kept as channels", True)):
        if named := [f"{name} ({why[name]})" for name in why if (name in chosen) == keeps]:
            lines.append(f"# {title}: {', '.join(named)}.")
            said.append(f"{title}: {', '.join(named)}.")
    if time is None or not any(series.in_order(one).sum() > 1 for one in times):
        asked = "No column looks like times: fill in sample_rate_hz, which nothing can confirm."
        return [*lines, "# sample_rate_hz = 100"], [*said, asked]
    clock, sentence = _clock(times, time)
    return [*lines, *clock], [*said, sentence]


def _key(name: str) -> str:
    return name if name.isdigit() else json.dumps(name, ensure_ascii=False)


def _time_in(table: Table) -> str | None:
    """Return the column named like a time, or else, of columns without names, one that rises."""
    does = series.courses(table)
    named = [n for n in does if _TIME.fullmatch(n.strip(" %")) and does[n] != series.TEXTS]
    steps = dict(zip(table.columns, np.diff(table.values, axis=0).T, strict=True))
    rising = [n for n in does if n.isdigit() and does[n] == series.RISES and (steps[n] != 1).any()]
    return next(iter(named + rising), None)


def _clock(times: Sequence[Numbers], time: str) -> tuple[list[str], str]:
    """Return lines and a sentence on the times of all files."""
    named = _TIME.fullmatch(time.strip(" %"))
    declared = (named and named["unit"]) or "s"
    kept = [found for one in times if len(found := one[series.in_order(one)]) > 1]
    steps = [np.diff(one) for one in kept]
    usual = float(np.median([np.median(step) for step in steps]))
    unit = series.unit_of(usual, max(map(len, kept)), declared)
    ms, declared_ms = UNITS_MS[unit], usual * UNITS_MS[declared]
    usual_ms, mean_ms = usual * ms, float(np.median([step.mean() for step in steps])) * ms
    longest_ms = float(max(step.max() for step in steps)) * ms
    dropped = max(1 - float(series.in_order(one).mean()) for one in times if len(one))
    lines = [f"time = {_key(time)}", f'time_unit = "{unit}"']
    sentence = f"Column {time} holds times in {unit}"
    sentence += f", since rows can't be {declared_ms:.3g} ms apart" * (unit != declared)
    sentence += f": rows {usual_ms:.3g} ms apart"
    if dropped or longest_ms > usual_ms * 1.5 or min(s.min() for s in steps) * ms < usual_ms / 2:
        lines += [
            "# Rows come unevenly: between them straight lines are drawn.",
            f"resample_hz = {float(f'{1000 / mean_ms:.2g}'):g}",
            f"{'# ' * (longest_ms <= 5 * usual_ms)}longest_gap_ms = {math.ceil(longest_ms)}",
        ]
        if Signal().out_of_order < dropped < _MOST_DROPPED:
            lines.append(f"out_of_order = {math.ceil(100 * dropped) / 100:g}  # the largest share")
        sentence += f" (median), {mean_ms:.3g} in the mean, so they are resampled"
    if min(one[-1] - one[0] for one in kept) * ms < 1000 * _SHORT_S:
        lines += ["# All of each file is used; of constant speed should be:", 'steady_s = "all"']
    else:
        lines += [
            "# Of constant speed, s; else 2.5 s are left out at each end.",
            "# steady_s = [1, 4]",
        ]
    return lines, f"{sentence}."
