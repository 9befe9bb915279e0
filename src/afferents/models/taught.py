"""A classifier of what was taught in single touches: solved at once, it names sample by sample.

It is `sa-wave-vector` as `train` solves it, from all touches. What is unknown is found otherwise
than by trained models: by the nearest sample that was taught, since few textures have few scores.
On tuning sessions of the simulated rig (seeds 100 to 103, four drums taught at one speed, two
unknown) the area under the ROC curve at other speeds was 0.89 so, 0.81 by scores.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from afferents import dims
from afferents.encodings.base import Encoding
from afferents.encodings.samples import Samples, find_labels, list_textures
from afferents.errors import InputError
from afferents.folds import held_out, protocol, splits
from afferents.models import calibrate, fit_solved, learning_set, model
from afferents.models.deployed import KNOWN, Deployed

Floats = NDArray[np.float32]

MODEL = model.MODELS["sa-wave-vector"]
_MOST = 2000
"""Samples that others are compared with: a comparison takes less than a millisecond."""
_LEAST_SD = 0.1
"""Of a value that hardly varies; as of `models.solved.Ridge`."""


class Nearest:
    """How far a sample lies from the nearest one that was taught.

    Values count by how much they distinguish textures: they are multiplied by their standard
    deviation over all samples and divided by their variance within textures.

    Parameters
    ----------
    values, labels
        Samples (n, ...) and the numbers of their textures, (n,).
    """

    def __init__(self, values: Floats, labels: NDArray[np.int64]) -> None:
        """Set the limit: `KNOWN` of the samples have another one that is nearer."""
        kept = learning_set.thin(np.arange(len(values)), _MOST)
        flat, labels = values.reshape(len(values), -1)[kept].astype(np.float64), labels[kept]
        within = np.mean([flat[labels == c].var(axis=0) for c in np.unique(labels)], axis=0)
        sd = np.maximum(flat.std(axis=0), _LEAST_SD)
        self._scale = sd / np.maximum(within, _LEAST_SD**2)
        self._taught = flat * self._scale
        apart = cdist(self._taught, self._taught)
        np.fill_diagonal(apart, np.inf)
        self._limit = float(np.quantile(apart.min(axis=1), KNOWN))

    def novelty(self, sample: Floats) -> float:
        """Return the novelty of a sample; above 1 it is unknown."""
        off = cdist(sample.reshape(1, -1) * self._scale, self._taught)
        return float(off.min() / self._limit)


@dataclass(frozen=True, eq=False)
class Taught:
    """What recognises textures that were taught, if any.

    Attributes
    ----------
    textures
        In the order of the probabilities.
    evidence_per_s, most_sure
        As of `models.card.Card`.
    tested
        How it was tested, in a sentence; empty where that takes more.
    """

    textures: tuple[str, ...] = ()
    evidence_per_s: float = 1.0
    most_sure: float = 1.0
    tested: str = ""
    deployed: Deployed | None = None
    nearest: Nearest | None = None

    @torch.no_grad()
    def ask(self, sample: Floats) -> tuple[Floats, float]:
        """Return the probabilities of the textures (n_textures,), and the novelty, of a sample."""
        assert self.nearest is not None  # needed only where a texture is known
        novelty = self.nearest.novelty(sample)
        if self.deployed is None:  # there is one texture alone
            return np.ones(1, np.float32), novelty
        scores = self.deployed.network(torch.from_numpy(sample[np.newaxis]))
        found: Floats = (scores / self.deployed.temperature).softmax(1)[0].numpy()
        return found, novelty


def solve_taught(samples: Samples, encoding: Encoding) -> Taught:
    """Learn textures from samples of single touches.

    Probabilities are calibrated by a speed that was left out, where every texture was taught at
    another one, else by the second half of each touch; then all is learnt from.

    Parameters
    ----------
    samples
        Of all touches, each a recording, in the order of time; at least two.
    encoding
        That made them.
    """
    torch.set_num_threads(1)
    textures, labels = tuple(list_textures(samples)), find_labels(samples)
    nearest = Nearest(samples.values, labels)
    if len(textures) == 1:
        return Taught(textures, most_sure=calibrate.most_that_can_show(1), nearest=nearest)
    fold = _choose_fold(samples)
    tried = _solve(samples, encoding, fold)
    calibrated = calibrate.calibrate_model(*tried, fold, samples)
    everything = np.arange(len(samples))
    deployed, _ = _solve(samples, encoding, replace(fold, train=everything))
    deployed.temperature = tried[0].temperature
    how = "by the first half of each touch, {} of the second half are"
    if fold.held_out:
        how = f"by the other speeds, {{}} of the samples at {fold.held_out:g} mm/s are"
    tested = how.format(f"{calibrated.validation_accuracy:.0%}")
    return Taught(
        textures,
        calibrated.evidence_per_s,
        calibrated.most_sure,
        f"{tested[0].upper()}{tested[1:]} recognised.",
        deployed,
        nearest,
    )


def _choose_fold(samples: Samples) -> protocol.Fold:
    """Return the fold that calibrates: a whole speed, or 0 for the second half of each touch."""
    if np.isfinite(samples[dims.SPEED].values).all():
        try:
            return splits.hold_out_the_middle(samples)
        except InputError:  # it needs every texture at two speeds
            pass
    recording = samples[dims.RECORDING].values
    n = np.arange(len(samples))
    of = {name: n[recording == name] for name in np.unique(recording)}
    first = np.concatenate([its[: (len(its) + 1) // 2] for its in of.values()])
    second = np.setdiff1d(n, first)
    return protocol.Fold(0.0, 0.0, np.sort(first), second, np.empty(0, np.int64), held_out.SPEED)


def _solve(
    samples: Samples, encoding: Encoding, fold: protocol.Fold
) -> tuple[Deployed, learning_set.LearningSet]:
    """Return the classifier that has learnt from a fold's training samples, and these."""
    ridge, labels = fit_solved.new_solved(MODEL, samples, encoding), find_labels(samples)
    fit_solved.learn(ridge, samples, labels, fold.train, 0, ridge.penalties[0])
    values = torch.from_numpy(samples.values), torch.from_numpy(labels)
    learnt = learning_set.LearningSet(*values, fold.train, fold.validation)
    return Deployed(ridge, len(list_textures(samples)), learnt.scale).eval(), learnt
