"""A dry run: the simulated rig's film and sound, and the devices that see and hear it."""

import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.lab.devices import base
from afferents.lab.devices.table import CAMERAS, DRIVES, MICROPHONES, make_device
from afferents.lab.recorder.devices import SIMULATED, Clock, Devices
from afferents.lab.recorder.plan import Entry, RecordingPlan
from afferents.rig import config, drive, drums
from afferents.rig.camera import Renderer
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.record import filmed_positions
from afferents.rig.run import simulate_run, tap
from afferents.rig.surface import bumped_surface

_SPARE_S = 0.5
"""The film is longer than a run by this much."""
_QUALITY = 95
_BLOCK = 441
LONGEST_S = 120.0
"""Longest run, s: some 10 MB of JPEGs a second are in memory."""
TAPS_S = (0.1, 0.5, 0.95)
"""The fingertip is tapped at these times, s, after the rest, where the plan wants taps."""


class Film(NamedTuple):
    """What camera and microphone take of one run.

    Attributes
    ----------
    time_s
        Of each frame, from the start of the run, s.
    jpegs
        The frames.
    sound
        Room and sensor at 44.1 kHz, (n_samples, 2).
    way_mm, speed_mm_s
        Of the drum at each frame; its way counts from a mark on the drum.
    """

    time_s: NDArray[np.float64]
    jpegs: list[bytes]
    sound: NDArray[np.int16]
    way_mm: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]


class Bench:
    """A simulated fingertip on a drum, with a clock of its own.

    Attributes
    ----------
    attempt
        At the run whose drum is mounted, from 1; 0 in a trial.
    set_mm_s
        What the drive was set to last; 0 when it was stopped.
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

    def __init__(self, rig: config.Rig, plan: RecordingPlan, speed: float = 4.0) -> None:
        """Mount nothing yet."""
        on = {name: None for name in config.NUISANCES if name != "clock-offset"}
        self.rig, self._plan = rig.with_nuisances(on), plan
        if plan.settle_s < (least_s := drive.STEADY_S - drive.STILL_S):
            raise InputError(
                f"settle_s: expected at least {least_s:g}, as the simulated drum needs, found "
                f"{plan.settle_s:g}"
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
        self.attempt = 0
        self.set_mm_s = 0.0

    def mount(self, entry: Entry, attempt: int) -> None:
        """Mount the drum of a run and make its film, which starts when a device asks for it.

        Parameters
        ----------
        attempt
            At this run, from 1; 0 for a trial.
        """
        if entry != self._entry:
            self.film = simulate_film(self.rig, entry, self._plan)
        self._entry, self.attempt, self._zero_s = entry, attempt, -np.inf

    def roll(self) -> float:
        """Return when the film has begun, s; the first to call starts it."""
        with self._lock:
            if not np.isfinite(self._zero_s):
                self._zero_s = self.clock.now()
            return self._zero_s

    def play(
        self, time_s: NDArray[np.float64], ended: threading.Event
    ) -> Iterator[tuple[int, float]]:
        """Yield a number at each of these times of the film, and when the film has begun, s."""
        ended.clear()
        zero_s = self.roll()
        for number, at_s in enumerate(time_s):
            if self.clock.wait(zero_s + at_s - self.clock.now(), ended):
                return
            yield number, zero_s
        ended.wait()

    def drum(self) -> tuple[float, float, float]:
        """Return the time, s, and the drum's way and speed, mm."""
        now_s = self.clock.now()
        rolled_s, film = now_s - self._zero_s, self.film
        if self.attempt == 0:
            return now_s, 0.0, self.set_mm_s
        if (over_s := rolled_s - film.time_s[-1]) > 0:  # it goes on turning where the film is over
            return now_s, film.way_mm[-1] + over_s * self.set_mm_s, self.set_mm_s
        way = float(np.interp(rolled_s, film.time_s, film.way_mm))
        speed = float(np.interp(rolled_s, film.time_s, film.speed_mm_s))
        return now_s, way, speed if self.set_mm_s else 0.0


