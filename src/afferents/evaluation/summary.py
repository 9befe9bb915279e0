"""The summary of a results folder: accuracies with intervals, and how sound the data were."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from afferents import dims
from afferents.evaluation.fold_files import FoldFacts, FoldKey, load_fold
from afferents.evaluation.intervals import (
    Accuracy,
    accuracies_of,
    bootstrap_unit_of,
    count_right,
    paired_difference,
)
from afferents.evaluation.metrics import (
    TOUCHES_S,
    confusion,
    inside_speeds,
    macro_f1,
    name_recordings,
    name_touches,
    reliability_of,
)
from afferents.evaluation.results import PREDICTIONS, SUMMARY
from afferents.evaluation.schemas import (
    Accuracies,
    Comparison,
    Difference,
    FirstEpoch,
    Intervals,
    Lost,
    OfTouches,
    Outcome,
    Summary,
    WithInside,
    WithIssues,
)
from afferents.files import write_aside
from afferents.folds.held_out import column_of, key_of
from afferents.store.responses import Responses, issues_in, read_whole


def data_quality(recordings: Sequence[Responses]) -> dict[str, Any]:
    """Return what of the recordings whoever reads the numbers must know, for a summary.

    Returns
    -------
    dict
        `issues`, of each recording that was kept though something is wrong with it, what;
        `lost`, the share of marker positions (time, marker) that were lost, from 0 to 1: median
        over recordings, worst, and in which. Each is left out where there is none.

    Raises
    ------
    InputError
        If what a store says of lost markers can't be read.
    """
    issues = [
        WithIssues(recording=str(r.attrs["name"]), found=tuple(found))
        for r in recordings
        if (found := issues_in(r.attrs))
    ]
    lost = lost_of({
        str(r.attrs["name"]): share_lost(read_whole(r, dims.DETECTED), r.attrs)
        for r in recordings
        if dims.DETECTED in r
    })  # fmt: skip
    return ({"issues": issues} if issues else {}) | ({"lost": lost} if lost else {})


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


def lost_of(shares: Mapping[str, float]) -> Lost | None:
    """Summarise each recording's share of lost markers; None of no recordings."""
    if not shares:
        return None
    worst = max(shares, key=lambda name: shares[name])
    median = float(np.median(list(shares.values())))
    return Lost(median=median, worst=shares[worst], recording=worst, n=len(shares))


def summarise(
    results: Path, keys: Sequence[FoldKey], textures: list[str], about: Mapping[str, Any]
) -> Summary:
    """Read the folds of `keys`, write predictions.parquet and summary.json, return the summary.

    Parameters
    ----------
    about
        What the summary says of the whole (data, cut, preset, skipped recordings). Where it names
        several sources, each is a session.
    """
    loaded = [(key, *load_fold(results, key)) for key in keys]
    everything = pd.concat([table for *_, table in loaded])
    bootstrap_unit = bootstrap_unit_of(len(about["data"]), everything)
    models: dict[str, dict[str, Outcome]] = {}
    accuracies: dict[tuple[str, str], Accuracy] = {}
    for model, protocol in dict.fromkeys((key.model, key.protocol) for key in keys):
        mine = [
            (facts, table)
            for key, facts, table in loaded
            if (key.model, key.protocol) == (model, protocol)
        ]
        predictions = pd.concat([table for _, table in mine])
        accuracies[model, protocol] = Accuracy(count_right(predictions, bootstrap_unit))
        found = _outcome(predictions, [facts for facts, _ in mine], textures, bootstrap_unit)
        models.setdefault(model, {})[protocol] = found
    with write_aside(results / PREDICTIONS) as partial, partial.open("wb") as file:
        everything.to_parquet(file, compression="zstd", index=False)
    units = {unit for accuracy in accuracies.values() for unit in accuracy.units}
    summary = Summary(
        **about,
        textures=tuple(textures),
        chance=constant_answer(everything),
        intervals=Intervals(bootstrap_unit=bootstrap_unit, n=len(units)),
        models=models,
        selection_effect=_selection_effects(accuracies),
        comparisons=tuple(_comparisons(accuracies)),
    )
    summary.write(results / SUMMARY)
    return summary


def constant_answer(predictions: pd.DataFrame) -> float:
    """Return the accuracy of who always names the same texture, the one that is there most often.

    One in the number of textures, where each has as many recordings in every group held out.
    """
    group = column_of(predictions)
    recordings = predictions.drop_duplicates([group, "recording"])
    recordings = recordings.reset_index(drop=True)  # crosstab aligns by label
    shares = pd.crosstab(recordings[group], recordings["true_texture"], normalize="index")
    return float(shares.mean().max())


