"""How often a texture held out is called unknown, and how often one that was learnt is.

A table of novelty has one row a sample asked, with the columns held_out_speed_mm_s,
left_out (the texture of which nothing was learnt), texture (its own), recording, novelty
(above 1 the sample is called unknown) and recordings_limit (above which the mean over a recording
calls that unknown). A texture that is not left out is asked once for each that is.
"""

from collections.abc import Callable, Collection
from functools import partial
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from torch import Tensor

from afferents import dims
from afferents.encodings.base import Encoding
from afferents.encodings.samples import Samples, labels_of, textures_of
from afferents.errors import InputError
from afferents.evaluation.intervals import TEXTURE, Accuracy, bootstrap_interval, count_right
from afferents.evaluation.metrics import accuracy_by_group, inside_speeds, outside_speeds
from afferents.evaluation.schemas import (
    ShareUnknown,
    Unit,
    UnknownBySpeed,
    UnknownOutcome,
    UnknownTexture,
)
from afferents.models.base import Solved
from afferents.models.confidence import KNOWN, Novelty
from afferents.models.fit_solved import learn, new_solved, scores_of
from afferents.models.model import Model
from afferents.models.solved import Gram, equal_weights, sum_of
from afferents.progress import Progress

FOLD = ["held_out_speed_mm_s", "left_out"]
"""What is held out together: a speed, and a texture."""


def summarise_unknown(table: pd.DataFrame, bootstrap_unit: str = TEXTURE) -> UnknownOutcome:
    """Return what a table of novelty of one model comes to; docs/results-format.md.

    Parameters
    ----------
    table
        As above.
    bootstrap_unit
        What is drawn anew for intervals, as `count_right` takes it.
    """
    table = table.reset_index(drop=True)
    units: dict[Unit, pd.DataFrame] = {"samples": table, "recordings": recordings_of(table)}
    is_new = {unit: rows["left_out"] == rows["texture"] for unit, rows in units.items()}

    def shares(held_out: bool) -> dict[Unit, UnknownBySpeed]:
        mine = {unit: rows[is_new[unit] == held_out] for unit, rows in units.items()}
        return {unit: share_unknown(rows, bootstrap_unit) for unit, rows in mine.items()}

    def areas(part: Callable[[pd.DataFrame], pd.DataFrame]) -> dict[Unit, float | None]:
        there = {unit: part(rows) for unit, rows in units.items()}
        return {u: _mean_auroc(rows) if len(rows) else None for u, rows in there.items()}

    def of_texture(texture: str) -> UnknownTexture:
        left_out = {unit: rows[rows["left_out"] == texture] for unit, rows in units.items()}
        return UnknownTexture(
            found_samples=_by_speed_mean(left_out["samples"], True),
            found_recordings=_by_speed_mean(left_out["recordings"], True),
            false_alarms=_by_speed_mean(table[table["texture"] == texture], False),
            auroc=_mean_auroc(left_out["samples"]),
        )

    by_speed = table.groupby("held_out_speed_mm_s")
    return UnknownOutcome(
        found=shares(True),
        false_alarms=shares(False),
        auroc=areas(lambda rows: rows),
        auroc_inside=areas(inside_speeds),
        auroc_outside=areas(outside_speeds),
        auroc_by_speed={f"{v:g}": _mean_auroc(rows) for v, rows in by_speed},
        by_texture={str(t): of_texture(t) for t in pd.unique(table["left_out"])},
        n=int(is_new["samples"].sum()),
    )


