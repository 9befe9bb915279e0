"""The bench of a dry run: a drum of the simulated rig, and the film and sound of one run of it."""

import threading
from typing import NamedTuple, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from afferents.core.errors import InputError
from afferents.devices import Options
from afferents.pipeline.record.clock import Clock
from afferents.pipeline.record.plan import Entry, Plan
from afferents.rig import NUISANCES, Rig, Simulated, bumped_surface, project, simulate, tap
from afferents.rig.drive import STEADY_S, STILL_S
from afferents.rig.drums import texture_name
from afferents.rig.microphone import SAMPLE_RATE_HZ
from afferents.rig.render import Renderer

_SPARE_S = 0.5
"""The film is longer than a run by this much."""
_QUALITY = 95
LONGEST_S = 120.0
"""Of a run: some 10 MB of JPEGs a second."""
TAPS_S = (0.1, 0.5, 0.95)
"""The fingertip is tapped so long after the skin was at rest, where the plan says so."""


class Faulty(Options):
    """When a simulated device has its faults.

    Attributes
    ----------
    run
        The faults come in this run alone, such as ``3/40``; None for in all.
    attempts
        In so many attempts at each run; then the device is whole.
    """

    run: str | None = None
    attempts: int = Field(1, ge=0)


Given = TypeVar("Given", bound=Faulty)


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
        Of the run whose drum is mounted.

    Parameters
    ----------
    rig
        With the sensor's pins; its nuisances are on but for the offset of the clocks.
    plan
        Says how long runs are.
    speed
        How much faster than in truth everything goes.
    """

    def __init__(self, rig: Rig, plan: Plan, speed: float = 4.0) -> None:
        """Mount nothing yet."""
        on = {name: None for name in NUISANCES if name != "clock-offset"}
        self.rig, self._plan = rig.with_nuisances(on), plan
        if plan.settle_s < STEADY_S - STILL_S:
            raise InputError(
                "settle_s", f"at least {STEADY_S - STILL_S:g}, as the simulated drum needs",
                f"{plan.settle_s:g}",
            )  # fmt: skip
        if plan.total_s > LONGEST_S:
            raise InputError(
                "seconds", f"runs of at most {LONGEST_S:g} s in a dry run, whose film is in memory",
                f"{plan.total_s:g} s", "rehearse shorter ones",
            )  # fmt: skip
        self.clock = Clock(speed)
        self._lock = threading.Lock()
        self._entry: Entry | None = None
        self.film: Film | None = None
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
        """Return when the film has begun on the clock, s, and the film; the first to ask starts it.

        Raises
        ------
        InputError
            If no drum is mounted.
        """
        with self._lock:
            if self.film is None:
                raise InputError("the bench", "a drum that is mounted", "none")
            if not np.isfinite(self._zero_s):
                self._zero_s = self.clock.now()
            return self._zero_s, self.film

    def faults(self, options: Given) -> Given:
        """Return a device's options, without faults where they are not for this attempt."""
        name = self._entry.name if self._entry else ""
        if options.run in (None, name) and 1 <= self._attempt <= options.attempts:
            return options
        return type(options)()

    def turn(self, speed_mm_s: float) -> None:
        """Take what the drive is asked for."""
        self.set_mm_s = speed_mm_s

    def drum(self) -> tuple[float, float, float, float]:
        """Return the time, how long the film has rolled, s, and the drum's way and speed, mm."""
        now_s = self.clock.now()
        rolled_s, film = now_s - self._zero_s, self.film
        if (
            film is None
            or self._attempt == 0
            or not np.isfinite(rolled_s)
            or rolled_s > film.time_s[-1]
        ):
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
    run = simulate(rig, entry.texture, surface, entry.speed_mm_s, seconds, entry.seed)
    still = (np.arange(n_rest) + 0.5) / rig.camera.fps_hz
    silence = np.zeros((round(rests_s * SAMPLE_RATE_HZ), 2))
    time, place, sound = [still], [np.repeat(run.position_mm[:1], n_rest, axis=0)], [silence]
    if tapped_s:
        taps = tap(rig, entry.texture, entry.speed_mm_s, tapped_s, TAPS_S, entry.seed)
        time.append(rests_s + taps.time_s)
        place.append(taps.position_mm)
        sound.append(_stereo(taps))
    n_before = sum(map(len, time))
    position = project(np.concatenate([*place, run.position_mm]), rig.camera)
    renderer = Renderer(rig.camera, entry.seed)
    way = run.angle_rad * rig.drum.diameter_mm / 2  # as of an absolute encoder on the drum
    return Film(
        np.concatenate([*time, rests_s + tapped_s + run.time_s]),
        [_jpeg(renderer.draw(positions)) for positions in position],
        position,
        np.rint(np.concatenate([*sound, _stereo(run)]) * 32767).astype(np.int16),
        _led_by(n_before, way),
        _led_by(n_before, run.speed_mm_s),
    )


def _stereo(run: Simulated) -> NDArray[np.float64]:
    return np.stack([np.clip(run.room, -1, 1), np.clip(run.sensor, -1, 1)], axis=1)


def _led_by(n: int, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Put the first value n times before the others."""
    return np.concatenate([np.repeat(values[:1], n, axis=0), values])


def _jpeg(image: NDArray[np.uint8]) -> bytes:
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return data.tobytes()


def _spacing(texture: str) -> str:
    """Return the bump spacing of a drum, mm; a texture that is a word has one of its own."""
    try:
        return texture_name(texture, {})
    except InputError:
        return f"{0.5 * (1 + sum(texture.encode()) % 12):g}"
