"""What a quick model recognises of recordings without markers, as they are and under controls."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from afferents import dims
from afferents.channels import CHANNELS
from afferents.encodings.samples import labels_of, textures_of
from afferents.errors import InputError
from afferents.evaluation.encode import Source, encode_all, has, kept_part
from afferents.evaluation.intervals import bootstrap_unit_of
from afferents.evaluation.recipe import Recipe
from afferents.evaluation.schemas import Accuracies
from afferents.evaluation.summary import accuracies_of
from afferents.folds.controls import controlled, controls_of
from afferents.models.fit_solved import named_when_left_out
from afferents.progress import Progress
from afferents.store.responses import Responses

_OTHER_QUESTIONS = {"test_only", "train_speeds", "held_out", "disturb", "disturb_training"}
"""Options under which models are asked something else than these controls are."""


def ask_controls(
    recipe: Recipe, recordings: Sequence[Responses], progress: Progress
) -> dict[str, Accuracies]:
    """Return how much is recognised under each control.

    Nothing where there are markers, recordings are too short for log spectra, or nothing is left
    to learn from.

    Each group is left out in turn and asked of a linear discriminant on log spectra, which has
    nothing to choose. So it says what the data give away, not how good a model is.

    Parameters
    ----------
    recordings
        As they are, with the part of them that is used.
    """
    if recipe.options.given().keys() & _OTHER_QUESTIONS:
        return {}
    source = Source(CHANNELS[dims.RA2], recipe.encodings.of("orders"))
    groups = np.array(recipe.split.groups_of(recordings))
    alone = any(recipe.split.sharing(groups, group).all() for group in groups.tolist())
    if alone or any(dims.POSITION in one or not has(one, source) for one in recordings):
        return {}
    try:
        for one in recordings:
            kept_part(one, source, recipe.options.cut)
    except InputError:
        return {}
    names = ("none", *controls_of(recipe.split))
    return {name: _asked(recipe, recordings, source, name, progress) for name in names}


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
    everything = [np.arange(values.shape[1])]
    (named,) = named_when_left_out(values, labels_of(samples), groups, everything, sharing)
    predictions = pd.DataFrame({
        split.column: split.of(samples),
        "recording": samples[dims.RECORDING].values,
        "true_texture": samples[dims.TEXTURE].values,
        "predicted_texture": np.array(textures_of(samples))[named],
    })  # fmt: skip
    unit = bootstrap_unit_of(len(recipe.data), predictions)
    return Accuracies(**accuracies_of(predictions, unit))
