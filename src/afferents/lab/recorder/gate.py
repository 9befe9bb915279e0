"""Whether a run is good enough to be kept: each check yes or no, with what was found.

Among them is the time of the sound against that of the picture, by the blocks' times and by taps
at the start of a run, which camera and microphone both show.
"""

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np
import soundfile
from numpy.typing import NDArray

from afferents.errors import InputError, reason_of
from afferents.extraction.align import measure_offset
from afferents.lab.devices.base import FULL_SCALE, CameraSettings, MicrophoneSettings
from afferents.lab.devices.picture import decode_picture
from afferents.lab.recorder.devices import Devices
from afferents.lab.recorder.plan import RecordingPlan, Tolerance
from afferents.markers.detect import detect
from afferents.markers.sensor import Sensor
from afferents.markers.track import Tracker
from afferents.recordings import layouts, video
from afferents.recordings.run_log import Log
from afferents.recordings.sound_clock import LIMIT_FRAMES, SURE, sound_clock
from afferents.store.recording import make_grey

LATE = 1.5
"""A frame that comes after this number of intervals, with no number missing, is late."""
SOUND_SHORT_S = 0.1
SYSTEMATIC_S = 0.0015
"""All taps of a set-up may be off by this much together: what delays all of them alike is no other
than an offset. Simulated microphones whose upper limit is 80 to 400 Hz make it 1.2 ms more to
1.1 ms less."""


class Check(NamedTuple):
    """One line of a gate or a preflight.

    Attributes
    ----------
    name
        What was looked at.
    passes
        Yes or no.
    found
        What was found, in words.
    do
        What to do about it; empty where it passes.
    """

    name: str
    passes: bool
    found: str
    do: str = ""

    def describe(self) -> str:
        """Return it as a line."""
        remedy = f"; {self.do}" if self.do and not self.passes else ""
        return f"{'yes' if self.passes else 'NO '}  {self.name}: {self.found}{remedy}"

    def as_json(self) -> dict[str, str | bool]:
        """Return it as files and scripts have it."""
        return {
            key: value for key, value in self._asdict().items() if key != "do" or not self.passes
        }


class Counts(NamedTuple):
    """What became of the frames of a run.

    Attributes
    ----------
    expected
        Frames that there should be, by the camera's rate.
    stored
        Frames in the video.
    lost
        Numbers of the frames that never came; no more than one above those expected.
    damaged, repeated, late
        Numbers of such frames, see `unwrap_numbers`.
    """

    expected: int
    stored: int
    lost: tuple[int, ...]
    damaged: tuple[int, ...]
    repeated: tuple[int, ...]
    late: tuple[int, ...]


def count_frames(log: Log, fps_hz: float, total_s: float) -> Counts:
    """Count what became of the frames, from the driver's numbers, their times and content."""
    numbers = unwrap_numbers([row.sequence for row in log.frames])
    time_s = np.array([row.time_s for row in log.frames])
    there = set(numbers.tolist())
    between = range(int(numbers[0]), int(numbers[-1]) + 1) if len(numbers) else range(0)
    step = np.diff(numbers, prepend=numbers[:1] - 1)
    gap = np.diff(time_s, prepend=time_s[:1]) * fps_hz > LATE
    repeated = (step <= 0) | np.array([row.repeated for row in log.frames], bool)
    damaged = np.array([row.damaged for row in log.frames], bool)
    expected = round(total_s * fps_hz)
    lost = (n for n in between if n not in there)
    return Counts(
        expected,
        sum(row.stored for row in log.frames),
        tuple(islice(lost, expected + 1)),  # a number that leaps makes no list without end
        tuple(numbers[damaged].tolist()),
        tuple(sorted(set(numbers[repeated].tolist()))),
        tuple(numbers[gap & (step == 1)].tolist()),
    )


def unwrap_numbers(numbers: Sequence[int]) -> NDArray[np.int64]:
    """Return frame numbers that go on where a counter of 8, 16 or 32 bits begins again at 0.

    It does where a number falls by more than half of the counter's range.
    """
    counted = np.array(numbers, np.int64)
    most = counted.max(initial=0)
    size = next((2**bits for bits in (8, 16, 32) if most < 2**bits), 0)
    return counted + size * np.cumsum(np.diff(counted, prepend=counted[:1]) < -size / 2)


