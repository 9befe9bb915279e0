"""The drive: how the drum turns and how deep it is pressed in, step by step.

A run begins with the drum still, for the rest frames; the drum is brought on (where it is not
from the start), runs up, and turns on at constant speed. Where it is on from the start, the drum
has slid before: what friction still holds of that is in the rest frames. In a sweep speed and depth
go up and down from then on.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

Values = NDArray[np.float64]

STILL_S = 0.5
"""The drum stands still for 45 frames; at least 30 are needed for the rest position."""
PRESSED_S = 0.8
"""By then the drum is pressed on."""
RUNNING_S = 1.1
"""By then the drum has its speed."""
STEADY_S = 1.5
"""From then on the recording counts as steady."""
MOTOR_TURNS = 14.4
"""Turns of the motor for one of the drum (paper, section 2.2)."""
BEFORE_S = 0.8
"""How long before a run the drum is followed where it touches from the start."""
_BEFORE_MM_S = 20.0
_STOPPED_S, _BACK_S = 0.5, 0.6
"""Of `BEFORE_S`: by then the drum has stopped, and has gone back as far as it goes."""
_OFF_MM = 3.0
"""The drum's distance from the skin before it is brought on."""
SWEEP_S, PLATEAU_S, DEEPER_S = 6.0, 1.0, 3.7
"""A sweep's speed goes up and down in this time, and stays this long at either end; its depth in a
time which is no fraction of the speed's, so that depths meet all speeds."""
DEEPER, CHANGE = 0.2, 0.2
"""How much deeper or less deep than usual a slide is at most on average, and how far its depth then
goes up and down, as shares of the usual depth."""
FASTEST_MM_S = 500.0
_RIPPLE_HZ = 3.0
_DRIFT_S = 20.0


class RigDrive(BaseModel):
    """How unevenly the drum turns; all strengths chosen, 0 is off.

    Attributes
    ----------
    eccentricity_mm
        Standard deviation of a drum's eccentricity (each of two axes), mm: its run-out, which a
        mounted drum keeps. Chosen to fit how the published SA-I rises and falls within a turn of
        the drum.
    ripple
        Ripple of the speed's closed loop at about 3 Hz, standard deviation over the speed.
    motor_ripple
        Ripple once a turn of the motor, amplitude over the speed.
    drift_mm
        Slow drift of the indentation over some 20 s, standard deviation, mm.
    back_mm, back_spread
        How far the drum goes back when it stops, mm: as the motor lets go, the skin that it has
        dragged along pulls it back. And how unlike that is from run to run: any way from
        1 - spread to 1 + spread times it is as likely.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    eccentricity_mm: float = Field(0.15, ge=0)
    ripple: float = Field(0.01, ge=0)
    motor_ripple: float = Field(0.005, ge=0)
    drift_mm: float = Field(0.02, ge=0)
    back_mm: float = Field(0.1, ge=0)
    back_spread: float = Field(1.0, ge=0, le=1)


class Slide(NamedTuple):
    """A slide of a sweep: the drum's speed goes up and down, as an arm's may, and the tip's depth.

    Attributes
    ----------
    low_mm_s, high_mm_s
        The slowest and the fastest speed.
    is_sine
        Whether the speed is a sinusoid; else its acceleration is constant, with plateaus.
    speed_phase, depth_phase
        Where in their periods speed and depth are when the video begins, 0 to 1.
    deeper_mm, change_mm
        How much deeper than usual the tip is pressed on average, and amplitude of its change.
    """

    low_mm_s: float
    high_mm_s: float
    is_sine: bool
    speed_phase: float
    depth_phase: float
    deeper_mm: float
    change_mm: float

    def speed_at(self, time_s: Values) -> Values:
        """Return the speed at some times, mm/s."""
        at, stays = (time_s / SWEEP_S + self.speed_phase) % 1, PLATEAU_S / SWEEP_S
        share = np.interp(at, (0, stays, 0.5, 0.5 + stays, 1), (0, 0, 1, 1, 0))
        if self.is_sine:
            share = (1 - np.cos(2 * math.pi * at)) / 2
        return self.low_mm_s + share * (self.high_mm_s - self.low_mm_s)

    def deeper_at(self, time_s: Values) -> Values:
        """Return how much deeper than usual the tip is pressed at some times, mm."""
        change = np.sin(2 * math.pi * (time_s / DEEPER_S + self.depth_phase))
        return self.deeper_mm + self.change_mm * change * _ramp(time_s, PRESSED_S, RUNNING_S)


def draw_slides(n: int, usual_mm: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw the last four of `Slide`, (n, 4): spread over their ranges, and in any order."""
    speed, depth = (rng.permuted(np.arange(n) + rng.random(n)) / n for _ in range(2))
    deeper = usual_mm * DEEPER * (2 * depth - 1)
    return np.column_stack([speed, rng.random(n), deeper, np.full(n, usual_mm * CHANGE)])


