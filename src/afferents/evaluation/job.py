"""One training of an evaluation: on one fold, for one model, protocol and seed."""

import json
import time
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from afferents.encodings.samples import Samples, list_textures
from afferents.errors import AfferentsError, InputError, LeakageError
from afferents.evaluation.data import OpenedData, open_data
from afferents.evaluation.encode import Source, encode_all, sources_of
from afferents.evaluation.evaluate import open_evaluation
from afferents.evaluation.fold_files import (
    FoldKey,
    claim_results_folder,
    digest_of,
    finished,
    predictions_table,
    save_fold,
)
from afferents.evaluation.job_status import at_work
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Recipe
from afferents.folds.corruption import fold_of_variants, in_variants
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import Leaks, LeaveOneGroupOut, find_leaks, refuse_leaks
from afferents.models.checkpoint import Checkpoint
from afferents.models.fitted import Fitting, Part, predict_alone
from afferents.models.fitting import choose_recipe, fit, learns_in_a_loop
from afferents.models.folder import dump_weights
from afferents.models.hardware import is_out_of_memory
from afferents.parallel import keep_freed_memory, require_seen
from afferents.progress import Progress
from afferents.store.responses import Responses

Indices = NDArray[np.int64]


class Outcome(NamedTuple):
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
        # A training that was cut off is gone on with by this recipe alone.
        checkpoint = Checkpoint(key.mark(recipe.out, "checkpoint"), digest_of(recipe.config))
        outcome = train_and_test(recipe, key, samples, checkpoint)
        claim_results_folder(recipe.out, recipe.config)
        save_fold(recipe.out, *outcome)
        checkpoint.path.unlink(missing_ok=True)
    return key


def run_far_job(recipe_json: str, key_json: str) -> str:
    """Do the same on another machine, which reads the data itself; all in JSON."""
    recipe, key = recipe_from(recipe_json), FoldKey.model_validate_json(key_json)
    with _naming(key):
        samples = samples_of(recipe, sources_of(recipe.model(key.model), recipe.encodings))
    run_job(recipe, key, samples)
    return key_json


@lru_cache(maxsize=1)
def recipe_from(sent: str) -> Recipe:
    """Return what `Recipe.to_json` wrote, once for all jobs that it is sent with.

    Raises
    ------
    InputError
        If the data or a model's file are not those that the evaluation began with, or this machine
        does not see the folder that the command was started in.
    """
    found = json.loads(sent)
    require_seen([found["folder"]])
    with chdir(found["folder"]):  # from which names of files count
        options, quiet = EvaluationOptions(**found["options"]), Progress(quiet=True)
        made = open_evaluation(found["data"], found["out"], options, quiet).recipe
    recipe = replace(made, skipped=found["skipped"], tested=frozenset(found["tested"]))
    if digest_of(recipe.config) != found["digest"]:
        raise changed_data(", ".join(found["data"]))
    return recipe


def train_and_test(
    recipe: Recipe, key: FoldKey, samples: Sequence[Samples], checkpoint: Checkpoint | None = None
) -> Outcome:
    """Train on one fold and test it once.

    Parameters
    ----------
    samples
        Of each of the model's sources.
    checkpoint
        Where a long training writes its checkpoints.
    """
    torch.set_num_threads(1)
    keep_freed_memory()
    start = time.perf_counter()
    model, protocol = recipe.model(key.model), PROTOCOLS[key.protocol]
    ranks, parts = [], []
    for of_source, (_, encoding) in zip(samples, sources_of(model, recipe.encodings), strict=True):
        # Published halves of spectra are drawn at random.
        splitter = LeaveOneGroupOut(protocol, encoding.of_vibration, key.seed, recipe.split)
        rank, fold = fold_of_variants(
            splitter, of_source, key.held_out, recipe.options.ablation, recipe.tested
        )
        ranks.append(rank)
        parts.append(Part(of_source, fold, encoding))
    leaks: dict[int, Leaks] = {}
    # Nothing but networks is picked by validation samples; `nested` lets others learn from them.
    picked = learns_in_a_loop(model)
    unused = not (picked or protocol.solved_models_learn_from_validation)

    def check(number: int, learnt_from: Indices) -> None:
        part = parts[number]
        used = replace(part.fold, validation=part.fold.validation[:0]) if unused else part.fold
        leaks[number] = find_leaks(part.samples, used, learnt_from)
        if protocol.refuses_leaks:
            refuse_leaks(leaks[number], part.fold)

    for number, part in enumerate(parts):
        check(number, part.fold.train[:0])
    config = recipe.options.training(choose_recipe(model, parts[0].encoding))
    searched = recipe.options.penalty == "searched"
    fitted = fit(
        Fitting(model, parts, protocol, config, key.seed, ranks[0], check, checkpoint, searched)
    )
    seconds = round(time.perf_counter() - start, 3)
    lead = parts[0]
    alone = predict_alone(model.name, fitted, lead.fold.test) if protocol.refuses_leaks else {}
    table = predictions_table(
        key, lead.samples, lead.fold, fitted.probabilities, list_textures(lead.samples),
        fitted.speed_mm_s,
    )  # fmt: skip
    facts = {"seconds": seconds, "job_seconds": seconds} | fitted.facts | alone
    return Outcome(key, table, facts, leaks[0], dump_weights(fitted.classifier))


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


def encoded(
    recipe: Recipe,
    sources: Sequence[Source],
    recordings: Sequence[Responses],
    progress: Progress,
    workers: int | None = 1,
) -> tuple[Samples, ...]:
    """Return the samples that models of these sources learn from, and are tested on.

    They come in two variants where what is tested is corrupted otherwise than what is learnt from.
    """
    options, found = recipe.options, []
    how = options.cut, progress, options.ablation
    for source in sources:
        samples = encode_all(recordings, source, *how, options.disturb_training, workers)
        if options.disturb != options.disturb_training:
            tested = encode_all(recordings, source, *how, options.disturb, workers)
            samples = in_variants(samples, tested)
        found.append(recipe.split.labelled(samples, recordings))
        if (n := len(samples) - len(found[-1])) and not recipe.split.whole:
            progress.note(
                f"{n} of {len(samples)} samples reach from {recipe.split.one} into another and are "
                "left out"
            )
    return tuple(found)


@lru_cache(maxsize=1)
def samples_of(recipe: Recipe, sources: tuple[Source, ...]) -> tuple[Samples, ...]:
    """Read and encode the data in this process, once for jobs of one kind in a row.

    Raises
    ------
    InputError
        As `opened_again`.
    """
    everything = recipe.recordings(opened_again(recipe))
    recordings = [r for r in everything if r.attrs["name"] not in recipe.skipped]
    return encoded(recipe, sources, recordings, Progress(quiet=True))


def opened_again(recipe: Recipe) -> list[OpenedData]:
    """Open the data anew.

    Raises
    ------
    InputError
        If they are not those that the evaluation began with.
    """
    sources = [origin.data_set for origin in recipe.data]
    data = open_data(sources, recipe.options.without, keep_going=True)
    for found, expected in zip(data, recipe.data, strict=True):
        if found.origin.fingerprint != expected.fingerprint:
            raise changed_data(expected.source)
    return data


def changed_data(source: str) -> InputError:
    """Return the error that says that data were changed under an evaluation."""
    return InputError(
        f"{source}: expected the data that the evaluation began with, found changed data; bring "
        "them back, or evaluate them into another folder"
    )
