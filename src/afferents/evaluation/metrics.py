"""The numbers of an evaluation, from its predictions: accuracy, touches, calibration, summary."""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from afferents.errors import InputError
from afferents.evaluation import fold_files, intervals, results
from afferents.files import write_aside
from afferents.folds.held_out import SPEED, Group, Split, column_of, group_in, key_of, order
from afferents.folds.splits import groups_of_samples

TOUCHES_S = (0.11, 1.0, 4.0)
"""Lengths of touch at which models are compared, s: ten frames of the paper's camera, and more."""
N_BINS = 15
"""Of confidence, of equal width, from 0 to 1."""
_LEAST = 1e-12
_NEAR = 0.25
"""A touch of whole samples may differ from the length given by this share."""
_GAP, _PART = 1.5, "_passage"
_TOUCHED = ("recording", "true_texture")


def accuracy_by_group(predictions: pd.DataFrame) -> dict[Group, float]:
    """Return the fraction of test samples recognised, for each group held out, in order.

    Several seeds are averaged.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    means = right.groupby(predictions[column_of(predictions)]).mean()
    found = {group_in(value): float(mean) for value, mean in means.items()}
    return {group: found[group] for group in sorted(found, key=order)}


def accuracy_fields(predictions: pd.DataFrame, bootstrap_unit: str) -> dict[str, Any]:
    """Return the fields of `Accuracies` of samples, recordings or touches."""
    by_group = accuracy_by_group(predictions)
    accuracy = intervals.Accuracy(intervals.count_right(predictions, bootstrap_unit))
    of_groups = intervals.intervals_by_group(accuracy)
    return {
        "mean_accuracy": sum(by_group.values()) / len(by_group),
        "ci95": intervals.bootstrap_interval(accuracy),
        "by": {key_of(group): share for group, share in by_group.items()},
        "ci95_by": {key_of(group): interval for group, interval in of_groups.items()},
        "worst": key_of(min(by_group, key=lambda group: by_group[group])),
    }


def accuracy_interval(y: ArrayLike, predicted: ArrayLike, groups: ArrayLike) -> results.Accuracies:
    """Return the share recognised, mean over groups held out, with its interval as in `evaluate`.

    The interval is how much the accuracy would differ with other textures; it is 0 to 1 of a
    single one.

    Parameters
    ----------
    y, predicted
        True and predicted texture of every sample, (n,).
    groups
        What was held out when a sample was tested, such as its speed, (n,).

    Returns
    -------
    Accuracies
        `mean_accuracy`, its `ci95` (low, high), `by` group and `ci95_by` group: shares, 0 to 1.

    Raises
    ------
    InputError
        If they differ in length, or a sample has no group.

    Examples
    --------
    >>> found = accuracy_interval(list("ababab"), list("ababbb"), [10, 10, 20, 20, 40, 40])
    >>> found.mean_accuracy, found.by
    (0.8333333333333334, {'10': 1.0, '20': 1.0, '40': 0.5})
    """
    columns = {"y": y, "predicted": predicted, "groups": groups_of_samples(groups)}
    require_equal_lengths(columns)
    table = tabulate_predictions(y, predicted, columns["groups"], columns["groups"])
    return results.Accuracies(**accuracy_fields(table, intervals.TEXTURE))


def tabulate_predictions(
    y: ArrayLike, predicted: ArrayLike, groups: ArrayLike, recordings: ArrayLike
) -> pd.DataFrame:
    """Return a table of predictions, a row a sample, as `intervals.count_right` reads it."""
    return pd.DataFrame({
        Split.column: np.asarray(groups),
        "recording": np.asarray(recordings),
        "true_texture": np.asarray(y),
        "predicted_texture": np.asarray(predicted),
    })  # fmt: skip


def require_equal_lengths(arrays: Mapping[str, Any]) -> None:
    """Refuse arrays, by their names, that are not all of as many samples.

    Raises
    ------
    InputError
        With how many each has.
    """
    if len({len(one) for one in arrays.values()}) > 1:
        found = ", ".join(map(str, map(len, arrays.values())))
        raise InputError(f"{', '.join(arrays)}: expected as many samples in each, found {found}")


def chance_accuracy(predictions: pd.DataFrame) -> float:
    """Return the accuracy of always naming the same texture, the one that is there most often.

    One in the number of textures, where each has as many recordings in every group held out.
    """
    group = column_of(predictions)
    recordings = predictions.drop_duplicates([group, "recording"])
    recordings = recordings.reset_index(drop=True)  # crosstab aligns by label
    shares = pd.crosstab(recordings[group], recordings["true_texture"], normalize="index")
    return float(shares.mean().max())


def confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Return counts, shape (true texture, predicted texture)."""
    from sklearn.metrics import confusion_matrix  # workers do without

    counts: NDArray[np.int64] = confusion_matrix(
        predictions["true_texture"], predictions["predicted_texture"], labels=textures
    )
    return counts


