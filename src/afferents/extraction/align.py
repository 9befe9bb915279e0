"""How far the microphone's clock is ahead of the camera's, from touches that both recorded.

Camera and microphone feel the same skin. What presses on the microphone below 40 Hz is very
nearly a linear function of where the skin's main motions are. The microphone does not pass it on
whole: gel and amplifier lose what is slow, and shift the phase of what is left. That is undone
by adding to the sound its integral, once and twice, each with a weight: the right ones make good
a loss of first or second order below some corner. The offset is the delay under which some such
sum is most nearly a linear function of the motions (the first canonical correlation; Hotelling
1936).

Compared with the motions as it is, the sound of a simulated tap comes 8.6 ms late: its shifted
phase looks like a delay. With its integrals it comes 0.2 ms early.

A touch of a smooth surface, or a tap, serves best: the hum of a regular texture looks the same a
period later. What delays all frequencies alike, a converter or a low-pass far above 40 Hz,
belongs to the offset: nothing can tell it from one.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, resample, sosfiltfilt

from afferents import dims
from afferents.errors import InputError
from afferents.markers.sensor import Sensor, resolve_sensor
from afferents.markers.track import track_markers
from afferents.progress import Progress
from afferents.recordings.audio import WavFile
from afferents.recordings.layouts import AUDIO, VIDEO, make_clip, session_around

Floats = NDArray[np.float64]

RATE_HZ = 1000.0
BAND_HZ = (2.0, 40.0)
"""What both feel: the camera nothing above half its frame rate, the gel little below."""
INTEGRALS = 2
"""A gel and an amplifier with a loss of first order each."""
MOTIONS = 3
"""Main motions of the skin: along the slide, across it, and outwards."""
BEFORE_S, AFTER_S = 0.3, 1.3
"""How much is used before and after the touch begins."""
FARTHEST_S = 0.1
STEP_S = 0.001
LEAST_S = 1.0
"""In less, anything is explained by that many motions."""
LEAST_EXPLAINED = 0.9


class Offset(NamedTuple):
    """A measured offset.

    Attributes
    ----------
    seconds
        What the camera sees at t, the microphone hears at t + `seconds`.
    explained
        Share of the variance of the sound, made good, that the skin's motion explains under it.
    error_s
        Standard error that follows from how sharp the maximum is and from what is not explained.
        What is wrong in the same way in every touch is not in it.
    """

    seconds: float
    explained: float
    error_s: float


def measure_offset(
    time_s: Floats, position: Floats, sound: NDArray[np.floating], sample_rate_hz: float
) -> Offset:
    """Measure the offset of two clocks.

    Parameters
    ----------
    time_s
        When the frames were taken, (n_frames,), s, from the rest frame on.
    position
        Of the markers, (n_frames, n_markers, 2), px; those lost at times (NaN) are not used.
    sound
        Of the sensor, (n_samples,), from the start of the audio on.
    sample_rate_hz
        Its rate, Hz.

    Raises
    ------
    InputError
        If there is no touch, or its sound is not that of the skin's motion.
    """
    ends_s = min(float(time_s[-1]) if len(time_s) else 0.0, len(sound) / sample_rate_hz)
    if len(time_s) < 2 or ends_s - time_s[0] < LEAST_S:
        raise InputError(
            f"the recording: expected at least {LEAST_S:g} s of video and audio, found "
            f"{ends_s:.2f} s"
        )
    moved = _main_motions(position)
    way = np.linalg.norm(moved, axis=1)
    touch_s = float(time_s[np.argmax(way > way.max() / 10)])  # a tenth of the skin's way
    every = np.arange(time_s[0], time_s[-1], 1 / RATE_HZ)
    used = (every > touch_s - BEFORE_S) & (every < touch_s + AFTER_S)
    time, motion = every[used], _filtered(CubicSpline(time_s, moved)(every))[used]
    if len(time) < LEAST_S * RATE_HZ:
        found = f"{len(time) / RATE_HZ:.2f} s round it"
        raise InputError(f"the recording: expected a touch with {LEAST_S:g} s of it, found {found}")
    n = round(len(sound) * RATE_HZ / sample_rate_hz)
    columns = [resample(np.asarray(sound, np.float64), n)]
    for _ in range(INTEGRALS):
        columns.append(np.cumsum(columns[-1] - columns[-1].mean()) / RATE_HZ)
    heard = _filtered(np.stack(columns, axis=1))
    delays = np.arange(-FARTHEST_S, FARTHEST_S + STEP_S / 2, STEP_S)
    basis, _ = np.linalg.qr(motion)
    step_s = np.float64(len(sound) / sample_rate_hz / n)  # a whole number of steps rarely fits
    at = np.arange(n) * step_s
    explained = np.empty(len(delays))
    for number, delay in enumerate(delays):  # the greatest share of a sum of sounds in the basis
        sounds = np.stack([np.interp(time + delay, at, one) for one in heard.T], axis=1)
        there, _ = np.linalg.qr(sounds)
        explained[number] = np.linalg.svd(basis.T @ there, compute_uv=False)[0] ** 2
    best = int(explained[1:-1].argmax()) + 1
    if explained[best] < LEAST_EXPLAINED or best in (1, len(delays) - 2):
        raise InputError(
            f"the recording: expected a touch within {1000 * FARTHEST_S:g} ms of its sound, of "
            f"which the skin's motion explains {100 * LEAST_EXPLAINED:g}%, found "
            f"{100 * explained[best]:.0f}%; tap the fingertip with something smooth"
        )
    before, at, after = explained[best - 1 : best + 2]
    bend = before - 2 * at + after
    aside = (before - after) / (2 * bend)
    # Independent values of the sound that the basis leaves over.
    independent = 2.0 * (BAND_HZ[1] - BAND_HZ[0]) * len(basis) / RATE_HZ
    freedom = max(1.0, float(independent - basis.shape[1] - INTEGRALS))
    error_s = STEP_S * np.sqrt(2 * (1 - at) / (freedom * -bend))
    return Offset(float(delays[best] + STEP_S * aside), float(at), float(error_s))


def _main_motions(position: Floats) -> Floats:
    """Return the course of the skin's main motions, (n_frames, MOTIONS), px."""
    seen = np.isfinite(position).all(axis=(0, 2))
    if not seen.any():
        raise InputError("the recording: expected markers that are seen all the time, found none")
    flat = position[:, seen].reshape(len(position), -1)
    flat = flat - flat[0]
    _, _, shapes = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
    return np.asarray(flat @ shapes[:MOTIONS].T)


