"""What a quick model recognises of recordings without markers, as they are and under controls."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from afferents import dims
from afferents.channels import CHANNELS
from afferents.choices import flag_of
from afferents.encodings.samples import find_labels, list_textures
from afferents.errors import InputError
from afferents.evaluation.encode import Source, encode_all, has, kept_part
from afferents.evaluation.intervals import accuracies_of, bootstrap_unit_of, predictions_of
from afferents.evaluation.recipe import Recipe
from afferents.evaluation.schemas import Accuracies
from afferents.folds.controls import controlled, controls_of
from afferents.models.solved import predict_left_out
from afferents.progress import Progress
from afferents.store.responses import Responses

_OTHER_QUESTIONS = ("test_only", "train_speeds", "held_out", "disturb", "disturb_training")
"""Options under which models are asked something else than these controls are."""


def ask_controls(
    recipe: Recipe, recordings: Sequence[Responses], progress: Progress
) -> dict[str, Any]:
    """Return how much is recognised under each control, as the summary has it: `controls`.

    Nothing where there are markers. Where options change the question, recordings are too short
    for log spectra, or nothing is left to learn from, why: `controls_left_out`.

    Each group is left out in turn and asked of a linear discriminant on log spectra, which has
    nothing to choose. So it says what the data give away, not how good a model is.

    Parameters
    ----------
    recordings
        As they are, with the part of them that is used.
    """
    if any(dims.POSITION in one for one in recordings):
        return {}
    source = Source(CHANNELS[dims.RA2], recipe.encodings.of("orders"))
    names = controls_of(recipe.split)
    if why := _reason_against(recipe, recordings, source):
        progress.note(f"controls ({', '.join(names)}) are left out: {why}")
        return {"controls_left_out": why}
    return {
        "controls": {
            name: _asked(recipe, recordings, source, name, progress) for name in ("none", *names)
        }
    }


def _reason_against(recipe: Recipe, recordings: Sequence[Responses], source: Source) -> str:
    """Return why there are no controls; empty where there are."""
    if other := [name for name in _OTHER_QUESTIONS if name in recipe.options.given()]:
        flags = ", ".join(map(flag_of, other))
        return f"they answer no question with {flags}; evaluate once without"
    groups = np.array(recipe.split.groups_of(recordings))
    if any(recipe.split.sharing(groups, group).all() for group in groups.tolist()):
        return f"nothing is left to learn from when one {recipe.split.title} is held out"
    if not all(has(one, source) for one in recordings):
        return "some recordings have no vibration"
    try:
        for one in recordings:
            kept_part(one, source, recipe.options.cut)
    except InputError as error:
        return str(error)
    return ""


def _asked(
    recipe: Recipe,
    recordings: Sequence[Responses],
    source: Source,
    control: str,
    progress: Progress,
) -> Accuracies:
    split = recipe.split
    left = controlled(recordings, control, split)
    samples = split.labelled(encode_all(left, source, recipe.options.cut, progress), left)
    of, groups = np.unique(split.of(samples), return_inverse=True)
    values = samples.values.reshape(len(samples), -1)
    sharing = np.array([split.sharing(of, group) for group in of.tolist()])
    named = predict_left_out(values, find_labels(samples), groups, sharing)
    textures = samples[dims.TEXTURE].values, np.array(list_textures(samples))[named]
    table = predictions_of(*textures, split.of(samples), samples[dims.RECORDING].values)
    return Accuracies(**accuracies_of(table, bootstrap_unit_of(len(recipe.data), table)))
