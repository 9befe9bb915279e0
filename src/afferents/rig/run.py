"""One run of the rig: a drum at a speed, with what differs from run to run drawn from the seed.

Before a run the fingertip may be tapped with something smooth, while no drum touches it (`tap`).
"""

import math
import zlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from afferents.errors import InputError
from afferents.rig import drive, microphone
from afferents.rig.config import DEEPEST_MM, Mounting, Rig
from afferents.rig.skin import PHYSICS_RATE_HZ, Motion, Skin, SkinOnDrum, SkinResponse
from afferents.rig.surface import Surface, bumped_surface, soft_maximum

STABLE = 1.5
"""The fastest oscillation times the step must stay below this; symplectic Euler bears 2."""

SPARE_S = 0.25
"""How much longer than requested a run lasts, so that the clock of the sound may begin later, s."""
POSE_HZ, FORCE_HZ = 125.0, 500.0
"""How often an arm that makes a sweep logs its pose, and its sensor forces."""
_BLOCK = round(PHYSICS_RATE_HZ)
_NEVER = np.empty(0)
_OFF_MM = 3.0
DEPTH_MM = 0.5
WIDTH_S = 0.1
"""Of a tap, on average: how deep it goes, and how long it takes with the way there and back."""


class Drawn(NamedTuple):
    """What was drawn for one run, some of it once a drum or once a session.

    Attributes
    ----------
    indentation_mm
        How deep the middle of the skin is pressed in after its first touch, mm.
    tilt_rad
        Of the drum against the skin, along x and y.
    lateral_mm
        How far the drum stands off along its axis.
    friction
        Factor on the friction of the skin.
    run_out_mm
        How much nearer the drum's surface is at an angle of 0 and of a quarter turn, mm.
    start_rad
        Angle of the drum at the start.
    clock_offset_s
        The audio's clock is this much ahead of the video's: what the camera sees at t, the
        microphone hears at t + clock_offset_s.
    """

    indentation_mm: float
    tilt_rad: tuple[float, float]
    lateral_mm: float
    friction: float
    run_out_mm: tuple[float, float]
    start_rad: float
    clock_offset_s: float


class Simulated(NamedTuple):
    """What came out of a run.

    Attributes
    ----------
    time_s
        When the frames were taken, (n_frames,), s.
    position_mm
        Where the camera's optics sees the pins, in the plane of the skin, (n_frames, n_nodes, 2).
    pressure_mn
        (n_frames, n_nodes), mN.
    angle_rad, speed_mm_s
        Of the drum when the frames were taken, (n_frames,).
    sensor, room
        The microphone's channels at 44.1 kHz, full scale 1, (n_samples,).
    arm
        Of a sweep what an arm logs, without noise: rows of a time (s on the video's clock), x, y, z
        (m) and a rotation vector (rad), x along the slide, z up, 0 at first touch, the rest 0;
        and rows of a time, force (N) and torque (N m) on the fingertip, see `SkinResponse`.
    """

    time_s: NDArray[np.float64]
    position_mm: NDArray[np.float64]
    pressure_mn: NDArray[np.float32]
    angle_rad: NDArray[np.float64]
    speed_mm_s: NDArray[np.float64]
    sensor: NDArray[np.float64]
    room: NDArray[np.float64]
    arm: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None


def make_generator(
    seed: int,
    texture: str | None,
    speed_mm_s: float | None,
    use: int,
    others: Sequence[int] = (),
) -> np.random.Generator:
    """Return a generator that depends on nothing but the seed, its use, and its level.

    Parameters
    ----------
    texture, speed_mm_s
        Of a run. None for both is for the session, None for the speed for all runs of a drum.
    others
        What makes it another run or drum, see `distinguish_run`.
    """
    words = [seed, use]
    if texture is not None:
        words.append(zlib.crc32(texture.encode()))
    if speed_mm_s is not None:
        words.append(round(1000 * speed_mm_s))
    return np.random.default_rng([*words, *others])


def distinguish_run(rig: Rig, seed: int, again: int = 0) -> list[int]:
    """Return what makes a run of a drum at a speed another one: depth, print, and which time.

    Nothing for the usual depth, the print of the seed's number, and the first time.
    """
    words = []
    if rig.mounting.indentation_mm != Mounting().indentation_mm:
        words.append(round(1000 * rig.mounting.indentation_mm))
    words += _distinguish_print(rig, seed)
    if again:
        words += [_AGAIN, again]
    return words


