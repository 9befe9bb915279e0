"""Train and test every fold of every model family asked for; the numbers of Table 1."""

import itertools
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from joblib import cpu_count
from torch import nn

from afferents import __version__
from afferents.core import dims
from afferents.core.cut import Cut
from afferents.core.errors import AfferentsError
from afferents.core.families import Encoding, Family
from afferents.core.files import remove_partials
from afferents.core.progress import Progress
from afferents.core.protocol import Protocol
from afferents.core.recording import natural_order
from afferents.core.responses import Responses
from afferents.core.results import SCHEMA
from afferents.core.samples import Samples, textures_of
from afferents.encodings import SpectralEncoding
from afferents.evaluation import (
    Fold,
    FoldKey,
    LeaveOneSpeedOut,
    at_work,
    check_results_folder,
    claim_results_folder,
    find_leaks,
    finished,
    finished_keys,
    plan,
    predictions_table,
    refuse_leaks,
    save_fold,
    summarise,
)
from afferents.models import CnnLstm, build
from afferents.pipeline.ablation import Ablation
from afferents.pipeline.data import DataSet
from afferents.pipeline.encode import encode_all, kept_part, require_support
from afferents.pipeline.learning import LearningSet, learning_set
from afferents.pipeline.parallel import side_by_side
from afferents.training import (
    Preset,
    TrainedModel,
    TrainingConfig,
    computed_with,
    predict,
    save_weights,
    train,
    train_in_stages,
    training_config,
)


@dataclass(frozen=True)
class Evaluation:
    """What is evaluated and how.

    Attributes
    ----------
    may_leave_out
        Whether families that the data don't support are left out instead of refused.
    keep_going
        Whether recordings that can't be encoded are skipped instead of refused.
    ablation
        What of the data is used.
    options
        The command's further options, for the report to name.
    skipped
        Recordings that no family uses, and why; found out when the evaluation begins.
    workers
        Processes side by side; None for one a core.
    """

    data: list[DataSet]
    out: Path
    families: list[Family]
    protocols: list[Protocol]
    preset: Preset
    cut: Cut
    spectral: SpectralEncoding
    seeds: list[int]
    without: Mapping[str, str] = field(default_factory=dict)
    may_leave_out: bool = False
    keep_going: bool = False
    ablation: Ablation = field(default_factory=Ablation)
    options: Sequence[str] = ()
    skipped: Mapping[str, str] = field(default_factory=dict)
    workers: int | None = None

    @property
    def config(self) -> dict[str, Any]:
        """Return what must agree for folds to stand in one results folder."""
        training = {
            encoding: training_config(self.preset, encoding).model_dump()
            for encoding in get_args(Encoding)
        }
        return {
            "schema": SCHEMA,
            "data": [data.describe() for data in self.data],
            "without": dict(self.without),
            "skipped": sorted(self.skipped),
            "cut": self.cut,
            "preset": self.preset,
            "spectral": self.spectral.model_dump(),
            "training": training,
            **({"ablation": ablation} if (ablation := self.ablation.describe()) else {}),
        }


