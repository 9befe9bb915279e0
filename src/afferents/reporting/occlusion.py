"""Occlusion: how much less likely the true texture is without a part of a model's input.

Zeiler & Fergus, Visualizing and understanding convolutional networks, ECCV 2014. Only the model's
answers count, whatever it is made of, and the loss has a unit: the logarithm of the true texture's
odds, which unlike its probability does not stand still near 1.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from afferents import dims
from afferents.encodings.images import ImageEncoding
from afferents.encodings.samples import Samples
from afferents.evaluation.data import Source
from afferents.markers.places import make_images
from afferents.rig.surface import Drum
from afferents.store.recording import spacing_mm

PART = "part"
"""Dimension of losses over the parts of the global shear."""
PATCH = 3
"""Markers on a side of what is covered at once: one alone is made up for by its neighbours."""
BAND_HZ = 4.0
"""Width of what is taken out of a spectrum at once."""
HARMONICS = np.arange(0, 5.1, 0.25)
"""Middles of the bins that frequencies over a drum's own rate are gathered in."""

Floats = NDArray[np.float32]
Predict = Callable[[Floats], NDArray[np.floating]]
"""A model: log-probabilities (n, n_classes) of inputs."""


def losses(
    predict: Predict,
    inputs: Floats,
    labels: NDArray[np.int64],
    masks: Iterable[NDArray[np.bool_]],
    instead: Floats,
) -> NDArray[np.float64]:
    """Return what the true textures lose in log-odds without each part, (part, n), nats.

    Parameters
    ----------
    inputs, labels
        (n, ...) and (n,).
    masks
        Of each part, of the inputs' last dimensions: True for what is taken away.
    instead
        What stands there then, of the inputs' shape without n, or one that goes with it.

    Returns
    -------
    Positive where the part speaks for the true texture.
    """
    whole = log_odds(predict(inputs), labels)
    found = [
        whole - log_odds(predict(np.where(mask, instead, inputs).astype(np.float32)), labels)
        for mask in masks
    ]
    return np.asarray(found, dtype=np.float64)


