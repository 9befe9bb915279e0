"""What a summary says of the recordings: what was accepted, how many markers were lost."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from afferents import dims
from afferents.evaluation.fold_files import FoldKey, course_of, load_fold
from afferents.evaluation.intervals import (
    Accuracy,
    bootstrap_interval,
    intervals_by_group,
    paired_difference,
    replicate_of,
)
from afferents.evaluation.metrics import (
    TOUCHES_S,
    accuracy_by_group,
    confusion,
    inside_speeds,
    macro_f1,
    name_recordings,
    name_touches,
    reliability_of,
)
from afferents.evaluation.results import PREDICTIONS, SUMMARY
from afferents.evaluation.schemas import SCHEMA
from afferents.files import write_aside, write_json
from afferents.folds.held_out import SPEED, Split, key_of
from afferents.store.responses import Responses, doubts_in, read_whole


def data_quality(recordings: Sequence[Responses]) -> dict[str, Any]:
    """Return what of the recordings whoever reads the numbers must know, ready for JSON.

    Returns
    -------
    dict
        `accepted`, of each recording that was kept with ``--accept`` what is wrong with it;
        `lost`, the share of marker positions (time, marker) that were lost, from 0 to 1: median
        over recordings, worst, and in which. Each is left out where there is none.

    Raises
    ------
    InputError
        If what a store says of lost markers can't be read.
    """
    accepted = [
        {"recording": str(r.attrs["name"]), "found": found}
        for r in recordings
        if (found := doubts_in(r.attrs))
    ]
    lost = {
        str(r.attrs["name"]): share_lost(read_whole(r, dims.DETECTED), r.attrs)
        for r in recordings
        if dims.DETECTED in r
    }
    return ({"accepted": accepted} if accepted else {}) | lost_of(lost)


def share_lost(detected: xr.DataArray, about: Mapping[Any, Any]) -> float:
    """Return the share of marker positions lost from the rest frame on; before, none is looked for.

    Parameters
    ----------
    detected
        `(time, marker)`.
    about
        Attributes of the responses, which name the rest frame.
    """
    return 1 - float(detected[int(about.get("rest_frame", 0)) :].mean())


def lost_of(shares: Mapping[str, float]) -> dict[str, Any]:
    """Return `lost` of `data_quality`, from each recording's share; nothing of no recordings."""
    if not shares:
        return {}
    worst = max(shares, key=lambda name: shares[name])
    median = float(np.median(list(shares.values())))
    return {
        "lost": {"median": median, "worst": shares[worst], "recording": worst, "n": len(shares)}
    }


# The summary of a results folder; its schema is documented in docs/results-format.md.

Accuracies = Mapping[tuple[str, str], Accuracy]
"""By model and protocol."""


def summarise(
    results: Path, keys: Sequence[FoldKey], textures: list[str], about: Mapping[str, Any]
) -> dict[str, Any]:
    """Read the folds of `keys`, write predictions.parquet and summary.json, return the summary.

    Parameters
    ----------
    about
        What the summary says of the whole (data, cut, preset, skipped recordings). Where it names
        several sources, each is a session.
    """
    replicate = replicate_of(len(about["data"]))
    loaded = [(key, *load_fold(results, key)) for key in keys]
    models: dict[str, dict[str, Any]] = {}
    accuracies: dict[tuple[str, str], Accuracy] = {}
    for model, protocol in dict.fromkeys((key.model, key.protocol) for key in keys):
        mine = [
            entry for entry in loaded if (entry[0].model, entry[0].protocol) == (model, protocol)
        ]
        predictions = pd.concat([table for _, _, table in mine])
        facts = [fact for _, fact, _ in mine]
        accuracy = accuracies[model, protocol] = Accuracy(predictions, replicate)
        found = _summary_of(predictions, accuracy, facts, textures, mine[0][0].split, replicate)
        models.setdefault(model, {})[protocol] = found
    with write_aside(results / PREDICTIONS) as partial, partial.open("wb") as file:
        pd.concat([table for _, _, table in loaded]).to_parquet(
            file, compression="zstd", index=False
        )
    summary = {
        "schema": SCHEMA,
        **about,
        "textures": textures,
        "intervals": {"replicate": replicate, "n": _n_replicates(accuracies)},
        "models": models,
        "selection_effect": _selection_effects(accuracies),
        "comparisons": _comparisons(accuracies),
    }
    write_json(results / SUMMARY, summary)
    return summary


