"""`PLAN.toml`: what to record, and with what."""

import hashlib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from afferents import documents, errors, files, forms
from afferents.store.drum_path import CONTACT_MM, MARK, Drum
from afferents.store.recording import require_distinct

EXAMPLE = Path(__file__).with_name("example.toml")
"""A plan to begin with, with comments."""
_WHAT = "a plan of a recording"
_TEXTURE = re.compile(r"[\w][\w .+-]*")
FASTEST_MM_S = 1000.0
LEAST_TAP_S = 2.0


def require_texture(name: str) -> str:
    """Return the name of a texture; raise `ValueError` unless a session's folder may have it."""
    if not _TEXTURE.fullmatch(name):
        raise ValueError("names that folders may have, such as '3' or 'linen'")
    return name


class Tolerance(forms.StrictForm):
    """What a run may have wrong with it and still be kept.

    Attributes
    ----------
    lost
        Frames lost or damaged, as a share of those that should be there.
    repeated
        Frames that equal the one before, as a share.
    speed
        How far the drum's speed may lie from the planned one while it is steady, as a share.
    clipped
        Samples of the sensor at full scale, as a share.
    silent
        A sensor whose sound never goes beyond this share of full scale counts as dead.
    markers
        Markers that may be missing at rest, as a share.
    """

    lost: float = Field(0.002, ge=0, le=1)
    repeated: float = Field(0.002, ge=0, le=1)
    speed: float = Field(0.05, gt=0, le=1)
    clipped: float = Field(0.001, ge=0, le=1)
    silent: float = Field(0.0005, ge=0, le=1)
    markers: float = Field(0.02, ge=0, le=1)


class RecordingPlan(forms.StrictForm):
    """What to record.

    Attributes
    ----------
    textures
        Names of the drums, which become folders.
    speeds_mm_s, repetitions
        Every texture is recorded at every speed, this number of times.
    sweep
        Whether the speed changes within each run, between the slowest and the fastest of these:
        every texture is then recorded `repetitions` times in all, without a speed.
    seconds
        Of constant speed in each run.
    rest_s
        How long the drum stands still first: the skin at rest.
    tap_s
        Between the two: how long a person taps the fingertip, which gives the offset of sound and
        picture; 0 for never.
    settle_s
        From the start of the drive until the speed is constant.
    seed
        Of the order of the runs; in a dry run, of mounting and drums too.
    redo
        How many times a run that the gate refuses is done again.
    drum_mm
        Diameter of the drums where their surface passes the fingertip; null where it need not be
        known, or the drive's own ``diameter_mm`` holds.
    drum_zero
        Where the drive's positions count from: ``start``, where the drum was when the drive was
        opened, or ``mark``, the same place of a drum whenever it was mounted.
    contact_mm
        Width of the contact patch along the slide.
    sensor
        Sensor file, or the name of a packaged sensor.
    sensor_channel
        The sensor's channel of the microphone, from 0; null for the last.
    direction
        Of the slide in the image.
    notes, conditions
        What else to remember; conditions go along with every recording.
    camera, microphone, drive
        Which devices, by ``kind``, and their options. Without ``[microphone]`` there is no sound;
        without ``[drive]`` something else turns the drum.
    """

    textures: tuple[Annotated[str, AfterValidator(require_texture)], ...] = Field(min_length=1)
    speeds_mm_s: tuple[Annotated[float, Field(gt=0, le=FASTEST_MM_S)], ...] = Field(min_length=1)
    repetitions: int = Field(1, ge=1, le=1000)
    sweep: bool = Field(False, exclude_if=lambda given: not given)  # plans agree as before
    seconds: float = Field(gt=0, le=6 * 3600)  # a wav of 44.1 kHz stereo holds no more
    rest_s: float = Field(0.5, ge=0.2, le=600)
    tap_s: float = Field(0.0, ge=0, le=60)
    settle_s: float = Field(1.0, ge=0, le=600)
    seed: int = Field(0, ge=0, lt=1 << 32)
    redo: int = Field(2, ge=0, le=20)
    drum_mm: float | None = Field(None, gt=0, le=1e5)
    drum_zero: Literal["start", "mark"] = "start"
    contact_mm: float = Field(CONTACT_MM, ge=0, le=1e4)
    sensor: str = Field("tip_b", min_length=1)
    sensor_channel: int | None = Field(None, ge=0)
    direction: str = Field("+x", pattern=r"^[+-][xy]$")
    notes: str = ""
    conditions: Mapping[str, str | float] = Field(default_factory=dict)
    camera: Mapping[str, Any]
    microphone: Mapping[str, Any] | None = None
    drive: Mapping[str, Any] = Field(default_factory=lambda: {"kind": "none"})
    tolerance: Tolerance = Tolerance()

    @model_validator(mode="after")
    def _require_consistent(self) -> Self:
        if self.tap_s and (self.tap_s < LEAST_TAP_S or self.microphone is None):
            raise ValueError(f"with tap_s, a [microphone] and at least {LEAST_TAP_S:g} s")
        if self.sweep and len(self.speeds_mm_s) != 2:
            raise ValueError("with sweep, two speeds_mm_s: the slowest and the fastest")
        return self

    @property
    def start_s(self) -> float:
        """When the drive starts, s."""
        return self.rest_s + self.tap_s

    @property
    def total_s(self) -> float:
        """Length of a run, s."""
        return self.start_s + self.settle_s + self.seconds

    @property
    def steady_s(self) -> tuple[float, float]:
        """Start and end of constant speed, s."""
        return self.start_s + self.settle_s, self.total_s

    @property
    def channel(self) -> int:
        """The sensor's channel of the microphone; -1 for the last."""
        return -1 if self.sensor_channel is None else self.sensor_channel

    def drum(self, opened: str, texture: str) -> Drum | None:
        """Return the drum of a texture, mounted on a drive.

        Parameters
        ----------
        opened
            Names the time since when the drive's positions count.

        Returns
        -------
        Drum
            None where its diameter is not known.
        """
        diameter_mm = self.drum_mm or self.drive.get("diameter_mm")
        if not isinstance(diameter_mm, int | float):
            return None
        zero = MARK if self.drum_zero == MARK else f"{opened} {texture}"
        circumference_mm = math.pi * diameter_mm
        return Drum(circumference_mm=circumference_mm, contact_mm=self.contact_mm, zero=zero)

    def entries(self) -> "list[Entry]":
        """Return the runs in the order in which they are made.

        Drums come in an order drawn from the seed, and so do the speeds and repetitions of each:
        a person changes a drum once, and no speed is always the first.
        """
        rng = np.random.default_rng(self.seed)
        found = []
        for drum in rng.permutation(len(self.textures)):
            speeds = (sum(self.speeds_mm_s) / 2,) if self.sweep else self.speeds_mm_s
            runs = [(s, r) for s in speeds for r in range(1, self.repetitions + 1)]
            for speed_mm_s, repetition in (runs[i] for i in rng.permutation(len(runs))):
                run = speed_mm_s, repetition, self.repetitions > 1, self.sweep
                found.append(Entry(self.textures[drum], *run))
        return found


