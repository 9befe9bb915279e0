"""A first `dataset.toml` for a folder of tables, guessed from their names and content."""

import json
import math
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from afferents.errors import InputError
from afferents.files import walk
from afferents.recordings import columns, description, guess
from afferents.recordings.pattern import SPEED
from afferents.recordings.tables import Numbers, Table, find_dialect, read_columns

TABLES = frozenset({".csv", ".parquet", ".npy", ".npz", ".h5", ".hdf5", ".mat"})
_TIME = re.compile(r"(?i)t|(?:time|timestamps?|seconds?)(?:[_ (\[]*(?P<unit>s|ms|us|ns)\W*)?")
_MOST_DROPPED = 0.25
"""Share of rows; where more repeat a time or go back, the times are no clock."""
_SHORT_S = 5.0


def find_tables(folder: Path) -> list[Path]:
    """Return the tables below a folder, of the kind that most are of; hidden ones never."""
    files = (path for _, files in walk(folder) for path in files)
    shown = [path for path in files if path.suffix.lower() in TABLES and path.is_file()]
    usual = Counter(path.suffix.lower() for path in shown).most_common(1)
    return sorted(path for path in shown if path.suffix.lower() == usual[0][0])


def guess_data_set(folder: Path, tables: Sequence[Path]) -> tuple[list[str], list[str]]:
    """Return the lines of a `dataset.toml`, and sentences on what was guessed."""
    names = [path.relative_to(folder).as_posix() for path in tables]
    pattern = guess.guess_rule(names) or guess.guess_plainest(names)
    lines = ["", "[files]", f"pattern = {json.dumps(pattern, ensure_ascii=False)}"]
    if f"{{{SPEED}}}" in pattern:
        sentence = f"Guessed from the names: {pattern}, with the speed in mm/s."
        lines.append('# speed_unit = "mm/min"  # where it is not mm/s')
    else:
        sentence = f"Guessed from the names: {pattern}; no speed was found in them."
        if len(names) > 1 and "/" not in pattern and pattern == guess.guess_plainest(names):
            such = f"{{texture}}_{{speed}}mms_{{trial}}{Path(names[0]).suffix}"
            sentence = (
                "No rule was found in the names, so each file counts as a texture of its own: "
                f"write the pattern, such as {such}."
            )
        lines.append("# speed_mm_s = 30")
    signal, more = _guess_signal(tables)
    return [*lines, "", "[signal]", *signal], [sentence, *more]


def _guess_signal(tables: Sequence[Path]) -> tuple[list[str], list[str]]:
    """Return lines and sentences on what is in the files."""
    files: list[columns.Courses] = []
    times: list[Numbers] = []
    broken: list[InputError] = []
    form, time = description.Signal(), None
    for path in tables:
        try:
            if not files:
                form = find_dialect(path) if path.suffix.lower() == ".csv" else description.Signal()
            table = read_columns(path, form)
        except InputError as error:
            broken.append(error)
            continue
        time = time if files else _find_time(table)
        files.append(columns.describe_columns(table))
        if time in table.columns:
            rising = table.values[:, table.columns.index(time)]
            times.append(rising[np.isfinite(rising)])
    if not files:
        return ["# channels = []", "# sample_rate_hz = 100"], []
    sentences = []
    if broken:
        sentences.append(f"Can't be read, {len(broken)} of {len(tables)} files: {broken[0]}.")
    lines = [f"separator = {json.dumps(form.separator)}"] * (form.separator != ",")
    lines += ['decimal = ","'] * (form.decimal == ",") + ["header = false"] * (not form.header)
    sentences += ["Numbers are read with decimal commas."] * (form.decimal == ",")
    others = [name for name in files[0] if name != time]
    doubts = columns.find_non_signals(files)
    why = {name: reason for name, reason in doubts.items() if name in others}
    chosen = [name for name in others if why.get(name) in (None, columns.DEAD)] or others
    lines.append(f"channels = [{', '.join(map(_key, chosen))}]")
    for title, keeps in (("Left out of the channels", False), ("Kept as channels", True)):
        if named := [f"{name} ({why[name]})" for name in why if (name in chosen) == keeps]:
            lines.append(f"# {title}: {', '.join(named)}.")
            sentences.append(f"{title}: {', '.join(named)}.")
    if time is None or not any(columns.find_rows_in_order(one).sum() > 1 for one in times):
        missing = "No column looks like times: fill in sample_rate_hz, which nothing can confirm."
        return [*lines, "# sample_rate_hz = 100"], [*sentences, missing]
    clock, sentence = _describe_clock(times, time)
    return [*lines, *clock], [*sentences, sentence]


def _key(name: str) -> str:
    return name if name.isdigit() else json.dumps(name, ensure_ascii=False)


def _find_time(table: Table) -> str | None:
    """Return the column named like a time, or else, of columns without names, one that rises."""
    does = columns.describe_columns(table)
    named = [n for n in does if _TIME.fullmatch(n.strip(" %")) and does[n] != columns.TEXTS]
    steps = dict(zip(table.columns, np.diff(table.values, axis=0).T, strict=True))
    rising = [n for n in does if n.isdigit() and does[n] == columns.RISES and (steps[n] != 1).any()]
    return next(iter(named + rising), None)


def _describe_clock(times: Sequence[Numbers], time: str) -> tuple[list[str], str]:
    """Return lines and a sentence on the times of all files."""
    named = _TIME.fullmatch(time.strip(" %"))
    declared = (named and named["unit"]) or "s"
    kept = [found for one in times if len(found := one[columns.find_rows_in_order(one)]) > 1]
    steps = [np.diff(one) for one in kept]
    usual = float(np.median([np.median(step) for step in steps]))
    unit = columns.find_unit(usual, max(map(len, kept)), declared)
    ms, declared_ms = description.UNITS_MS[unit], usual * description.UNITS_MS[declared]
    usual_ms, mean_ms = usual * ms, float(np.median([step.mean() for step in steps])) * ms
    longest_ms = float(max(step.max() for step in steps)) * ms
    dropped = max(1 - float(columns.find_rows_in_order(one).mean()) for one in times if len(one))
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
        if description.Signal().out_of_order < dropped < _MOST_DROPPED:
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