def _n_replicates(accuracies: Accuracies) -> int:
    return len({name for accuracy in accuracies.values() for name in accuracy.replicates})


def _selection_effects(accuracies: Accuracies) -> dict[str, Any]:
    """Return, by model, how much the published protocol adds to the nested one's accuracy."""
    both = [
        m for m, protocol in accuracies if protocol == "published" and (m, "nested") in accuracies
    ]
    return {
        model: paired_difference(
            accuracies[model, "published"], accuracies[model, "nested"]
        ).describe()
        for model in both
    }


def _comparisons(accuracies: Accuracies) -> list[dict[str, Any]]:
    """Return, for each two models under one protocol, how much better the later one is."""
    return [
        {
            "protocol": protocol,
            "model": other,
            "than": model,
            **paired_difference(
                accuracies[other, protocol], accuracies[model, protocol]
            ).describe(),
        }
        for (model, protocol), (other, same) in combinations(accuracies, 2)
        if protocol == same
    ]


def _summary_of(
    predictions: pd.DataFrame,
    accuracy: Accuracy,
    facts: list[dict[str, Any]],
    textures: list[str],
    split: Split,
    replicate: str,
) -> dict[str, Any]:
    named = name_recordings(predictions, textures)
    return {
        **_outcome(predictions, accuracy, split),
        "inside": _outcome_inside(predictions, replicate),
        "recordings": {
            **_outcome(named, Accuracy(named, replicate), split),
            "inside": _outcome_inside(named, replicate),
        },
        "by_touch": {
            f"{s:g}": _touches(predictions, textures, split, s, replicate) for s in TOUCHES_S
        },
        "macro_f1": macro_f1(predictions, textures),
        "confusion": confusion(predictions, textures).tolist(),
        "reliability": found.describe() if (found := reliability_of(predictions)) else None,
        "n_test": len(predictions),
        "seeds": sorted({fact["seed"] for fact in facts}),
        split.validations: _by_group(facts, split, split.validation, first=True),
        "validation_accuracy": _by_group(facts, split, "validation_accuracy"),
        "epochs": _by_group(facts, split, "epochs"),
        **course_of(facts, split),
        "seconds": sum(fact["seconds"] for fact in facts),
        "leaks": _total_leaks(facts),
    }


def _outcome(predictions: pd.DataFrame, accuracy: Accuracy, split: Split) -> dict[str, Any]:
    """Return means, intervals and worst group of what was named, samples or recordings."""
    by_group = accuracy_by_group(predictions)
    interval = bootstrap_interval(accuracy)
    worst = min(by_group, key=lambda group: by_group[group])
    return {
        "mean_accuracy": sum(by_group.values()) / len(by_group),
        "ci95": [interval.low, interval.high],
        split.by: {key_of(group): accuracy for group, accuracy in by_group.items()},
        split.ci95_by: {
            key_of(group): [found.low, found.high]
            for group, found in intervals_by_group(accuracy).items()
        },
        split.worst: key_of(worst),
    }


def _outcome_inside(predictions: pd.DataFrame, replicate: str) -> dict[str, Any] | None:
    """Return the same of the speeds that lie between others; None where there is none."""
    inner = inside_speeds(predictions)
    return _outcome(inner, Accuracy(inner, replicate), SPEED) if len(inner) else None


def _touches(
    predictions: pd.DataFrame, textures: list[str], split: Split, length_s: float, replicate: str
) -> dict[str, Any] | None:
    """Return the same of touches of one length; None where there are none."""
    found = name_touches(predictions, textures, length_s, split.whole)
    if found is None:
        return None
    outcome = _outcome(found.named, Accuracy(found.named, replicate), split)
    inside = _outcome_inside(found.named, replicate)
    return {"seconds": found.seconds, "samples": found.samples, **outcome, "inside": inside}


def _by_group(
    facts: list[dict[str, Any]], split: Split, name: str, first: bool = False
) -> dict[str, Any]:
    """Collect a fact by group held out: one value a seed, or the first seed's alone."""
    collected: dict[str, list[Any]] = {}
    for fact in facts:
        collected.setdefault(key_of(fact[split.held_out]), []).append(fact[name])
    return {group: values[0] if first else values for group, values in collected.items()}


def _total_leaks(facts: list[dict[str, Any]]) -> dict[str, Any]:
    total: dict[str, Any] = {}
    for fact in facts:
        for name, value in fact["leaks"].items():
            seen = isinstance(value, bool)
            total[name] = (total.get(name, False) or value) if seen else total.get(name, 0) + value
    return total
