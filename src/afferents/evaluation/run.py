"""Run an evaluation: train and test every fold that is not finished, then sum up the folder.

Trainings run side by side in processes of this machine, or on a Dask cluster, whose workers read
the data themselves and are sent JSON.
"""

import itertools
import json
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import chdir, contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
import torch
from joblib import cpu_count

from afferents import dims, files, outputs, parallel
from afferents.encodings.samples import Samples
from afferents.encodings.wavenumbers import unseen_waves
from afferents.errors import AfferentsError, InputError, LeakageError
from afferents.evaluation import controls, data, fold_files, metrics, plan
from afferents.evaluation.data import OpenedData, Source, find_sources
from afferents.evaluation.fold_files import FoldFacts, FoldKey, finished, save_fold
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.plan import Evaluation
from afferents.evaluation.results import CONFIG, SUMMARY, Summary, read_summary
from afferents.folds import splits
from afferents.folds.held_out import Group, key_of
from afferents.folds.protocol import PROTOCOLS, Indices
from afferents.models import fitting, folder, hardware, learner
from afferents.models.fitted import Fitting, Part, predict_alone
from afferents.models.model import Model, list_names
from afferents.progress import Progress
from afferents.store import responses as store
from afferents.store.responses import Responses
from afferents.store.trimming import require_within


def run_evaluation(
    evaluation: Evaluation, progress: Progress, quick_controls: bool = True
) -> Summary:
    """Run what is not finished yet and return the summary of the results folder.

    Parameters
    ----------
    quick_controls
        Whether `controls.ask_controls` is called as well, for the report.

    Raises
    ------
    InputError
        If the data don't support the models, the folder holds other results, or a recording
        can't be encoded (with `keep_going` it is skipped by all models, and the summary states
        it).
    LeakageError
        If anything of a held-out speed is seen under the nested protocol.
    """
    options, out, everything = evaluation.options, evaluation.out, evaluation.recordings
    may_leave_out = "all" in list_names(options.models)
    able = plan.require_support(evaluation.models, everything, may_leave_out)
    left_out = [model.name for model in evaluation.models if model not in able]
    if left_out:
        progress.note(f"left out, since these data don't support them: {', '.join(left_out)}")
    plan.require_options(able, evaluation.encodings, everything, options)
    options.by.groups_of(everything)
    _note_limits(evaluation, able, everything, progress)
    skipped = _find_skipped(evaluation, able, everything)
    recordings = [r for r in everything if r.attrs["name"] not in skipped]
    groups = _choose_groups(evaluation, recordings)
    plan.require_trainable(able, recordings, evaluation.encodings, options.cut)
    tested = options.ablation.tested(data.join_recordings(evaluation.opened))
    evaluation = replace(evaluation, skipped=skipped, tested=tested)
    config, about = evaluation.config, evaluation.about(recordings)
    about |= {"left_out": left_out, "recommended": plan.recommended(everything)}
    fold_files.check_results_folder(out, config)
    with outputs.writing_alone(out, "evaluate"):
        fold_files.check_results_folder(out, config)
        files.remove_partials(out)
        fold_files.keep_own_models(out, able, evaluation.encodings)
        keys = [
            FoldKey.of(model.name, protocol.name, seed, group, options.by)
            for model in able
            for protocol in options.protocols
            for seed in options.seeds
            for group in groups
        ]
        all_finished = all(finished(out, key) for key in keys)
        workers = options.workers or cpu_count()
        if options.cluster is not None and not all_finished:
            workers = parallel.workers_at(options.cluster)
        fold_files.write_plan(out, keys, workers, options.cluster)
        known = all_finished and (out / SUMMARY).is_file() and read_summary(out).controls
        # On this machine those models run side by side that share samples, which are all in memory;
        # a cluster's workers read what they need, so that none waits for the last of a group.
        together = [able]
        if options.cluster is None:
            by_source = itertools.groupby(able, lambda m: find_sources(m, evaluation.encodings))
            together = [list(models) for _, models in by_source]
        for models in together:
            its = [key for key in keys if key.model in {model.name for model in models}]
            _run_group(evaluation, models, its, recordings, progress)
        files.write_json(out / CONFIG, config)
        if known:
            about["controls"] = known
        elif quick_controls and options.control == "none":
            about |= controls.ask_controls(evaluation, recordings, progress)
        return _summarise_folder(evaluation, groups, recordings, about)


