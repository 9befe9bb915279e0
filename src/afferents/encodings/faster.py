"""Tactile images as other speeds would give them: ours, not the paper's.

The paper stretches spectra in frequency (section 2.4.3): slid f times faster, a texture makes the
same vibration f times as fast. It moves the markers so, too. What a marker shows at time t at one
speed it shows at t / f at a speed f times as high, as far as the skin follows alike. Therefore

- SA-I of a single frame is the same, and there is nothing to augment;
- RA-I, which is a change per frame, is f times as large (over steps that are short beside what the
  marker goes through);
- a run of frames is gone through f times as fast, and if it is one of RA-I is f times as large.

The skin does not quite follow alike: it is viscoelastic, and friction depends on speed. Copies are
a guess at other speeds, no recordings of them.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.errors import InputError

Floats = NDArray[np.float32]

RANGES = ((0.5, 1.0), (1.0, 2.0))
"""Of the random factor of each copy. One of each of the paper's two ranges, where it draws three:
images take more memory than spectra."""
_GAP = 0.5
"""In frames: a run that begins so long after the end of another does not go on from it."""


def grows_with_speed(samples: xr.DataArray) -> bool:
    """Tell whether samples are of a response that counts per frame, as RA-I does."""
    return samples.attrs.get(dims.UNITS) == dims.PIXELS_PER_FRAME


def faster_images(
    samples: xr.DataArray, index: NDArray[np.int64], rng: np.random.Generator
) -> tuple[Floats, NDArray[np.int64]]:
    """Return copies of single images as other speeds would give them.

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
        do = "augment RA-I, or runs of images"
        raise InputError("augmentation", "samples that change with the speed", "single images", do)
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
    linear between two frames. Beyond its own end a run goes on in the next of the same recording;
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
    follows = _follows(samples)[index]
    copies = np.empty((len(RANGES) * len(index), *samples.shape[1:]), dtype=np.float32)
    for number, between in enumerate(RANGES):
        factors = rng.uniform(*between, len(index))
        factors = np.where(follows, factors, np.minimum(factors, 1.0))
        for i, (sample, factor) in enumerate(zip(index, factors, strict=True)):
            frames = samples.values[sample : sample + 1 + follows[i]].reshape(
                -1, *samples.shape[2:]
            )
            copy = _at(frames, factor * np.arange(n_frames))
            copies[number * len(index) + i] = factor * copy if grows else copy
    return copies, np.tile(np.arange(len(index)), len(RANGES))


def _follows(samples: xr.DataArray) -> NDArray[np.bool_]:
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


def _at(frames: Floats, where: NDArray[np.float64]) -> Floats:
    """Return frames at places between them, linear between two."""
    below = np.minimum(where.astype(np.int64), len(frames) - 1)
    above = np.minimum(below + 1, len(frames) - 1)
    share = (where - below).astype(np.float32)[:, None, None]
    return np.asarray((1 - share) * frames[below] + share * frames[above])
