"""Late fusion: the probabilities of several models of one touch, joined.

The log-probabilities of the parts are weighed; `models.fit_solved` learns the weights on a fold.
"""

from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax
from torch import nn

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.models import base, calibrate

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_LOG_WEIGHTS = (-4.0, 4.0)


class LateFusion(base.Classifier):
    """The models of the parts, and how much each counts.

    Parameters
    ----------
    parts
        By the name of their model, learnt already.
    weights
        How often each one's log-probabilities count.
    """

    name = "late-fusion"
    deployable = False

    def __init__(self, parts: dict[str, base.Classifier], weights: list[float]) -> None:
        """Take the parts."""
        super().__init__()
        self.parts = nn.ModuleDict(parts)
        self.register_buffer("weights", torch.tensor(weights))

    @classmethod
    def built_for(cls, task: base.Task) -> Self:
        """Return one without parts."""
        return cls({}, [])


def best_weights(parts: list[Floats], labels: Indices) -> Floats:
    """Return the weights, above 0, under which the sum of log-probabilities loses least.

    Parameters
    ----------
    parts
        Of every part (n, n_classes), of samples not learnt from; what is missing is 0.
    labels
        Their textures, (n,).
    """
    found = minimize(
        lambda log_weights: calibrate.cross_entropy(join(parts, np.exp(log_weights)), labels),
        np.zeros(len(parts)),
        bounds=[_LOG_WEIGHTS] * len(parts),
        method="L-BFGS-B",
    )
    return np.asarray(np.exp(found.x))


def join(parts: list[Floats], weights: Floats) -> Floats:
    """Return the log-probabilities (n, n_classes) that several parts together give."""
    total = np.sum([w * part for w, part in zip(weights, parts, strict=True)], axis=0)
    return np.asarray(log_softmax(total, axis=1))


def mean_within(
    lead: Samples, windows: Indices, other: Samples, index: Indices, values: Floats
) -> Floats:
    """Return the mean value of the samples that end within each window.

    Parameters
    ----------
    lead, windows
        Samples whose extents are the windows, and which of them are meant, (n,).
    other, index, values
        Samples of another kind, which of them have values, (m,), and these values, (m, k).

    Returns
    -------
    Shape (n, k); 0 where no sample of the other kind ends within a window.
    """
    found = np.zeros((len(windows), values.shape[1]))
    recording, stop_s = _name_touches(other)[index], other[dims.STOP].values[index]
    of_window = _name_touches(lead)[windows]
    for name in np.unique(of_window):
        mine = np.flatnonzero(of_window == name)
        theirs = np.flatnonzero(recording == name)
        order = theirs[np.argsort(stop_s[theirs], kind="stable")]
        sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values[order], axis=0)])
        edges = (lead[which].values[windows[mine]] for which in (dims.START, dims.STOP))
        first, stop = (np.searchsorted(stop_s[order], edge, side="right") for edge in edges)
        n = (stop - first)[:, None]
        found[mine] = np.where(n > 0, (sums[stop] - sums[first]) / np.maximum(n, 1), 0.0)
    return found


def _name_touches(samples: Samples) -> NDArray[np.str_]:
    """Return each sample's recording, with its variant and part if it has several."""
    named = samples[dims.RECORDING].values.astype(np.str_)
    for mark, name in (("#", dims.VARIANT), ("@", dims.GROUP)):
        if name in samples.coords:
            named = np.char.add(named, np.char.add(mark, samples[name].values.astype(np.str_)))
    return named
