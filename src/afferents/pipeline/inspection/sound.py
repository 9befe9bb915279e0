"""What is in a wav file, and how loud it is."""

from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.pipeline.inspection.found import VIBRATION, Inspection
from afferents.recordings import WavFile, clipped_share, doubt_loudness, require_finite
from afferents.reporting import save_figure, vibration_figure

PICTURED_S = 10.0
"""Length of the vibration that is drawn, s."""


def inspect_wav(path: Path, out: Path) -> Inspection:
    """Say what a wav file holds and draw its start; the last channel is the sensor's."""
    header = WavFile(path, 0)
    audio = WavFile(path, header.n_channels - 1)
    seconds = audio.n_samples / audio.sample_rate_hz
    found = Inspection(str(path))
    found.sentences.append(
        f"{audio.n_channels} channel(s) at {audio.sample_rate_hz:g} Hz, {seconds:.2f} s; "
        f"channel {audio.n_channels} is taken for the sensor."
    )
    samples = audio.samples()
    found.sentences += level_sentences(samples)
    found.facts = {
        "channels": audio.n_channels,
        "sample_rate_hz": audio.sample_rate_hz,
        "duration_s": seconds,
    }
    try:
        require_finite(samples, path, audio.sample_rate_hz)
    except InputError as error:
        found.problems.append(str(error))
        return found
    found.problems += [str(doubt) for doubt in doubt_loudness(samples, path, audio.sample_rate_hz)]
    found.pictures = [draw_vibration(audio.read(), path.name, out)]
    return found


def level_sentences(samples: NDArray[np.float32]) -> list[str]:
    """Say how loud a signal (n,) is, and whether it is clipped or silent; by what is a number."""
    numbers = samples[np.isfinite(samples)].astype(float)
    if len(numbers) == 0:
        return ["No sample is a number."]
    peak, rms = float(np.abs(numbers).max()), float(np.sqrt((numbers**2).mean()))
    sentences = [f"Peak {peak:.3g}, RMS {rms:.3g} of full scale."]
    if peak == 0:
        sentences.append("It is silent: look at the sensor's channel and cable.")
    clipped = clipped_share(numbers)
    if clipped > 0:
        sentences.append(
            f"{100 * clipped:.3g}% of samples are clipped, at {numbers.min():.3g} or "
            f"{numbers.max():.3g}: lower the gain."
        )
    return sentences


def draw_vibration(signal: xr.DataArray, name: str, out: Path) -> Path:
    """Draw the first seconds of vibration and their spectrum."""
    n = round(PICTURED_S * signal.attrs[dims.SAMPLE_RATE])
    figure = vibration_figure(signal.isel({dims.AUDIO_TIME: slice(0, n)}), name)
    return save_figure(figure, out / VIBRATION)
