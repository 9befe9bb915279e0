"""Train and test every fold of every model asked for; the numbers of Table 1."""

import itertools
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import cpu_count

from afferents import dims
from afferents.encodings.settings import Encodings
from afferents.encodings.wavenumbers import unseen_waves
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.choice import require_options, require_trainable
from afferents.evaluation.controls import ask_controls
from afferents.evaluation.data import recordings_in
from afferents.evaluation.encode import kept_part, recommended, require_support, sources_of
from afferents.evaluation.fold_files import FoldKey, check_results_folder, finished, finished_keys
from afferents.evaluation.job import encoded, opened_again, run_far_job, run_job
from afferents.evaluation.job_status import has_failed, plan
from afferents.evaluation.recipe import Evaluation, describe_custom_models, keep_own_models
from afferents.evaluation.results import CONFIG, SUMMARY, read_summary
from afferents.evaluation.schemas import Accuracies, Summary
from afferents.evaluation.summary import summarise
from afferents.files import remove_partials, write_json
from afferents.folds.held_out import Group, Split, key_of
from afferents.models.fitting import learns_in_a_loop
from afferents.models.model import Model
from afferents.outputs import writing_alone
from afferents.parallel import on_cluster, side_by_side, workers_at
from afferents.progress import Progress
from afferents.store.responses import Responses, named_by_spacing, read_whole, textures_of
from afferents.store.trimming import require_within


def evaluate(evaluation: Evaluation, progress: Progress, quick_controls: bool = True) -> Summary:
    """Run what is not finished yet and return the summary of the results folder.

    Parameters
    ----------
    quick_controls
        Whether `ask_controls` is asked as well, for the report.

    Raises
    ------
    InputError
        If the data don't support the models, the folder holds other results, or a recording
        can't be encoded (with `keep_going` it is skipped by all models, and the summary says
        so).
    LeakageError
        If anything of a held-out speed is seen under the nested protocol.
    """
    recipe, options, everything = evaluation.recipe, evaluation.options, evaluation.recordings
    able = require_support(recipe.models, everything, options.may_leave_out)
    left_out = [model.name for model in recipe.models if model not in able]
    if left_out:
        progress.note(f"left out, since these data don't support them: {', '.join(left_out)}")
    require_options(able, recipe.encodings, everything, options)
    recipe.split.groups_of(everything)
    if options.ablation.markers != 1:
        require_images(able, recipe.encodings)
    bumps = textures_of(everything) if named_by_spacing(everything) else []
    _note_limits(evaluation, able, bumps, progress)
    skipped = skipped_recordings(evaluation, able, everything)
    recordings = [r for r in everything if r.attrs["name"] not in skipped]
    _require_enough(evaluation, recordings)
    require_trainable(able, recordings, recipe.encodings, options.cut)
    tested = options.ablation.tested(recordings_in(evaluation.data))
    recipe = replace(recipe, skipped=skipped, tested=tested)
    evaluation = replace(evaluation, recipe=recipe)
    about = evaluation.about(recordings)
    about |= {"left_out": left_out, "recommended": recommended(everything)}
    check_results_folder(recipe.out, recipe.config)
    with writing_alone(recipe.out, "evaluate"):
        check_results_folder(recipe.out, recipe.config)
        remove_partials(recipe.out)
        keep_own_models(recipe.out, able, recipe.encodings)
        jobs = planned(evaluation, able, recordings)
        plan(recipe.out, jobs, _workers(evaluation, jobs), options.cluster)
        known = _known_controls(recipe.out, jobs)
        for group in _groups(evaluation, able):
            evaluate_group(evaluation, group, recordings, progress)
        write_json(recipe.out / CONFIG, recipe.config)
        if known:
            about["controls"] = known
        elif quick_controls and options.control == "none":
            about |= ask_controls(recipe, recordings, progress)
        return summarise_folder(evaluation, recordings, about)


