"""Samples as other speeds would give them: stretched spectra (paper, 2.4.3), faster images.

Slid f times faster, a texture makes the same vibration f times as fast. It moves the markers so,
too: what a marker shows at time t at one speed it shows at t / f at a speed f times as high, as far
as the skin follows alike. It does not quite: it is viscoelastic, and friction depends on speed.
Copies are a guess at other speeds, no recordings of them; those of images are ours, not the
paper's.
"""

from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError

Stretch = Literal["rebinned", "fourier"]
Floats = NDArray[np.float32]

COPIES = ((0.5, 1.0), (0.5, 1.0), (0.5, 1.0), (1.0, 2.0), (1.0, 2.0), (1.0, 2.0))
"""Range of the random factor of each copy of a training spectrum (section 2.4.3)."""
RANGES = ((0.5, 1.0), (1.0, 2.0))
"""Of the random factor of each copy. One of each of the paper's two ranges, where it draws three:
images take more memory than spectra."""
_GAP = 0.5
"""In frames: a run that begins this long after the end of another does not continue it."""


def stretch_spectrum(
    spectrum: NDArray[np.float32],
    factor: float,
    kind: Stretch = "rebinned",
    bins: int | None = None,
) -> NDArray[np.float32]:
    """Stretch a spectrum by `factor` along its last axis: S(nu) becomes S(nu / f).

    Two forms, chosen by the protocol:

    - `fourier` is what the published code does: Fourier resampling of the magnitude spectrum
      (train_vibration.ipynb, cells 6-7). It rings, and can fall below zero.
    - `rebinned` treats the spectrum as a histogram over frequency and takes, for each new bin, the
      mean over the stretch of the old axis that it covers. Nothing rings, nothing turns negative,
      no line falls between two bins, and a factor of 1 changes nothing.

    Parameters
    ----------
    spectrum
        Amplitudes, shape (..., n), bin k at k times the bin spacing.
    factor
        Above 0: what lay at frequency nu comes to lie at `factor` * nu.
    kind
        `rebinned` or `fourier`.
    bins
        How many bins to return, default n. What came from beyond the last bin is 0.

    Raises
    ------
    InputError
        If the factor is not a positive number.
    """
    if not np.isfinite(factor) or factor <= 0:
        raise InputError(f"factor: expected a stretch above 0, found {factor}")
    n = spectrum.shape[-1]
    bins = bins or n
    if kind == "fourier":
        import scipy.signal  # which takes longer to import than all the rest

        resampled = scipy.signal.resample(spectrum, int(n * factor), axis=-1)[..., :bins]
        missing = [(0, 0)] * (spectrum.ndim - 1) + [(0, bins - resampled.shape[-1])]
        return np.asarray(np.pad(resampled, missing), np.float32)
    area = np.zeros((*spectrum.shape[:-1], n + 1))
    np.cumsum(spectrum, axis=-1, out=area[..., 1:])
    # Bin k is the mean over (k - 1/2, k + 1/2) / factor of the old axis, whose bin edges lie at
    # -1/2, 1/2, ...; what would reach below the old axis starts at its edge.
    edges = np.clip((np.arange(bins + 1) - 0.5) / factor + 0.5, 0.0, None)
    below = np.minimum(edges.astype(np.int64), n - 1)
    at_edges = area[..., below] + (np.minimum(edges, n) - below) * spectrum[..., below]
    means = np.diff(at_edges, axis=-1) / np.maximum(np.diff(edges), 1e-12)
    return np.asarray(means, np.float32)