def simulate_film(rig: config.Rig, entry: Entry, plan: RecordingPlan) -> Film:
    """Simulate a run and draw its frames.

    The rig's drum sets off after half a second; where the plan rests longer, the skin is seen at
    rest for longer, and it is tapped where the plan wants taps.
    """
    tapped_s = max(0.0, plan.tap_s - drive.STILL_S)
    n_rest = round(max(0.0, plan.start_s - tapped_s - drive.STILL_S) * rig.camera.fps_hz)
    rests_s = n_rest / rig.camera.fps_hz
    try:
        spacing = drums.texture_name(entry.texture, {})
    except InputError:  # a texture that is a word has a spacing of its own
        spacing = f"{0.5 * (1 + sum(entry.texture.encode()) % 12):g}"
    surface = bumped_surface(float(spacing), rig.drum)
    seconds = plan.total_s - rests_s - tapped_s + _SPARE_S
    texture, speed, which = entry.texture, entry.speed_mm_s, (plan.seed, entry.seed)
    run = simulate_run(rig, texture, surface, speed, seconds, *which)
    time = [(np.arange(n_rest) + 0.5) / rig.camera.fps_hz]
    place = [np.repeat(run.position_mm[:1], n_rest, axis=0)]
    sound = [np.zeros((round(rests_s * SAMPLE_RATE_HZ), 2))]
    taps = [(rests_s, tap(rig, texture, speed, tapped_s, TAPS_S, *which))] if tapped_s else []
    for begin_s, part in (*taps, (rests_s + tapped_s, run)):
        time.append(begin_s + part.time_s)
        place.append(part.position_mm)
        sound.append(np.clip(np.stack([part.room, part.sensor], axis=1), -1, 1))
    position_mm = np.concatenate(place)
    filmed_px = filmed_positions(rig, position_mm, texture, speed, *which)
    renderer, quality = Renderer(rig.camera, entry.seed), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    before = (len(position_mm) - len(run.time_s), 0)
    way_mm = run.angle_rad * rig.drum.diameter_mm / 2  # as of an absolute encoder on the drum
    return Film(
        np.concatenate(time),
        [cv2.imencode(".jpg", renderer.draw(at), quality)[1].tobytes() for at in filmed_px],
        np.rint(np.concatenate(sound) * 32767).astype(np.int16),
        np.pad(way_mm, before, "edge"),
        np.pad(run.speed_mm_s, before, "edge"),
    )


class _OnBench:
    """What simulated devices have in common: a bench, and an end."""

    def __init__(self, bench: Bench) -> None:
        """Stand on the bench."""
        self._bench = bench
        self._ended = threading.Event()


class SimulatedCamera(_OnBench, base.Camera):
    """Gives the rig's film as JPEGs, each at its time."""

    def open(self) -> None:
        """Take the rig's settings."""
        camera = self._bench.rig.camera
        mode = camera.width, camera.height, camera.fps_hz
        self.settings = base.CameraSettings(SIMULATED, "MJPG", *mode)

    def frames(self) -> Iterator[base.Frame]:
        """Yield the film of the drum that is mounted."""
        film = self._bench.film
        for number, zero_s in self._bench.play(film.time_s, self._ended):
            yield base.Frame(number, zero_s + float(film.time_s[number]), False, film.jpegs[number])


class SimulatedMicrophone(_OnBench, base.Microphone):
    """Gives the rig's sound."""

    def open(self) -> None:
        """Take the rig's settings."""
        self.settings = base.MicrophoneSettings(SIMULATED, float(SAMPLE_RATE_HZ), 2)

    def blocks(self) -> Iterator[base.Block]:
        """Yield the sound of the drum that is mounted."""
        sound = self._bench.film.sound
        first = np.arange(0, len(sound), _BLOCK)
        for number, zero_s in self._bench.play((first + _BLOCK) / SAMPLE_RATE_HZ, self._ended):
            n = int(first[number])
            yield base.Block(zero_s + n / SAMPLE_RATE_HZ, sound[n : n + _BLOCK], False)


class SimulatedDrive(_OnBench, base.Drive):
    """Turns the rig's drum."""

    def open(self) -> None:
        """Take its limits."""
        self.limits = base.DriveLimits(1.0, 500.0)

    def close(self) -> None:
        """Stop."""
        self.stop()

    def start(self, speed_mm_s: float) -> None:
        """Turn."""
        self._bench.set_mm_s = speed_mm_s

    def query(self) -> base.DriveState:
        """Return where the drum of the film is."""
        return base.DriveState(*self._bench.drum(), None)

    def stop(self) -> None:
        """Let the drum stand."""
        self._bench.set_mm_s = 0.0


def simulate_devices(plan: RecordingPlan, path: Path, bench: Bench) -> Devices:
    """Return devices of a dry run; those that a plan names are checked, and stay untouched."""

    def stand_in(kinds: Mapping[str, Any], name: str, simulated: type) -> Any:
        table = getattr(plan, name)
        if table is not None and table.get("kind") != SIMULATED:
            make_device(kinds, table, f"{path}, [{name}]")
        return None if table is None else simulated(bench)

    return Devices(
        stand_in(CAMERAS, "camera", SimulatedCamera),
        stand_in(MICROPHONES, "microphone", SimulatedMicrophone),
        stand_in(DRIVES, "drive", SimulatedDrive),
        bench.clock,
    )
