"""Whether the recordings of a session belong together: its grid, its files, its rates."""

import json
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from afferents.documents import as_form
from afferents.errors import InputError, reading
from afferents.quality.issues import KINDS, QualityIssue
from afferents.recordings.audio import as_wav, sound_within
from afferents.recordings.check import (
    RATE_TOLERANCE,
    ClipFile,
    check_files,
    check_recording,
    lost_frames,
)
from afferents.recordings.data_set import DataSet
from afferents.recordings.layouts import (
    AUDIO,
    REFERENCE,
    VIDEO,
    listed,
    press_in,
    published,
    recording_folders,
    reference_in,
    video_of,
)
from afferents.recordings.media import (
    OTHER_SOUNDS,
    SOUNDS,
    VIDEOS,
    is_image_folder,
    left_out,
    media_in,
    named,
)
from afferents.recordings.pictures import ZIP
from afferents.recordings.session_file import (
    SESSION_FILES,
    SESSION_TOML,
    ListedRecording,
    SessionFile,
    StrictFile,
    declared_by,
    rate_in,
    session_file,
)
from afferents.recordings.video import VideoFile
from afferents.store.recording import Recording, RecordingSet, natural_order, require_distinct
from afferents.store.responses import Responses

if TYPE_CHECKING:
    import pandas as pd


