"""A dry run: the simulated rig's film and sound, and the devices that see and hear it."""

import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from afferents.devices.base import (
    Block,
    Camera,
    CameraSettings,
    DeviceError,
    Drive,
    DriveLimits,
    DriveState,
    Frame,
    Microphone,
    MicrophoneSettings,
    Options,
)
from afferents.devices.table import CAMERAS, DRIVES, MICROPHONES, device_of
from afferents.errors import InputError
from afferents.recorder.devices import SIMULATED, Clock, Devices
from afferents.recorder.plan import Entry, Plan
from afferents.rig.camera import Renderer, project
from afferents.rig.config import NUISANCES, Rig
from afferents.rig.drive import STEADY_S, STILL_S
from afferents.rig.drums import texture_name
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.record import filmed_positions
from afferents.rig.run import simulate_run, tap
from afferents.rig.surface import bumped_surface

_SPARE_S = 0.5
"""The film is longer than a run by this much."""
_QUALITY = 95
LONGEST_S = 120.0
"""Of a run: some 10 MB of JPEGs a second."""
TAPS_S = (0.1, 0.5, 0.95)
"""The fingertip is tapped so long after the skin was at rest, where the plan says so."""


class FaultOptions(Options):
    """Base of the options of simulated devices: when they have their faults.

    Attributes
    ----------
    run
        The faults come in this run alone, such as ``3/40``; None for in all.
    attempts
        In so many attempts at each run; then the device is whole.
    """

    kind: Literal["simulated"] = "simulated"
    run: str | None = None
    attempts: int = Field(1, ge=0)


Given = TypeVar("Given", bound=FaultOptions)


class Film(NamedTuple):
    """What camera and microphone take of one run.

    Attributes
    ----------
    time_s
        Of each frame, from the start of the run, s.
    jpegs
        The frames.
    position_px
        Where the pins truly are, (frame, marker, 2), px.
    sound
        Room and sensor at 44.1 kHz, (n_samples, 2).
    way_mm, speed_mm_s
        Of the drum at each frame; its way counts from a mark on the drum.
    """

    time_s: NDArray[np.float64]
    jpegs: list[bytes]
    position_px: NDArray[np.float64]
    sound: NDArray[np.int16]
    way_mm: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]


class Bench:
    """A simulated fingertip on a drum, with a clock of its own.

    Attributes
    ----------
    set_mm_s
        What the drive was asked for last; 0 when it was stopped.
    film
        Of the run whose drum is mounted; there once one is, which is before any device is read.

    Parameters
    ----------
    rig
        With the sensor's pins; its nuisances are on but for the offset of the clocks.
    plan
        Says how long runs are.
    speed
        How much faster than in truth everything goes.
    """

    film: Film

    def __init__(self, rig: Rig, plan: Plan, speed: float = 4.0) -> None:
        """Mount nothing yet."""
        on = {name: None for name in NUISANCES if name != "clock-offset"}
        self.rig, self._plan = rig.with_nuisances(on), plan
        if plan.settle_s < STEADY_S - STILL_S:
            raise InputError(
                f"settle_s: expected at least {STEADY_S - STILL_S:g}, as the simulated drum "
                f"needs, found {plan.settle_s:g}"
            )
        if plan.total_s > LONGEST_S:
            raise InputError(
                f"seconds: expected runs of at most {LONGEST_S:g} s in a dry run, whose film is "
                f"in memory, found {plan.total_s:g} s; rehearse shorter ones"
            )
        self.clock = Clock(speed)
        self._lock = threading.Lock()
        self._entry: Entry | None = None
        self._zero_s = -np.inf
        self._attempt = 0
        self.set_mm_s = 0.0

    def mount(self, entry: Entry, attempt: int) -> None:
        """Mount the drum of a run and make its film, which starts when a device asks for it.

        Parameters
        ----------
        attempt
            At this run, from 1; 0 for a trial, in which no device has faults.
        """
        if entry != self._entry:
            self.film = film_of(self.rig, entry, self._plan)
        self._entry, self._attempt, self._zero_s = entry, attempt, -np.inf

    def roll(self) -> tuple[float, Film]:
        """Return when the film has begun, s, and the film; the first to ask starts it."""
        with self._lock:
            if not np.isfinite(self._zero_s):
                self._zero_s = self.clock.now()
            return self._zero_s, self.film

    def faults(self, options: Given) -> Given:
        """Return a device's options, without faults where they are not for this attempt."""
        name = self._entry.name if self._entry else ""
        if options.run in (None, name) and 1 <= self._attempt <= options.attempts:
            return options
        return type(options)()

    def drum(self) -> tuple[float, float, float, float]:
        """Return the time, how long the film has rolled, s, and the drum's way and speed, mm."""
        now_s = self.clock.now()
        rolled_s, film = now_s - self._zero_s, self.film
        if self._attempt == 0 or rolled_s > film.time_s[-1]:
            return now_s, 0.0, 0.0, self.set_mm_s
        way = float(np.interp(rolled_s, film.time_s, film.way_mm))
        speed = float(np.interp(rolled_s, film.time_s, film.speed_mm_s))
        return now_s, rolled_s, way, speed if self.set_mm_s else 0.0