def _filtered(signal: Floats) -> Floats:
    band = butter(2, BAND_HZ, "bandpass", fs=RATE_HZ, output="sos")
    return np.asarray(sosfiltfilt(band, signal, axis=0))


class Alignment(NamedTuple):
    """Offsets in ms, one a recording, and their mean; `error_ms` is the mean's standard error."""

    offsets_ms: tuple[float, ...]
    explained: tuple[float, ...]
    mean_ms: float
    error_ms: float | None

    def describe(self) -> list[str]:
        """Return it in sentences."""
        each = [
            f"{offset:+.1f} ms, under which the skin's motion explains {100 * share:.0f}% of the "
            "sound below 40 Hz."
            for offset, share in zip(self.offsets_ms, self.explained, strict=True)
        ]
        error = "" if self.error_ms is None else f" ± {self.error_ms:.1f}"
        return [
            *each,
            f"The microphone's clock is ahead of the camera's by {self.mean_ms:.1f}{error} ms; "
            f"feel with --audio-offset-ms {self.mean_ms:.1f}.",
        ]


def align(
    recordings: Sequence[Path], sensor: str | Path | Sensor = "tip_b", quiet: bool = False
) -> Alignment:
    """Measure the time offset between microphone and camera, for 'live --audio-offset-ms'.

    Parameters
    ----------
    recordings
        Recordings of touches on something smooth: folders of mp4 and wav.
    sensor
        Sensor file (TOML), or the name of a packaged one.
    quiet
        No progress bars; plain lines on stderr.

    Raises
    ------
    InputError
        If a recording lacks video or audio, or shows no touch whose sound is that of the skin.
    """
    given = resolve_sensor(sensor)
    if given.layout == dims.CELLS:
        raise InputError(
            f"--sensor: expected one with markers, since the sound goes by their way, found "
            f"'{given.name}' of cells; give live the offset by hand"
        )
    with Progress(quiet) as progress:
        folders = progress.track(recordings, "aligning", len(recordings))
        found = [_offset(folder, given) for folder in folders]
    offsets = np.array([1000 * offset.seconds for offset in found])
    error = float(offsets.std(ddof=1) / np.sqrt(len(offsets))) if len(offsets) > 1 else None
    explained = tuple(offset.explained for offset in found)
    return Alignment(tuple(offsets.tolist()), explained, float(offsets.mean()), error)


def _offset(folder: Path, sensor: Sensor) -> Offset:
    declared, own_hz = session_around(folder / VIDEO)
    tracks = track_markers(make_clip(folder / VIDEO, declared, own_hz), sensor)
    audio = WavFile(folder / AUDIO, declared.channel)
    touched = tracks.isel({dims.TIME: slice(tracks.attrs["rest_frame"], None)})
    try:
        return measure_offset(
            touched[dims.TIME].values,
            touched[dims.POSITION].values,
            audio.read().values[:, 0],
            audio.sample_rate_hz,
        )
    except InputError as error:
        raise error.at(folder) from error
