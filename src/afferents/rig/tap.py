"""Taps on the fingertip with something smooth, while no drum touches it."""

from collections.abc import Sequence

import numpy as np

from afferents.rig.config import Rig
from afferents.rig.drive import Turning
from afferents.rig.run import (
    CAMERA,
    TAPS,
    Simulated,
    draw,
    frame_times,
    listen,
    press,
    random_of,
    seen,
)
from afferents.rig.skin import PHYSICS_RATE_HZ
from afferents.rig.surface import bumped_surface

_OFF_MM = 3.0
DEPTH_MM = 0.5
WIDTH_S = 0.1
"""Of a tap, on average: how deep it goes, and how long it takes with the way there and back."""


def tap(
    rig: Rig, texture: str, speed_mm_s: float, seconds: float, at_s: Sequence[float], seed: int
) -> Simulated:
    """Tap the fingertip at some times, before a run of a drum.

    Parameters
    ----------
    texture, speed_mm_s, seed
        Of the run that follows: the mounting is drawn from them.
    seconds
        How long it lasts.
    at_s
        When each tap begins, s. Each has a depth and a width of its own.

    Returns
    -------
    Simulated
        As of a run; the drum stands still, and the clocks have no offset.
    """
    # Where the microphone is: the rim is pressed late, or not at all, by what meets the middle.
    towards = -rig.microphone.y_mm / rig.skin.tip_radius_mm
    sooner_mm = rig.microphone.y_mm**2 / (2 * rig.skin.tip_radius_mm)  # than the middle is met
    drawn = draw(rig, texture, speed_mm_s, seed)._replace(tilt_rad=(0.0, towards))
    rng = random_of(seed, texture, speed_mm_s, TAPS)
    time = (np.arange(round((seconds + 0.25) * PHYSICS_RATE_HZ)) + 1) / PHYSICS_RATE_HZ
    pressed = np.full(len(time), -_OFF_MM)
    for at in at_s:
        width, depth = rng.uniform(0.7, 1.4) * WIDTH_S, rng.uniform(0.7, 1.3) * DEPTH_MM
        share = np.sin(np.pi * np.clip((time - at) / width, 0, 1)) ** 2
        deepest = depth - sooner_mm - drawn.indentation_mm
        pressed = np.maximum(pressed, share * (_OFF_MM + deepest) - _OFF_MM)
    still = np.zeros(len(time))
    turning = Turning(time, still + drawn.start_rad, still, pressed)
    frames = frame_times(rig, seconds, random_of(seed, texture, speed_mm_s, CAMERA))
    skin = press(rig, drawn, bumped_surface(0.0, rig.drum), turning, frames)
    sensor, room = listen(rig, skin, turning, speed_mm_s, seconds, 0.0, rng)
    standing = np.zeros(len(frames))
    return Simulated(
        frames,
        seen(rig, skin),
        skin.pressure_mn,
        standing + drawn.start_rad,
        standing,
        sensor,
        room,
    )
