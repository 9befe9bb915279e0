"""Train and test every fold of every model family asked for; the numbers of Table 1."""

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

import numpy as np

from afferents import __version__
from afferents.core import dims
from afferents.core.cut import Cut
from afferents.core.families import Encoding, Family
from afferents.core.files import remove_partials
from afferents.core.progress import Mark, Progress
from afferents.core.protocol import Protocol
from afferents.core.recording import natural_order
from afferents.core.responses import Responses
from afferents.core.results import SCHEMA
from afferents.core.samples import Samples
from afferents.encodings import SpectralEncoding
from afferents.evaluation import (
    Fold,
    FoldKey,
    LeaveOneSpeedOut,
    claim_results_folder,
    find_leaks,
    finished,
    finished_keys,
    predictions_table,
    refuse_leaks,
    save_fold,
    summarise,
)
from afferents.models import build
from afferents.pipeline.data import DataSet
from afferents.pipeline.encode import encode_all, supported_families
from afferents.pipeline.learning import learning_set, textures_of
from afferents.training import Epoch, Preset, predict, save_weights, train, training_config


@dataclass(frozen=True)
class Evaluation:
    """What is evaluated and how."""

    data: list[DataSet]
    out: Path
    families: list[Family]
    protocols: list[Protocol]
    preset: Preset
    cut: Cut
    spectral: SpectralEncoding
    seeds: list[int]
    without: Mapping[str, str] = field(default_factory=dict)
    keep_going: bool = False
    options: Sequence[str] = ()
    """The command's further options, for the report to name."""

    @property
    def recordings(self) -> list[Responses]:
        """Responses of all data sets."""
        return [responses for data in self.data for responses in data.responses]

    @property
    def config(self) -> dict[str, Any]:
        """What must agree for folds to stand in one results folder."""
        training = {
            encoding: training_config(self.preset, encoding).model_dump()
            for encoding in get_args(Encoding)
        }
        return {
            "schema": SCHEMA,
            "data": [data.describe() for data in self.data],
            "without": dict(self.without),
            "cut": self.cut,
            "preset": self.preset,
            "spectral": self.spectral.model_dump(),
            "training": training,
        }


@dataclass(frozen=True)
class Job:
    """One training: a family, a protocol, a seed and a fold."""

    family: Family
    protocol: Protocol
    seed: int
    rank: int
    fold: Fold

    @property
    def key(self) -> FoldKey:
        """Name of the job's fold in the results folder."""
        return FoldKey(self.family.name, self.protocol.name, self.seed, self.fold.held_out_mm_s)


def evaluate(evaluation: Evaluation, progress: Progress) -> dict[str, Any]:
    """Run what is not finished yet and return the summary of the results folder.

    Raises
    ------
    InputError
        If the data support none of the families, the folder holds other results, or a
        recording can't be encoded (with `keep_going` it is skipped and the summary says so).
    LeakageError
        If anything of a held-out speed is seen under the nested protocol.
    """
    recordings = evaluation.recordings
    able = supported_families(evaluation.families, recordings)
    for family in evaluation.families:
        if family not in able:
            progress.note(f"{family.title} left out: not every recording has what it learns from")
    claim_results_folder(evaluation.out, evaluation.config)
    remove_partials(evaluation.out)
    skipped: dict[str, str] | None = {} if evaluation.keep_going else None
    for (afferent, encoding), group in itertools.groupby(
        able, key=lambda family: (family.afferent, family.encoding)
    ):
        samples = encode_all(
            recordings, afferent, encoding, evaluation.cut, evaluation.spectral, progress, skipped
        )
        for family in group:
            evaluate_family(evaluation, family, samples, progress)
    return summarise_folder(evaluation, skipped or {})


def evaluate_family(
    evaluation: Evaluation, family: Family, samples: Samples, progress: Progress
) -> None:
    """Train and test one family on all folds, protocols and seeds that are not finished."""
    jobs = [
        Job(family, protocol, seed, rank, fold)
        for protocol in evaluation.protocols
        for seed in evaluation.seeds
        for rank, fold in enumerate(splitter(protocol, family, seed).folds(samples))
    ]
    with progress.task(family.title, len(jobs)) as mark:
        for done, job in enumerate(jobs):
            if not finished(evaluation.out, job.key):
                run_job(evaluation, job, samples, done, mark)
            mark(done + 1)


def splitter(protocol: Protocol, family: Family, seed: int) -> LeaveOneSpeedOut:
    """Return the splitter of a family: published halves of spectra are drawn at random."""
    return LeaveOneSpeedOut(protocol, random_halves=family.encoding == "spectral", seed=seed)


def run_job(evaluation: Evaluation, job: Job, samples: Samples, done: int, mark: Mark) -> None:
    """Train on one fold, test it once, save it."""
    config = training_config(evaluation.preset, job.family.encoding)
    learnt = learning_set(
        samples,
        job.family,
        job.protocol,
        job.fold,
        evaluation.spectral.model_bins,
        config.training_samples,
        np.random.default_rng([job.seed, job.rank]),
    )
    leaks = find_leaks(samples, job.fold, learnt.scaled_on)
    if job.protocol.name == "nested":
        refuse_leaks(leaks, job.fold)
    textures = textures_of(samples)
    model = build(job.family.encoding, len(textures), tuple(learnt.values.shape[1:]), job.seed)

    def show(epoch: Epoch) -> None:
        held_out = f"{job.protocol.name}, {job.fold.held_out_mm_s:g} mm/s held out"
        mark(done + epoch.number / config.max_epochs, f"{held_out}, epoch {epoch.number}")

    trained = train(
        model,
        learnt.values,
        learnt.labels,
        learnt.train,
        learnt.validation,
        learnt.scale,
        config,
        job.seed,
        show,
    )
    probabilities = predict(model, learnt.values, job.fold.test, learnt.scale, config)
    facts = {
        "validation_mm_s": job.fold.validation_mm_s,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(job.fold.test),
        "scale": learnt.scale,
        **trained.facts(),
    }
    table = predictions_table(job.key, samples, job.fold, probabilities, textures)
    save_fold(evaluation.out, job.key, table, facts, leaks, lambda path: save_weights(model, path))


def summarise_folder(evaluation: Evaluation, skipped: Mapping[str, str]) -> dict[str, Any]:
    """Summarise every model, protocol and seed of the folder whose folds are all finished."""
    recordings = [r for r in evaluation.recordings if r.attrs["name"] not in skipped]
    speeds = sorted({float(r.attrs[dims.SPEED]) for r in recordings})
    textures = sorted({str(r.attrs[dims.TEXTURE]) for r in recordings}, key=natural_order)
    keys = finished_keys(evaluation.out)
    whole = Counter((key.model, key.protocol, key.seed) for key in keys)
    about = {
        "afferents": __version__,
        "data": [data.describe() for data in evaluation.data],
        "without": dict(evaluation.without),
        "options": list(evaluation.options),
        "cut": evaluation.cut,
        "preset": evaluation.preset,
        "speeds_mm_s": speeds,
        "chance": 1 / len(textures),
        "skipped": [{"recording": name, "reason": why} for name, why in skipped.items()],
    }
    complete = [k for k in keys if whole[k.model, k.protocol, k.seed] == len(speeds)]
    return summarise(evaluation.out, complete, textures, about)