def stretched_copies(
    spectra: NDArray[np.float32], rng: np.random.Generator, kind: Stretch, bins: int
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Draw the six stretched copies of every training spectrum.

    Parameters
    ----------
    spectra
        Shape (sample, channel, frequency), with more bins than the model sees.
    bins
        Bins kept of each copy.

    Returns
    -------
    Copies (6 * sample, channel, bins), and the index of the sample each came from.
    """
    n = len(spectra)
    copies = np.empty((len(COPIES) * n, spectra.shape[1], bins), dtype=np.float32)
    for c, (low, high) in enumerate(COPIES):
        for i, factor in enumerate(rng.uniform(low, high, n)):
            copies[c * n + i] = stretch_spectrum(spectra[i], factor, kind, bins)
    return copies, np.tile(np.arange(n), len(COPIES))


def grows_with_speed(samples: xr.DataArray) -> bool:
    """Return whether samples are of a response that counts per frame, as RA-I does."""
    return str(samples.attrs.get(dims.UNITS)).endswith("/frame")


def faster_images(
    samples: xr.DataArray, index: NDArray[np.int64], rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64]]:
    """Return copies of single images as other speeds would give them.

    RA-I, a change per frame, is f times as large (over steps that are short compared with what the
    marker goes through). SA-I of a single frame is the same at any speed.

    Parameters
    ----------
    samples
        RA-I (sample, row, column), px/frame.
    index
        Samples to copy, (n,).

    Returns
    -------
    Copies (2 * n, row, column), and the place in `index` of the sample that each came from.

    Raises
    ------
    InputError
        If the samples are of SA-I, of which a single image is the same at any speed.
    """
    if not grows_with_speed(samples):
        raise InputError(
            "augmentation: expected samples that change with the speed, found single images; "
            "augment RA-I, or runs of images"
        )
    values = samples.values[index]
    factors = [rng.uniform(*between, len(index)).astype(np.float32) for between in RANGES]
    return (
        np.concatenate([values * factor[:, None, None] for factor in factors]),
        np.tile(np.arange(len(index)), len(RANGES)),
    )


def faster_runs(
    samples: xr.DataArray, index: NDArray[np.int64], rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64]]:
    """Return copies of runs of images as other speeds would give them.

    Of a copy f times as fast, frame k is the recording f * k frames after the run's first one,
    linear between two frames; of RA-I it is also f times as large. Beyond its own end a run
    continues in the next of the same recording;
    one that has none, the last, is copied at lower speeds only. So is one before a gap, and one
    whose next is held out with others: what is tested must not be learnt from in a copy.

    Parameters
    ----------
    samples
        SA-I or RA-I (sample, frame, row, column), runs of a recording one after the other.
    index
        Samples to copy, (n,). The runs after them are looked at as well.

    Returns
    -------
    Copies (2 * n, frame, row, column), and the place in `index` of the sample each came from.
    """
    n_frames, grows = samples.shape[1], grows_with_speed(samples)
    follows = _find_followed(samples)[index]
    copies = np.empty((len(RANGES) * len(index), *samples.shape[1:]), dtype=np.float32)
    for number, between in enumerate(RANGES):
        factors = rng.uniform(*between, len(index))
        factors = np.where(follows, factors, np.minimum(factors, 1.0))
        for i, (sample, factor) in enumerate(zip(index, factors, strict=True)):
            runs = samples.values[sample : sample + 1 + follows[i]]
            frames = runs.reshape(-1, *samples.shape[2:])
            place = factor * np.arange(n_frames)
            below = np.minimum(place.astype(np.int64), len(frames) - 1)
            above = np.minimum(below + 1, len(frames) - 1)
            share = (place - below).astype(np.float32)[:, None, None]
            copy = (1 - share) * frames[below] + share * frames[above]
            copies[number * len(index) + i] = factor * copy if grows else copy
    return copies, np.tile(np.arange(len(index)), len(RANGES))


def _find_followed(samples: xr.DataArray) -> NDArray[np.bool_]:
    """Return after which samples the next is of the same recording, and begins where they end."""
    start_s, stop_s = samples[dims.START].values, samples[dims.STOP].values
    apart = start_s[1:] - stop_s[:-1]
    frame_s = (stop_s - start_s)[:-1] / samples.shape[1]
    later = start_s[1:] > start_s[:-1]  # a variant of it begins anew
    follows = later & (apart < _GAP * frame_s)
    for name in {dims.RECORDING, dims.GROUP} & set(samples.coords):
        of = samples[name].values
        follows &= of[1:] == of[:-1]
    return np.append(follows, False)