@dataclass(frozen=True)
class Recipe:
    """What all jobs share, light enough to be sent along with each."""

    out: Path
    config: dict[str, Any]
    preset: Preset
    spectral: SpectralEncoding


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
        If the data don't support the families, the folder holds other results, or a recording
        can't be encoded (with `keep_going` it is skipped by all families, and the summary says
        so).
    LeakageError
        If anything of a held-out speed is seen under the nested protocol.
    """
    everything = evaluation.ablation.recordings(
        [responses for data in evaluation.data for responses in data.responses]
    )
    able = require_support(evaluation.families, everything, evaluation.may_leave_out)
    left_out = [family.name for family in evaluation.families if family not in able]
    if left_out:
        progress.note(f"left out, since these data don't support them: {', '.join(left_out)}")
    skipped = skipped_recordings(evaluation, able, everything)
    recordings = [r for r in everything if r.attrs["name"] not in skipped]
    evaluation = replace(evaluation, skipped=skipped)
    check_results_folder(evaluation.out, evaluation.config)
    remove_partials(evaluation.out)
    plan(evaluation.out, planned(evaluation, able, recordings), evaluation.workers or cpu_count())
    for (afferent, encoding), group in itertools.groupby(
        able, key=lambda family: (family.afferent, family.encoding)
    ):
        arguments = (afferent, encoding, evaluation.cut, evaluation.spectral, progress)
        samples = evaluation.ablation.images(encode_all(recordings, *arguments))
        evaluate_group(evaluation, list(group), samples, progress)
    return summarise_folder(evaluation, recordings, left_out)


def planned(
    evaluation: Evaluation, families: Sequence[Family], recordings: Sequence[Responses]
) -> list[FoldKey]:
    """Name the folds of all families, protocols, seeds and speeds."""
    speeds = sorted({float(r.attrs[dims.SPEED]) for r in recordings})
    return [
        FoldKey(family.name, protocol.name, seed, speed)
        for family in families
        for protocol in evaluation.protocols
        for seed in evaluation.seeds
        for speed in speeds
    ]


def skipped_recordings(
    evaluation: Evaluation, families: Sequence[Family], recordings: Sequence[Responses]
) -> dict[str, str]:
    """Return the recordings that no family uses, and why, before anything is trained.

    A recording that one family can't use is used by none: all numbers are of the same ones.

    Raises
    ------
    InputError
        If there is one and `keep_going` is not set.
    """
    skipped = {name: why for data in evaluation.data for name, why in data.failed.items()}
    for responses, family in itertools.product(recordings, families):
        try:
            kept_part(
                responses, family.afferent, family.encoding, evaluation.cut, evaluation.spectral
            )
        except AfferentsError as error:
            if not evaluation.keep_going:
                raise
            skipped[responses.attrs["name"]] = str(error)
    return skipped


def evaluate_group(
    evaluation: Evaluation, families: Sequence[Family], samples: Samples, progress: Progress
) -> None:
    """Train and test families that learn from the same samples, where not finished yet."""
    all_jobs = [job for family in families for job in jobs(evaluation, family, samples)]
    missing = [job for job in all_jobs if not finished(evaluation.out, job.key)]
    recipe = Recipe(evaluation.out, evaluation.config, evaluation.preset, evaluation.spectral)
    done = len(all_jobs) - len(missing)
    title = ", ".join(family.title for family in families)
    with progress.task(title, len(all_jobs)) as mark:
        mark(done)
        work = ((recipe, job, samples) for job in missing)
        for key in side_by_side(run_job, work, evaluation.workers):
            done += 1
            mark(done, f"{key.protocol}, {key.held_out_mm_s:g} mm/s held out")


def jobs(evaluation: Evaluation, family: Family, samples: Samples) -> Iterator[Job]:
    """Yield a family's jobs: protocol by protocol, seed by seed, held-out speeds ascending."""
    for protocol, seed in itertools.product(evaluation.protocols, evaluation.seeds):
        for rank, fold in enumerate(splitter(protocol, family, seed).folds(samples)):
            fold = evaluation.ablation.fold(fold, samples)
            yield Job(family, protocol, seed, rank, fold)


def splitter(protocol: Protocol, family: Family, seed: int) -> LeaveOneSpeedOut:
    """Return the splitter of a family: published halves of spectra are drawn at random."""
    return LeaveOneSpeedOut(protocol, random_halves=family.encoding == "spectral", seed=seed)


def run_job(recipe: Recipe, job: Job, samples: Samples) -> FoldKey:
    """Train on one fold, test it once, save it; return its name."""
    with at_work(recipe.out, job.key):
        train_and_test(recipe, job, samples)
    return job.key


def train_and_test(recipe: Recipe, job: Job, samples: Samples) -> None:
    """Do the work of a job."""
    start = time.perf_counter()
    config = training_config(recipe.preset, job.family.encoding)
    learnt = learning_set(
        samples,
        job.family,
        job.protocol,
        job.fold,
        recipe.spectral.model_bins,
        config,
        np.random.default_rng([job.seed, job.rank]),
    )
    leaks = find_leaks(samples, job.fold, learnt.scaled_on)
    if job.protocol.name == "nested":
        refuse_leaks(leaks, job.fold)
    torch.set_num_threads(1)
    textures = textures_of(samples)
    model = build(job.family.encoding, len(textures), tuple(learnt.values.shape[1:]), job.seed)
    trained = fit(model, learnt, config, job.seed)
    probabilities = predict(model, learnt.values, job.fold.test, learnt.scale, config)
    facts = {
        "validation_mm_s": job.fold.validation_mm_s,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(job.fold.test),
        "scale": learnt.scale,
        **trained.facts(),
        **computed_with(config),
    }
    facts["job_seconds"] = round(time.perf_counter() - start, 3)
    table = predictions_table(job.key, samples, job.fold, probabilities, textures)
    claim_results_folder(recipe.out, recipe.config)
    save_fold(recipe.out, job.key, table, facts, leaks, lambda path: save_weights(model, path))


def fit(model: nn.Module, learnt: LearningSet, config: TrainingConfig, seed: int) -> TrainedModel:
    """Train a network on a fold, in stages where the recipe says so."""
    arrays = (learnt.values, learnt.labels, learnt.train, learnt.validation)
    if config.image_epochs and isinstance(model, CnnLstm):
        return train_in_stages(model, *arrays, config, seed)
    return train(model, *arrays, learnt.scale, config, seed)


def summarise_folder(
    evaluation: Evaluation,
    recordings: Sequence[Responses],
    left_out: Sequence[str],
) -> dict[str, Any]:
    """Summarise every model, protocol and seed of the folder whose folds are all finished."""
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
        "skipped": [{"recording": n, "reason": why} for n, why in evaluation.skipped.items()],
        "left_out": list(left_out),
    }
    complete = [k for k in keys if whole[k.model, k.protocol, k.seed] == len(speeds)]
    return summarise(evaluation.out, complete, textures, about)
