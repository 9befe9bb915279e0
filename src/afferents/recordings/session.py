"""The session folder: recordings that belong together, in the published layout or as it says."""

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from afferents.documents import as_form
from afferents.errors import InputError, reading
from afferents.quality.issues import KINDS, QualityIssue
from afferents.recordings import audio, check, grid, layouts, media, session_file
from afferents.recordings.data_set import DataSet
from afferents.recordings.pictures import ZIP
from afferents.recordings.session_file import SESSION_TOML, ListedRecording, SessionFile, StrictFile
from afferents.recordings.video import VideoFile
from afferents.store.recording import Recording, RecordingSet, natural_order
from afferents.store.responses import Responses

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Session(RecordingSet):
    """Recordings that belong together, and what is declared of them.

    `afferents.read_session` reads one from a folder, `from_table` makes one of a table.
    `afferents.extract` takes either.
    """

    declared: SessionFile = field(default_factory=SessionFile)
    press: Recording | None = None

    def left_out(self) -> list[str]:
        """Return what lies in the folder, or within its videos, and is not read, and why."""
        if self.declared.notes is not None:
            return list(self.declared.notes)
        used = [path for recording in self.recordings for path in recording.files]
        used += [self.reference.path] if self.reference else []
        videos = [r.video.path for r in self.recordings if isinstance(r.video, VideoFile)]
        declared, why = (
            self.declared,
            f"not called <texture>/<speed>/{layouts.VIDEO} or {layouts.AUDIO}",
        )
        if declared.names_files:
            of = f"of the pattern '{declared.pattern}'" if declared.pattern else "listed"
            why = f"not {of} in {declared.file}"
        advice = audio.advise_conversion(Path("NAME"))
        return [
            *media.left_out(self.root, used, media.VIDEOS | media.SOUNDS, why),
            *media.left_out(self.root, used, media.OTHER_SOUNDS, advice),
            *audio.sound_within(videos),
        ]

    def resolve(self) -> "Session":
        """Return it with paths that are found from anywhere."""
        return make_session(self.root.resolve(), self.declared)

    def at_rate(self, fps_hz: float | None) -> "Session":
        """Return it with the true frame rate of all videos, Hz; as it is for None.

        Raises
        ------
        InputError
            If it is no rate, or recordings name theirs.
        """
        return self if fps_hz is None else make_session(self.root, self.declared.at_rate(fps_hz))

    @classmethod
    def from_table(
        cls, table: "pd.DataFrame", root: str | Path = ".", **declared: object
    ) -> "Session":
        """Make a session of a table with a row a recording.

        Parameters
        ----------
        table
            Columns as the keys of a recording in ``session.toml``: `video` or `audio` or both
            (paths, from `root`), `texture`, and where they are known `speed_mm_s`, `repetition`,
            `id`, `fps_hz`, `steady_s`, `rest_frame`, `sensor`. All other columns are conditions.
            Cells may be empty (NaN or None).
        root
            The folder that paths count from.
        declared
            What else ``session.toml`` may say of all, such as ``steady_s=(0.5, 2.5)``.

        Raises
        ------
        InputError
            Naming the row and column that are not what they should be.
        """
        folder = Path(root).resolve()
        there = table.astype(object).where(table.notna(), None)
        rows = [_read_row(row) for row in there.to_dict("records")]
        if not rows:
            raise InputError("the table: expected a row for each recording, found none")
        for number, row in enumerate(rows):
            as_form(row, ListedRecording, f"row {number} of the table", "a recording")
        content = {**declared, "recordings": rows}
        return make_session(
            folder, session_file.parse_declaration(content, "the table", StrictFile)
        )


