"""One training of an evaluation: on one fold, for one model, protocol and seed."""

import json
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from torch import nn

from afferents.core.cut import Cut
from afferents.core.errors import AfferentsError, InputError, LeakageError
from afferents.core.families import FAMILIES, Family
from afferents.core.progress import Progress
from afferents.core.protocol import PROTOCOLS
from afferents.core.responses import Responses
from afferents.core.samples import Samples, textures_of
from afferents.encodings import Encodings
from afferents.evaluation import (
    PLAN,
    Fold,
    FoldKey,
    Leaks,
    LeaveOneSpeedOut,
    at_work,
    claim_results_folder,
    digest_of,
    find_leaks,
    finished,
    predictions_table,
    refuse_leaks,
    save_fold,
)
from afferents.models import CnnLstm, build
from afferents.pipeline.ablation import Ablation
from afferents.pipeline.data import DataSet, open_data, recordings_in
from afferents.pipeline.encode import Source, encode_all, sources_of
from afferents.pipeline.learning import LearningSet, learning_set
from afferents.pipeline.parallel import keep_freed_memory
from afferents.pipeline.solve import solve
from afferents.training import (
    Compute,
    Preset,
    PutAside,
    TrainedModel,
    TrainingConfig,
    computed_with,
    is_out_of_memory,
    predict,
    train,
    train_in_stages,
    training_config,
    weights_of,
)


@dataclass(frozen=True)
class Recipe:
    """What all jobs share, light enough to be sent along with each.

    Attributes
    ----------
    out
        The results folder.
    config_json
        Its configuration; says which data, by fingerprint, and which recordings are skipped.
    sources, without
        Where the data are, for processes that read them themselves.
    tested
        Recordings that alone are tested, and never learnt from; none for all alike.
    """

    out: Path
    config_json: str
    sources: tuple[str, ...]
    without: tuple[tuple[str, str], ...]
    cut: Cut
    preset: Preset
    compute: Compute
    encodings: Encodings
    ablation: Ablation
    tested: frozenset[str] = frozenset()

    @property
    def config(self) -> dict[str, Any]:
        """The configuration of the results folder."""
        return dict(json.loads(self.config_json))

    def training(self, family: Family) -> TrainingConfig:
        """Return how a family is trained."""
        return training_config(self.preset, family.encoding, self.compute)


@dataclass(frozen=True)
class Outcome:
    """What a job leaves: one row a test sample, facts, leaks, and the content of a weights file."""

    key: FoldKey
    table: pd.DataFrame
    facts: dict[str, Any]
    leaks: Leaks
    weights: bytes


def run_job(recipe: Recipe, key: FoldKey, samples: Sequence[Samples]) -> FoldKey:
    """Train on one fold, test it once, save it; return its name.

    It may have been finished by a process that died before it could say so.
    """
    if finished(recipe.out, key):
        return key
    with _naming(key), at_work(recipe.out, key):
        keep(recipe, train_and_test(recipe, key, samples, aside_of(recipe, key)))
    return key


def run_far_job(recipe: Recipe, key: FoldKey) -> Outcome:
    """Do the same on another machine, which reads the data itself and sends the outcome back.

    Where it sees the results folder, the training is marked and put aside in it as ever.
    """
    seen = (recipe.out / PLAN).is_file()
    with _naming(key), at_work(recipe.out, key) if seen else nullcontext():
        samples = samples_of(recipe, sources_of(FAMILIES[key.model], recipe.encodings))
        return train_and_test(recipe, key, samples, aside_of(recipe, key) if seen else None)


def aside_of(recipe: Recipe, key: FoldKey) -> PutAside:
    """Return where a training waits that was cut off, to be gone on with by this recipe alone."""
    return PutAside(key.aside(recipe.out), digest_of(recipe.config))


def keep(recipe: Recipe, outcome: Outcome) -> None:
    """Write an outcome to the results folder, whole or not at all; nothing of it waits any more."""
    claim_results_folder(recipe.out, recipe.config)
    save_fold(
        recipe.out,
        outcome.key,
        outcome.table,
        outcome.facts,
        outcome.leaks,
        outcome.weights,
    )
    outcome.key.aside(recipe.out).unlink(missing_ok=True)


def train_and_test(
    recipe: Recipe, key: FoldKey, samples: Sequence[Samples], aside: PutAside | None = None
) -> Outcome:
    """Train on one fold and test it once.

    Parameters
    ----------
    samples
        Of each of the family's sources.
    aside
        Where a long training is put aside now and then.
    """
    torch.set_num_threads(1)
    family = FAMILIES[key.model]
    if family.learner == "network":
        return _network_outcome(recipe, key, samples[0], aside)
    folds = [fold_of(recipe, key, part)[1] for part in samples]
    start = time.perf_counter()
    nested = key.protocol == "nested"
    solved = solve(family, samples, folds, recipe.encodings, key.seed, nested)
    leaks = find_leaks(samples[0], folds[0], solved.learnt_from[0])
    for part, fold, learnt_from in zip(samples, folds, solved.learnt_from, strict=True):
        if nested:
            refuse_leaks(find_leaks(part, fold, learnt_from), fold)
    seconds = round(time.perf_counter() - start, 3)
    facts = solved.facts | {"seconds": seconds, "job_seconds": seconds}
    table = predictions_table(
        key, samples[0], folds[0], solved.probabilities, textures_of(samples[0]), solved.speed_mm_s
    )
    return Outcome(key, table, facts, leaks, weights_of(solved.model))