def film_of(rig: Rig, entry: Entry, plan: Plan) -> Film:
    """Simulate a run and draw its frames.

    The rig's drum sets off after half a second; where the plan rests longer, the skin is seen at
    rest for longer, and it is tapped where the plan says so.
    """
    tapped_s = max(0.0, plan.tap_s - STILL_S)
    n_rest = round(max(0.0, plan.start_s - tapped_s - STILL_S) * rig.camera.fps_hz)
    rests_s = n_rest / rig.camera.fps_hz
    surface = bumped_surface(float(_spacing(entry.texture)), rig.drum)
    seconds = plan.total_s - rests_s - tapped_s + _SPARE_S
    texture, speed, which = entry.texture, entry.speed_mm_s, (plan.seed, entry.seed)
    run = simulate_run(rig, texture, surface, speed, seconds, *which)
    time = [(np.arange(n_rest) + 0.5) / rig.camera.fps_hz]
    place = [np.repeat(run.position_mm[:1], n_rest, axis=0)]
    sound = [np.zeros((round(rests_s * SAMPLE_RATE_HZ), 2))]
    parts = [(rests_s + tapped_s, run)]
    if tapped_s:
        taps = tap(rig, texture, speed, tapped_s, TAPS_S, *which)
        parts.insert(0, (rests_s, taps))
    for begin_s, part in parts:
        time.append(begin_s + part.time_s)
        place.append(part.position_mm)
        sound.append(np.clip(np.stack([part.room, part.sensor], axis=1), -1, 1))
    position_mm = np.concatenate(place)
    filmed_px = filmed_positions(rig, position_mm, texture, speed, *which)
    renderer = Renderer(rig.camera, entry.seed)
    before = (len(position_mm) - len(run.time_s), 0)
    way = run.angle_rad * rig.drum.diameter_mm / 2  # as of an absolute encoder on the drum
    return Film(
        np.concatenate(time),
        [_jpeg(renderer.draw(positions)) for positions in filmed_px],
        project(position_mm, rig.camera),
        np.rint(np.concatenate(sound) * 32767).astype(np.int16),
        np.pad(way, before, "edge"),
        np.pad(run.speed_mm_s, before, "edge"),
    )


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return data.tobytes()


def _spacing(texture: str) -> str:
    """Return the bump spacing of a drum, mm; a texture that is a word has one of its own."""
    try:
        return texture_name(texture, {})
    except InputError:
        return f"{0.5 * (1 + sum(texture.encode()) % 12):g}"


# Devices for a dry run: their camera sees the simulated rig's film, their microphone hears it.
#
# Faults can be asked for in the plan, to see what becomes of them.

Numbers = tuple[Annotated[int, Field(ge=0)], ...]
_BLOCK = 441


class _OnBench:
    """What simulated devices have in common: a bench, and an end."""

    def __init__(self, options: Any, bench: Bench) -> None:
        """Stand on the bench."""
        self.options, self._bench = options, bench
        self._ended = threading.Event()


class SimulatedCameraOptions(FaultOptions):
    """A camera and its faults.

    Attributes
    ----------
    lost, damaged, repeated
        Numbers of frames, from 0 at the start of a run.
    unplugged_at
        Number of the frame instead of which the camera is gone; None for never.
    """

    lost: Numbers = ()
    damaged: Numbers = ()
    repeated: Numbers = ()
    unplugged_at: int | None = Field(None, ge=0)


