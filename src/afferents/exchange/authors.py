"""The largest difference from the authors' own arrays and networks, at each stage of the way."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from afferents.errors import InputError
from afferents.exchange.authors_arrays import (
    AuthorsFolder,
    Difference,
    ResponseDifferences,
    TestSets,
)
from afferents.exchange.authors_networks import MOST, Asked, ModelDifferences
from afferents.files import Place
from afferents.models.model import MODELS, TABLE1
from afferents.progress import Progress
from afferents.reporting.tables import make_table
from afferents.store.zarr_store import open_responses


@dataclass(frozen=True)
class Comparison:
    """What a comparison found.

    Attributes
    ----------
    differences
        In the order of the way: tracks, SA-I, RA-I, samples of each model, outputs of its networks.
    networks
        What the authors' networks name rightly.
    sentences
        Recordings that differ in other ways, and what was not there to be compared.
    """

    differences: tuple[Difference, ...]
    networks: tuple[Asked, ...]
    sentences: tuple[str, ...]

    @property
    def facts(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "differences": [one.describe() for one in self.differences],
            "networks": [one.describe() for one in self.networks],
            "notes": list(self.sentences),
        }

    @property
    def tables(self) -> list[pd.DataFrame]:
        """Return the differences, and what the networks name rightly, if there are any."""
        tables = [_of_stages(self.differences)] if self.differences else []
        return tables + ([_of_networks(self.networks)] if self.networks else [])


def compare_with_authors(store: Path, authors: Path, progress: Progress) -> Comparison:
    """Compare a store with the authors' arrays and networks, as far as both are there.

    Raises
    ------
    InputError
        If they have nothing in common, a file is damaged or another's, or a recording is too short
        for the published cut.
    """
    folder, recordings = AuthorsFolder(authors), open_responses(store)
    responses = ResponseDifferences()
    for recording in progress.track(recordings, "comparing responses", len(recordings)):
        responses.add(recording, folder)
    models = _models(folder, TestSets(recordings, folder), progress)
    stages = [responses.tracks, responses.sa1, responses.ra1]
    stages += [model.samples for model in models]
    stages += [stage for model in models for stage in (model.computed, model.outputs)]
    found = tuple(stage for stage in stages if stage.where)
    networks = tuple(asked for model in models for asked in model.networks)
    if not found and not networks:
        expected = "arrays or networks of recordings and speeds that the store has"
        raise InputError(f"{authors}: expected {expected}, found none")
    missing = "; ".join(stage.stage for stage in stages if not stage.where)
    said = [f"Not there to be compared: {missing}."] if missing else []
    return Comparison(found, networks, (*responses.otherwise, *said))


def _models(folder: AuthorsFolder, sets: TestSets, progress: Progress) -> list[ModelDifferences]:
    models = [ModelDifferences(model) for model in TABLE1.values()]
    for one in models:
        label = f"comparing {one.model.title}"
        for speed_mm_s in progress.track(sets.speeds, label, len(sets.speeds)):
            one.add(speed_mm_s, folder, sets)
    return models


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
             f"{one.n:,}", f"{one.missing:,}")
            for one in differences
        ),
    )  # fmt: skip


def _of_networks(networks: Sequence[Asked]) -> pd.DataFrame:
    return make_table(
        "The authors' networks",
        f"Percent recognised, of at most {MOST} samples of each texture of the test set.",
        ("Model", "Held-out speed, mm/s", "Their samples", "Our samples"),
        (
            (
                MODELS[one.model].title,
                f"{one.speed_mm_s:g}",
                *map(_percent, (one.on_theirs, one.on_ours)),
            )
            for one in networks
        ),
        n_headers=2,
    )


def _percent(share: float | None) -> str | None:
    return None if share is None else f"{100 * share:.1f}"


def compare(store: Place, authors: Place, quiet: bool = False) -> "Comparison":
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
        `differences` of each stage, what the authors' `networks` name rightly, and `sentences`.

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
    with Progress(quiet) as progress:
        return compare_with_authors(Path(store), Path(authors), progress)
