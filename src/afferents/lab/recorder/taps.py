"""Sound against picture: the taps at the start of a run, which camera and microphone both have."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import soundfile

from afferents.errors import InputError
from afferents.extraction.align import Offset, measure_offset
from afferents.lab.devices.base import MicrophoneSettings
from afferents.lab.recorder.gate import Check
from afferents.lab.recorder.plan import RecordingPlan
from afferents.markers.sensor import Sensor
from afferents.markers.track import Tracker
from afferents.recordings.layouts import AUDIO, VIDEO
from afferents.recordings.run_log import Log
from afferents.recordings.sound_clock import sound_clock
from afferents.recordings.video import VideoFile

AUDIO_OFFSET, SOUND_CLOCK = "audio_offset", "sound_clock"
"""What `run.json` has of the taps, and of the times of the blocks."""

SYSTEMATIC_S = 0.0015
"""All taps of a set-up may be off by this much together: what delays all of them alike is no other
than an offset. Simulated microphones whose upper limit is 80 to 400 Hz make it 1.2 ms more to
1.1 ms less."""
_DO = "tap the fingertip three times, softly, with something smooth, when it is time"


class Tapped(NamedTuple):
    """What the taps of a run show.

    Attributes
    ----------
    check
        For the gate.
    offset_s, error_s
        What the camera sees at t, the microphone hears at t + `offset_s`; and its uncertainty, one
        standard deviation. None where the taps were not found.
    """

    check: Check
    offset_s: float | None = None
    error_s: float | None = None


def measure_taps(folder: Path, plan: RecordingPlan, sensor: Sensor) -> Tapped:
    """Measure the offset of a run's sound and picture from its taps.

    Parameters
    ----------
    folder
        Where its files lie.
    """
    name = "sound against picture"
    try:
        found = _compare(folder, plan, sensor)
    except InputError as error:
        return Tapped(Check(name, False, f"no tap that both show ({error.at('taps')})", _DO))
    error_s = float(np.hypot(found.error_s, SYSTEMATIC_S))
    offset = f"{1000 * found.seconds:+.1f} ms, give or take {1000 * error_s:.1f}"
    return Tapped(Check(name, True, offset), found.seconds, error_s)


def describe_sound_times(
    log: Log, microphone: MicrophoneSettings | None, taps: Tapped | None
) -> dict[str, Any]:
    """Return what is known of when the sound of a run was taken, as `run.json` has it."""
    about: dict[str, Any] = {}
    if microphone is not None and log.blocks and log.origin_s is not None:
        clock = sound_clock(log.blocks, microphone.rate_hz)
        about[SOUND_CLOCK] = {"seconds": clock.start_s - log.origin_s, "error_s": clock.error_s}
        if clock.drift is not None:
            share, error = clock.drift
            about[SOUND_CLOCK] |= {"drift": share, "drift_error": error}
    if taps:
        about[AUDIO_OFFSET] = {"seconds": taps.offset_s, "error_s": taps.error_s}
    return about


def _compare(folder: Path, plan: RecordingPlan, sensor: Sensor) -> Offset:
    """Follow the markers until the drum starts, and compare with the sound until then."""
    time_s, position = [], []
    tracker: Tracker | None = None
    for number, frame in enumerate(VideoFile(folder / VIDEO).frames()):
        if frame.time_s >= plan.start_s:
            break
        if number < sensor.rest_frame:
            continue
        if tracker is None:
            tracker = Tracker(sensor, levels=frame.levels)
        time_s.append(frame.time_s)
        position.append(tracker.step(frame.luma)[0])
    if not position:
        raise InputError(f"{folder}: expected frames before the drum starts, found none")
    with soundfile.SoundFile(folder / AUDIO) as sound:
        n = round(plan.start_s * sound.samplerate)
        samples = sound.read(n, dtype="float64", always_2d=True)
        rate_hz = sound.samplerate
    return measure_offset(np.array(time_s), np.array(position), samples[:, plan.channel], rate_hz)
