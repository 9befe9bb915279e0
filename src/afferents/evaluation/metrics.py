"""Accuracy by group held out and of whole touches, confusion, and calibration."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.evaluation.results import PROBABILITY
from afferents.evaluation.schemas import Reliability
from afferents.folds.held_out import SPEED, Group, column_of, group_in, order


def accuracy_by_group(predictions: pd.DataFrame) -> dict[Group, float]:
    """Return the fraction of test samples recognised, for each group held out, in order.

    Several seeds are averaged.
    """
    right = predictions["true_texture"] == predictions["predicted_texture"]
    means = right.groupby(predictions[column_of(predictions)]).mean()
    found = {group_in(value): float(mean) for value, mean in means.items()}
    return {group: found[group] for group in sorted(found, key=order)}


def confusion(predictions: pd.DataFrame, textures: list[str]) -> NDArray[np.int64]:
    """Return counts, shape (true texture, predicted texture)."""
    from sklearn.metrics import confusion_matrix  # workers need none of it

    counts: NDArray[np.int64] = confusion_matrix(
        predictions["true_texture"], predictions["predicted_texture"], labels=textures
    )
    return counts


def macro_f1(predictions: pd.DataFrame, textures: list[str]) -> float:
    """Return the mean over textures of the F1 score, over all groups held out together."""
    from sklearn.metrics import f1_score

    return float(
        f1_score(
            predictions["true_texture"],
            predictions["predicted_texture"],
            labels=textures,
            average="macro",
            zero_division=0.0,
        )
    )


# What all samples of one touch say together: of a whole recording, or of a stated length.

_LEAST = 1e-12
TOUCHES_S = (0.11, 1.0, 4.0)
"""Lengths of touch at which models are compared, s: ten frames of the paper's camera, and more."""
_NEAR = 0.25
"""A touch of so many whole samples may differ from the length asked for by this share."""


_GAP, _PART = 1.5, "_passage"
_TOUCHED = ("recording", "true_texture")


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

    Neighbouring samples say nearly the same, so the sum is far too sure of itself; which texture
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
    return _named(predictions, textures, ["seed", column_of(predictions), *_TOUCHED])


def name_touches(predictions: pd.DataFrame, textures: list[str], length_s: float) -> Touches | None:
    """Name touches of one length by the mean of their samples' log-probabilities.

    A touch is made of as many consecutive samples of a recording as come nearest to its length,
    and shares none with the next. Samples may overlap; what a touch lasts is from the beginning of
    its first to the end of its last sample, and where samples lie unevenly, as the windows that
    `published` draws for a half, touches of another length are left out. None goes over a gap.

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
    of_recording = ["seed", column_of(predictions), *_TOUCHED]
    rows = _by_passage(predictions, of_recording)
    of_recording = [*of_recording, _PART]
    recordings = [rows[name] for name in of_recording]
    stride = _median(rows.groupby(of_recording)["start_s"].diff(), recordings)
    lasting = _median(rows["stop_s"] - rows["start_s"], recordings)
    more = ((length_s - lasting) / stride).round().clip(lower=0).fillna(0)
    rows = rows.assign(_n=more + 1)
    rows = rows.assign(_touch=rows.groupby(of_recording).cumcount() // rows["_n"])
    of_touch = [*of_recording, "_touch"]
    rows = rows[rows.groupby(of_touch)["_n"].transform("size") == rows["_n"]]
    each = rows.groupby(of_touch)
    rows = rows.assign(_seconds=each["stop_s"].transform("max") - each["start_s"].transform("min"))
    rows = rows[(rows["_seconds"] - length_s).abs() <= _NEAR * length_s * (1 + 1e-9)]
    held_out = column_of(predictions)
    if set(rows[held_out]) != set(predictions[held_out]):
        return None
    named = _named(rows, textures, of_touch).drop(columns=["_touch", _PART])
    return Touches(named, float(rows["_seconds"].median()), int(rows["_n"].median()))


def _by_passage(predictions: pd.DataFrame, of_recording: list[str]) -> pd.DataFrame:
    """Return predictions in order of time, with the number of the passage that each is of.

    A recording's next passage begins where samples are farther apart than they mostly are.
    """
    rows = predictions.sort_values([*of_recording, "start_s"], kind="stable")
    apart = rows.groupby(of_recording)["start_s"].diff()
    usual = _median(apart, [rows[name] for name in of_recording])
    return rows.assign(**{_PART: (apart > _GAP * usual).cumsum()})


def _median(values: "pd.Series[float]", by: "list[pd.Series[str]]") -> "pd.Series[float]":
    """Return the median of each recording, in every row of it."""
    return values.groupby(by).transform("median")


def _named(predictions: pd.DataFrame, textures: list[str], by: list[str]) -> pd.DataFrame:
    """Return one row for all samples that share what `by` names, named by them together."""
    columns = [f"{PROBABILITY}{texture}" for texture in textures]
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


# Is a model right as often as it says? Confidence against accuracy (Guo et al., ICML 2017).

N_BINS = 15
"""Of equal width, from 0 to 1."""


def reliability(
    confidence: NDArray[np.floating], right: NDArray[np.bool_], n_bins: int = N_BINS
) -> Reliability:
    """Gather samples, at least one, by their confidence.

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
    return Reliability(
        ece=float(count @ np.abs(accuracy - mean) / count.sum()),
        count=tuple(count.tolist()),
        confidence=tuple(mean.tolist()),
        accuracy=tuple(accuracy.tolist()),
    )


def reliability_of(predictions: pd.DataFrame) -> Reliability | None:
    """Return that of a table of predictions; None where it holds no probabilities."""
    columns = [name for name in predictions.columns if name.startswith(PROBABILITY)]
    if not columns or predictions.empty:
        return None
    right = predictions["true_texture"] == predictions["predicted_texture"]
    return reliability(predictions[columns].max(axis=1).to_numpy(), right.to_numpy())