def _distinguish_print(rig: Rig, seed: int) -> list[int]:
    return [_PRINT, rig.drum.prints] if rig.drum.prints != seed else []


_MOUNTING, _MATERIAL, _RUN_OUT, _RUN, _DRIVE, _SOUND, CAMERA, MARKERS, TAPS, SWEEP = range(10)
_PRINT, _AGAIN = 1, 2


def draw(rig: Rig, texture: str, speed_mm_s: float, seed: int, again: int = 0) -> Drawn:
    """Draw what differs between runs: each quantity at its level.

    Once a session: the fingertip's mounting (tilt, place, depth; or as `Mounting.remount` says) and
    the friction of its material. Once a drum: run-out. For each run: the angle at which the drum
    starts, since it stopped anywhere after the run before; friction's change; the clocks' offset.
    What is drawn for each run is drawn anew at another depth, on another print and the next time
    (`again`), and run-out on another print.

    Raises
    ------
    InputError
        If the fingertip would not touch.
    """
    mount = rig.mounting
    others, printed = distinguish_run(rig, seed, again), _distinguish_print(rig, seed)
    mounted: Sequence[int] = ()
    level: tuple[str | None, float | None] = (None, None)
    if mount.remount == "drum":  # mounted once for all turns
        level, mounted = (texture, None), distinguish_run(rig, seed)
    elif mount.remount == "run":
        level, mounted = (texture, speed_mm_s), others
    of_mounting = make_generator(seed, *level, _MOUNTING, mounted)
    of_material = make_generator(seed, None, None, _MATERIAL)
    of_drum = make_generator(seed, texture, None, _RUN_OUT, printed)
    of_run = make_generator(seed, texture, speed_mm_s, _RUN, others)
    tilt = of_mounting.normal(0, mount.tilt_rad, 2)
    run_out = of_drum.normal(0, rig.drive.eccentricity_mm, 2)
    depth_mm = mount.indentation_mm + float(of_mounting.normal(0, mount.indentation_sd_mm))
    if depth_mm <= 0:
        raise InputError(
            f"--indentation: expected a fingertip that touches, found {depth_mm:.2f} mm, drawn "
            f"about {mount.indentation_mm:g} for {texture}/{speed_mm_s:g}; press deeper, or "
            "lessen the nuisance 'indentation'"
        )
    return Drawn(
        indentation_mm=depth_mm,
        tilt_rad=(float(tilt[0]), float(tilt[1])),
        lateral_mm=float(np.clip(of_mounting.normal(0, mount.lateral_mm), -3, 3)),
        friction=math.exp(
            of_material.normal(0, mount.friction_sd) + of_run.normal(0, mount.friction_change_sd)
        ),
        run_out_mm=(float(run_out[0]), float(run_out[1])),
        start_rad=float(of_run.uniform(0, 2 * math.pi)) * mount.any_angle,
        clock_offset_s=float(np.clip(of_run.normal(0, mount.clock_sd_s), -SPARE_S, SPARE_S)),
    )


def simulate_run(
    rig: Rig,
    texture: str,
    surface: Surface,
    speed_mm_s: float,
    seconds: float,
    seed: int,
    again: int = 0,
    slide: drive.Slide | None = None,
) -> Simulated:
    """Run a drum at a speed, or through a sweep whose mean that is.

    Parameters
    ----------
    surface
        The drum's; what nodules feel of it is worked out here.
    seconds
        Length of the video; the audio is as long.
    again
        Which time the same drum turns at the same speed under the same mounting.
    slide
        Speeds and depths of a sweep.

    Raises
    ------
    InputError
        If the constants make the steps unstable, or the run comes out as no numbers.
    """
    drawn = draw(rig, texture, speed_mm_s, seed, again)
    others = distinguish_run(rig, seed, again)
    per_step = rig.skin.stiffest_per_s(DEEPEST_MM) / PHYSICS_RATE_HZ
    if per_step > STABLE:
        raise InputError(
            f"the rig's constants: expected a skin whose fastest swing moves less than {STABLE:g} "
            f"rad in a step of the physics, found {per_step:.2f}; make it softer or heavier"
        )
    turning = drive.turn(
        speed_mm_s,
        seconds + SPARE_S,
        rig.drive,
        rig.drum.diameter_mm / 2,
        drawn.start_rad,
        drawn.run_out_mm,
        rig.mounting.contact_at_rest,
        PHYSICS_RATE_HZ,
        make_generator(seed, texture, speed_mm_s, _DRIVE, others),
        slide,
    )
    of_camera = make_generator(seed, texture, speed_mm_s, CAMERA, others)
    time = frame_times(rig, seconds, of_camera)
    rng = make_generator(seed, texture, speed_mm_s, _SOUND, others)
    return _take_up(rig, drawn, surface, turning, time, seconds, rng, slide)


