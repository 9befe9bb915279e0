"""Data sets of time series that a file describes: `dataset.toml`, or one of the package's own."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from afferents.errors import InputError, reading
from afferents.files import is_hidden
from afferents.recordings import media, pattern, tables
from afferents.recordings.data_set import DataSet
from afferents.recordings.description import DataSetFile, Labels, Signal, read_data_set_file
from afferents.recordings.series import JoinedFiles, SeriesFile, describe_files
from afferents.store.recording import Recording, RecordingSet, fold_label, require_distinct

DATA_SET_FILE = "dataset.toml"
PACKAGED = {path.stem: path for path in sorted((Path(__file__).parent / "sets").glob("*.toml"))}
"""Descriptions of public data sets, by name."""
Row = Mapping[str, str]
"""What a file of labels says of a file: texture, speed, or the name of a condition."""


class Described(DataSet):
    """A data set as its `dataset.toml` describes it; see docs/your-data.md.

    Parameters
    ----------
    path
        The TOML file, or a folder that holds ``dataset.toml``. With a description, the folder of
        the data.
    description
        A TOML file that lies elsewhere, as those of the package.

    Raises
    ------
    InputError
        If the file is not what it should be; it names the key.
    """

    name = "dataset"
    chooses_encodings = True

    def __init__(self, path: str | Path, description: Path | None = None) -> None:
        super().__init__(path)
        self.description = description
        if description is None and self.path.is_dir():
            self.path = self.path / DATA_SET_FILE
        self.form: DataSetFile = read_data_set_file(description or self.path)
        self.name = self.name if description is None else description.stem
        self.title = self.form.title or self.path.parent.name or "the data set"
        self.encodings = self.form.encodings

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether it is a TOML file, or a folder that holds one of the expected name."""
        if path.is_dir():
            return (path / DATA_SET_FILE).is_file()
        return path.suffix.lower() == ".toml"

    @property
    def root(self) -> Path:
        """Folder that files are looked for in."""
        return self.path if self.description else self.path.parent

    def config(self) -> Mapping[str, Any]:
        """Return what a file that may change says of the signals."""
        if self.description is not None:
            return {}
        known = self.form.model_dump(mode="json", include={"files", "signal"})
        return {"described": known, "declared": {"simulated": self.form.simulated}}

    def matching(self, look: bool = False) -> list[tuple[Path, Mapping[str, str]]]:
        """Return the files that match and what their names say, of the first folder with any.

        Their path from the folder matches all of the pattern; hidden ones never do.

        Parameters
        ----------
        look
            Whether it is a quick look that searches no folders at any depth.
        """
        files, found = self.form.files, []
        for folder in (one for one in files.folders if not (look and "**" in one)):
            literal = re.sub(r"[\[?]", r"[\g<0>]", folder)  # all but "*" stands for itself
            places = [self.root / folder] if "*" not in folder else self.root.glob(literal)
            for place in filter(Path.is_dir, places):
                for path in place.glob("/".join(["*"] * files.depth)):
                    inner = path.relative_to(place)
                    known = None if is_hidden(inner) else files.values(inner.as_posix(), self.path)
                    if known is not None and path.is_file():
                        found.append((path, known))
            if found:
                return self._label(sorted(found, key=lambda one: one[0]))
        return []

    def scan(self) -> RecordingSet:
        """Return a recording a file; a file's fault shows when it is read."""
        if not self.root.is_dir():
            raise InputError(
                f"{self.root}: expected a folder of {self.title}, found no such folder"
            )
        found = self.matching()
        if not found:
            files = self.form.files
            there = (p for p in self.root.rglob("*") if p.is_file() and p.suffix != ".toml")
            seen = ", ".join(path.relative_to(self.root).as_posix() for path in sorted(there)[:3])
            raise InputError(
                f"{self.root}: expected files that match {files.pattern or files.regex}, found "
                f"none of them{f' ({seen}, ...)' if seen else ''}"
            )
        recordings, rate_hz = [], self.form.signal.rate_hz
        for known, paths in self._group(found):
            parts = {}
            for part, path in paths.items():
                parts[part] = SeriesFile(path, self.form.signal, rate_hz)
                if rate_hz is None:
                    with suppress(InputError):
                        rate_hz = parts[part].sample_rate_hz
            whole = JoinedFiles(parts) if self.form.files.joined else parts[""]
            recordings.append(self._make_recording(whole, known))
        stems = {one.source.stem for one in recordings}
        if self.description is not None and len(stems) == len(recordings):
            recordings = [replace(one, name=one.source.stem) for one in recordings]
        self._require_distinct(recordings)
        require_distinct(self.path, (one.texture for one in recordings), ())
        return RecordingSet(self.root, tuple(recordings))

    def describe(self, session: RecordingSet) -> list[str]:
        """Return what the clock rests on, and which columns are channels where none is named."""
        files = [
            file
            for one in session.recordings
            if isinstance(one.audio, SeriesFile | JoinedFiles)
            for file in one.audio.files
        ]
        return [*describe_files(files), *self.left_out(session)]

    def left_out(self, session: RecordingSet) -> list[str]:
        """Return which files, of the endings of those that are read, are not read."""
        taken, files = [path for one in session.recordings for path in one.files], self.form.files
        endings = {path.suffix.lower() for path in taken}
        where = "" if files.folders == (".",) else f" in {' or '.join(files.folders)}"
        why = f"not of '{files.pattern or files.regex}'{where}"
        if files.labels:
            why += f", or without a row in {files.labels.file}"
            taken.append(self.root / files.labels.file)
        return media.left_out(self.root, taken, endings, why)

    def _group(
        self, found: Sequence[tuple[Path, Mapping[str, str]]]
    ) -> list[tuple[Mapping[str, str], dict[str, Path]]]:
        """Return what is known of each recording, and its files by part: one, called nothing.

        Raises
        ------
        InputError
            If files of a recording are missing that others have, or two are the same part.
        """
        joined = self.form.files.joined
        if not joined:
            return [(known, {"": path}) for path, known in found]
        groups: dict[tuple[tuple[str, str], ...], dict[str, Path]] = {}
        for path, known in found:
            rest = tuple((name, text) for name, text in known.items() if name != joined)
            parts = groups.setdefault(rest, {})
            if other := parts.get(known[joined]):
                raise InputError(
                    f"{self.path}: expected files that their names tell apart, found {other.name} "
                    f"and {path.name}; name what differs in the pattern, such as {{trial}}"
                )
            parts[known[joined]] = path
        wanted = {part for parts in groups.values() for part in parts}
        for parts in groups.values():
            if missing := sorted(wanted - set(parts)):
                first = next(iter(parts.values()))
                raise InputError(
                    f"{first}: expected a file of each {joined} ({', '.join(sorted(wanted))}), "
                    f"found none of '{missing[0]}'; add it, or leave the others out of the pattern"
                )
        return [(dict(rest), dict(sorted(parts.items()))) for rest, parts in groups.items()]

    def _label(
        self, found: Sequence[tuple[Path, Mapping[str, str]]]
    ) -> list[tuple[Path, Mapping[str, str]]]:
        """Return the files that have a row in the file of labels, with what that says of each."""
        if (labels := self.form.files.labels) is None:
            return list(found)
        path = self.root / labels.file
        rows = read_labels(path, labels)
        taken: dict[str, Path] = {}
        kept: list[tuple[Path, Mapping[str, str]]] = []
        for file, known in found:
            inner = file.relative_to(self.root)
            # A row names a file by its path, without ending, or by the last part of either.
            names = (inner, inner.with_suffix(""), Path(inner.name), Path(inner.stem))
            name = next((one.as_posix() for one in names if one.as_posix() in rows), None)
            if name is None:
                continue
            if (other := taken.setdefault(name, file)) is not file:
                raise InputError(
                    f"{path}: expected a row a file, found '{name}', which {other} and {file} are "
                    "called; write more of their paths"
                )
            kept.append((file, {**known, **rows[name]}))
        if not kept:
            raise InputError(
                f"{path}: expected rows of the files in {self.root}, such as {found[0][0].name}, "
                f"found others, such as {next(iter(rows))}"
            )
        return kept

    def _make_recording(
        self, series: SeriesFile | JoinedFiles, values: Mapping[str, str]
    ) -> Recording:
        files, known = self.form.files, {k: fold_label(text) for k, text in values.items()}
        for name, words in files.words.items():
            known[name] = words.get(known[name], known[name])
        speed = files.speed_mm_s
        if "speed" in known:
            text = known.pop("speed")
            try:
                speed = pattern.parse_speed(text) * files.mm_s
            except ValueError:
                raise InputError(
                    f"{series.path}: expected a speed in its name, found '{text}'"
                ) from None
            if speed == 0:
                raise InputError(
                    f"{series.path}: expected a slide faster than 0 mm/s, found '{text}'"
                )
        texture = files.texture or known.pop("texture")
        inner = series.path.relative_to(self.root).with_suffix("")
        return Recording(
            name=inner.as_posix(),
            texture=texture,
            speed_mm_s=speed,
            source=series.path,
            audio=series,
            steady_s=_find_steady(series, self.form.signal),
            conditions={
                name: int(text)
                if re.fullmatch(r"-?\d+", text)
                else (float(text) if re.fullmatch(r"-?\d+\.\d+", text) else text)
                for name, text in known.items()
            },
        )

    def _require_distinct(self, recordings: list[Recording]) -> None:
        """Refuse files that the pattern does not tell apart: it matches something twice."""
        seen: dict[Any, Recording] = {}
        for one in recordings:
            known = (one.texture, one.speed_mm_s, tuple(sorted(one.conditions.items())))
            other = seen.setdefault(known, one)
            if other is not one:
                at = "" if one.speed_mm_s is None else f" at {one.speed_mm_s:g} mm/s"
                raise InputError(
                    f"{self.path}: expected files that their names tell apart, found "
                    f"{other.source.name} and {one.source.name}, both {one.texture}{at}; name "
                    "what differs in the pattern, such as {trial}"
                )