def _selection_effects(accuracies: Mapping[tuple[str, str], Accuracy]) -> dict[str, Difference]:
    """Return, by model, how much the published protocol adds to the nested one's accuracy."""
    return {
        model: paired_difference(accuracies[model, "published"], accuracies[model, "nested"])
        for model, protocol in accuracies
        if protocol == "published" and (model, "nested") in accuracies
    }


def _comparisons(accuracies: Mapping[tuple[str, str], Accuracy]) -> Iterable[Comparison]:
    """Yield, for each two models under one protocol, how much better the later one is."""
    for (model, protocol), (other, same) in combinations(accuracies, 2):
        if protocol == same:
            found = paired_difference(accuracies[other, protocol], accuracies[model, protocol])
            yield Comparison(protocol=protocol, model=other, than=model, **found.content())


def _outcome(
    predictions: pd.DataFrame, facts: Sequence[FoldFacts], textures: list[str], bootstrap_unit: str
) -> Outcome:
    """Return what came out for one model under one protocol."""
    recordings = name_recordings(predictions, textures)
    validated = {key_of(fact.held_out): fact.validated_by for fact in reversed(facts)}
    return Outcome(
        **_with_inside(predictions, bootstrap_unit),
        recordings=WithInside(**_with_inside(recordings, bootstrap_unit)),
        by_touch={
            f"{s:g}": _of_touches(predictions, textures, s, bootstrap_unit) for s in TOUCHES_S
        },
        macro_f1=macro_f1(predictions, textures),
        confusion=tuple(map(tuple, confusion(predictions, textures).tolist())),
        reliability=reliability_of(predictions),
        n_test=len(predictions),
        seeds=tuple(sorted({fact.seed for fact in facts})),
        validations=validated,
        validation_accuracy=_by_group(facts, "validation_accuracy"),
        epochs=_by_group(facts, "epochs"),
        **course_of(facts),
        seconds=sum(fact.seconds for fact in facts),
        leaks=_total_leaks(facts),
    )


def _with_inside(predictions: pd.DataFrame, bootstrap_unit: str) -> dict[str, Any]:
    """Return the fields of accuracies, and of those of speeds that lie between others."""
    inner = inside_speeds(predictions)
    inside = Accuracies(**accuracies_of(inner, bootstrap_unit)) if len(inner) else None
    return {**accuracies_of(predictions, bootstrap_unit), "inside": inside}


def _of_touches(
    predictions: pd.DataFrame, textures: list[str], length_s: float, unit: str
) -> OfTouches | None:
    """Return the same of touches of one length; None where there are none."""
    found = name_touches(predictions, textures, length_s)
    if found is None:
        return None
    fields = _with_inside(found.named, unit)
    return OfTouches(seconds=found.seconds, samples=found.samples, **fields)


def _by_group(facts: Sequence[FoldFacts], name: str) -> dict[str, tuple[Any, ...]]:
    """Collect a fact by group held out, one value a seed."""
    collected: dict[str, tuple[Any, ...]] = {}
    for fact in facts:
        group = key_of(fact.held_out)
        collected[group] = (*collected.get(group, ()), getattr(fact, name))
    return collected


def course_of(facts: Sequence[FoldFacts]) -> dict[str, dict[str, tuple[Any, ...]]]:
    """Return the best and the first epoch by group held out, one value a seed.

    What was solved at once has no epochs and is passed over.

    Returns
    -------
    dict
        ``best_epoch``: the number, from 1, of the epoch whose weights were kept. ``first_epoch``:
        its accuracies, shares from 0 to 1, in training and in validation.
    """
    learnt = [fact for fact in facts if fact.history and fact.best_epoch is not None]
    return {
        "best_epoch": _by_group(learnt, "best_epoch"),
        "first_epoch": {
            group: tuple(
                FirstEpoch(training=epochs[0].accuracy, validation=epochs[0].validation_accuracy)
                for epochs in histories
            )
            for group, histories in _by_group(learnt, "history").items()
        },
    }


def _total_leaks(facts: Sequence[FoldFacts]) -> dict[str, Any]:
    total: dict[str, Any] = {}
    for fact in facts:
        for name, value in fact.leaks.items():
            seen = isinstance(value, bool)
            total[name] = (total.get(name, False) or value) if seen else total.get(name, 0) + value
    return total
