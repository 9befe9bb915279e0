"""Stretching spectra in frequency, to stand in for speeds never seen (paper, section 2.4.3).

A texture slid f times faster vibrates at f times the frequency, so its spectrum S(nu) becomes
S(nu / f). Two forms, chosen by the protocol:

- `fourier` is what the published code does: Fourier resampling of the magnitude spectrum
  (train_vibration.ipynb, cells 6-7). It rings, and can fall below zero.
- `rebinned` treats the spectrum as a histogram over frequency and takes, for each new bin, the
  mean over the stretch of the old axis that it covers. Nothing rings, nothing turns negative,
  no line falls between two bins, and a factor of 1 changes nothing.
"""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError

Stretch = Literal["rebinned", "fourier"]

COPIES = ((0.5, 1.0), (0.5, 1.0), (0.5, 1.0), (1.0, 2.0), (1.0, 2.0), (1.0, 2.0))
"""Range of the random factor of each copy of a training spectrum (section 2.4.3)."""


def stretch_spectrum(
    spectrum: NDArray[np.float32],
    factor: float,
    kind: Stretch = "rebinned",
    bins: int | None = None,
) -> NDArray[np.float32]:
    """Stretch a spectrum by `factor` along its last axis.

    Parameters
    ----------
    spectrum
        Amplitudes, shape (..., n), bin k at k times the bin spacing.
    factor
        Above 0: what lay at frequency nu comes to lie at `factor` * nu.
    kind
        `rebinned` or `fourier`, see the module.
    bins
        How many bins to return, default n. What came from beyond the last bin is 0.

    Raises
    ------
    InputError
        If the factor is not a positive number.
    """
    if not np.isfinite(factor) or factor <= 0:
        raise InputError("factor", "a stretch above 0", f"{factor}")
    bins = bins or spectrum.shape[-1]
    stretched = _fourier if kind == "fourier" else _rebinned
    return stretched(spectrum, factor, bins).astype(np.float32)


def _fourier(spectrum: NDArray[np.float32], factor: float, bins: int) -> NDArray[np.float64]:
    import scipy.signal  # which takes longer to import than all the rest

    n = spectrum.shape[-1]
    whole: NDArray[np.float64] = scipy.signal.resample(spectrum, int(n * factor), axis=-1)
    resampled = whole[..., :bins]
    missing = bins - resampled.shape[-1]
    padded: NDArray[np.float64] = np.pad(resampled, [(0, 0)] * (spectrum.ndim - 1) + [(0, missing)])
    return padded


def _rebinned(spectrum: NDArray[np.float32], factor: float, bins: int) -> NDArray[np.float64]:
    n = spectrum.shape[-1]
    area = np.zeros((*spectrum.shape[:-1], n + 1))
    np.cumsum(spectrum, axis=-1, out=area[..., 1:])
    # Bin k is the mean over (k - 1/2, k + 1/2) / factor of the old axis, whose bin edges lie at
    # -1/2, 1/2, ...; what would reach below the old axis starts at its edge.
    edges = np.clip((np.arange(bins + 1) - 0.5) / factor + 0.5, 0.0, None)
    below = np.minimum(edges.astype(np.int64), n - 1)
    part = np.minimum(edges, n) - below
    at_edges = area[..., below] + part * spectrum[..., below]
    means: NDArray[np.float64] = np.diff(at_edges, axis=-1) / np.maximum(np.diff(edges), 1e-12)
    return means


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