def _note_limits(
    evaluation: Evaluation,
    models: Sequence[Model],
    recordings: Sequence[Responses],
    progress: Progress,
) -> None:
    """Note which of the textures the fingertip can't show to models that rely on waves."""
    bumps = store.textures_of(recordings) if store.named_by_spacing(recordings) else []
    sources = [s for model in models for s in find_sources(model, evaluation.encodings)]
    if any(dims.ROW_WAVENUMBER in source.encoding.sample_dims for source in sources):
        sensors = [origin.data_set.config().get("sensor") for origin in evaluation.data]
        for pitch in dict.fromkeys(sensor.get("pitch_mm") for sensor in sensors if sensor):
            progress.note(unseen_waves(pitch, bumps))


def _find_skipped(
    evaluation: Evaluation, models: Sequence[Model], recordings: Sequence[Responses]
) -> dict[str, str]:
    """Return the recordings that no model uses, and why, before anything is trained.

    A recording that one model can't use is used by none: all numbers are of the same ones. With
    `keep_going` all is read once, so that what is damaged is found now, and not after days.

    Raises
    ------
    InputError
        If there is one and `keep_going` is not set.
    """
    options, how = evaluation.options, evaluation.encodings
    skipped = {name: why for one in evaluation.opened for name, why in one.failed.items()}
    sources = dict.fromkeys(source for model in models for source in find_sources(model, how))
    for responses, (channel, encoding) in itertools.product(recordings, sources):
        try:
            require_within(responses, channel.made_of, options.steady)
            encoding.kept(responses, channel.made_of, channel.lookback, options.cut)
            if encoding.of_vibration or options.keep_going:
                store.read_whole(responses, channel.made_of)
            if options.keep_going and dims.DETECTED in responses:
                store.read_whole(responses, dims.DETECTED)
        except AfferentsError as error:
            if not options.keep_going:
                raise
            skipped[responses.attrs["name"]] = str(error)
    return skipped


def _choose_groups(evaluation: Evaluation, recordings: Sequence[Responses]) -> list[Group]:
    """Return the groups, by default speeds, that are held out in turn.

    Raises
    ------
    InputError
        If there are too few textures or groups, a texture is not left when a group is out, or
        groups were requested that there are none of.
    """
    textures, split = store.textures_of(recordings), evaluation.options.by
    if len(textures) < 2:
        found = ", ".join(textures) or "none"
        raise InputError(f"the data: expected at least 2 textures to recognise, found {found}")
    groups = split.groups_of(recordings)
    nested = any(p.validation == "training-speed" for p in evaluation.options.protocols)
    solved = not all(fitting.learns_in_a_loop(model) for model in evaluation.models)
    needed = 3 if nested or solved else 2
    if len(groups) < needed:
        do = (
            f"record more {split.many}, or use --protocol published with models of Table 1"
            if len(groups) == 2
            else f"with one {split.title} no model can be tested at another; record more"
        )
        raise InputError(
            f"the data: expected at least {needed} {split.many}, to hold one out"
            f"{' under nested' if nested else ''}, found {len(groups)} "
            f"({', '.join(map(key_of, groups))}{split.unit}); {do}"
        )
    for texture in textures:
        its = [r for r in recordings if str(r.attrs[dims.TEXTURE]) == texture]
        its_groups = split.groups_of(its)
        for group in its_groups:
            if split.sharing(np.array(its_groups), group).all():
                raise InputError(
                    f"the data: expected each texture in at least 2 {split.many}, so that it is "
                    f"learnt from when one is held out, found {texture} in {split.printed(group)} "
                    "alone; record it again, leave it out with --textures, or hold out something "
                    "else"
                )
    wanted = evaluation.options.held_out
    split.require(wanted, groups, "--held-out")
    return [group for group in groups if group in wanted or not wanted]


def _run_group(
    evaluation: Evaluation,
    models: Sequence[Model],
    keys: Sequence[FoldKey],
    recordings: Sequence[Responses],
    progress: Progress,
) -> None:
    """Train and test the folds of some models where not finished yet, here or on a cluster.

    Here all of the models learn from the same samples.
    """
    missing = [key for key in keys if not finished(evaluation.out, key)]
    # What has failed comes last: nothing waits for it to fail again.
    missing.sort(key=lambda key: key.mark(evaluation.out, "failed").is_file())
    done = len(keys) - len(missing)
    # A folder that any process finds, wherever it was started.
    evaluation = replace(evaluation, out=evaluation.out.resolve(), opened=())
    cluster, workers = evaluation.options.cluster, evaluation.options.workers
    with progress.task(", ".join(model.title for model in models), len(keys)) as mark:
        mark(done)
        finishing: Iterable[FoldKey] = ()
        if missing and cluster is not None:
            sent = evaluation.to_json()
            far = [(sent, key.model_dump_json(by_alias=True)) for key in missing]
            found = parallel.on_cluster(run_far_job, far, cluster, evaluation.out)
            finishing = map(FoldKey.model_validate_json, found)
        elif missing:
            sources = find_sources(models[0], evaluation.encodings)
            samples = encode_samples(evaluation, sources, recordings, progress, workers)
            _open_again(evaluation)  # hours may have gone by: samples of changed data are refused
            jobs = ((evaluation, key, samples) for key in missing)
            finishing = parallel.side_by_side(run_job, jobs, workers, progress.note)
        for key in finishing:
            done += 1
            mark(done, f"{key.protocol}, {key.split.printed(key.held_out)} held out")