def _take_up(
    rig: Rig,
    drawn: Drawn,
    surface: Surface,
    turning: drive.Turning,
    frames_s: NDArray[np.float64],
    seconds: float,
    rng: np.random.Generator,
    slide: drive.Slide | None = None,
) -> Simulated:
    """Return what camera and microphone take of a drum that turns so, and what an arm logs."""
    force_s = _NEVER if slide is None else np.arange(0, seconds, 1 / FORCE_HZ)
    skin = press(rig, drawn, surface, turning, frames_s, force_s)
    if not np.isfinite(skin.displacement_mm).all():
        raise InputError(
            "the rig's constants: expected a skin that stays in one piece, found infinite "
            "displacements; soften it, or press less deep"
        )
    sensor, room = listen(rig, skin, turning, seconds, drawn.clock_offset_s, rng)
    at = np.clip(np.searchsorted(turning.time_s, frames_s), 0, len(turning.time_s) - 1)
    angle, speed = turning.angle_rad[at], turning.speed_mm_s[at]
    arm = None
    if slide is not None:
        pose = np.zeros((math.ceil(seconds * POSE_HZ), 7))
        pose[:, 0] = time_s = np.arange(len(pose)) / POSE_HZ
        way_rad = np.interp(time_s, turning.time_s, turning.angle_rad) - drawn.start_rad
        pose[:, 1] = way_rad * rig.drum.diameter_mm / 2000
        pose[:, 3] = -(drawn.indentation_mm + slide.deeper_at(time_s)) / 1000
        arm = pose, np.column_stack([force_s, skin.wrench])
    return Simulated(frames_s, seen(rig, skin), skin.pressure_mn, angle, speed, sensor, room, arm)