class Turning(NamedTuple):
    """The drum's way through a run, a value a step, shape (n_steps,).

    Attributes
    ----------
    time_s
        End of each step, s from the first frame's exposure on; below 0 what was before.
    angle_rad
        Of the drum, from its starting angle.
    speed_mm_s
        At the drum's base.
    pressed_mm
        How much deeper than the indentation at the surface's highest point the tip is pressed:
        drift and eccentricity; far below 0 where the drum is off.
    """

    time_s: Values
    angle_rad: Values
    speed_mm_s: Values
    pressed_mm: Values

    @property
    def before(self) -> int:
        """How many steps lie before the run."""
        return int(np.searchsorted(self.time_s, 0, "right"))


def turn(
    speed_mm_s: float,
    seconds: float,
    drive: RigDrive,
    drum_radius_mm: float,
    start_rad: float,
    run_out_mm: tuple[float, float],
    contact_at_rest: bool,
    rate_hz: float,
    rng: np.random.Generator,
    slide: Slide | None = None,
) -> Turning:
    """Turn the drum through a whole run.

    Parameters
    ----------
    speed_mm_s
        At which it turns; of a sweep its mean.
    run_out_mm
        Of the drum: how much nearer its surface is at an angle of 0 and of a quarter turn, mm.
    slide
        Speeds and depths of a sweep.
    """
    before = round(BEFORE_S * rate_hz) if contact_at_rest else 0
    time = (np.arange(round(seconds * rate_hz)) + 1) / rate_hz
    motor_phase = rng.uniform(0, 2 * math.pi)
    ripple = drive.ripple * _slow_noise(len(time), rate_hz, 1 / (2 * math.pi * _RIPPLE_HZ), rng)
    drift = drive.drift_mm * _slow_noise(len(time), rate_hz, _DRIFT_S, rng)
    ramp = _ramp(time, PRESSED_S, RUNNING_S)
    if slide is not None:
        ramp = ramp * slide.speed_at(time) / speed_mm_s
    nominal = speed_mm_s / drum_radius_mm * np.cumsum(ramp) / rate_hz
    motor = drive.motor_ripple * np.sin(MOTOR_TURNS * nominal + motor_phase)
    speed = speed_mm_s * ramp * (1 + ripple + motor)
    back_mm = drive.back_mm * (1 + drive.back_spread * rng.uniform(-1, 1))
    # Before the run the drum slides, stops, and goes back a little.
    early = (np.arange(before) + 1) / rate_hz
    slides = 1 - _ramp(early, _STOPPED_S - 0.1, _STOPPED_S)
    going = np.gradient(_ramp(early, _STOPPED_S, _BACK_S)) * rate_hz if before else early
    earlier = _BEFORE_MM_S * slides - back_mm * going
    speed = np.concatenate([earlier, speed])
    way = np.cumsum(speed) / rate_hz
    angle = start_rad + (way - earlier.sum() / rate_hz) / drum_radius_mm
    time = np.concatenate([(np.arange(before) - before + 1) / rate_hz, time])
    drift = np.concatenate([np.full(before, drift[0]), drift])
    pressed = run_out_mm[0] * np.cos(angle) + run_out_mm[1] * np.sin(angle) + drift
    if slide is not None:
        pressed = pressed + slide.deeper_at(time)
    if not contact_at_rest:
        pressed = pressed - _OFF_MM * (1 - _ramp(time, STILL_S, PRESSED_S))
    return Turning(time, angle, speed, pressed)


def _ramp(time: Values, start_s: float, stop_s: float) -> Values:
    """Rise smoothly from 0 to 1 between two times."""
    share = np.clip((time - start_s) / (stop_s - start_s), 0, 1)
    return np.asarray(share**2 * (3 - 2 * share))


def _slow_noise(n: int, rate_hz: float, tau_s: float, rng: np.random.Generator) -> Values:
    """Draw noise of variance 1 that forgets itself within about `tau_s`.

    An Ornstein-Uhlenbeck process drawn at twenty points a tau, straight lines between.
    """
    points = max(2, math.ceil(n / rate_hz / tau_s * 20) + 2)
    keep = math.exp(-1 / 20)
    drawn = rng.normal(0, 1, points)
    for i in range(1, points):
        drawn[i] = keep * drawn[i - 1] + math.sqrt(1 - keep**2) * drawn[i]
    at = np.arange(n) / (rate_hz * tau_s / 20)
    return np.asarray(np.interp(at, np.arange(points), drawn))
