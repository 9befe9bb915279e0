"""What `session.toml`, which people write, and `session.json`, which programs write, say.

Both are one form. They say what a session folder holds: how it was recorded, and, where it is not
in the published layout, which files are which recordings.
"""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import pydantic
from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo

from afferents import choices, documents, forms
from afferents.errors import InputError
from afferents.store.recording import fold_label
from afferents.store.responses import VARIABLES, Steady

_LABEL = re.compile(r"[^./\\\x00-\x1f][^/\\\x00-\x1f]*")
_LONGEST = 100


def _as_text(label: Any) -> Any:
    """Return a number as the text that names a folder, and text as names are compared."""
    if isinstance(label, str):
        return fold_label(label)
    return f"{label:.15g}" if type(label) in (int, float) else label


def require_label(label: str) -> str:
    """Return what may name a group of a store.

    Raises
    ------
    ValueError
        If it is empty, too long, begins with a dot, or holds a slash or a control character.
    """
    if not _LABEL.fullmatch(label) or len(label) > _LONGEST or label != label.strip():
        raise ValueError("a label without '/' that does not begin with '.' or a space")
    return label


def _require_labels(name: str) -> str:
    for part in name.split("/"):
        require_label(part)
    return name


def _require_conditions(conditions: Mapping[str, str | float]) -> Mapping[str, str | float]:
    for name, value in conditions.items():
        require_label(name)
        if name == "speed":
            raise ValueError("conditions other than the speed, which is speed_mm_s")
        if isinstance(value, float) and not math.isfinite(value):
            raise ValueError(f"conditions that are text or finite numbers ({name})")
    return conditions


def _require_new_name(name: str) -> str:
    if not name.isidentifier() or name in VARIABLES:
        raise ValueError("a name of letters that no response has")
    return name