def check_run(
    log: Log,
    counts: Counts,
    folder: Path,
    plan: RecordingPlan,
    speed_mm_s: float,
    devices: Devices,
    sensor: Sensor,
) -> list[Check]:
    """Look at a run that has come to its end.

    Parameters
    ----------
    folder
        Where its files lie.
    devices
        That it was made with, open still.
    """
    camera, microphone = devices.camera.settings, devices.sound
    checks = [*check_frames(counts, plan.tolerance), check_speed(log, plan, speed_mm_s)]
    if microphone is not None:
        checks += check_sound(log, plan, microphone)
        checks += check_clock(log, plan, camera, microphone)
    checks.append(check_markers(log, camera, sensor, plan))
    name, do = "file", "look at the disk"
    try:  # without decoding
        with av.open(f"file:{folder / layouts.VIDEO}") as container:
            n = sum(packet.size > 0 for packet in container.demux(video=0))
    except av.FFmpegError as error:
        return [*checks, Check(name, False, reason_of(error), do)]
    return [*checks, Check(name, n == counts.stored, f"{n} frames in it", do)]


def check_frames(counts: Counts, tolerance: Tolerance) -> list[Check]:
    """Look at what became of the frames."""
    lost = max(len(counts.lost) + len(counts.damaged), counts.expected - counts.stored - 1)
    allowed = tolerance.lost * counts.expected
    found = f"{counts.stored} of {counts.expected} frames"
    for what, numbers in (("lost", counts.lost), ("damaged", counts.damaged)):
        if numbers:
            found += f", {len(numbers)} {what} (the first is number {numbers[0]})"
    again = len(counts.repeated)
    do = "another USB port, fewer devices on it, or a faster disk"
    return [
        Check("frames", lost <= allowed, found, do),
        Check(
            "repeated frames",
            again <= tolerance.repeated * counts.expected,
            f"{again} repeated, {len(counts.late)} late",
            "more light, so that the camera keeps its rate",
        ),
    ]


def check_speed(log: Log, plan: RecordingPlan, speed_mm_s: float) -> Check:
    """Judge whether the drum held its speed while it was to be steady."""
    begin_s, end_s = (edge + (log.origin_s or 0.0) for edge in plan.steady_s)
    speeds = np.array([row.speed_mm_s for row in log.drive if begin_s <= row.time_s <= end_s])
    n_known = int(np.isfinite(speeds).sum())
    if fault := next((row.fault for row in log.drive if row.fault), None):
        return Check("speed", False, f"the drive reports a fault: {fault}", "see to the drive")
    if len(speeds) > n_known == 0:
        return Check("speed", True, "unknown: nothing reads the drum")
    if n_known < max(1, len(speeds)):
        found = f"known in {n_known} of {len(speeds)} readings"
        return Check("speed", False, found, "see to the drive")
    if plan.sweep:
        low, high = min(plan.speeds_mm_s), max(plan.speeds_mm_s)
        mean, allowed = float(speeds.mean()), plan.tolerance.speed
        found = f"{mean:.2f} mm/s on average, {speeds.min():.2f} to {speeds.max():.2f}"
        passes = low * (1 - allowed) <= mean <= high * (1 + allowed)
        return Check("speed", passes, found, f"see to the arm: {low:g} to {high:g} are planned")
    # A tenth of a second together: what is read from one moment to the next is coarse.
    smooth = np.convolve(speeds, np.ones(5) / 5, "valid") if len(speeds) >= 5 else speeds
    off = float(np.abs(smooth / speed_mm_s - 1).max())
    found = f"{speeds.mean():.2f} mm/s of {speed_mm_s:g}, at most {off:.1%} off"
    return Check("speed", off <= plan.tolerance.speed, found, "see to the drive, or widen 'speed'")


def check_sound(log: Log, plan: RecordingPlan, microphone: MicrophoneSettings) -> list[Check]:
    """Judge whether the sound is whole, and its level."""
    n = sum(row.n_samples for row in log.blocks)
    overflows = sum(row.overflowed for row in log.blocks)
    seconds = n / microphone.rate_hz
    whole = overflows == 0 and seconds >= plan.total_s - SOUND_SHORT_S
    clipped, peak = log.clipped / max(n, 1), log.peak / FULL_SCALE
    return [
        Check("sound", whole, f"{seconds:.2f} s, {overflows} overflows", "close other programs"),
        Check(
            "level of the sound",
            clipped <= plan.tolerance.clipped and peak > plan.tolerance.silent,
            f"peak {peak:.1%} of full scale, {clipped:.2%} clipped",
            "turn the gain down" if clipped > plan.tolerance.clipped else "look at its plug",
        ),
    ]


