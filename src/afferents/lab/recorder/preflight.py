"""Before a plan: whether devices, light, sound, disk and drive are fit for it."""

import math
from pathlib import Path

import numpy as np
from scipy.stats import siegelslopes

from afferents import dims, files
from afferents.lab.devices import base
from afferents.lab.devices.picture import decode_picture
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.gate import Check, unwrap_numbers
from afferents.lab.recorder.plan import RecordingPlan
from afferents.lab.recorder.run import WARM_UP
from afferents.lab.writers import SAMPLE_BYTES
from afferents.markers.detect import detect, spacing_px, without_shine
from afferents.markers.sensor import Sensor
from afferents.quality import image as quality
from afferents.recordings.sound_clock import SURE
from afferents.store.recording import make_grey

LOOKED_S = 1.5
RATE = 0.02
"""How far a measured rate may lie from the one that was read back, as a share; of a camera no
slower than what a run may lose, or each run would be refused."""
MARGIN = 1.2
_REACHED_S = 2.0


def preflight(
    devices: Devices, plan: RecordingPlan, sensor: Sensor, session: Path, n_runs: int
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
        If one refuses what the plan holds.
    """
    camera = devices.camera.settings
    frames, blocks, faults = list[base.Frame](), list[base.Block](), list[Exception]()
    with devices.stream(frames.append, blocks.append, faults.append):
        devices.clock.wait(LOOKED_S)
    if faults:
        raise faults[0]
    checks = [check_rate(camera, frames, plan), check_picture(camera, frames, sensor)]
    a_second = camera.fps_hz * sum(len(frame.data) for frame in frames) / max(1, len(frames))
    if (sound := devices.sound) is not None:
        checks += check_microphone(sound, blocks, plan)
        a_second += sound.rate_hz * sound.channels * SAMPLE_BYTES
    needed, free = MARGIN * a_second * n_runs * plan.total_s, files.free_bytes(session)
    found = f"{needed / 1e9:.2f} GB needed with a margin, {free / 1e9:.1f} GB free"
    disk = Check("disk", free > needed, found, "make room, or record to another disk")
    return [*checks, disk, *check_speeds(devices, plan)]


def check_rate(
    settings: base.CameraSettings, frames: list[base.Frame], plan: RecordingPlan
) -> Check:
    """Judge whether the camera gives the rate that it names: by it a run's frames are counted."""
    mode = f"{settings.width} x {settings.height} {settings.format} at {settings.fps_hz:g} frames/s"
    frames = frames[WARM_UP:]
    if len(frames) < 3:
        found = f"{mode}, but it gave {len(frames)} frames"
        return Check("camera", False, found, "look at its plug")
    number = unwrap_numbers([frame.sequence for frame in frames])
    number -= number[0]
    if (np.diff(number) <= 0).any():
        return Check("camera", False, f"{mode}, but its frames repeat numbers", "another camera")
    time_s = np.array([frame.time_s - frames[0].time_s for frame in frames])
    (step_s, _), covariance = np.polyfit(number, time_s, 1, cov=True)
    rate, error = 1 / step_s, covariance[0, 0] ** 0.5 / step_s
    lost = int(number[-1]) + 1 - len(frames)
    short = 1 - rate / settings.fps_hz
    most = min(RATE, plan.tolerance.lost + 1 / (plan.total_s * settings.fps_hz))
    passes = bool(-RATE <= short <= most + SURE * error and lost == 0)
    unknown = f"; not known: {'; '.join(settings.unknown)}" if settings.unknown else ""
    found = f"{mode}, measured {rate:.2f}, {lost} lost{unknown}"
    do = "more light, a shorter exposure, another USB port, fps_hz as measured, or more 'lost'"
    return Check("camera", passes, found, do)


def check_picture(settings: base.CameraSettings, frames: list[base.Frame], sensor: Sensor) -> Check:
    """Judge light, focus and markers of a picture of the skin at rest."""
    pictures = (decode_picture(frame.data, settings) for frame in frames[5:])
    picture = next(filter(None, pictures), None)
    if picture is None:
        return Check("picture", False, "none that can be decoded", "look at the camera's format")
    image = make_grey(*picture)
    level = f"mean grey level {image.mean():.0f}"
    if sensor.layout == dims.CELLS:
        return Check("picture", not quality.describe_no_light(image), level, "see to the light")
    markers = detect(image, sensor)
    usual = sensor.n_markers or len(markers)
    found = f"{len(markers)} markers of {usual}"
    if len(markers) < max(4, 0.9 * usual):
        do = "see to light, focus, and the sensor file"
        return Check("picture", False, f"{found}, {level}", do)
    plain = without_shine(image, sensor.looks)
    measured = quality.measure_image_quality(plain, markers, spacing_px(markers))
    found += f", edges {measured.edge_px:.1f} px, {measured.saturated:.0%} saturated"
    too_bright = measured.saturated > quality.OVEREXPOSED
    passes = measured.edge_px <= quality.BLURRED_PX and not too_bright
    return Check("picture", passes, found, "less light or gain" if too_bright else "turn the focus")


def check_microphone(
    settings: base.MicrophoneSettings, blocks: list[base.Block], plan: RecordingPlan
) -> list[Check]:
    """Judge whether a microphone gives the rate that it names, and its sensor's level."""
    if len(blocks) < 3:
        return [Check("microphone", False, "it gave no sound", "look at its plug")]
    counted = np.cumsum([0, *(len(block.samples) for block in blocks[:-1])])
    step_s, _ = siegelslopes([block.time_s for block in blocks], counted)  # some stamps may be off
    rate = 1 / step_s
    lost = sum(block.overflowed for block in blocks)
    drift = 1e6 * (rate / settings.rate_hz - 1)
    sensor = [block.samples[:, plan.channel].astype(np.int32) for block in blocks]
    peak = max(int(np.abs(samples).max()) for samples in sensor) / base.FULL_SCALE
    loud = peak < 1 - 1 / base.FULL_SCALE
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


def check_speeds(devices: Devices, plan: RecordingPlan) -> list[Check]:
    """Turn the drum at every speed, each from rest, as in a run."""
    checks, clock, drive = [], devices.clock, devices.drive
    for speed_mm_s in sorted(plan.speeds_mm_s):
        try:
            check = try_speed(devices, speed_mm_s, plan)
            latest_s = clock.now() + plan.settle_s + _REACHED_S
            while clock.now() < latest_s:  # until the drum stands
                state = drive.read()
                state.raise_fault()
                still = abs(state.speed_mm_s or 0.0) <= plan.tolerance.speed * speed_mm_s
                if still or math.isinf(drive.limits.highest_mm_s):
                    break
                clock.wait(0.02)
        except base.DeviceError as error:
            check = Check(f"speed {speed_mm_s:g} mm/s", False, str(error), "see to the drive")
        checks.append(check)
    return checks


def try_speed(devices: Devices, speed_mm_s: float, plan: RecordingPlan) -> Check:
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
                gone_s = clock.now() - begun_s
                found = f"reached after {gone_s:.2f} s"
                return Check(name, gone_s <= plan.settle_s, found, "a longer settle_s")
            clock.wait(0.02)
    finally:
        drive.stop()
    found = f"{np.mean(speeds[-5:]):.2f} mm/s at last"
    return Check(name, False, found, "see to the drive, or leave the speed out")