def log_odds(logs: NDArray[np.floating], labels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return log p - log (1 - p) of the true textures, (n,), from (n, n_classes) of log p."""
    is_true = np.arange(logs.shape[1]) == labels[:, None]
    others = np.where(is_true, -np.inf, logs)
    return np.asarray(logs[is_true] - logsumexp(others, axis=1), dtype=np.float64)


def patches(shape: tuple[int, int], size: int) -> list[NDArray[np.bool_]]:
    """Return a square patch of a grid round each of its places, (row, column), row by row."""
    row, column = np.indices(shape)
    half = size // 2
    return [
        (abs(row - r) <= half) & (abs(column - c) <= half)
        for r in range(shape[0])
        for c in range(shape[1])
    ]


def neighbourhoods(
    row: NDArray[np.generic], column: NDArray[np.generic], size: int
) -> list[NDArray[np.bool_]]:
    """Return each marker with its nearest, `size` in all, by the places of markers, (marker,)."""
    place = np.stack([row, column], axis=1).astype(np.float64)
    _, near = cKDTree(place).query(place, k=min(size, len(place)))
    return [np.isin(np.arange(len(place)), own) for own in near]


def bands(n: int, width: int) -> list[NDArray[np.bool_]]:
    """Return bands of an axis of n bins, side by side, the last perhaps narrower."""
    at = np.arange(n)
    return [at // width == k for k in range(-(-n // width))]


@dataclass(frozen=True)
class Examples:
    """Samples of textures that a model knows, to be recognised with and without their parts.

    Attributes
    ----------
    source
        What they were made of, and how.
    samples
        As the model takes them.
    textures
        Those that the model knows.
    labels
        Numbers among these, (n,).
    runs
        The images that they are made of: (n, frame, component, row, column); none of vibration.
        Of models that learn from single markers (n, 1, component, marker).
    places
        Rows and columns of the markers in an image, (marker,) each; none where not known.
    """

    source: Source
    samples: Samples
    textures: tuple[str, ...]
    labels: NDArray[np.int64]
    runs: Floats | None = None
    places: tuple[NDArray[Any], NDArray[Any]] | None = None

    @property
    def by_spacing(self) -> bool:
        """Whether textures are named by the spacing of their bumps, mm."""
        return bool(self.samples.attrs.get(dims.NAMED_BY_SPACING, False))


def lose_parts(predict: Predict, examples: Examples) -> dict[str, xr.DataArray]:
    """Return what each texture loses without each part, by the kind of part, nats."""
    samples, runs, labels = examples.samples, examples.runs, examples.labels
    found: dict[str, xr.DataArray] = {}
    channel, encoding = examples.source
    if isinstance(encoding, ImageEncoding) and runs is not None:

        def without(masks: list[NDArray[np.bool_]], instead: Floats) -> NDArray[np.float64]:
            def predict_runs(values: Floats) -> NDArray[np.floating]:
                return predict(encoding.of_runs(values, channel.lookback))

            return losses(predict_runs, runs, labels, masks, instead)

        still = np.zeros(runs.shape[-1], np.float32)
        if channel.parts:  # one is as it is on average
            names = list(channel.parts)
            lost = without(bands(len(names), 1), runs.mean(axis=0))
            found["parts"] = _mean_by_texture(examples, lost, {PART: np.array(names)})
        elif encoding.of_pixels:
            shape = runs.shape[-2], runs.shape[-1]
            lost = without(patches(shape, PATCH), still)
            found["markers"] = _mean_by_texture(examples, lost, _grid(shape))
        elif examples.places is not None:  # a marker and its nearest; pixels of none are 0
            lost = without(neighbourhoods(*examples.places, PATCH**2), still)
            images = make_images(lost.T, *examples.places).astype(np.float64)
            flat = images.reshape(len(images), -1).T
            found["markers"] = _mean_by_texture(examples, flat, _grid(images.shape[1:]))
    if dims.FREQUENCY in samples.dims:
        found |= lose_frequencies(predict, examples)
    if dims.ROW_WAVENUMBER in samples.dims:
        each = patches((samples.shape[-2], samples.shape[-1]), 1)
        lost = losses(predict, samples.values, labels, each, samples.values.mean(axis=0))
        axes = {str(dim): samples[dim].values for dim in samples.dims[-2:]}
        found["waves"] = _mean_by_texture(examples, lost, axes)
    return found


def _grid(shape: tuple[int, ...]) -> dict[str, NDArray[Any]]:
    return {dims.ROW: np.arange(shape[0]), dims.COLUMN: np.arange(shape[1])}


def lose_frequencies(predict: Predict, examples: Examples) -> dict[str, xr.DataArray]:
    """Return the losses over frequency, and over harmonics where textures have a spacing."""
    samples, labels = examples.samples, examples.labels
    values, frequency = samples.values, samples[dims.FREQUENCY].values
    taken = bands(len(frequency), max(1, round(BAND_HZ / float(frequency[1] - frequency[0]))))
    lost = losses(predict, values, labels, taken, values.mean(axis=0))
    middle = np.array([frequency[band].mean() for band in taken])
    found = {"frequencies": _mean_by_texture(examples, lost, {dims.FREQUENCY: middle})}
    bumps = [(examples.by_spacing and spacing_mm(one)) or 0.0 for one in examples.textures]
    per_mm = np.array([Drum().rate_hz(x, 1.0) if x else 0.0 for x in bumps])[labels]
    if (bumpy := per_mm > 0).any():
        harmonic = middle[:, None] / (samples[dims.SPEED].values * per_mm)[bumpy]
        at = np.digitize(harmonic, np.append(HARMONICS - 0.125, HARMONICS[-1] + 0.125)) - 1
        there = np.intersect1d(at, np.arange(len(HARMONICS)))
        means = [lost[:, bumpy][at == k].mean() for k in there]
        found["harmonics"] = xr.DataArray(means, {"harmonic": HARMONICS[there]}, ("harmonic",))
    return found


def _mean_by_texture(
    examples: Examples, lost: NDArray[np.float64], axes: dict[str, NDArray[Any]]
) -> xr.DataArray:
    """Return the mean losses of each texture's samples, over the axes of the parts."""
    there = np.unique(examples.labels).tolist()
    shape = [len(axis) for axis in axes.values()]
    means = [lost[:, examples.labels == k].mean(axis=1).reshape(shape) for k in there]
    textures = [examples.textures[k] for k in there]
    found = np.stack(means), {dims.TEXTURE: textures, **axes}, (dims.TEXTURE, *axes)
    return xr.DataArray(*found, attrs={dims.NAMED_BY_SPACING: examples.by_spacing})