def _known_controls(results: Path, jobs: Sequence[FoldKey]) -> dict[str, Accuracies]:
    """Return the controls of a folder in which nothing is left to do; else nothing."""
    there = (results / SUMMARY).is_file() and all(finished(results, key) for key in jobs)
    return read_summary(results).controls if there else {}


def require_images(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse models whose samples hide where each marker is, as waves do: none can be left out."""
    for model in models:
        for encoding in (source.encoding for source in sources_of(model, encodings)):
            if not encoding.of_vibration and not {dims.ROW, dims.MARKER} & {*encoding.sample_dims}:
                found = f"{model.name}, which learns from their {encoding.name}"
                raise InputError(
                    f"--markers: expected models of tactile images or of vibration, found {found}"
                )


def _note_limits(
    evaluation: Evaluation, models: Sequence[Model], bumps: Sequence[str], progress: Progress
) -> None:
    """Say what the fingertip keeps from models that rely on waves."""
    sources = [s for model in models for s in sources_of(model, evaluation.recipe.encodings)]
    if any(dims.ROW_WAVENUMBER in source.encoding.sample_dims for source in sources):
        sensors = [data.origin.data_set.config().get("sensor") for data in evaluation.data]
        for pitch in dict.fromkeys(sensor.get("pitch_mm") for sensor in sensors if sensor):
            progress.note(unseen_waves(pitch, bumps))


def _groups(evaluation: Evaluation, models: Sequence[Model]) -> list[list[Model]]:
    """Return models whose trainings run side by side.

    On this machine those that share samples, which are all in memory; a cluster's workers read
    what they need, so it is given everything at once, and none waits for the last of a group.
    """
    if evaluation.options.cluster is not None:
        return [list(models)]
    by_source = itertools.groupby(models, lambda f: sources_of(f, evaluation.recipe.encodings))
    return [list(group) for _, group in by_source]


def _workers(evaluation: Evaluation, jobs: Sequence[FoldKey]) -> int:
    """Return how many trainings there will be side by side; a cluster with work to do is asked."""
    idle = all(finished(evaluation.recipe.out, key) for key in jobs)
    if evaluation.options.cluster is not None and not idle:
        return workers_at(evaluation.options.cluster)
    return evaluation.options.workers or cpu_count()


def _require_enough(evaluation: Evaluation, recordings: Sequence[Responses]) -> None:
    textures = textures_of(recordings)
    if len(textures) < 2:
        found = ", ".join(textures) or "none"
        raise InputError(f"the data: expected at least 2 textures to tell apart, found {found}")
    split = evaluation.recipe.split
    groups = split.groups_of(recordings)
    nested = any(p.validation == "training-speed" for p in evaluation.options.protocols)
    solved = not all(learns_in_a_loop(model) for model in evaluation.recipe.models)
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
    _require_shared_textures(split, recordings)


def _require_shared_textures(split: Split, recordings: Sequence[Responses]) -> None:
    """Refuse a texture of which nothing would be left to learn from where one group is held out."""
    for texture in textures_of(recordings):
        its = [r for r in recordings if str(r.attrs[dims.TEXTURE]) == texture]
        groups = split.groups_of(its)
        for group in groups:
            if split.sharing(np.array(groups), group).all():
                raise InputError(
                    f"the data: expected each texture in at least 2 {split.many}, so that it is "
                    f"learnt from when one is held out, found {texture} in {split.printed(group)} "
                    "alone; record it again, leave it out with --textures, or hold out something "
                    "else"
                )


def planned(
    evaluation: Evaluation, models: Sequence[Model], recordings: Sequence[Responses]
) -> list[FoldKey]:
    """Name the folds of all models, protocols, seeds and groups to be held out."""
    groups, split = held_out_groups(evaluation, recordings), evaluation.recipe.split
    return [
        FoldKey.of(model.name, protocol.name, seed, group, split)
        for model in models
        for protocol in evaluation.options.protocols
        for seed in evaluation.options.seeds
        for group in groups
    ]


def held_out_groups(evaluation: Evaluation, recordings: Sequence[Responses]) -> list[Group]:
    """Return the groups, by default speeds, that are held out in turn.

    Raises
    ------
    InputError
        If one is asked for that no recording is of.
    """
    split, wanted = evaluation.recipe.split, evaluation.options.held_out
    there = split.groups_of(recordings)
    split.require(wanted, there, "--held-out")
    return [group for group in there if group in wanted or not wanted]


def skipped_recordings(
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
    skipped = {name: why for data in evaluation.data for name, why in data.failed.items()}
    encodings = evaluation.recipe.encodings
    sources = dict.fromkeys(source for model in models for source in sources_of(model, encodings))
    for responses, source in itertools.product(recordings, sources):
        try:
            require_within(responses, source.channel.made_of, evaluation.options.steady)
            kept_part(responses, source, evaluation.options.cut)
            if source.encoding.of_vibration or evaluation.options.keep_going:
                read_whole(responses, source.channel.made_of)
            if evaluation.options.keep_going and dims.DETECTED in responses:
                read_whole(responses, dims.DETECTED)
        except AfferentsError as error:
            if not evaluation.options.keep_going:
                raise
            skipped[responses.attrs["name"]] = str(error)
    return skipped


def evaluate_group(
    evaluation: Evaluation,
    models: Sequence[Model],
    recordings: Sequence[Responses],
    progress: Progress,
) -> None:
    """Train and test some models where not finished yet."""
    keys = planned(evaluation, models, recordings)
    missing = [key for key in keys if not finished(evaluation.recipe.out, key)]
    # What has failed comes last: nothing waits for it to fail again.
    missing.sort(key=lambda key: has_failed(evaluation.recipe.out, key))
    done = len(keys) - len(missing)
    title = ", ".join(model.title for model in models)
    outcomes = run_jobs(evaluation, models[0], missing, recordings, progress)
    with progress.task(title, len(keys)) as mark:
        mark(done)
        for key in outcomes:
            done += 1
            mark(done, f"{key.protocol}, {key.split.printed(key.held_out)} held out")


def run_jobs(
    evaluation: Evaluation,
    model: Model,
    keys: Sequence[FoldKey],
    recordings: Sequence[Responses],
    progress: Progress,
) -> Iterator[FoldKey]:
    """Run jobs here, where all learn from the same samples, or on a cluster; yield the finished.

    Parameters
    ----------
    model
        Any whose samples they are.
    """
    if not keys:
        return
    # A folder that any process finds, wherever it was started.
    recipe = replace(evaluation.recipe, out=evaluation.recipe.out.resolve())
    if evaluation.options.cluster is not None:
        sent = recipe.to_json()
        far = [(sent, key.model_dump_json(by_alias=True)) for key in keys]
        done = on_cluster(run_far_job, far, evaluation.options.cluster, recipe.out)
        yield from map(FoldKey.model_validate_json, done)
        return
    sources, workers = sources_of(model, recipe.encodings), evaluation.options.workers
    samples = encoded(recipe, sources, recordings, progress, workers)
    opened_again(recipe)  # hours may have gone by: samples of changed data are refused
    jobs = ((recipe, key, samples) for key in keys)
    yield from side_by_side(run_job, jobs, workers, progress.note)


def summarise_folder(
    evaluation: Evaluation, recordings: Sequence[Responses], about: Mapping[str, Any]
) -> Summary:
    """Summarise every model, protocol and seed of the folder whose folds are all finished.

    Folds of other groups than those to be held out are not looked at.

    Parameters
    ----------
    about
        From `Evaluation.about`, and what else is known.
    """
    recipe, groups = evaluation.recipe, held_out_groups(evaluation, recordings)
    textures = textures_of(recordings)
    keys = [key for key in finished_keys(recipe.out) if key.held_out in groups]
    whole = Counter((key.model, key.protocol, key.seed) for key in keys)
    complete = [k for k in keys if whole[k.model, k.protocol, k.seed] == len(groups)]
    held_out = {recipe.split.groups: groups}
    everything = {**about, **held_out, **describe_custom_models(recipe.out)}
    return summarise(recipe.out, complete, textures, everything)
