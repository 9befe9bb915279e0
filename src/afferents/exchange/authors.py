"""The largest difference from the authors' own arrays and networks, at each stage of the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.exchange.authors_arrays import (
    SHAPES,
    Floats,
    TestSets,
    compare_responses,
    network_file,
    require_arrays,
)
from afferents.files import Place
from afferents.models.base import Network
from afferents.models.classifiers import build
from afferents.models.config import Compute, training_config
from afferents.models.keras import load_keras_weights
from afferents.models.loop import predict
from afferents.models.model import MODELS, TABLE1, Model
from afferents.progress import Progress
from afferents.reporting.tables import make_table
from afferents.store.zarr_store import open_responses

MOST = 200
"""Samples of each texture, evenly spread over time, that a network is asked about."""
_KINDS = {
    dims.SA1: ("images of SA-I", dims.PIXELS),
    dims.RA1: ("images of RA-I", dims.PIXELS_PER_FRAME),
    dims.RA2: ("spectra", "of the largest"),
}
_BY_KERAS, _OF_OURS = "network, by Keras and here", "network, of our samples"
"""Outputs of a network: of their samples, as Keras and we compute them; of theirs and of ours, both
computed here."""


@dataclass
class Difference:
    """Differences of one stage, taken together.

    Attributes
    ----------
    stage
        What is compared, such as SA-I.
    unit
        Of the numbers.
    compared, missing
        How many numbers were compared, and how many are missing here (NaN).
    largest, where
        The largest difference, and the recording or held-out speed that has it.
    """

    stage: str
    unit: str
    compared: int = 0
    missing: int = 0
    largest: float = 0.0
    where: str = ""
    _sum: float = 0.0

    def add(
        self, ours: NDArray[np.floating], theirs: NDArray[np.floating], where: str
    ) -> "Difference":
        """Take in two arrays of one shape; return itself."""
        apart = np.abs(ours.astype(np.float64) - theirs)
        known = apart[np.isfinite(apart)]
        self.missing += apart.size - known.size
        self.compared += known.size
        self._sum += float(known.sum())
        largest = float(known.max(initial=0.0))
        if not self.where or largest > self.largest:
            self.largest, self.where = largest, where
        return self

    @property
    def mean(self) -> float:
        """Mean difference."""
        return self._sum / self.compared if self.compared else 0.0

    def describe(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        names = ("stage", "unit", "compared", "missing", "largest", "mean", "where")
        return {name: getattr(self, name) for name in names}


class Answered(NamedTuple):
    """What share of samples one of their networks recognises, of their own and of ours."""

    model: str
    held_out_speed_mm_s: float
    accuracy_on_their_samples: float | None
    accuracy_on_our_samples: float | None


@dataclass(frozen=True)
class Comparison:
    """What a comparison found.

    Attributes
    ----------
    differences
        In the order of the way: tracks, SA-I, RA-I, samples of each model, outputs of its networks.
    networks
        What the authors' networks recognise.
    sentences
        Recordings that differ in other ways, and what was not there to be compared.
    """

    differences: tuple[Difference, ...]
    networks: tuple[Answered, ...]
    sentences: tuple[str, ...]

    @property
    def facts(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "differences": [one.describe() for one in self.differences],
            "networks": [one._asdict() for one in self.networks],
            "notes": list(self.sentences),
        }

    @property
    def tables(self) -> list[pd.DataFrame]:
        """Return the differences, and what the networks recognise, if there are any."""
        tables = [_of_stages(self.differences)] if self.differences else []
        return tables + ([_of_networks(self.networks)] if self.networks else [])


def compare(store: Place, authors: Place, quiet: bool = False) -> Comparison:
    """Say how far a store is from the authors' own arrays and networks, at each stage of the way.

    Parameters
    ----------
    store
        Of the published recordings, extracted; with the tracker ``published`` if the numbers are to
        be the same.
    authors
        Folder that ``scripts/convert_authors_arrays.py`` wrote. Anything may be missing in it.
        Reading networks (Keras' HDF5) needs the extra ``hdf5``.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Comparison
        `differences` of each stage, what the authors' `networks` recognise, and `sentences`.

    Raises
    ------
    InputError
        If the folder holds pickles or nothing to compare, a file is damaged or another's, or a
        recording is too short for the published cut.

    Examples
    --------
    >>> found = compare("published.zarr", "converted")  # doctest: +SKIP
    >>> found.differences[1].stage, found.differences[1].largest  # doctest: +SKIP
    ('SA-I', 1.9e-06)
    """
    folder, recordings = require_arrays(Path(authors)), open_responses(store)
    sets = TestSets(recordings, folder)
    stages = _stages()
    notes: list[str] = []
    networks: list[Answered] = []
    with Progress(quiet) as progress:
        for recording in progress.track(recordings, "comparing responses", len(recordings)):
            name = str(recording.attrs["name"])
            for stage, ours, theirs in compare_responses(recording, folder, notes):
                stages[stage].add(ours, theirs, name)
        for model in TABLE1.values():
            label = f"comparing {model.title}"
            for speed_mm_s in progress.track(sets.speeds, label, len(sets.speeds)):
                answered = _compare_model(model, speed_mm_s, sets, stages)
                networks += [] if answered is None else [answered]
    found = tuple(stage for stage in stages.values() if stage.where)
    if not found and not networks:
        expected = "arrays or networks of recordings and speeds that the store has"
        raise InputError(f"{authors}: expected {expected}, found none")
    if missing := "; ".join(stage.stage for stage in stages.values() if not stage.where):
        notes.append(f"Not there to be compared: {missing}.")
    return Comparison(found, tuple(networks), tuple(notes))


def _stages() -> dict[str, Difference]:
    """Return all stages by name, in the order of the way."""
    units = {"tracks: rest positions": dims.PIXELS, "SA-I": dims.PIXELS}
    units["RA-I"] = dims.PIXELS_PER_FRAME
    units |= {_samples_of(model): _KINDS[model.channel][1] for model in TABLE1.values()}
    for model in TABLE1.values():
        units |= {f"{model.title}: {what}": "probability" for what in (_BY_KERAS, _OF_OURS)}
    return {stage: Difference(stage, unit) for stage, unit in units.items()}


def _samples_of(model: Model) -> str:
    return f"{model.title}: {_KINDS[model.channel][0]}"


def _compare_model(
    model: Model, speed_mm_s: float, sets: TestSets, stages: dict[str, Difference]
) -> Answered | None:
    """Compare samples and outputs at a held-out speed; None where there is no network to ask."""
    where, path = f"{speed_mm_s:g} mm/s", network_file(sets.folder, model.name, speed_mm_s)
    theirs = sets.theirs(model, speed_mm_s)
    if theirs is None and path is None:
        return None
    ours = sets.ours(model, speed_mm_s, theirs)
    if theirs is not None and ours is not None:
        stages[_samples_of(model)].add(ours, theirs, where)
    if path is None or (theirs is None and ours is None):
        return None
    n_textures = len(sets.textures)
    network = build(model.classifier, n_textures, SHAPES[model.encoding])
    assert isinstance(network, Network)
    load_keras_weights(network, path)
    of_theirs, of_ours = (None if one is None else _ask(network, one) for one in (theirs, ours))
    keras = sets.outputs(model, speed_mm_s)
    if of_theirs is not None and keras is not None:
        stages[f"{model.title}: {_BY_KERAS}"].add(of_theirs, thinned(keras), where)
    if of_theirs is not None and of_ours is not None:
        stages[f"{model.title}: {_OF_OURS}"].add(of_ours, of_theirs, where)
    shares = (
        None
        if answers is None
        else float((answers.argmax(axis=1) == np.arange(len(answers)) % n_textures).mean())
        for answers in (of_theirs, of_ours)
    )
    return Answered(model.name, speed_mm_s, *shares)


def thinned(in_turn: Floats) -> Floats:
    """Return at most `MOST` samples of each texture, of (time, texture, ...), as (n, ...)."""
    n = len(in_turn)
    kept = np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))
    return np.asarray(in_turn[kept].reshape(-1, *in_turn.shape[2:]))


def _ask(network: Network, in_turn: Floats) -> Floats:
    """Return the probabilities (n, texture) that a network gives to some of the samples."""
    values = torch.from_numpy(np.ascontiguousarray(thinned(in_turn)))
    config = training_config("paper", network.recipe, Compute("auto", "float32"))
    return predict(network, values, np.arange(len(values)), 1.0, config)


def _of_stages(differences: Sequence[Difference]) -> pd.DataFrame:
    return make_table(
        "Differences from the authors' arrays and networks",
        "Of single numbers, in the unit of the stage, with the recording or held-out speed of the "
        "largest. Images are those of the test sets. Theirs were windows of vibration drawn at "
        "random: each is compared with ours that is most like it. Networks are theirs, asked "
        f"about at most {MOST} samples of each texture.",
        ("Stage", "Unit", "Largest", "Mean", "Where", "Compared", "Lost here"),
        (
            (one.stage, one.unit, f"{one.largest:.3g}", f"{one.mean:.3g}", one.where,
             f"{one.compared:,}", f"{one.missing:,}")
            for one in differences
        ),
    )  # fmt: skip


def _of_networks(networks: Sequence[Answered]) -> pd.DataFrame:
    return make_table(
        "The authors' networks",
        f"Percent recognised, of at most {MOST} samples of each texture of the test set.",
        ("Model", "Held-out speed, mm/s", "Their samples", "Our samples"),
        (
            (MODELS[model].title, f"{speed_mm_s:g}", _percent(theirs), _percent(ours))
            for model, speed_mm_s, theirs, ours in networks
        ),
        n_headers=2,
    )


def _percent(share: float | None) -> str | None:
    return None if share is None else f"{100 * share:.1f}"
