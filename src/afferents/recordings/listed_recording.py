"""One recording as a session file, or a row of a table, describes it."""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

Conditions = Mapping[str, str | float]
"""What else is known of a recording, by name: pressure, direction, trial."""

_LABEL = re.compile(r"[^./\\\x00-\x1f][^/\\\x00-\x1f]*")
_LONGEST = 100


class ListedRecording(BaseModel):
    """A recording: its files, what it is of, and what is peculiar to it.

    Attributes
    ----------
    video, audio
        Files, or a folder of numbered images, from the session's folder.
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
        images.
    steady_s
        Start and end of constant speed, s.
    rest_frame
        Index of the frame that shows the skin at rest.
    sensor
        Sensor file, from the session's folder, or the name of a packaged sensor.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    video: str | None = Field(None, min_length=1)
    audio: str | None = Field(None, min_length=1)
    texture: str
    speed_mm_s: float | None = Field(None, gt=0, allow_inf_nan=False)
    repetition: str | None = None
    id: str | None = None
    conditions: Conditions = Field(default_factory=dict)
    fps_hz: float | None = Field(None, gt=0, allow_inf_nan=False)
    steady_s: tuple[float, float] | None = None
    rest_frame: int | None = Field(None, ge=0)
    sensor: str | None = Field(None, min_length=1)

    @property
    def name(self) -> str:
        """Its id."""
        speed = None if self.speed_mm_s is None else f"{self.speed_mm_s:g}"
        parts = (self.texture, speed, self.repetition)
        return self.id or "/".join(part for part in parts if part is not None)

    @model_validator(mode="after")
    def _has_a_file(self) -> "ListedRecording":
        if self.video is None and self.audio is None:
            raise ValueError("a video, audio, or both")
        return self

    @field_validator("texture", "repetition", mode="before")
    @classmethod
    def _may_be_a_number(cls, label: Any) -> Any:
        return text_of(label)

    @field_validator("texture", "repetition")
    @classmethod
    def _is_a_label(cls, label: str | None) -> str | None:
        return label if label is None else require_label(label)

    @field_validator("id")
    @classmethod
    def _is_a_path_of_labels(cls, name: str | None) -> str | None:
        for part in name.split("/") if name is not None else ():
            require_label(part)
        return name

    @field_validator("conditions")
    @classmethod
    def _conditions_have_names(cls, given: Conditions) -> Conditions:
        for name in given:
            require_label(name)
        return given

    @field_validator("steady_s")
    @classmethod
    def _steady_is_an_interval(cls, steady: tuple[float, float] | None) -> object:
        return require_interval(steady)


def text_of(label: Any) -> Any:
    """Return a number as the text that names a folder."""
    return f"{label:g}" if type(label) in (int, float) else label


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


def require_interval(steady: tuple[float, float] | None) -> tuple[float, float] | None:
    """Return start and stop, s, if they are such.

    Raises
    ------
    ValueError
        If they are not.
    """
    if steady is not None and not 0 <= steady[0] < steady[1]:
        raise ValueError("steady_s is [start, stop] with 0 <= start < stop")
    return steady