def check_clock(
    log: Log, plan: RecordingPlan, camera: CameraSettings, microphone: MicrophoneSettings
) -> list[Check]:
    """Judge whether the sound began at the run's zero, and kept its rate to the end."""
    if not log.blocks or log.origin_s is None:
        return []
    clock = sound_clock(log.blocks, microphone.rate_hz)
    late_s, limit_s = clock.start_s - log.origin_s, LIMIT_FRAMES / camera.fps_hz
    found = (
        f"it began {1000 * late_s:+.1f} ms from the run's zero (error {1000 * clock.error_s:.1f})"
    )
    passes = abs(late_s) <= limit_s + SURE * clock.error_s
    if clock.drift is not None:
        found += f", drift {clock.drift.describe()}"
        apart = abs(clock.drift.share) - SURE * clock.drift.error
        passes = passes and apart * plan.total_s <= limit_s
    return [
        Check(
            "clock of the sound", passes, f"{found}; half a frame is {1000 * limit_s:.1f} ms",
            "take the sound card itself, not a sound server, or make runs shorter",
        )
    ]  # fmt: skip


def check_markers(log: Log, camera: CameraSettings, sensor: Sensor, plan: RecordingPlan) -> Check:
    """Look for the markers in a picture at rest and in the last."""
    pictures = [decode_picture(data, camera) for data in (log.rest, log.last)]
    found = [len(detect(make_grey(*seen), sensor)) if seen else 0 for seen in pictures]
    usual = sensor.n_markers or found[0]
    missing = max(0.0, 1 - min(found) / max(usual, 1))
    return Check(
        "markers",
        min(found) > 0 and missing <= plan.tolerance.markers,
        f"{found[0]} at rest and {found[1]} at the end, of {usual}",
        "see to light and focus, and to the sensor file",
    )


def measure_taps(
    folder: Path, plan: RecordingPlan, sensor: Sensor
) -> tuple[Check, dict[str, float | None]]:
    """Measure the offset of a run's sound and picture from its taps.

    The markers are followed until the drum starts, and compared with the sound until then.

    Parameters
    ----------
    folder
        Where its files lie.

    Returns
    -------
    tuple
        A check for the gate, and for `run.json` the offset in `seconds` and its `error_s`: what the
        camera sees at t, the microphone hears at t + `seconds`, with an uncertainty of one standard
        deviation. None where the taps were not found.
    """
    name = "sound against picture"
    time_s, position = [], []
    tracker: Tracker | None = None
    try:
        for number, frame in enumerate(video.VideoFile(folder / layouts.VIDEO).frames()):
            if frame.time_s >= plan.start_s:
                break
            if number < sensor.rest_frame:
                continue
            tracker = tracker or Tracker(sensor, levels=frame.levels)
            time_s.append(frame.time_s)
            position.append(tracker.step(frame.luma)[0])
        if not position:
            raise InputError(f"{folder}: expected frames before the drum starts, found none")
        with soundfile.SoundFile(folder / layouts.AUDIO) as sound:
            n, rate_hz = round(plan.start_s * sound.samplerate), sound.samplerate
            heard = sound.read(n, dtype="float64", always_2d=True)[:, plan.channel]
        found = measure_offset(np.array(time_s), np.array(position), heard, rate_hz)
    except InputError as error:
        do = "tap the fingertip three times, softly, with something smooth, when it is time"
        check = Check(name, False, f"no tap that both show ({error.at('taps')})", do)
        return check, {"seconds": None, "error_s": None}
    error_s = float(np.hypot(found.error_s, SYSTEMATIC_S))
    offset = f"{1000 * found.seconds:+.1f} ms, give or take {1000 * error_s:.1f}"
    return Check(name, True, offset), {"seconds": found.seconds, "error_s": error_s}


def describe_sound_times(log: Log, microphone: MicrophoneSettings | None) -> dict[str, Any]:
    """Return what is known of when the sound of a run was taken, as `run.json` has it."""
    about: dict[str, Any] = {}
    if microphone is not None and log.blocks and log.origin_s is not None:
        clock = sound_clock(log.blocks, microphone.rate_hz)
        about["sound_clock"] = {"seconds": clock.start_s - log.origin_s, "error_s": clock.error_s}
        if clock.drift is not None:
            share, error = clock.drift
            about["sound_clock"] |= {"drift": share, "drift_error": error}
    return about
