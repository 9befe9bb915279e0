"""The authors' own trained networks beside ours."""

from typing import Any, NamedTuple

import numpy as np
import torch

from afferents import dims
from afferents.exchange.authors_arrays import AuthorsFolder, Difference, Floats, TestSets
from afferents.models.base import Network
from afferents.models.classifiers import build
from afferents.models.config import Compute, training_config
from afferents.models.keras import load_keras_weights
from afferents.models.loop import predict
from afferents.models.model import Model

MOST = 200
"""Samples of each texture, evenly spread over time, that a network is asked about."""


class Asked(NamedTuple):
    """What one of their networks says.

    Attributes
    ----------
    on_theirs, on_ours
        Share that is named rightly, of their samples and of ours.
    """

    model: str
    speed_mm_s: float
    on_theirs: float | None
    on_ours: float | None

    def describe(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "model": self.model,
            "held_out_speed_mm_s": self.speed_mm_s,
            "accuracy_on_their_samples": self.on_theirs,
            "accuracy_on_our_samples": self.on_ours,
        }


class Answers(NamedTuple):
    """Probabilities (n, texture) that a network gives: of their samples, of ours, and Keras' own.

    None where there are no such samples.
    """

    theirs: Floats | None
    ours: Floats | None
    keras: Floats | None


def ask(
    model: Model,
    speed_mm_s: float,
    folder: AuthorsFolder,
    sets: TestSets,
    theirs: Floats | None,
    ours: Floats | None,
) -> tuple[Asked, Answers] | None:
    """Ask one of the authors' networks; None if it is not there, or there is nothing to ask about.

    Parameters
    ----------
    theirs, ours
        Samples (time, texture, *sample_shape).

    Raises
    ------
    InputError
        If the file is no such network's.
    """
    path = folder.network(model.name, speed_mm_s)
    if path is None or (theirs is None and ours is None):
        return None
    network = build(model.classifier, len(sets.textures), sets.shape(model))
    assert isinstance(network, Network)
    load_keras_weights(network, path)
    keras = sets.outputs(model, speed_mm_s)
    if keras is not None:
        keras = thinned(keras.reshape(-1, len(sets.textures), keras.shape[-1]))
    said = Answers(_answers(network, theirs), _answers(network, ours), keras)
    right = (_share_right(answers, len(sets.textures)) for answers in (said.theirs, said.ours))
    return Asked(model.name, speed_mm_s, *right), said


def thinned(in_turn: Floats) -> Floats:
    """Return at most `MOST` samples of each texture, of (time, texture, ...), as (n, ...)."""
    n = len(in_turn)
    kept = np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))
    return np.asarray(in_turn[kept].reshape(-1, *in_turn.shape[2:]))


def _answers(network: Network, in_turn: Floats | None) -> Floats | None:
    if in_turn is None:
        return None
    values = torch.from_numpy(np.ascontiguousarray(thinned(in_turn)))
    config = training_config("paper", network.recipe, Compute("auto", "float32"))
    return predict(network, values, np.arange(len(values)), 1.0, config)


def _share_right(answers: Floats | None, n_textures: int) -> float | None:
    if answers is None:
        return None
    return float((answers.argmax(axis=1) == np.arange(len(answers)) % n_textures).mean())


# Samples of the paper's models and what their networks say, ours and the authors'.

_KINDS = {
    dims.SA1: ("images of SA-I", dims.PIXELS),
    dims.RA1: ("images of RA-I", "px/frame"),
    dims.RA2: ("spectra", "of the largest"),
}
_OUTPUTS = "probability"


class ModelDifferences:
    """Differences of one model over held-out speeds.

    Attributes
    ----------
    samples
        Of the test sets.
    computed
        Of a network's outputs as Keras and as we compute them, both of the authors' samples.
    outputs
        Of a network's outputs, all computed here: of the authors' samples and of ours.
    networks
        What each network names rightly.
    """

    def __init__(self, model: Model) -> None:
        """Begin with none."""
        self.model = model
        kind, unit = _KINDS[model.channel]
        self.samples = Difference(f"{model.title}: {kind}", unit)
        self.computed = Difference(f"{model.title}: network, by Keras and here", _OUTPUTS)
        self.outputs = Difference(f"{model.title}: network, of our samples", _OUTPUTS)
        self.networks: list[Asked] = []

    def add(self, speed_mm_s: float, folder: AuthorsFolder, sets: TestSets) -> None:
        """Compare what there is of a held-out speed.

        Raises
        ------
        InputError
            If a file is damaged or another's, or a recording too short for the published cut.
        """
        where = f"{speed_mm_s:g} mm/s"
        theirs = sets.theirs(self.model, speed_mm_s)
        if theirs is None and folder.network(self.model.name, speed_mm_s) is None:
            return
        ours = sets.ours(self.model, speed_mm_s, theirs)
        if theirs is not None and ours is not None:
            self.samples.add(ours, theirs, where)
        if (asked := ask(self.model, speed_mm_s, folder, sets, theirs, ours)) is None:
            return
        about, said = asked
        self.networks.append(about)
        if said.theirs is not None and said.keras is not None:
            self.computed.add(said.theirs, said.keras, where)
        if said.theirs is not None and said.ours is not None:
            self.outputs.add(said.ours, said.theirs, where)