def run_job(evaluation: Evaluation, key: FoldKey, samples: Sequence[Samples]) -> FoldKey:
    """Train on one fold, test it once, save it; return its name.

    A process that died before it could report it may have finished it.
    """
    out = evaluation.out
    if finished(out, key):
        return key
    config = evaluation.config
    with _naming(key), fold_files.mark_running(out, key):
        # A training that was cut off is continued under this configuration alone.
        checkpoint = learner.Checkpoint(
            key.mark(out, "checkpoint"), fold_files.config_digest(config)
        )
        facts, predictions, weights = train_and_test(evaluation, key, samples, checkpoint)
        fold_files.claim_results_folder(out, config)
        save_fold(out, facts, predictions, weights)
        checkpoint.path.unlink(missing_ok=True)
    return key


def run_far_job(evaluation_json: str, key_json: str) -> str:
    """Do the same on another machine, which reads the data itself; all in JSON."""
    evaluation, key = _reopen(evaluation_json), FoldKey.model_validate_json(key_json)
    with _naming(key):
        sources = find_sources(evaluation.model(key.model), evaluation.encodings)
        samples = _encode_again(evaluation, sources)
    run_job(evaluation, key, samples)
    return key_json


@lru_cache(maxsize=1)
def _reopen(sent: str) -> Evaluation:
    """Return what `Evaluation.to_json` wrote, once for all jobs that it is sent with.

    Raises
    ------
    InputError
        If the data or a model's file are not those that the evaluation began with, or this machine
        does not see the folder that the command was started in.
    """
    found = json.loads(sent)
    parallel.require_seen([found["folder"]])
    with chdir(found["folder"]):  # from which names of files count
        options, quiet = EvaluationOptions(**found["options"]), Progress(quiet=True)
        opened = plan.open_evaluation(found["data"], found["out"], options, quiet)
    tested = frozenset(found["tested"])
    evaluation = replace(opened, skipped=found["skipped"], tested=tested, opened=())
    if fold_files.config_digest(evaluation.config) != found["digest"]:
        raise _changed_data(", ".join(found["data"]))
    return evaluation


@lru_cache(maxsize=1)
def _encode_again(evaluation: Evaluation, sources: tuple[Source, ...]) -> tuple[Samples, ...]:
    """Read and encode the data in this process, once for jobs of one kind in a row."""
    everything = replace(evaluation, opened=_open_again(evaluation)).recordings
    recordings = [r for r in everything if r.attrs["name"] not in evaluation.skipped]
    return encode_samples(evaluation, sources, recordings, Progress(quiet=True))


def _open_again(evaluation: Evaluation) -> list[OpenedData]:
    """Open the data anew; refuse them if they are not those that the evaluation began with."""
    sources = [origin.data_set for origin in evaluation.data]
    opened = data.open_data(sources, evaluation.options.without, keep_going=True)
    for found, expected in zip(opened, evaluation.data, strict=True):
        if found.origin.fingerprint != expected.fingerprint:
            raise _changed_data(expected.source)
    return opened


def _changed_data(source: str) -> InputError:
    return InputError(
        f"{source}: expected the data that the evaluation began with, found changed data; bring "
        "them back, or evaluate them into another folder"
    )


def encode_samples(
    evaluation: Evaluation,
    sources: Sequence[Source],
    recordings: Sequence[Responses],
    progress: Progress,
    workers: int | None = 1,
) -> tuple[Samples, ...]:
    """Return the samples that models of these sources learn from, and are tested on.

    They come in two variants where what is tested is corrupted otherwise than what is learnt from.
    """
    options, found = evaluation.options, []
    how = options.cut, progress, options.ablation
    for source in sources:
        samples = data.encode_all(recordings, source, *how, options.disturb_training, workers)
        if options.disturb != options.disturb_training:
            tested = data.encode_all(recordings, source, *how, options.disturb, workers)
            samples = splits.join_variants(samples, tested)
        found.append(options.by.labelled(samples, recordings))
        if (n := len(samples) - len(found[-1])) and not options.by.whole:
            progress.note(
                f"{n} of {len(samples)} samples reach from {options.by.one} into another and are "
                "left out"
            )
    return tuple(found)