def require_grid(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    """Refuse a session with one texture or speed under two names, with holes, or with files amiss.

    A list of recordings is what there is; of files that are found, one may have been forgotten.

    Raises
    ------
    InputError
        Naming what is amiss.
    """
    speeds = set()
    for r in recordings:
        if r.speed_mm_s is not None:
            folders = [] if declared.recordings else r.name.split("/")[1:2]
            name = (folders or [f"{r.speed_mm_s:g}"])[0]
            speeds.add((name.lstrip("+-"), r.speed_mm_s))  # a sign says a direction
    require_distinct(root, (r.texture for r in recordings), speeds)
    if not declared.recordings:
        _require_no_holes(root, recordings, declared)
    for what, usual in (("video", "video.mp4"), ("audio", "audio.wav")):
        lacking = [r.name for r in recordings if getattr(r, what) is None]
        if 0 < len(lacking) < len(recordings):  # models would be left out for all
            raise InputError(
                f"{root}: expected {what if declared.names_files else usual} in every condition or "
                f"in none, found none in {', '.join(lacking)}; record what is missing, or move "
                f"these folders away and declare them in {declared.file} as 'holes'"
            )


def _require_no_holes(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    present = {(r.texture, r.speed_mm_s) for r in recordings if r.speed_mm_s is not None}
    expected = {(texture, speed) for texture, _ in present for _, speed in present}
    missing = sorted(
        expected - present - set(declared.holes), key=lambda c: (natural_order(c[0]), c[1])
    )
    if missing:
        names = ", ".join(f"{texture}/{speed:g}" for texture, speed in missing)
        raise InputError(
            f"{root}: expected a recording of every texture at every speed, found none in "
            f"{names}; record what is missing or declare it in {declared.file}: holes = "
            f"{[[texture, speed] for texture, speed in missing]}"
        )


def require_rates_that_agree(session: RecordingSet, declared: SessionFile) -> None:
    """Refuse recordings of several frame rates or sample rates, or of several picture sizes.

    What is learnt from them is counted in frames, Hz and px, and would be mixed. Opens all files
    where no rate or size is declared of all; whether a file has it is `check_recording`'s.

    Raises
    ------
    InputError
        Naming two recordings that contradict each other.
    """
    sizes: dict[str, str] = {}
    for recording in session.recordings:
        if size := _size(recording, declared):
            sizes.setdefault(size, recording.name)
    if len(sizes) > 1:
        found = ", ".join(f"{size} px in {name}" for size, name in sizes.items())
        raise InputError(
            f"{session.root}: expected pictures of one size, found {found}; make a session of "
            "each size"
        )
    each = "make a session of each rate"
    true = f"if a container is wrong, write the recording's true fps_hz, else {each}"
    for what, tolerance, unit, do in (
        ("fps_hz", RATE_TOLERANCE, "frames a second", true),
        ("sample_rate_hz", 0.0, "samples a second", each),
    ):
        rates = [(r, _rate(r, what, declared)) for r in session.recordings]
        most = max((rate for _, rate in rates if rate), default=0.0)
        known = [
            (recording, rate)
            for recording, rate in rates
            if rate and not (rate < (1 - tolerance) * most and lost_frames(recording.video, most))
        ]
        for recording, rate in known:
            first, expected = known[0]
            if abs(rate - expected) > tolerance * expected:
                raise InputError(
                    f"{session.root}: expected recordings of one rate ({unit}), found "
                    f"{expected:g} in {first.name}, {rate:g} in {recording.name}; {do}"
                )


def _size(recording: Recording, declared: SessionFile) -> str:
    """Return its pictures' size; nothing where its own sensor, or what is declared of all, says."""
    if recording.video is None or recording.sensor or declared.frame_width:
        return ""
    with suppress(InputError):  # which extracting it says
        return f"{recording.video.width}x{recording.video.height}"
    return ""


def _rate(recording: Recording, what: str, declared: SessionFile) -> float | None:
    """Return its own rate, Hz, else the one that is declared of all, else its file's, if any."""
    source = recording.video if what == "fps_hz" else recording.audio
    if source is None:
        return None
    own: float | None = getattr(source, "rate_hz", None) or getattr(declared, what)
    with suppress(InputError):  # which extracting it says
        return own or getattr(source, what)
    return None


# The session folder: recordings that belong together, in the published layout or as it says.


@dataclass(frozen=True)
class Session(RecordingSet):
    """Recordings that belong together, and what is declared of them.

    `afferents.read_session` reads one from a folder, `from_table` makes one of a table.
    `afferents.extract` takes either.
    """

    declared: SessionFile = field(default_factory=SessionFile)
    press: Recording | None = None

    def left_out(self) -> list[str]:
        """Say what lies in the folder, or within its videos, and is not read, and why."""
        if self.declared.notes is not None:
            return list(self.declared.notes)
        used = [path for recording in self.recordings for path in recording.files]
        used += [self.reference.path] if self.reference else []
        videos = [r.video.path for r in self.recordings if isinstance(r.video, VideoFile)]
        declared, why = self.declared, f"not called <texture>/<speed>/{VIDEO} or {AUDIO}"
        if declared.names_files:
            of = f"of the pattern '{declared.pattern}'" if declared.pattern else "listed"
            why = f"not {of} in {declared.file}"
        return [
            *left_out(self.root, used, VIDEOS | SOUNDS, why),
            *left_out(self.root, used, OTHER_SOUNDS, as_wav(Path("NAME"))),
            *sound_within(videos),
        ]

    def resolve(self) -> "Session":
        """Return it with paths that are found from anywhere."""
        return session_of(self.root.resolve(), self.declared)

    def at_rate(self, fps_hz: float | None) -> "Session":
        """Return it with the true frame rate of all videos, Hz; as it is for None.

        Raises
        ------
        InputError
            If it is no rate, or recordings name theirs.
        """
        return self if fps_hz is None else session_of(self.root, self.declared.at_rate(fps_hz))

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
        rows = [_row(row) for row in there.to_dict("records")]
        if not rows:
            raise InputError("the table: expected a row for each recording, found none")
        for number, row in enumerate(rows):
            as_form(row, ListedRecording, f"row {number} of the table", "a recording")
        content = {**declared, "recordings": rows}
        return session_of(folder, declared_by(content, "the table", StrictFile))


def _row(row: Mapping[Any, Any]) -> dict[str, Any]:
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
        """Tell whether there is a session file, or a folder in the published layout."""
        if not path.is_dir():
            return False
        if any((path / name).is_file() for name in SESSION_FILES):
            return True
        with suppress(InputError, OSError):  # which reading it says
            return any(True for _ in recording_folders(path))
        return False

    def declared(self) -> SessionFile:
        """Return what the folder's session file says, or one that names its files."""
        if not self.path.is_dir():
            raise InputError(
                f"{self.path}: expected a session folder, found "
                f"{'a file' if self.path.exists() else 'no such folder'}"
            )
        return session_file(self.path)

    @property
    def root(self) -> Path:
        """The folder that `declared` names files from."""
        return self.path

    def scan(self) -> Session:
        """Return a recording a condition; only the grid is checked."""
        return session_of(self.root, self._declared)

    @cached_property
    def _declared(self) -> SessionFile:
        """Of many runs it takes a while, and each recording is checked against it."""
        return self.declared().at_rate(self.fps_hz)

    def at_rate(self, fps_hz: float) -> Self:
        """Return it with the true frame rate of its videos."""
        found = type(self)(self.path)
        found.fps_hz = rate_in(fps_hz)
        return found

    def check(self, recording: Recording) -> list[QualityIssue]:
        """Return what differs from the session's own declaration."""
        return check_recording(recording, self._declared, KINDS)

    def describe(self, session: RecordingSet) -> list[str]:
        """Say whether there is a marker reference, and what was found but is not used."""
        assert isinstance(session, Session)
        sentences = []
        if session.declared.reference:
            sentences.append(f"The skin at rest is in {session.declared.reference}.")
        elif session.reference:
            sentences.append(
                f"There is a {REFERENCE}: the order of markers comes from it with the published "
                "tracker only; the others take it from the sensor's layout."
            )
        elif not session.declared.names_files:
            sentences.append(
                f"There is no {REFERENCE}; it is needed only by the published tracker."
            )
        return sentences + session.left_out()


class Pictures(PublishedSession):
    """Numbered images alone, in a folder or a zip file: one recording, named as they are."""

    name, title = "pictures", "Images"

    @classmethod
    def recognises(cls, path: Path) -> bool:
        """Tell whether it is a zip file, or a folder of numbered images and nothing else."""
        return path.suffix.lower() == ZIP if path.is_file() else is_image_folder(path)

    @property
    def root(self) -> Path:
        """The folder that they lie in."""
        return self.path.absolute().parent

    def declared(self) -> SessionFile:
        """Name them: the texture is their name."""
        only = {"video": self.path.name, "texture": self.path.stem}
        declared = declared_by({"recordings": [only]}, self.path)
        declared._notes = ()
        return declared


def recordings_of(session: Session, extracted: Iterable[Responses]) -> dict[str, Recording]:
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
        if checksum and checksum != check_files(found[name], session.declared):
            expected = f"the files of '{name}' that the store was extracted from"
            raise InputError(
                f"{session.root}: expected {expected}, found others; give that session, or none"
            )
        rate_hz = json.loads(responses.attrs.get("declared", "{}")).get("fps_hz")
        if rate_hz and isinstance(video := found[name].video, ClipFile):
            seen = video_of(video.path, session.declared, rate_hz)
            found[name] = replace(found[name], video=seen)
    return found


def session_of(root: Path, declared: SessionFile) -> Session:
    """Return the recordings of a folder, as a session file says or in the published layout.

    Raises
    ------
    InputError
        If the folder is unreadable, holds no condition, or not what `require_grid` asks for.
    """
    with reading(root, "a readable folder", OSError):
        found = listed(root, declared) if declared.names_files else published(root, declared)
        if not found:
            raise _nothing(root, declared)
    recordings = tuple(sorted(found, key=_grid_order))
    require_grid(root, recordings, declared)
    reference = reference_in(root, declared, recordings[0])
    return Session(root, recordings, reference, declared, press_in(root, declared))


def _nothing(root: Path, declared: SessionFile) -> InputError:
    """Say what was found where no recording was, and what a session needs."""
    there = media_in(root)
    conditions = f"conditions <texture>/<speed>/ with {VIDEO} or {AUDIO}"
    if not there:
        return InputError(f"{root}: expected {conditions}, found none of them")
    return InputError(
        f"{root}: expected {conditions}, or a {SESSION_TOML} that says which files are "
        f"recordings, found {named(root, there)}; 'afferents init {root}' writes a first "
        f"{SESSION_TOML}"
    )


def _grid_order(recording: Recording) -> tuple[tuple[float, str], float, list[tuple[float, str]]]:
    speed = float("inf") if recording.speed_mm_s is None else recording.speed_mm_s
    parts = [natural_order(part) for part in recording.name.split("/")]
    return natural_order(recording.texture), speed, parts
