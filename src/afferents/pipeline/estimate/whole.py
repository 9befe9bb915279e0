"""The estimate of a whole reproduction: what is left to be tracked and trained."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import torch

from afferents.core.errors import InputError
from afferents.core.model import Model
from afferents.core.protocol import Protocol
from afferents.core.recording import Recording
from afferents.core.split import Group
from afferents.core.store import open_responses, responses_there
from afferents.evaluation import FoldKey, finished
from afferents.markers import Method
from afferents.pipeline.encode import best_of, lacking
from afferents.pipeline.estimate.amount import amount_of, n_frames, typical
from afferents.pipeline.estimate.estimate import Estimate
from afferents.pipeline.estimate.measure import Measured, measure_recording
from afferents.pipeline.estimate.trainings import Trainings
from afferents.pipeline.recipe import Recipe
from afferents.pipeline.sensors import Sensors
from afferents.recordings import Session


def estimate_of(
    session: Session,
    sensors: Sensors,
    method: Method,
    store: Path,
    recipe: Recipe,
    protocols: Sequence[Protocol],
    seeds: Sequence[int],
    held_out: Sequence[Group],
    with_best: bool = False,
) -> Estimate:
    """Measure this machine on a few frames and batches, and multiply.

    Parameters
    ----------
    store
        Where responses go: recordings that it holds are not counted.
    recipe
        Of the trainings; those finished in its folder are not counted.
    with_best
        Whether the model that we recommend for such recordings is trained as well.

    Raises
    ------
    AfferentsError
        If no recording can be tracked, or what is measured is too short to be encoded.
    """
    missing = [r for r in session.recordings if not _is_there(store, r)]
    candidates = typical(session.recordings, recipe.cut, recipe.steady_s)
    measured = (
        measure_recording(candidates, sensors, method) if missing else _stored(candidates, store)
    )
    able = [model for model in recipe.models if lacking(model, [measured.responses]) is None]
    best = best_of([measured.responses]) if with_best else None
    models = able if best is None or best in able else [*able, best]
    how = recipe.cut, recipe.split, held_out, recipe.ablation, recipe.steady_s
    amount = amount_of(session, measured.recording, *how)

    def left(model: Model, protocol: Protocol) -> int:
        keys = (
            FoldKey(model.name, protocol.name, seed, group, recipe.split)
            for seed in seeds
            for group in amount.groups
        )
        return sum(not finished(recipe.out, key) for key in keys)

    trainings = Trainings(replace(recipe, models=models), measured, amount)
    return Estimate(
        float(sum(n_frames(recording) for recording in missing)),
        measured.frame_s,
        len(missing),
        trainings.works(models, protocols, left),
        recipe.compute.device != "cpu" and torch.cuda.is_available(),
    )


def _stored(recordings: Sequence[Recording], store: Path) -> Measured:
    """Return a recording that has been extracted: nothing is left to be tracked."""
    if not recordings:
        raise InputError("the session", "a recording that is long enough", "none")
    first = recordings[0]
    there = {str(responses.attrs["name"]): responses for responses in open_responses(store)}
    return Measured(first, there[first.name], 0.0)


def _is_there(store: Path, recording: Recording) -> bool:
    return responses_there(store, recording.name) is not None