@dataclass(frozen=True)
class Entry:
    """One run of the plan; of a sweep, the speed is the one between both."""

    texture: str
    speed_mm_s: float
    repetition: int
    is_repeated: bool
    is_sweep: bool = False

    @property
    def name(self) -> str:
        """Its folder in the session, and the recording's name."""
        if self.is_sweep:
            return f"{self.texture}/sweep/{self.repetition}"
        name = f"{self.texture}/{self.speed_mm_s:g}"
        return f"{name}/{self.repetition}" if self.is_repeated else name

    @property
    def seed(self) -> int:
        """A number of its own: which of the session's runs it is on the simulated rig."""
        return int.from_bytes(hashlib.sha256(self.name.encode()).digest()[:4], "big")


def read_plan(path: Path) -> RecordingPlan:
    """Read a plan and check it whole; devices are not touched.

    Raises
    ------
    InputError
        Naming the first key that is missing, unknown or wrong.
    """
    content = documents.read_toml(path, _WHAT, "'afferents record --example PLAN.toml' writes one")
    plan = documents.as_form(content, RecordingPlan, path, _WHAT)
    for values in (plan.textures, plan.speeds_mm_s):
        if len(set(values)) < len(values):
            raise errors.InputError(
                f"{path}: expected each texture and each speed once, found one of them twice"
            )
    require_distinct(path, plan.textures, [(f"{speed!r}", speed) for speed in plan.speeds_mm_s])
    return plan


def write_example(path: Path) -> None:
    """Write a plan to begin with.

    Raises
    ------
    InputError
        If there is something of that name already.
    """
    files.require_free(path)
    with files.write_aside(path) as partial:
        partial.write_bytes(EXAMPLE.read_bytes())