class SimulatedCamera(_OnBench, Camera):
    """Gives the rig's film as JPEGs, each at its time."""

    Options = SimulatedCameraOptions

    def open(self) -> None:
        """Say how it is set."""
        camera = self._bench.rig.camera
        self.settings = CameraSettings(
            SIMULATED, "MJPG", camera.width, camera.height, camera.fps_hz
        )

    def frames(self) -> Iterator[Frame]:
        """Yield the film of the drum that is mounted."""
        self._ended.clear()
        zero_s, film = self._bench.roll()
        faults = self._bench.faults(self.options)
        shown = b""
        for number, time_s in enumerate(film.time_s):
            if self._bench.clock.wait(zero_s + time_s - self._bench.clock.now(), self._ended):
                return
            if number == faults.unplugged_at:
                raise DeviceError("camera simulated: it was unplugged")
            if number in faults.lost:
                continue
            shown = shown if number in faults.repeated else film.jpegs[number]
            damaged = number in faults.damaged
            data = shown[: len(shown) // 2] if damaged else shown
            yield Frame(number, zero_s + float(time_s), damaged, data)
        self._ended.wait()


class SimulatedMicrophoneOptions(FaultOptions):
    """A microphone and its faults.

    Attributes
    ----------
    gone_at_s, overflow_at_s
        When it vanishes or loses samples, s from the start of a run; None for never.
    silent
        Whether it gives nothing but zeros.
    offset_ms
        How far its clock is ahead of the camera's, always.
    """

    gone_at_s: float | None = None
    overflow_at_s: float | None = None
    silent: bool = False
    offset_ms: float = Field(0.0, ge=-100, le=100)


class SimulatedMicrophone(_OnBench, Microphone):
    """Gives the rig's sound."""

    Options = SimulatedMicrophoneOptions

    def open(self) -> None:
        """Say how it is set."""
        self.settings = MicrophoneSettings(SIMULATED, float(SAMPLE_RATE_HZ), 2)

    def blocks(self) -> Iterator[Block]:
        """Yield the sound of the drum that is mounted."""
        self._ended.clear()
        zero_s, film = self._bench.roll()
        faults = self._bench.faults(self.options)
        lost = -1 if faults.overflow_at_s is None else int(faults.overflow_at_s * 100)
        for number, first in enumerate(range(0, len(film.sound), _BLOCK)):
            time_s = first / SAMPLE_RATE_HZ
            ends_s = zero_s + time_s + _BLOCK / SAMPLE_RATE_HZ
            if self._bench.clock.wait(ends_s - self._bench.clock.now(), self._ended):
                return
            if faults.gone_at_s is not None and time_s >= faults.gone_at_s:
                raise DeviceError("microphone simulated: it was unplugged")
            if number == lost:
                continue
            samples = film.sound[first : first + _BLOCK]
            quiet = np.zeros_like(samples) if faults.silent else samples
            ahead_s = self.options.offset_ms / 1000
            yield Block(zero_s + time_s + ahead_s, quiet, number == lost + 1 > 0)
        self._ended.wait()


class SimulatedDriveOptions(FaultOptions):
    """A drive and its faults.

    Attributes
    ----------
    off
        By how much its speed differs from what is asked for, as a share.
    fault_at_s
        When it reports a fault, s from the start of a run; None for never.
    """

    off: float = 0.0
    fault_at_s: float | None = None


class SimulatedDrive(_OnBench, Drive):
    """Turns the rig's drum."""

    Options = SimulatedDriveOptions

    def open(self) -> None:
        """Say what it can do."""
        self.limits = DriveLimits(1.0, 500.0)

    def close(self) -> None:
        """Stop."""
        self.stop()

    def start(self, speed_mm_s: float) -> None:
        """Turn."""
        self._bench.set_mm_s = speed_mm_s

    def query(self) -> DriveState:
        """Return where the drum of the film is."""
        now_s, rolled_s, position, speed = self._bench.drum()
        faults = self._bench.faults(self.options)
        faulty = faults.fault_at_s is not None and rolled_s >= faults.fault_at_s
        return DriveState(
            now_s, position, speed * (1 + faults.off), "over current" if faulty else None
        )

    def stop(self) -> None:
        """Let the drum stand."""
        self._bench.set_mm_s = 0.0


def simulate_devices(plan: Plan, path: Path, bench: Bench) -> Devices:
    """Return devices of a dry run in place of those that a plan names.

    Tables of the kind ``simulated`` keep their options, with the faults that they ask for; the
    others are checked, and replaced.
    """

    def stand_in(kinds: Mapping[str, Any], name: str, simulated: type) -> Any:
        table, where = getattr(plan, name), f"{path}, [{name}]"
        if table is None:
            return None
        if table.get("kind") != SIMULATED:
            device_of(kinds, table, where)
            table = {"kind": SIMULATED}
        return device_of({SIMULATED: simulated}, table, where, bench)

    return Devices(
        stand_in(CAMERAS, "camera", SimulatedCamera),
        stand_in(MICROPHONES, "microphone", SimulatedMicrophone),
        stand_in(DRIVES, "drive", SimulatedDrive),
        bench.clock,
    )