def _read_row(row: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a row as a session file would say it."""
    given = {str(name): value for name, value in row.items() if value is not None}
    known = {name: given[name] for name in ListedRecording.model_fields if name in given}
    others = {name: value for name, value in given.items() if name not in known}
    others = {k: str(v) if isinstance(v, bool | np.bool_) else v for k, v in others.items()}
    if isinstance(known.get("conditions", {}), Mapping):  # else it is refused as it is
        known["conditions"] = {**known.get("conditions", {}), **others}
    frame = known.get("rest_frame")
    if isinstance(frame, float) and frame.is_integer():  # an empty cell makes all of them floats
        known["rest_frame"] = int(frame)
    return known


class PublishedSession(DataSet):
    """A session folder, and what a reader of videos begins with: see `read_session`.

    Where its session file names files, by a list or a pattern, these are the recordings. Else a
    condition is a folder two levels down, or of a repetition three, that holds a `video` of any
    kind or `audio.wav`; folders without conditions and hidden ones are ignored.

    Other folders of videos or images are read by a subclass whose `declared` names their files.
    """

    name, title = "session", "A session"
    extracted_first = True
    fps_hz: float | None = None

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether there is a session file, or a folder in the published layout."""
        if not path.is_dir():
            return False
        if any((path / name).is_file() for name in session_file.SESSION_FILES):
            return True
        with suppress(InputError, OSError):  # which reading it says
            return any(True for _ in layouts.recording_folders(path))
        return False

    def declared(self) -> SessionFile:
        """Return what the folder's session file says, or one that names its files."""
        if not self.path.is_dir():
            raise InputError(
                f"{self.path}: expected a session folder, found "
                f"{'a file' if self.path.exists() else 'no such folder'}"
            )
        return session_file.read_session_file(self.path)

    @property
    def root(self) -> Path:
        """The folder that `declared` names files from."""
        return self.path

    def scan(self) -> Session:
        """Return a recording a condition; only the grid is checked."""
        return make_session(self.root, self._declared)

    @cached_property
    def _declared(self) -> SessionFile:
        """Of many runs it takes a while, and each recording is checked against it."""
        return self.declared().at_rate(self.fps_hz)

    def at_rate(self, fps_hz: float) -> Self:
        """Return it with the true frame rate of its videos."""
        found = type(self)(self.path)
        found.fps_hz = session_file.parse_rate(fps_hz)
        return found

    def check(self, recording: Recording) -> list[QualityIssue]:
        """Return what differs from the session's own declaration."""
        return check.check_recording(recording, self._declared, KINDS)

    def describe(self, session: RecordingSet) -> list[str]:
        """Return whether there is a marker reference, and what was found but is not used."""
        assert isinstance(session, Session)
        sentences = []
        if session.declared.reference:
            sentences.append(f"The skin at rest is in {session.declared.reference}.")
        elif session.reference:
            sentences.append(
                f"There is a {layouts.REFERENCE}: the order of markers comes from it with the "
                "published tracker only; the others take it from the sensor's layout."
            )
        elif not session.declared.names_files:
            sentences.append(
                f"There is no {layouts.REFERENCE}; it is needed only by the published tracker."
            )
        return sentences + session.left_out()


class Pictures(PublishedSession):
    """Numbered images alone, in a folder or a zip file: one recording, named as they are."""

    name, title = "pictures", "Images"

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Return whether it is a zip file, or a folder of numbered images and nothing else."""
        return path.suffix.lower() == ZIP if path.is_file() else media.is_image_folder(path)

    @property
    def root(self) -> Path:
        """The folder that they lie in."""
        return self.path.absolute().parent

    def declared(self) -> SessionFile:
        """Name them: the texture is their name."""
        only = {"video": self.path.name, "texture": self.path.stem}
        declared = session_file.parse_declaration({"recordings": [only]}, self.path)
        declared._notes = ()
        return declared


def match_recordings(session: Session, extracted: Iterable[Responses]) -> dict[str, Recording]:
    """Return a session's recordings by name, which must hold those that were extracted.

    Their videos have the frame rate that they were extracted at.

    Raises
    ------
    InputError
        If one of them is not there, or its files are others than those it was extracted from.
    """
    found = {one.name: one for one in session.recordings}
    for responses in extracted:
        name, checksum = str(responses.attrs["name"]), responses.attrs.get("checksum")
        if name not in found:
            raise InputError(
                f"{session.root}: expected the recording '{name}' of the store, found none"
            )
        if checksum and checksum != check.check_files(found[name], session.declared):
            expected = f"the files of '{name}' that the store was extracted from"
            raise InputError(
                f"{session.root}: expected {expected}, found others; give that session, or none"
            )
        rate_hz = json.loads(responses.attrs.get("declared", "{}")).get("fps_hz")
        if rate_hz and isinstance(video := found[name].video, check.ClipFile):
            seen = layouts.make_clip(video.path, session.declared, rate_hz)
            found[name] = replace(found[name], video=seen)
    return found


def make_session(root: Path, declared: SessionFile) -> Session:
    """Return the recordings of a folder, as a session file says or in the published layout.

    Raises
    ------
    InputError
        If the folder is unreadable, holds no condition, or not what `require_grid` asks for.
    """
    with reading(root, "a readable folder", OSError):
        find = layouts.listed if declared.names_files else layouts.published
        found = find(root, declared)
        there = [] if found else media.find_media(root)
    if not found:
        files = f"{layouts.VIDEO} or {layouts.AUDIO}"
        expected = f"{root}: expected conditions <texture>/<speed>/ with {files}"
        if not there:
            raise InputError(f"{expected}, found none of them")
        raise InputError(
            f"{expected}, or a {SESSION_TOML} that says which files are recordings, found "
            f"{media.named(root, there)}; 'afferents init {root}' writes a first {SESSION_TOML}"
        )

    def place(one: Recording) -> tuple[tuple[float, str], float, list[tuple[float, str]]]:
        speed = float("inf") if one.speed_mm_s is None else one.speed_mm_s
        return natural_order(one.texture), speed, [*map(natural_order, one.name.split("/"))]

    recordings = tuple(sorted(found, key=place))
    grid.require_grid(root, recordings, declared)
    reference = layouts.find_reference(root, declared, recordings[0])
    return Session(root, recordings, reference, declared, layouts.find_press(root, declared))