Label = Annotated[str, BeforeValidator(_as_text), AfterValidator(require_label)]
Conditions = Annotated[Mapping[str, str | float], AfterValidator(_require_conditions)]
"""What else is known of a recording, by name: pressure, direction, trial."""
Text = Annotated[str, Field(min_length=1)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Index = Annotated[int, Field(ge=0)]


class Logged(forms.StrictForm):
    """Numbers that something else wrote along with a recording, which the store keeps.

    Attributes
    ----------
    name
        Of the variable in the store, such as ``force``.
    file
        CSV, from the session's folder.
    time
        Its column of times, s, by the clock of the images' CSV, or of one that a press sets.
    columns
        Those that are kept.
    units
        Of the numbers, such as ``N``.
    """

    name: Annotated[str, AfterValidator(_require_new_name)]
    file: Text
    time: Text
    columns: Annotated[tuple[Text, ...], Field(min_length=1)]
    units: Text


class ListedRecording(forms.StrictForm):
    """A recording: its files, what it is of, and what is peculiar to it.

    Attributes
    ----------
    video, audio
        Files, or a folder or zip of numbered images, from the session's folder.
    times
        CSV that says when the images were taken, where none lies in or next to them.
    texture
        Any label.
    speed_mm_s
        Sliding speed, mm/s, where it is known.
    repetition
        Which of several of the same texture and speed.
    id
        Its name and its group in the store, where that should not be
        ``<texture>/<speed>/<repetition>`` of what is given.
    conditions
        Whatever else is known: ``{pressure = 3}``.
    fps_hz
        True frame rate, where the container's is wrong: times then count from it. Needed for
        images without a CSV.
    steady_s
        Start and end of constant speed, s.
    rest_frame
        Index of the frame that shows the skin at rest.
    sensor
        Sensor file, from the session's folder, or the name of a packaged sensor.
    beside
        What else was logged meanwhile.
    """

    video: Text | None = None
    audio: Text | None = None
    times: Text | None = None
    texture: Label
    speed_mm_s: Positive | None = None
    repetition: Label | None = None
    id: Annotated[str, BeforeValidator(_as_text), AfterValidator(_require_labels)] | None = None
    conditions: Conditions = Field(default_factory=dict)
    fps_hz: Positive | None = None
    steady_s: Steady | None = None
    rest_frame: Index | None = None
    sensor: Text | None = None
    beside: tuple[Logged, ...] = ()

    @property
    def name(self) -> str:
        """Its id."""
        speed = None if self.speed_mm_s is None else f"{self.speed_mm_s:.15g}"
        parts = (self.texture, speed, self.repetition)
        return self.id or "/".join(part for part in parts if part is not None)

    @property
    def file(self) -> str:
        """Its video, else its sound."""
        return self.video or self.audio or ""

    @pydantic.model_validator(mode="after")
    def _has_a_file(self) -> "ListedRecording":
        if self.video is None and self.audio is None:
            raise ValueError("a video, audio, or both")
        return self


SESSION_FILES = SESSION_FILE, SESSION_TOML = "session.json", "session.toml"

_UNKNOWN = ("sample_rate_hz", "audio_channels", "sensor_channel", "fps_hz", "frame_width",
            "frame_height")  # fmt: skip
"""What is not checked where the files are named one by one and nothing is declared of them."""
_WHAT = "a session file"
_LAYOUT = ("pattern", "recordings")
FPS = "--fps"
"""The option that says the true frame rate."""


class SessionFile(pydantic.BaseModel):
    """What a session file declares; the defaults are the published recordings.

    Where it names files, by `pattern` or `recordings`, rates, sizes and channels have no default:
    the files' own are taken, and must agree with one another.

    Attributes
    ----------
    pattern
        Where the files are, as ``{texture}/{speed}_{trial}.avi``: a name in braces stands for a
        part of a path, ``*`` for anything. Names other than texture and speed are conditions. A
        pattern that ends in ``/`` is of folders of numbered images.
    audio_pattern
        The same for the sound that belongs to each.
    recordings
        The recordings one by one, instead.
    sample_rate_hz, audio_channels
        Rate and channels of every sound file.
    sensor_channel
        The sensor's channel, from 0 (published: the second; of mono sound the first; where files
        are named: the last).
    fps_hz
        Nominal frame rate of every video, within 10 %; the true frame times are the container's.
        Of images without a CSV of times, their rate.
    fps_overrules
        Whether the containers' frame rate is wrong: times then count from `fps_hz`.
    frame_width, frame_height
        Size of every video, px.
    steady_s
        Start and end of constant speed in each recording, s; null where unknown.
    rest_frame
        Index of the frame that shows the skin at rest; null for the one of the sensor file.
    sensor
        Sensor file, from the session's folder, or the name of a packaged sensor.
    conditions
        Of all recordings.
    reference
        Clip or single image of the skin at rest, from the session's folder.
    rest
        ``reference`` where displacement counts from that, since recordings begin when the skin is
        touched already.
    press
        Another recording, of a press that shows in the images and in what is logged alongside: it
        sets the clocks of that, in all recordings.
    holes
        ``[texture, speed]`` of each condition of the grid that was never recorded.
    direction
        Direction in which the texture slides in the image, ``+x``, ``-x``, ``+y`` or ``-y``;
        unknown, if not given, where the files are named one by one.
    simulated
        Whether a simulation made the recordings.
    checksums
        SHA-256 (hex) of files, by recording and file: ``{"3/50": {"video.mp4": ...}}``.
    """

    model_config = pydantic.ConfigDict(frozen=True, extra="ignore")

    sample_rate_hz: float | None = Field(44100, gt=0)
    audio_channels: int | None = Field(2, ge=1)
    sensor_channel: int | None = Field(1, ge=0, validate_default=True)
    fps_hz: float | None = Field(90, gt=0)
    frame_width: int | None = Field(640, ge=1)
    frame_height: int | None = Field(480, ge=1)
    steady_s: Steady | None = None
    holes: tuple[tuple[Annotated[str, BeforeValidator(_as_text)], float], ...] = ()
    direction: str = Field("+x", pattern=r"^[+-][xy]$")
    simulated: bool = False
    checksums: Mapping[str, Mapping[str, str]] = Field(default_factory=dict)
    # Left out of what is written down where they are not given: stores agree as before.
    pattern: str | None = Field(None, min_length=1, exclude_if=lambda given: not given)
    audio_pattern: str | None = Field(None, min_length=1, exclude_if=lambda given: not given)
    recordings: tuple[ListedRecording, ...] = Field((), exclude_if=lambda given: not given)
    fps_overrules: bool = Field(False, exclude_if=lambda given: not given)
    rest_frame: int | None = Field(None, ge=0, exclude_if=lambda given: given is None)
    sensor: str | None = Field(None, min_length=1, exclude_if=lambda given: given is None)
    conditions: Conditions = Field(default_factory=dict, exclude_if=lambda given: not given)
    reference: str | None = Field(None, min_length=1, exclude_if=lambda given: given is None)
    rest: choices.Rest | None = Field(None, exclude_if=lambda given: given is None)
    press: ListedRecording | None = Field(None, exclude_if=lambda given: given is None)

    _file: str = pydantic.PrivateAttr(default=SESSION_TOML)
    _notes: tuple[str, ...] | None = pydantic.PrivateAttr(default=None)

    @property
    def file(self) -> str:
        """The name of the file that says so, or should."""
        return self._file

    @property
    def notes(self) -> tuple[str, ...] | None:
        """What a reader says of files that it leaves out; None to look for them."""
        return self._notes

    @property
    def channel(self) -> int:
        """The sensor's channel in all sound files; -1, the last, where nothing says so."""
        return -1 if self.sensor_channel is None else self.sensor_channel

    @property
    def names_files(self) -> bool:
        """Whether it says which files are recordings; else they are in the published layout."""
        return self.pattern is not None or bool(self.recordings)

    def of(self, name: str) -> "SessionFile":
        """Return what it says of one recording, light enough to be sent along with it."""
        sums = {name: self.checksums[name]} if name in self.checksums else {}
        return self.model_copy(update={"checksums": sums, "holes": (), "recordings": ()})

    def at_rate(self, fps_hz: float | None) -> "SessionFile":
        """Return it with the true frame rate, Hz, of all videos, whatever their containers say.

        Raises
        ------
        InputError
            If it is no rate, or recordings name theirs.
        """
        if fps_hz is None:
            return self
        true_hz = parse_rate(fps_hz)
        for recording in self.recordings:
            if recording.fps_hz is not None:
                found = f"{recording.fps_hz:g} for {recording.name} in {self.file}"
                expected = "a session whose recordings name no fps_hz"
                raise InputError(f"{FPS}: expected {expected}, found {found}; leave it out")
        return self.model_copy(update={"fps_hz": true_hz, "fps_overrules": True})

    @pydantic.model_validator(mode="after")
    def _has_one_layout(self) -> "SessionFile":
        if self.pattern is not None and self.recordings:
            raise ValueError("a pattern or a list of recordings, not both")
        if self.audio_pattern is not None and self.pattern is None:
            raise ValueError("audio_pattern goes with a pattern of the videos")
        if self.fps_overrules and self.fps_hz is None:
            raise ValueError("fps_overrules needs fps_hz, the true frame rate")
        return self

    @pydantic.field_validator("sensor_channel")
    @classmethod
    def _sensor_is_on_a_channel(cls, channel: int | None, info: ValidationInfo) -> int | None:
        channels = info.data.get("audio_channels")
        if channel is not None and channels is not None and channel >= channels:
            raise ValueError("counted from 0, below audio_channels")
        return channel


class StrictFile(SessionFile, extra="forbid"):
    """The same, where an unknown key is a slip of the pen."""


def parse_rate(fps_hz: float) -> float:
    """Return a frame rate, Hz, as it is given to a command.

    Raises
    ------
    InputError
        If it is none.
    """
    if not 0 < fps_hz < float("inf"):
        raise InputError(f"{FPS}: expected frames a second, above 0, found {fps_hz:g}")
    return float(fps_hz)


def read_session_file(root: Path) -> SessionFile:
    """Read `session.toml` or `session.json`; return the published defaults where there is none.

    In `session.toml` unknown keys are refused; `session.json` may hold what other programs note.

    Raises
    ------
    InputError
        If both are there, or the file is damaged, or a field is not what it should be.
    """
    toml, json = root / SESSION_TOML, root / SESSION_FILE
    if toml.exists() and json.exists():
        found = f"{SESSION_TOML} and {SESSION_FILE}"
        raise InputError(
            f"{root}: expected one session file, found {found}; put what counts into one of them"
        )
    if toml.exists():
        return parse_declaration(documents.read_toml(toml, _WHAT), toml, StrictFile)
    if not json.exists():
        return SessionFile()
    content = documents.read_json(json, _WHAT)
    if not isinstance(content.get("sensor"), str):  # what some programs note of theirs
        content.pop("sensor", None)
    declared = parse_declaration(content, json)
    declared._file = SESSION_FILE
    return declared


def parse_declaration(
    content: Mapping[str, Any], where: object, form: type[SessionFile] = SessionFile
) -> SessionFile:
    """Return what a session file says.

    Raises
    ------
    InputError
        Naming the first key that is not what it should be.
    """
    if any(content.get(key) for key in _LAYOUT):
        content = {**dict.fromkeys(_UNKNOWN), **content}
    if content.get("audio_channels") == 1:  # the second, as is published, is not there
        content = {"sensor_channel": 0, **content}
    return documents.as_form(content, form, where, _WHAT)