def macro_f1(predictions: pd.DataFrame, textures: list[str]) -> float:
    """Return the mean over textures of the F1 score, over all groups held out together."""
    from sklearn.metrics import f1_score

    true, predicted = predictions["true_texture"], predictions["predicted_texture"]
    score = f1_score(true, predicted, labels=textures, average="macro", zero_division=0.0)
    return float(score)


class Touches(NamedTuple):
    """Touches of one length.

    Attributes
    ----------
    named
        One row a touch, as `name_recordings` has a row a recording.
    seconds, samples
        How long they are and of how many samples, median.
    """

    named: pd.DataFrame
    seconds: float
    samples: int


def name_recordings(predictions: pd.DataFrame, textures: list[str]) -> pd.DataFrame:
    """Name each recording by the sum of its samples' log-probabilities.

    Neighbouring samples are nearly the same, so the sum is far too sure of itself; which texture
    leads does not depend on that.

    Parameters
    ----------
    predictions
        One row a test sample, as `predictions_table` makes them.

    Returns
    -------
    DataFrame
        One row a recording and seed: seed, held_out_speed_mm_s (or held_out_group), recording,
        true_texture, predicted_texture.
    """
    return _name_together(predictions, textures, ["seed", column_of(predictions), *_TOUCHED])


def name_touches(predictions: pd.DataFrame, textures: list[str], length_s: float) -> Touches | None:
    """Name touches of one length by the mean of their samples' log-probabilities.

    A touch is made of as many consecutive samples of a recording as come nearest to its length,
    and shares none with the next. Samples may overlap; what a touch lasts is from the beginning of
    its first to the end of its last sample, and where samples lie unevenly, as the windows that
    `published` draws for a half, touches of another length are left out. None goes over a gap:
    where samples are farther apart than they mostly are.

    Parameters
    ----------
    predictions
        One row a test sample, as `predictions_table` makes them.
    length_s
        Of a touch, s.

    Returns
    -------
    Touches, or None if at some group held out no recording has a touch of about that length:
    samples are longer, or recordings shorter.
    """
    held_out = column_of(predictions)
    by = ["seed", held_out, *_TOUCHED]
    rows = predictions.sort_values([*by, "start_s"], kind="stable")
    step = rows.groupby(by)["start_s"].diff()
    usual = step.groupby([rows[name] for name in by]).transform("median")
    rows = rows.assign(**{_PART: (step > _GAP * usual).cumsum()})
    by = [*by, _PART]
    recordings = [rows[name] for name in by]
    stride = rows.groupby(by)["start_s"].diff().groupby(recordings).transform("median")
    lasting = (rows["stop_s"] - rows["start_s"]).groupby(recordings).transform("median")
    more = ((length_s - lasting) / stride).round().clip(lower=0).fillna(0)
    rows = rows.assign(_n=more + 1)
    rows = rows.assign(_touch=rows.groupby(by).cumcount() // rows["_n"])
    of_touch = [*by, "_touch"]
    rows = rows[rows.groupby(of_touch)["_n"].transform("size") == rows["_n"]]
    each = rows.groupby(of_touch)
    rows = rows.assign(_seconds=each["stop_s"].transform("max") - each["start_s"].transform("min"))
    rows = rows[(rows["_seconds"] - length_s).abs() <= _NEAR * length_s * (1 + 1e-9)]
    if set(rows[held_out]) != set(predictions[held_out]):
        return None
    named = _name_together(rows, textures, of_touch).drop(columns=["_touch", _PART])
    return Touches(named, float(rows["_seconds"].median()), int(rows["_n"].median()))


def _name_together(predictions: pd.DataFrame, textures: list[str], by: list[str]) -> pd.DataFrame:
    """Return one row for all samples that share what `by` names, named by them together."""
    columns = [f"{results.PROBABILITY}{texture}" for texture in textures]
    logs = predictions[[*by, *columns]].copy()
    logs[columns] = np.log(logs[columns].clip(lower=_LEAST))
    sums = logs.groupby(by, sort=True)[columns].sum()
    named = pd.DataFrame(sums.index.to_frame(index=False))
    named["predicted_texture"] = np.array(textures)[sums.to_numpy().argmax(axis=1)]
    return named


def inside_speeds(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return the rows whose held-out speed lies between others: neither slowest nor fastest.

    To hold out an end of the range is to extrapolate, a harder question than the other speeds'.
    Of groups that lie on no scale none lies between others.
    """
    if SPEED.column not in predictions:
        return predictions.iloc[:0]
    speed = predictions[SPEED.column]
    inner: pd.DataFrame = predictions.loc[(speed > speed.min()) & (speed < speed.max())]
    return inner


def reliability(
    confidence: NDArray[np.floating], right: NDArray[np.bool_], n_bins: int = N_BINS
) -> results.Reliability:
    """Gather samples, at least one, by their confidence.

    Confidence against accuracy shows whether a model is right as often as it states (Guo et al.,
    ICML 2017).

    Parameters
    ----------
    confidence
        Probability of what each sample is named, 0 to 1, (n,).
    right
        Whether that is what it is, (n,).
    n_bins
        A bin's upper edge belongs to it.
    """
    exact = np.clip(np.asarray(confidence, dtype=np.float64), 0, 1)
    number = np.clip(np.ceil(exact * n_bins).astype(np.int64) - 1, 0, n_bins - 1)
    count = np.bincount(number, minlength=n_bins)
    some = np.maximum(count, 1)
    mean = np.bincount(number, exact, n_bins) / some
    accuracy = np.bincount(number, right, n_bins) / some
    return results.Reliability(
        ece=float(count @ np.abs(accuracy - mean) / count.sum()),
        count=tuple(count.tolist()),
        confidence=tuple(mean.tolist()),
        accuracy=tuple(accuracy.tolist()),
    )


def measure_reliability(predictions: pd.DataFrame) -> results.Reliability | None:
    """Return the reliability of a table of predictions; None where it holds no probabilities."""
    columns = [name for name in predictions.columns if name.startswith(results.PROBABILITY)]
    if not columns or predictions.empty:
        return None
    right = predictions["true_texture"] == predictions["predicted_texture"]
    return reliability(predictions[columns].max(axis=1).to_numpy(), right.to_numpy())


def summarise(
    folder: Path, keys: Sequence[fold_files.FoldKey], textures: list[str], about: Mapping[str, Any]
) -> results.Summary:
    """Read the folds of `keys`, write predictions.parquet and summary.json, return the summary.

    Parameters
    ----------
    about
        What the summary holds of the whole (data, cut, preset, skipped recordings). Where it names
        several sources, each is a session.
    """
    loaded = [(key, *fold_files.load_fold(folder, key)) for key in keys]
    everything = pd.concat([table for *_, table in loaded])
    unit = intervals.choose_bootstrap_unit(len(about["data"]), everything)
    models: dict[str, dict[str, results.Outcome]] = {}
    accuracies: dict[tuple[str, str], intervals.Accuracy] = {}
    for model, protocol in dict.fromkeys((key.model, key.protocol) for key in keys):
        mine = [one for one in loaded if (one[0].model, one[0].protocol) == (model, protocol)]
        predictions = pd.concat([table for *_, table in mine])
        accuracies[model, protocol] = intervals.Accuracy(intervals.count_right(predictions, unit))
        found = _summarise_model(predictions, [facts for _, facts, _ in mine], textures, unit)
        models.setdefault(model, {})[protocol] = found
    with write_aside(folder / results.PREDICTIONS) as partial, partial.open("wb") as file:
        everything.to_parquet(file, compression="zstd", index=False)
    compared = []
    for (than, under), (model, same) in combinations(accuracies, 2):
        if under == same:
            by = intervals.paired_difference(accuracies[model, under], accuracies[than, under])
            compared.append(
                results.Comparison(protocol=under, model=model, than=than, **by.content())
            )
    summary = results.Summary(
        **about,
        textures=tuple(textures),
        chance=chance_accuracy(everything),
        intervals=results.Intervals(
            bootstrap_unit=unit,
            n=len({unit for accuracy in accuracies.values() for unit in accuracy.units}),
        ),
        models=models,
        selection_effect={
            model: intervals.paired_difference(
                accuracies[model, "published"], accuracies[model, "nested"]
            )
            for model, protocols in models.items()
            if {"published", "nested"} <= protocols.keys()
        },
        comparisons=tuple(compared),
    )
    summary.write(folder / results.SUMMARY)
    return summary


def _summarise_model(
    predictions: pd.DataFrame, facts: Sequence[fold_files.FoldFacts], textures: list[str], unit: str
) -> results.Outcome:
    """Return what came out for one model under one protocol."""
    by_touch: dict[str, results.OfTouches | None] = {}
    for length_s in TOUCHES_S:
        touches = name_touches(predictions, textures, length_s)
        by_touch[f"{length_s:g}"] = None
        if touches is not None:
            fields = _fields_with_inside(touches.named, unit)
            by_touch[f"{length_s:g}"] = results.OfTouches(
                seconds=touches.seconds, samples=touches.samples, **fields
            )
    leaks: dict[str, Any] = {}
    for name, value in (leak for fact in facts for leak in fact.leaks.items()):
        earlier = leaks.get(name, 0)
        leaks[name] = bool(earlier or value) if isinstance(value, bool) else earlier + value
    in_epochs = [fact for fact in facts if fact.history and fact.best_epoch is not None]
    recordings = _fields_with_inside(name_recordings(predictions, textures), unit)
    return results.Outcome(
        **_fields_with_inside(predictions, unit),
        recordings=results.WithInside(**recordings),
        by_touch=by_touch,
        macro_f1=macro_f1(predictions, textures),
        confusion=tuple(map(tuple, confusion(predictions, textures).tolist())),
        reliability=measure_reliability(predictions),
        n_test=len(predictions),
        seeds=tuple(sorted({fact.seed for fact in facts})),
        validations={key_of(fact.held_out): fact.validated_by for fact in reversed(facts)},
        validation_accuracy=_collect(facts, lambda fact: fact.validation_accuracy),
        epochs=_collect(facts, lambda fact: fact.epochs),
        best_epoch=_collect(in_epochs, lambda fact: fact.best_epoch),
        first_epoch=_collect(
            in_epochs,
            lambda fact: results.FirstEpoch(
                training=fact.history[0].accuracy, validation=fact.history[0].validation_accuracy
            ),
        ),
        seconds=sum(fact.seconds for fact in facts),
        leaks=leaks,
    )


def _fields_with_inside(predictions: pd.DataFrame, unit: str) -> dict[str, Any]:
    """Return the fields of accuracies, and of those of speeds that lie between others."""
    inner = inside_speeds(predictions)
    inside = results.Accuracies(**accuracy_fields(inner, unit)) if len(inner) else None
    return {**accuracy_fields(predictions, unit), "inside": inside}


def _collect(
    facts: Sequence[fold_files.FoldFacts], get: Callable[[fold_files.FoldFacts], Any]
) -> dict[str, tuple[Any, ...]]:
    """Return what is got of each fold by group held out, one value a seed."""
    collected: dict[str, tuple[Any, ...]] = {}
    for fact in facts:
        group = key_of(fact.held_out)
        collected[group] = (*collected.get(group, ()), get(fact))
    return collected
