"""Before a plan: whether devices, clocks, light, sound, disk and drive are fit for it."""

import threading
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from afferents.devices.base import Block, Frame
from afferents.devices.picture import picture_of
from afferents.files import free_bytes
from afferents.markers.detect import detect, spacing_px
from afferents.markers.sensor import Sensor
from afferents.quality.image import BLURRED_PX, OVEREXPOSED, measure_image_quality
from afferents.recorder.devices import Devices
from afferents.recorder.gate import Check
from afferents.recorder.plan import Plan
from afferents.recorder.run import WARM_UP
from afferents.recordings.run_log import LIMIT_FRAMES, SURE, Drift
from afferents.store.recording import GreyImage, as_grey

_PARTS = 6
"""Of the time that was looked at; in each, what arrived with the least delay counts."""


def fit_drift(own_s: Sequence[float], arrived_s: Sequence[float]) -> Drift:
    """Return how a clock drifts, from its times and when this machine heard of them, s.

    What arrives late says nothing of the clock: of each sixth of the time only what arrived soonest
    is taken, and a straight line is laid through these.

    Examples
    --------
    >>> own = [0.01 * n for n in range(150)]
    >>> fit_drift(own, [1.001 * t + 0.005 for t in own]).said()
    '-999 ppm (error 0)'
    """
    late_s = np.array(arrived_s) - np.array(own_s)
    parts = np.array_split(np.arange(len(late_s)), _PARTS)
    soonest = [part[np.argmin(late_s[part])] for part in parts]
    at_s, ahead_s = np.array(arrived_s)[soonest], late_s.mean() - late_s[soonest]
    line, covariance = np.polyfit(at_s - at_s.mean(), ahead_s, 1, cov=True)
    return Drift(float(line[0]), float(covariance[0, 0] ** 0.5))


def check_clocks(camera: Drift, microphone: Drift | None, fps_hz: float, run_s: float) -> Check:
    """Judge whether sound and picture stay together for a run.

    The camera's is the clock of its frames' times, the microphone's that of its samples.
    """
    limit = LIMIT_FRAMES / fps_hz / run_s
    said = f"camera {camera.said()}"
    apart = camera
    if microphone is not None:
        apart = Drift(
            camera.share - microphone.share, float(np.hypot(camera.error, microphone.error))
        )
        said += f", microphone {microphone.said()} from this machine's, {apart.said()} apart"
    else:
        said += " from this machine's"
    passes = abs(apart.share) <= limit + SURE * apart.error
    found = f"{said}; half a frame in a run is {1e6 * limit:.0f} ppm"
    return Check("clocks", passes, found, "make runs shorter, or take another sound card or camera")


LOOKED_S = 1.5
RATE = 0.02
"""How far a measured rate may lie from the one that was read back, as a share."""
MARGIN = 1.2
_REACHED_S = 2.0
_ENOUGH = 24
"""Frames or blocks from which a drift can be told."""
_FULL = 32768
_BYTES = 2


def preflight(
    devices: Devices, plan: Plan, sensor: Sensor, session: Path, n_runs: int
) -> list[Check]:
    """Look at everything for a moment, and turn the drum at every speed.

    Parameters
    ----------
    session
        Where runs are written.
    n_runs
        How many are to be recorded: there must be room for them.

    Raises
    ------
    DeviceError
        If a device goes away.
    InputError
        If one refuses what it is asked for.
    """
    arrived = _take(devices)
    frames, blocks = [frame for _, frame in arrived[0]], [block for _, block in arrived[1]]
    checks = [_rate(devices, frames), _picture(devices, frames, sensor)]
    if devices.microphone is not None:
        checks += _sound(devices, blocks, plan)
    checks += _clocks(devices, *arrived, plan)
    checks.append(_disk(devices, frames, n_runs * plan.total_s, session))
    return [*checks, *(_reaches(devices, speed, plan) for speed in sorted(plan.speeds_mm_s))]


Frames = list[tuple[float, Frame]]
Blocks = list[tuple[float, Block]]
"""With when each arrived, s."""


def _take(devices: Devices) -> tuple[Frames, Blocks]:
    """Take frames and sound for a while, side by side."""
    frames: Frames = []
    blocks: Blocks = []
    faults, now = list[Exception](), devices.clock.now
    with devices.stream(
        lambda frame: frames.append((now(), frame)),
        lambda block: blocks.append((now(), block)),
        faults.append,
    ):
        devices.clock.wait(LOOKED_S, threading.Event())
    if faults:
        raise faults[0]
    return frames, blocks


def _clocks(devices: Devices, frames: Frames, blocks: Blocks, plan: Plan) -> list[Check]:
    """Compare the clocks of camera and microphone with this machine's, where both gave enough."""
    frames = frames[WARM_UP:]
    if len(frames) < _ENOUGH or (devices.microphone and len(blocks) < _ENOUGH):
        return []  # said already
    camera = fit_drift([frame.time_s for _, frame in frames], [at_s for at_s, _ in frames])
    heard = None
    if devices.microphone is not None:
        n = np.cumsum([len(block.samples) for _, block in blocks])
        own_s = n / devices.microphone.settings.rate_hz
        heard = fit_drift(own_s.tolist(), [at_s for at_s, _ in blocks])
    return [check_clocks(camera, heard, devices.camera.settings.fps_hz, plan.total_s)]