def frame_times(rig: Rig, seconds: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return when the frames are taken, s: the camera's clock with its jitter."""
    n = math.floor(seconds * rig.camera.fps_hz)
    jitter = np.clip(rng.normal(0, rig.mounting.jitter_s, n), -0.003, 0.003)
    return np.asarray(np.maximum((np.arange(n) + 0.5) / rig.camera.fps_hz + jitter, 0))


def press(
    rig: Rig,
    drawn: Drawn,
    surface: Surface,
    turning: drive.Turning,
    frames_s: NDArray[np.float64],
    force_s: NDArray[np.float64] = _NEVER,
) -> SkinResponse:
    """Let the skin feel the whole run, a second at a time; its wrench is taken at `force_s`."""
    width_mm = rig.skin.footprint_mm if rig.skin.nodular else rig.skin.flat_mm  # that a node feels
    nodules = soft_maximum(surface, width_mm, rig.skin.bridging_per_mm)
    factor = drawn.friction * nodules.friction_factor
    skin = rig.skin.model_copy(update={"friction": rig.skin.friction * factor})
    lattice = SkinOnDrum(
        skin, nodules, drawn.tilt_rad, drawn.lateral_mm, rig.microphone.weights(skin.rest_mm())
    )
    top_radius = surface.length_mm / (2 * math.pi)
    slide = turning.angle_rad * top_radius
    speed = turning.speed_mm_s * top_radius / (rig.drum.diameter_mm / 2)
    depth = drawn.indentation_mm - nodules.top_mm + turning.pressed_mm
    both_s = np.concatenate([frames_s, force_s])
    order = np.argsort(both_s, kind="stable")
    steps, is_frame = both_s[order] * PHYSICS_RATE_HZ + turning.before, order < len(frames_s)
    parts = []
    for start in range(0, len(slide), _BLOCK):
        block = slice(start, start + _BLOCK)
        taken = (steps >= start) & (steps < start + len(slide[block]))
        part = lattice.run(Motion(slide[block], speed[block], depth[block]), steps[taken] - start)
        frame = is_frame[taken]
        of_frames = part.displacement_mm[frame], part.inward_mm[frame], part.pressure_mn[frame]
        parts.append(SkinResponse(*of_frames, part.wrench[~frame], *part[4:]))
    whole = SkinResponse(*(np.concatenate(part) for part in zip(*parts, strict=True)))
    return whole._replace(
        pressure_rate=whole.pressure_rate[turning.before :],
        shear_rate=whole.shear_rate[turning.before :],
    )


def seen(rig: Rig, skin: SkinResponse) -> NDArray[np.float64]:
    """Return where the camera sees the pins, in the plane of the skin at rest, mm.

    What the camera sees is the pins' inner ends, deep in the gel, where the drum's finer features
    are lost (`_spread`). A pin that is pushed in comes nearer to the camera and so moves outwards
    in the picture: position = (rest + displacement) * distance / (distance - inward). No two pins
    tip alike (`Skin.gains`).
    """
    rest, spread = rig.skin.rest_mm(), _spread(rig.skin)
    n_frames, n_nodes = skin.inward_mm.shape
    inward = (skin.inward_mm @ spread.T).astype(np.float64)
    moved = np.stack([skin.displacement_mm[..., i] @ spread.T for i in (0, 1)], axis=-1)
    nearer = rig.mounting.camera_mm / (rig.mounting.camera_mm - inward)
    way = (rest + moved) * nearer[..., None] - rest
    return np.asarray(rest + way * rig.skin.gains()[:, None]).reshape(n_frames, n_nodes, 2)


def _spread(skin: Skin) -> NDArray[np.float32]:
    """Return how much of each node's movement reaches each pin's inner end, (n_pins, n_nodes).

    What moves at the surface of a half-space reaches the depth h spread over
    h^3 / (r^2 + h^2)^(5/2) (Johnson, Contact Mechanics, 1985, equation 3.19): waves shorter than
    some 2 h are lost.
    """
    pins = skin.rest_mm()
    weight = (1 + cdist(pins, pins, "sqeuclidean") / skin.pin_depth_mm**2) ** -2.5
    weight *= 1 if skin.mesh is None else skin.mesh.share
    return np.asarray(weight / weight.sum(axis=1, keepdims=True), np.float32)


def listen(
    rig: Rig,
    skin: SkinResponse,
    turning: drive.Turning,
    seconds: float,
    offset_s: float,
    rng: np.random.Generator,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the sensor's and the room's channel, full scale 1, on the audio's clock."""
    sensor = microphone.heard(skin.pressure_rate, skin.shear_rate, PHYSICS_RATE_HZ, rig.microphone)
    n = round(seconds * microphone.SAMPLE_RATE_HZ)
    time = np.arange(len(sensor)) / microphone.SAMPLE_RATE_HZ
    angle = np.interp(time, turning.time_s, turning.angle_rad)
    motor_turns = angle * (drive.MOTOR_TURNS / (2 * math.pi))
    moving = np.interp(time, turning.time_s, turning.speed_mm_s)
    sensor = sensor + microphone.disturbances(motor_turns, moving / 100, rig.microphone, rng)
    room = rng.normal(0, rig.microphone.room_noise, n)
    first = round(-offset_s * microphone.SAMPLE_RATE_HZ)
    quiet = np.zeros(max(0, -first))
    return np.concatenate([quiet, sensor])[max(0, first) :][:n], room


def tap(
    rig: Rig,
    texture: str,
    speed_mm_s: float,
    seconds: float,
    at_s: Sequence[float],
    seed: int,
    again: int = 0,
) -> Simulated:
    """Tap the fingertip at some times, before a run of a drum.

    Parameters
    ----------
    texture, speed_mm_s, seed, again
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
    drawn = draw(rig, texture, speed_mm_s, seed, again)
    drawn = drawn._replace(tilt_rad=(0.0, towards), clock_offset_s=0.0)
    others = distinguish_run(rig, seed, again)
    rng = make_generator(seed, texture, speed_mm_s, TAPS, others)
    time = (np.arange(round((seconds + SPARE_S) * PHYSICS_RATE_HZ)) + 1) / PHYSICS_RATE_HZ
    pressed = np.full(len(time), -_OFF_MM)
    for at in at_s:
        width, depth = rng.uniform(0.7, 1.4) * WIDTH_S, rng.uniform(0.7, 1.3) * DEPTH_MM
        share = np.sin(np.pi * np.clip((time - at) / width, 0, 1)) ** 2
        deepest = depth - sooner_mm - drawn.indentation_mm
        pressed = np.maximum(pressed, share * (_OFF_MM + deepest) - _OFF_MM)
    still = np.zeros(len(time))
    turning = drive.Turning(time, still + drawn.start_rad, still, pressed)
    frames = frame_times(rig, seconds, make_generator(seed, texture, speed_mm_s, CAMERA, others))
    smooth = bumped_surface(0.0, rig.drum)
    return _take_up(rig, drawn, smooth, turning, frames, seconds, rng)