def _find_steady(series: SeriesFile | JoinedFiles, signal: Signal) -> tuple[float, float] | None:
    """Return the part of constant speed; None where a file can't be read, as reading it says."""
    if signal.steady_s is None:
        return None
    start_s, stop_s = (0.0, 0.0) if signal.steady_s == "all" else signal.steady_s
    if stop_s > 0:
        return start_s, stop_s
    try:
        end_s = series.n_samples / series.sample_rate_hz + stop_s
    except InputError:
        return None
    if end_s <= start_s:
        raise InputError(
            f"{series.path}: expected more than steady_s leaves out, found a file of "
            f"{end_s - stop_s:g} s; leave it out, or shorten [signal] steady_s"
        )
    return start_s, end_s


def read_labels(path: Path, labels: Labels) -> dict[str, Row]:
    """Read what a file says, by the path of the file that it says it of.

    Parameters
    ----------
    path
        A CSV with names of columns, or JSON: a list of objects, or an object by file.

    Raises
    ------
    InputError
        If it can't be read, lacks a column, leaves one empty, or has two rows of one file.
    """
    found: dict[str, Row] = {}
    for where, row in _read_rows(path, labels):
        missing = [one for one in (labels.name, *labels.columns.values()) if not row.get(one)]
        if missing:
            have = ", ".join(name for name, text in row.items() if text) or "nothing"
            raise InputError(
                f"{path}, {where}: expected '{missing[0]}', found {have}; fill it in, or say in "
                "[files.labels] what it is called"
            )
        name = Path(row[labels.name]).as_posix()
        if name in found:
            raise InputError(f"{path}, {where}: expected a row a file, found '{name}' twice")
        found[name] = {what: row[column] for what, column in labels.columns.items()}
    if not found:
        raise InputError(f"{path}: expected a row for each file of data, found none")
    return found


def _read_rows(path: Path, labels: Labels) -> Iterator[tuple[str, Row]]:
    """Yield where each row stands, and its texts by column."""
    if path.suffix.lower() != ".json":
        yield from ((f"line {number}", row) for number, row in tables.read_texts(path))
        return
    with reading(path, "a JSON file of labels", OSError, ValueError):
        found = json.loads(path.read_text(encoding="utf-8-sig"))
    if isinstance(found, dict):
        found = [
            {labels.name: name, **(row if isinstance(row, dict) else {labels.texture: row})}
            for name, row in found.items()
        ]
    if not isinstance(found, list) or not all(isinstance(row, dict) for row in found):
        raise InputError(
            f"{path}: expected a list of objects, or an object by file, found another JSON"
        )
    for number, row in enumerate(found, start=1):
        texts = {str(k): "" if one is None else str(one).strip() for k, one in row.items()}
        yield f"row {number}", texts