def train_and_test(
    evaluation: Evaluation,
    key: FoldKey,
    samples: Sequence[Samples],
    checkpoint: learner.Checkpoint | None = None,
) -> tuple[FoldFacts, pd.DataFrame, bytes]:
    """Train on one fold and test it once.

    Parameters
    ----------
    samples
        Of each of the model's sources.
    checkpoint
        Where a long training writes its checkpoints.

    Returns
    -------
    Facts of the fold, its leaks with them; one row a test sample; the content of a weights file.
    """
    torch.set_num_threads(1)
    parallel.keep_freed_memory()
    start, options = time.perf_counter(), evaluation.options
    model, protocol = evaluation.model(key.model), PROTOCOLS[key.protocol]
    ranks, parts = [], []
    sources = find_sources(model, evaluation.encodings)
    for of_source, (_, encoding) in zip(samples, sources, strict=True):
        # Published halves of spectra are drawn at random.
        splitter = splits.LeaveOneGroupOut(protocol, encoding.of_vibration, key.seed, options.by)
        rank, fold = splits.make_fold(
            splitter, of_source, key.held_out, options.ablation, evaluation.tested
        )
        ranks.append(rank)
        parts.append(Part(of_source, fold, encoding))
    leaks: dict[int, splits.Leaks] = {}
    # Nothing but networks is picked by validation samples; `nested` lets others learn from them.
    unused = not (fitting.learns_in_a_loop(model) or protocol.solved_models_learn_from_validation)

    def check(number: int, learnt_from: Indices) -> None:
        part = parts[number]
        used = replace(part.fold, validation=part.fold.validation[:0]) if unused else part.fold
        leaks[number] = splits.find_leaks(part.samples, used, learnt_from)
        if protocol.refuses_leaks:
            splits.refuse_leaks(leaks[number], part.fold)

    for number, part in enumerate(parts):
        check(number, part.fold.train[:0])
    lead, searched = parts[0], options.penalty == "searched"
    config = options.training(fitting.choose_recipe(model, lead.encoding))
    fitted = fitting.fit(
        Fitting(model, parts, protocol, config, key.seed, ranks[0], check, checkpoint, searched)
    )
    seconds = round(time.perf_counter() - start, 3)
    alone = predict_alone(model.name, fitted, lead.fold.test) if protocol.refuses_leaks else {}
    facts = {"seconds": seconds, "job_seconds": seconds} | fitted.facts | alone
    facts |= key.content() | {"leaks": leaks[0].describe(key.split)}
    predictions = fold_files.predictions_table(
        key, lead.samples, lead.fold, fitted.probabilities, fitted.speed_mm_s
    )
    return FoldFacts.model_validate(facts), predictions, folder.dump_weights(fitted.classifier)


@contextmanager
def _naming(key: FoldKey) -> Iterator[None]:
    """Name in an error which training it was."""
    try:
        yield
    except LeakageError:
        raise
    except AfferentsError as error:
        raise AfferentsError(f"{key}: {error}") from error
    except (MemoryError, RuntimeError) as error:
        if not hardware.is_out_of_memory(error):
            raise
        raise AfferentsError(
            f"{key}: out of memory; what is finished is kept: run the same command again with "
            "fewer --workers, or where there is more"
        ) from error


def _summarise_folder(
    evaluation: Evaluation,
    groups: Sequence[Group],
    recordings: Sequence[Responses],
    about: Mapping[str, Any],
) -> Summary:
    """Summarise every model, protocol and seed of the folder whose folds are all finished.

    Parameters
    ----------
    groups
        That are held out in turn; folds of others are left aside.
    about
        From `Evaluation.about`, and what else is known.
    """
    out = evaluation.out
    keys = [key for key in fold_files.finished_keys(out) if key.held_out in groups]
    n_folds = Counter((key.model, key.protocol, key.seed) for key in keys)
    complete = [k for k in keys if n_folds[k.model, k.protocol, k.seed] == len(groups)]
    held_out = {evaluation.options.by.groups: list(groups)}
    everything = {**about, **held_out, **fold_files.describe_own_models(out)}
    return metrics.summarise(out, complete, store.textures_of(recordings), everything)
