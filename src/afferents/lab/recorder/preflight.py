"""Before a plan: whether devices, light, sound, disk and drive are fit for it."""

import math
import threading
from pathlib import Path

import numpy as np
from scipy.stats import siegelslopes

from afferents import dims
from afferents.files import free_bytes
from afferents.lab.devices.base import (
    FULL_SCALE,
    Block,
    CameraSettings,
    DeviceError,
    Frame,
    MicrophoneSettings,
)
from afferents.lab.devices.picture import decode_picture
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.gate import Check, count_on
from afferents.lab.recorder.plan import Plan
from afferents.lab.recorder.run import WARM_UP
from afferents.lab.writers import SAMPLE_BYTES
from afferents.markers.detect import detect, spacing_px, without_shine
from afferents.markers.sensor import Sensor
from afferents.quality.image import (
    BLURRED_PX,
    OVEREXPOSED,
    describe_no_light,
    measure_image_quality,
)
from afferents.recordings.run_log import SURE
from afferents.store.recording import as_grey

LOOKED_S = 1.5
RATE = 0.02
"""How far a measured rate may lie from the one that was read back, as a share; of a camera no
slower than what a run may lose, or each run would be refused."""
MARGIN = 1.2
_REACHED_S = 2.0


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
    frames, blocks = _take(devices)
    checks = [check_rate(devices.camera.settings, frames, plan)]
    checks.append(_picture(devices, frames, sensor))
    if devices.microphone is not None:
        checks += check_sound(devices.microphone.settings, blocks, plan)
    checks.append(_disk(devices, frames, n_runs * plan.total_s, session))
    return checks + check_speeds(devices, plan)


def _take(devices: Devices) -> tuple[list[Frame], list[Block]]:
    """Take frames and sound for a while, side by side."""
    frames, blocks, faults = list[Frame](), list[Block](), list[Exception]()
    with devices.stream(frames.append, blocks.append, faults.append):
        devices.clock.wait(LOOKED_S, threading.Event())
    if faults:
        raise faults[0]
    return frames, blocks


def check_rate(settings: CameraSettings, frames: list[Frame], plan: Plan) -> Check:
    """Judge whether the camera gives the rate that it names: by it a run's frames are counted."""
    said = f"{settings.width} x {settings.height} {settings.format} at {settings.fps_hz:g} frames/s"
    frames = frames[WARM_UP:]
    if len(frames) < 3:
        return Check(
            "camera", False, f"{said}, but it gave {len(frames)} frames", "look at its plug"
        )
    number = count_on([frame.sequence for frame in frames])
    number -= number[0]
    if (np.diff(number) <= 0).any():
        return Check("camera", False, f"{said}, but its frames repeat numbers", "another camera")
    time_s = np.array([frame.time_s - frames[0].time_s for frame in frames])
    (step_s, _), covariance = np.polyfit(number, time_s, 1, cov=True)
    rate, error = 1 / step_s, covariance[0, 0] ** 0.5 / step_s
    lost = int(number[-1]) + 1 - len(frames)
    short = 1 - rate / settings.fps_hz
    most = min(RATE, plan.tolerance.lost + 1 / (plan.total_s * settings.fps_hz))
    passes = bool(-RATE <= short <= most + SURE * error and lost == 0)
    unknown = f"; not known: {'; '.join(settings.unknown)}" if settings.unknown else ""
    found = f"{said}, measured {rate:.2f}, {lost} lost{unknown}"
    do = (
        "more light, a shorter exposure, another USB port, what it gives as fps_hz, or a wider "
        "'lost'"
    )
    return Check("camera", passes, found, do)