def recordings_of(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row a recording and fold: its novelty is the mean over its samples.

    It is measured by the recordings' own limit, so that above 1 is unknown here too.
    """
    rows = table.groupby([*FOLD, "texture", "recording"], sort=False, as_index=False)[
        ["novelty", "recordings_limit"]
    ].mean()
    return rows.assign(novelty=rows["novelty"] / rows["recordings_limit"])


def share_unknown(rows: pd.DataFrame, bootstrap_unit: str = TEXTURE) -> UnknownBySpeed:
    """Return the share of rows called unknown: mean over held-out speeds, and by speed.

    The 95% interval is by bootstrap over units, as of accuracies. The same of the speeds that lie
    between others, and of the slowest and the fastest, which lie outside what was learnt when they
    are held out; None where no speed lies between others.
    """
    called = _called(rows).reset_index(drop=True)
    inner, outer = inside_speeds(called), outside_speeds(called)
    return UnknownBySpeed(
        **_mean_and_interval(called, bootstrap_unit),
        inside=ShareUnknown(**_mean_and_interval(inner, bootstrap_unit)) if len(inner) else None,
        outside=ShareUnknown(**_mean_and_interval(outer, bootstrap_unit)) if len(inner) else None,
        by_speed={f"{speed:g}": share for speed, share in accuracy_by_group(called).items()},
    )


def auroc(rows: pd.DataFrame) -> float:
    """Return how often an unknown sample is more novel than a known one, of all pairs."""
    from sklearn.metrics import roc_auc_score  # workers need none of it

    return float(roc_auc_score(rows["left_out"] == rows["texture"], rows["novelty"]))


def _mean_and_interval(called: pd.DataFrame, bootstrap_unit: str) -> dict[str, Any]:
    accuracy = Accuracy(count_right(called, bootstrap_unit))
    return {"mean": accuracy.mean(), "ci95": bootstrap_interval(accuracy)}


def _mean_auroc(rows: pd.DataFrame) -> float:
    """Return the mean over folds, each of which has its own model and its own limit."""
    return float(np.mean([auroc(fold) for _, fold in rows.groupby(FOLD)]))


def _by_speed_mean(rows: pd.DataFrame, left_out: bool) -> float:
    """Return the mean over speeds of the share called unknown of what was left out, or not."""
    asked = rows[(rows["left_out"] == rows["texture"]) == left_out]
    return float(np.mean(list(accuracy_by_group(_called(asked)).values())))


def _called(rows: pd.DataFrame) -> pd.DataFrame:
    """Return rows as predictions whose accuracy is the share that is called unknown."""
    return pd.DataFrame(
        {
            "held_out_speed_mm_s": rows["held_out_speed_mm_s"],
            "recording": rows["recording"],
            "true_texture": rows["texture"],
            "predicted_texture": rows["texture"].where(rows["novelty"] > 1),
        }
    )


# Whether a texture held out is recognised as none of those that were learnt.
#
# For every speed held out and every texture left out, a model learns from the others, and is asked
# at that speed: samples of the texture left out should be novel to it, those of the others not.
# From where on is unknown is set inside the training data: each of its speeds that lies between
# others is left out as well in its turn, and 95 in 100 samples of known textures at these are to
# be below it. So 5% false alarms are stated for speeds that lie between those learnt from, and
# what came of it is in the results. The slowest and the fastest speed are not asked for the limit:
# what is learnt without them is stretched too far, and the limit would be set by them alone. Where
# one of them is held out, the speed lies outside what was learnt, and no rate is stated: the
# results keep these speeds apart.

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]
ScoresWithout = Callable[[int, Collection[float]], Tensor]
"""From a texture (its number) and speeds, mm/s, of which nothing is learnt, to all samples' scores,
(n, texture)."""


def ask_unknown(
    model: Model, samples: Samples, encoding: Encoding, progress: Progress
) -> pd.DataFrame:
    """Return the novelty of all samples at each speed held out, for each texture left out.

    One row a sample and texture left out; the columns are those of `evaluation.unknown`, and
    model, start_s, stop_s and speed_outside. Where one texture alone was felt at a speed, nothing
    known is there to tell it from: that speed is left out.
    """
    scores = scores_without(model, samples, encoding)
    labels, speed = labels_of(samples), samples[dims.SPEED].values
    held_out, tables = np.unique(speed), []
    with progress.task(f"{model.title}, unknown", len(held_out)) as mark:
        for done, v in enumerate(held_out, start=1):
            each = [_fold(samples, scores, t, v) for t in np.unique(labels[speed == v])]
            tables += [one for one in each if (one["texture"] != one["left_out"]).any()]
            mark(done, f"{v:g} mm/s held out")
    if not tables:
        raise InputError("the data: expected several textures at one speed, found one at each")
    return pd.concat(tables, ignore_index=True).assign(model=model.name)


def scores_without(model: Model, samples: Samples, encoding: Encoding) -> ScoresWithout:
    """Return what gives the scores of all samples, of models that have not learnt from some."""
    solved = new_solved(model, samples, encoding)
    return ridges_of(samples) if solved.learns_from_sums else partial(_learnt_anew, solved, samples)


def ridges_of(samples: Samples) -> ScoresWithout:
    """Return what gives scores of ridges, in no more time than it takes to solve them.

    Weights are given once, over all samples, so that how many a condition has tells on the others'
    penalty, slightly.
    """
    labels, speed = labels_of(samples), samples[dims.SPEED].values
    named = torch.from_numpy(labels)
    targets = torch.nn.functional.one_hot(named)
    weight = equal_weights(named, torch.from_numpy(speed))
    sums = ConditionSums(torch.from_numpy(samples.values), labels, speed, targets, weight)

    def scores_without(texture: int, speeds: Collection[float]) -> Tensor:
        weight, constant = sums.without((texture,), speeds).solve_as_ridge()
        return sums.values @ weight + constant

    return scores_without


class ConditionSums:
    """What least squares needs of samples, texture by texture and speed by speed: it adds up.

    Parameters
    ----------
    values
        (n, ...), kept flat.
    texture, speed
        Numbers of textures or their spacings, and mm/s, (n,).
    targets, weight
        (n, target) and (n,).

    Attributes
    ----------
    where
        The numbers of a condition's samples, by texture and speed, ascending.
    """

    def __init__(
        self,
        values: Tensor,
        texture: NDArray[Any],
        speed: Floats,
        targets: Tensor,
        weight: Tensor,
    ) -> None:
        """Sum once."""
        self.values = values.flatten(1)
        conditions = zip(texture.tolist(), speed.tolist(), strict=True)
        self.where = {
            (t, v): np.flatnonzero((texture == t) & (speed == v))
            for t, v in sorted(set(conditions))
        }
        self._of: dict[tuple[float, float], Gram] = {}
        for condition, index in self.where.items():
            gram = self._of[condition] = Gram(self.values.shape[1], targets.shape[1])
            there = torch.from_numpy(index)
            gram.add(self.values[there], targets[there], weight[there])
        self._all = sum_of(list(self._of.values()))
        self._of_texture, self._of_speed = (
            {k: sum_of([g for c, g in self._of.items() if c[i] == k]) for k in self.there(i)}
            for i in (0, 1)
        )

    def there(self, which: int) -> list[float]:
        """Return the textures (0) or the speeds (1), ascending."""
        return sorted({condition[which] for condition in self.where})

    def without(self, textures: Collection[float], speeds: Collection[float]) -> Gram:
        """Return what is needed of the samples of no such texture, and at no such speed."""
        learnt = self._all
        for texture in textures:
            learnt = learnt - self._of_texture[texture]
        for v in speeds:
            learnt = learnt - self._of_speed[v]
            for condition in self._of.keys() & {(texture, v) for texture in textures}:
                learnt = learnt + self._of[condition]  # had been taken away twice
        return learnt


def _learnt_anew(
    solved: Solved, samples: Samples, texture: int, speeds: Collection[float]
) -> Tensor:
    """Return scores of all samples by a model that learns from some; told its speed."""
    labels = labels_of(samples)
    learnt = (labels != texture) & ~np.isin(samples[dims.SPEED].values, list(speeds))
    learn(solved, samples, labels, np.flatnonzero(learnt), 0, solved.penalties[0])
    return scores_of(solved, samples, np.arange(len(samples)))[:, 0]


def _fold(
    samples: Samples, scores_without: ScoresWithout, texture: int, held_out: float
) -> pd.DataFrame:
    """Return the novelty of the samples at a speed held out, with a texture left out."""
    labels, speed = labels_of(samples), samples[dims.SPEED].values
    recording = samples[dims.RECORDING].values
    known = (labels != texture) & (speed != held_out)
    distances, of_recordings = [], []
    for other in _inner(np.unique(speed[known])):
        learnt = known & (speed != other)
        unseen = np.flatnonzero(known & ~learnt & np.isin(labels, labels[learnt]))
        scores = scores_without(texture, (held_out, other))
        distances.append(_distances(scores, labels, learnt, unseen))
        of_recordings.append(_means(distances[-1], recording[unseen]))
    if not any(map(len, distances)):
        raise InputError(
            f"the data: expected textures that are learnt from at several speeds beside {texture} "
            f"and {held_out:g} mm/s, found none; record more textures at each speed"
        )
    limit = float(np.quantile(np.concatenate(distances), KNOWN))
    asked = np.flatnonzero(
        (speed == held_out) & ((labels == texture) | np.isin(labels, labels[known]))
    )
    found = _distances(scores_without(texture, (held_out,)), labels, known, asked)
    textures = np.array(textures_of(samples))
    return pd.DataFrame(
        {
            "held_out_speed_mm_s": held_out,
            "left_out": textures[texture],
            "texture": textures[labels[asked]],
            "speed_outside": not speed[known].min() < held_out < speed[known].max(),
            dims.RECORDING: recording[asked],
            dims.START: samples[dims.START].values[asked],
            dims.STOP: samples[dims.STOP].values[asked],
            "novelty": (found / limit).astype(np.float32),
            "recordings_limit": float(np.quantile(np.concatenate(of_recordings), KNOWN)) / limit,
        }
    )


def _inner(speeds: Floats) -> Floats:
    """Return the speeds that lie between others, all where there are none."""
    return speeds[1:-1] if len(speeds) > 2 else speeds


def _distances(scores: Tensor, labels: Indices, learnt: Mask, asked: Indices) -> Floats:
    """Return the distances of samples to all that was learnt, from scores of all samples."""
    there, number = np.unique(labels[learnt], return_inverse=True)
    of_known = scores[:, torch.from_numpy(there)]
    novelty = Novelty(len(there), len(there))
    novelty.fit_classes(of_known[torch.from_numpy(learnt)], torch.from_numpy(number))
    found = novelty.distance(of_known[torch.from_numpy(asked)])
    return np.asarray(found.double().numpy())


def _means(values: Floats, recording: NDArray[np.str_]) -> Floats:
    """Return the mean of each recording."""
    _, number = np.unique(recording, return_inverse=True)
    return np.asarray(np.bincount(number, values) / np.bincount(number))