def _network_outcome(
    recipe: Recipe, key: FoldKey, samples: Samples, aside: PutAside | None
) -> Outcome:
    """Train a network on one fold and test it once."""
    start = time.perf_counter()
    family, protocol = FAMILIES[key.model], PROTOCOLS[key.protocol]
    config = recipe.training(family)
    rank, fold = fold_of(recipe, key, samples)
    rng = np.random.default_rng([key.seed, rank])
    encoding = recipe.encodings.of(family.encoding)
    learnt = learning_set(samples, encoding, family.augmented, protocol, fold, config, rng)
    leaks = find_leaks(samples, fold, learnt.scaled_on)
    if protocol.name == "nested":
        refuse_leaks(leaks, fold)
    textures = textures_of(samples)
    model = build(family.encoding, len(textures), tuple(learnt.values.shape[1:]), key.seed)
    begun = time.perf_counter()
    trained = fit(model, learnt, config, key.seed, aside)
    earlier_s = max(0.0, trained.seconds - (time.perf_counter() - begun))  # before it was stopped
    probabilities = predict(model, learnt.values, fold.test, learnt.scale, config)
    facts = {
        "validation_mm_s": fold.validation_mm_s,
        "n_train": len(learnt.train),
        "n_validation": len(learnt.validation),
        "n_test": len(fold.test),
        "scale": learnt.scale,
        **trained.facts(),
        **computed_with(config),
        "job_seconds": round(time.perf_counter() - start + earlier_s, 3),
    }
    table = predictions_table(key, samples, fold, probabilities, textures)
    return Outcome(key, table, facts, leaks, weights_of(model))


@contextmanager
def _naming(key: FoldKey) -> Iterator[None]:
    """Say in an error which training it was."""
    try:
        yield
    except LeakageError:
        raise
    except AfferentsError as error:
        raise AfferentsError(f"{key}: {error}") from error
    except (MemoryError, RuntimeError) as error:
        if not is_out_of_memory(error):
            raise
        raise AfferentsError(
            f"{key}: out of memory; what is finished is kept: run the same command again with "
            "fewer --workers, or where there is more"
        ) from error


def fold_of(recipe: Recipe, key: FoldKey, samples: Samples) -> tuple[int, Fold]:
    """Return the fold that a key names, and its rank among its protocol's.

    Published halves of spectra are drawn at random.
    """
    at_random = recipe.encodings.of(FAMILIES[key.model].encoding).of_vibration
    splitter = LeaveOneSpeedOut(PROTOCOLS[key.protocol], random_halves=at_random, seed=key.seed)
    rank, fold = splitter.fold(samples, key.held_out_mm_s)
    return rank, recipe.ablation.fold(fold, samples, recipe.tested)


def fit(
    model: nn.Module,
    learnt: LearningSet,
    config: TrainingConfig,
    seed: int,
    aside: PutAside | None = None,
) -> TrainedModel:
    """Train a network on a fold, in stages where the recipe says so."""
    keep_freed_memory()
    arrays = (learnt.values, learnt.labels, learnt.train, learnt.validation)
    if config.image_epochs and isinstance(model, CnnLstm):
        return train_in_stages(model, *arrays, config, seed)
    return train(model, *arrays, learnt.scale, config, seed, aside=aside)


def encoded(
    recipe: Recipe,
    sources: Sequence[Source],
    recordings: Sequence[Responses],
    progress: Progress,
) -> tuple[Samples, ...]:
    """Return the samples that families of these sources learn from."""
    every = (encode_all(recordings, source, recipe.cut, progress) for source in sources)
    return tuple(recipe.ablation.images(samples) for samples in every)


@lru_cache(maxsize=1)
def samples_of(recipe: Recipe, sources: tuple[Source, ...]) -> tuple[Samples, ...]:
    """Read and encode the data in this process, once for jobs of one kind in a row.

    Raises
    ------
    InputError
        As `opened_again`.
    """
    everything = recipe.ablation.recordings(recordings_in(opened_again(recipe)))
    skipped = set(recipe.config["skipped"])
    recordings = [r for r in everything if r.attrs["name"] not in skipped]
    return encoded(recipe, sources, recordings, Progress(quiet=True))


def opened_again(recipe: Recipe) -> list[DataSet]:
    """Open the data anew.

    Raises
    ------
    InputError
        If they are not those that the evaluation began with.
    """
    data = open_data(list(recipe.sources), dict(recipe.without), keep_going=True)
    for found, expected in zip(data, recipe.config["data"], strict=True):
        if found.fingerprint != expected["fingerprint"]:
            raise InputError(
                found.source,
                "the data that the evaluation began with",
                "changed data",
                "bring them back, or evaluate them into another folder",
            )
    return data