def _rate(devices: Devices, frames: list[Frame]) -> Check:
    settings = devices.camera.settings
    said = f"{settings.width} x {settings.height} {settings.format} at {settings.fps_hz:g} frames/s"
    frames = frames[WARM_UP:]
    if len(frames) < 3:
        return Check(
            "camera", False, f"{said}, but it gave {len(frames)} frames", "look at its plug"
        )
    numbers = frames[-1].sequence - frames[0].sequence
    rate = numbers / (frames[-1].time_s - frames[0].time_s)
    lost = numbers + 1 - len(frames)
    passes = abs(rate / settings.fps_hz - 1) <= RATE and lost == 0
    unknown = f"; not known: {'; '.join(settings.unknown)}" if settings.unknown else ""
    found = f"{said}, measured {rate:.2f}, {lost} lost{unknown}"
    return Check("camera", passes, found, "more light, a shorter exposure, or another USB port")


def _picture(devices: Devices, frames: list[Frame], sensor: Sensor) -> Check:
    image = next(
        (as_grey(*p) for f in frames[5:] if (p := picture_of(f.data, devices.camera.settings))),
        None,
    )
    if image is None:
        return Check("picture", False, "none that can be decoded", "look at the camera's format")
    return check_picture(image, sensor)


def check_picture(image: GreyImage, sensor: Sensor) -> Check:
    """Judge light, focus and markers of a picture of the skin at rest."""
    found = detect(image, sensor)
    usual = sensor.n_markers or len(found)
    if len(found) < max(4, 0.9 * usual):
        said = f"{len(found)} markers of {usual}, mean grey level {image.mean():.0f}"
        return Check("picture", False, said, "see to light, focus, and the sensor file")
    quality = measure_image_quality(image, found, spacing_px(found))
    said = (
        f"{len(found)} markers of {usual}, edges {quality.edge_px:.1f} px, "
        f"{quality.saturated:.0%} saturated"
    )
    passes = quality.edge_px <= BLURRED_PX and quality.saturated <= OVEREXPOSED
    do = "less light or gain" if quality.saturated > OVEREXPOSED else "turn the focus"
    return Check("picture", passes, said, do)


def _sound(devices: Devices, blocks: list[Block], plan: Plan) -> list[Check]:
    assert devices.microphone is not None
    settings = devices.microphone.settings
    if len(blocks) < 3:
        return [Check("microphone", False, "it gave no sound", "look at its plug")]
    n = sum(len(block.samples) for block in blocks[:-1])
    rate = n / (blocks[-1].time_s - blocks[0].time_s)
    lost = sum(block.overflowed for block in blocks)
    drift = 1e6 * (rate / settings.rate_hz - 1)
    sensor = [block.samples[:, plan.channel].astype(np.int32) for block in blocks]
    peak = max(int(np.abs(samples).max()) for samples in sensor) / _FULL
    loud = peak < 1 - 1 / _FULL
    return [
        Check(
            "microphone",
            lost == 0 and abs(rate / settings.rate_hz - 1) <= RATE,
            f"{settings.rate_hz:g} Hz x {settings.channels}, its clock {drift:+.0f} ppm from this "
            f"machine's, {lost} overflows",
            "close other programs, or name another in [microphone]",
        ),
        Check(
            "level of the sound",
            loud and peak > plan.tolerance.silent,
            f"peak {peak:.2%} of full scale",
            "look at plug and channel" if loud else "turn the gain down",
        ),
    ]


def _disk(devices: Devices, frames: list[Frame], seconds: float, session: Path) -> Check:
    sound = devices.sound
    a_second = devices.camera.settings.fps_hz * (
        sum(len(frame.data) for frame in frames) / max(1, len(frames))
    )
    if sound is not None:
        a_second += sound.rate_hz * sound.channels * _BYTES
    needed = MARGIN * a_second * seconds
    free = free_bytes(session)
    found = f"{needed / 1e9:.2f} GB needed with a margin, {free / 1e9:.1f} GB free"
    return Check("disk", free > needed, found, "make room, or record to another disk")


def _reaches(devices: Devices, speed_mm_s: float, plan: Plan) -> Check:
    """Turn the drum at a speed until it is reached."""
    drive, clock = devices.drive, devices.clock
    name = f"speed {speed_mm_s:g} mm/s"
    begun_s, speeds = clock.now(), []
    try:
        drive.start(speed_mm_s)
        while clock.now() - begun_s < plan.settle_s + _REACHED_S:
            state = drive.read()
            if state.fault is not None:
                return Check(name, False, f"the drive reports {state.fault}", "see to the drive")
            if not np.isfinite(state.speed_mm_s):
                return Check(name, True, "unknown: nothing reads the drum")
            speeds.append(state.speed_mm_s)
            reached = abs(np.mean(speeds[-5:]) / speed_mm_s - 1) <= plan.tolerance.speed
            if len(speeds) >= 5 and reached:
                seconds = clock.now() - begun_s
                late = seconds > plan.settle_s
                said = f"reached after {seconds:.2f} s"
                return Check(name, not late, said, "a longer settle_s")
            clock.wait(0.02, threading.Event())
    finally:
        drive.stop()
    said = f"{np.mean(speeds[-5:]):.2f} mm/s at last"
    return Check(name, False, said, "see to the drive, or leave the speed out")
