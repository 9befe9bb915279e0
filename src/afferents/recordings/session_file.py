"""`session.json`: what a session folder declares of its recordings."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator

from afferents.core.documents import as_form, read_json

SESSION_FILE = "session.json"


class SessionFile(BaseModel):
    """What `session.json` declares; the defaults are the published recordings.

    Other fields (sensor, versions) may stand in the file and are not looked at.

    Attributes
    ----------
    sample_rate_hz, audio_channels
        Rate and channels of every `audio.wav`.
    sensor_channel
        The sensor's channel, from 0 (published: the second).
    fps_hz
        Nominal frame rate of every `video.mp4`, within 10 %; the true frame times are the
        container's.
    frame_width, frame_height
        Size of every `video.mp4`, px.
    steady_s
        Start and end of constant speed in each recording, s; null where unknown.
    holes
        ``[texture, speed]`` of each condition of the grid that was never recorded.
    direction
        Direction in which the texture slides in the image, ``+x``, ``-x``, ``+y`` or ``-y``.
    simulated
        Whether a simulation made the recordings.
    checksums
        SHA-256 (hex) of files, by recording and file: ``{"3/50": {"video.mp4": ...}}``.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    sample_rate_hz: float = Field(44100, gt=0)
    audio_channels: int = Field(2, ge=1)
    sensor_channel: int = Field(1, ge=0, validate_default=True)
    fps_hz: float = Field(90, gt=0)
    frame_width: int = Field(640, ge=1)
    frame_height: int = Field(480, ge=1)
    steady_s: tuple[float, float] | None = None
    holes: tuple[tuple[str, float], ...] = ()
    direction: str = Field("+x", pattern=r"^[+-][xy]$")
    simulated: bool = False
    checksums: Mapping[str, Mapping[str, str]] = Field(default_factory=dict)

    def of(self, name: str) -> "SessionFile":
        """Return what it says of one recording, light enough to be sent along with it."""
        sums = {name: self.checksums[name]} if name in self.checksums else {}
        return self.model_copy(update={"checksums": sums, "holes": ()})

    @field_validator("holes", mode="before")
    @classmethod
    def _textures_may_be_numbers(cls, holes: object) -> object:
        if not isinstance(holes, list | tuple):
            return holes
        return tuple(_named(hole) for hole in holes)

    @field_validator("sensor_channel")
    @classmethod
    def _sensor_is_on_a_channel(cls, channel: int, info: ValidationInfo) -> int:
        if channel >= info.data.get("audio_channels", channel + 1):
            raise ValueError("counted from 0, below audio_channels")
        return channel

    @field_validator("steady_s")
    @classmethod
    def _steady_is_an_interval(cls, steady: tuple[float, float] | None) -> object:
        if steady is not None and not 0 <= steady[0] < steady[1]:
            raise ValueError("steady_s is [start, stop] with 0 <= start < stop")
        return steady


def _named(hole: object) -> object:
    """Return ``[texture, speed]`` with the texture as a folder name."""
    if isinstance(hole, list | tuple) and len(hole) == 2:
        texture, speed = hole
        return (f"{texture:g}" if type(texture) in (int, float) else texture, speed)
    return hole


def session_file(root: Path) -> SessionFile:
    """Read `session.json`, or return the published defaults where there is none.

    Raises
    ------
    InputError
        If it is not JSON, or a field is not what it should be.
    """
    path = root / SESSION_FILE
    if not path.exists():
        return SessionFile()
    return as_form(read_json(path, "a session file"), SessionFile, path, "a session file")