def _picture(devices: Devices, frames: list[Frame], sensor: Sensor) -> Check:
    """Judge light, focus and markers of a picture of the skin at rest."""
    image = next(
        (as_grey(*p) for f in frames[5:] if (p := decode_picture(f.data, devices.camera.settings))),
        None,
    )
    if image is None:
        return Check("picture", False, "none that can be decoded", "look at the camera's format")
    if sensor.layout == dims.CELLS:
        said = f"mean grey level {image.mean():.0f}"
        return Check("picture", not describe_no_light(image), said, "see to the light")
    found = detect(image, sensor)
    usual = sensor.n_markers or len(found)
    if len(found) < max(4, 0.9 * usual):
        said = f"{len(found)} markers of {usual}, mean grey level {image.mean():.0f}"
        return Check("picture", False, said, "see to light, focus, and the sensor file")
    plain = without_shine(image, sensor.looks)
    quality = measure_image_quality(plain, found, spacing_px(found))
    said = (
        f"{len(found)} markers of {usual}, edges {quality.edge_px:.1f} px, "
        f"{quality.saturated:.0%} saturated"
    )
    passes = quality.edge_px <= BLURRED_PX and quality.saturated <= OVEREXPOSED
    do = "less light or gain" if quality.saturated > OVEREXPOSED else "turn the focus"
    return Check("picture", passes, said, do)


def check_sound(settings: MicrophoneSettings, blocks: list[Block], plan: Plan) -> list[Check]:
    """Judge whether a microphone gives the rate that it names, and its sensor's level."""
    if len(blocks) < 3:
        return [Check("microphone", False, "it gave no sound", "look at its plug")]
    counted = np.cumsum([0, *(len(block.samples) for block in blocks[:-1])])
    step_s, _ = siegelslopes([block.time_s for block in blocks], counted)  # some stamps may be off
    rate = 1 / step_s
    lost = sum(block.overflowed for block in blocks)
    drift = 1e6 * (rate / settings.rate_hz - 1)
    sensor = [block.samples[:, plan.channel].astype(np.int32) for block in blocks]
    peak = max(int(np.abs(samples).max()) for samples in sensor) / FULL_SCALE
    loud = peak < 1 - 1 / FULL_SCALE
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
        a_second += sound.rate_hz * sound.channels * SAMPLE_BYTES
    needed = MARGIN * a_second * seconds
    free = free_bytes(session)
    found = f"{needed / 1e9:.2f} GB needed with a margin, {free / 1e9:.1f} GB free"
    return Check("disk", free > needed, found, "make room, or record to another disk")


def check_speeds(devices: Devices, plan: Plan) -> list[Check]:
    """Turn the drum at every speed, each from rest, as in a run."""
    checks = []
    for speed_mm_s in sorted(plan.speeds_mm_s):
        try:
            check = _reaches(devices, speed_mm_s, plan)
            _wait_for_rest(devices, speed_mm_s, plan)
        except DeviceError as error:
            check = Check(f"speed {speed_mm_s:g} mm/s", False, str(error), "see to the drive")
        checks.append(check)
    return checks


def _wait_for_rest(devices: Devices, speed_mm_s: float, plan: Plan) -> None:
    """Wait until a drum that was stopped stands, but no longer than it may need to turn."""
    latest_s = devices.clock.now() + plan.settle_s + _REACHED_S
    still_mm_s = plan.tolerance.speed * speed_mm_s
    while devices.clock.now() < latest_s:
        state = devices.drive.read()
        state.raise_fault()
        is_motor = math.isfinite(devices.drive.limits.highest_mm_s)
        if not is_motor or abs(state.speed_mm_s or 0.0) <= still_mm_s:
            return
        devices.clock.wait(0.02, threading.Event())


def _reaches(devices: Devices, speed_mm_s: float, plan: Plan) -> Check:
    """Turn the drum at a speed until it is reached."""
    drive, clock = devices.drive, devices.clock
    name = f"speed {speed_mm_s:g} mm/s"
    begun_s, speeds = clock.now(), list[float]()
    try:
        drive.start(speed_mm_s)
        while clock.now() - begun_s < plan.settle_s + _REACHED_S:
            state = drive.read()
            state.raise_fault()
            if state.speed_mm_s is None and not speeds:
                return Check(name, True, "unknown: nothing reads the drum")
            if math.isinf(drive.limits.highest_mm_s):  # it is no motor
                return Check(name, True, f"not tried: it reads {state.speed_mm_s:.2f} mm/s now")
            speeds.append(math.nan if state.speed_mm_s is None else state.speed_mm_s)
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
