"""Controls: what is recognised once something was taken from recordings, or from arrays.

`evaluate` runs them on recordings without markers; `controls` on any model and anybody's arrays.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from afferents import choices, dims
from afferents.channels import CHANNELS
from afferents.encodings.samples import find_labels, list_textures
from afferents.errors import InputError, reading
from afferents.evaluation import data, intervals, metrics, results
from afferents.folds import controls as taking
from afferents.folds.protocol import Indices
from afferents.folds.splits import LeaveOneGroupOut, groups_of_samples
from afferents.progress import Progress
from afferents.store.responses import Responses

if TYPE_CHECKING:
    from afferents.evaluation.plan import Evaluation

AS_IT_IS = "as it is"
_MEANS = {
    "permuted": "the model knows labels that it did not learn here, or, of few textures, groups "
    "that are alike were named alike; look for what was learnt with the labels before",
    "shuffled": "the order in time is hardly needed",
    "offsets": "the sensor's offset is enough, which may be that day's: take each window's mean "
    "away within the model, or record textures in another order each day",
    "amplitudes": "the strength of the signal is enough; it may change with force and mounting",
}
"""What it means where a control leaves about as much as the model recognises."""
_OTHER_QUESTIONS = ("test_only", "train_speeds", "held_out", "disturb", "disturb_training")
"""Options under which models answer another question than these controls do."""


def ask_controls(
    evaluation: "Evaluation", recordings: Sequence[Responses], progress: Progress
) -> dict[str, Any]:
    """Return how much is recognised under each control, as the summary has it: `controls`.

    Nothing where there are markers. Where options change the question, recordings are too short
    for log spectra, or nothing is left to learn from, why: `controls_left_out`.

    Each group is left out in turn and named by a linear discriminant on log spectra, which has
    nothing to choose. So it shows what the data give away, not how good a model is.

    Parameters
    ----------
    recordings
        As they are, with the part of them that is used.
    """
    from afferents.models.solved import predict_left_out  # arrays alone need no torch

    if any(dims.POSITION in one for one in recordings):
        return {}
    split, cut = evaluation.options.by, evaluation.options.cut
    source = data.Source(CHANNELS[dims.RA2], evaluation.encodings.of("orders"))
    names = taking.list_controls(split)
    if why := _find_hindrance(evaluation, recordings, source):
        progress.note(f"controls ({', '.join(names)}) are left out: {why}")
        return {"controls_left_out": why}
    found = {}
    for name in ("none", *names):
        left = taking.apply_control(recordings, name, split)
        samples = split.labelled(data.encode_all(left, source, cut, progress), left)
        of, groups = np.unique(split.of(samples), return_inverse=True)
        values = samples.values.reshape(len(samples), -1)
        sharing = np.array([split.sharing(of, group) for group in of.tolist()])
        named = predict_left_out(values, find_labels(samples), groups, sharing)
        table = metrics.tabulate_predictions(
            samples[dims.TEXTURE].values,
            np.array(list_textures(samples))[named],
            split.of(samples),
            samples[dims.RECORDING].values,
        )
        unit = intervals.choose_bootstrap_unit(len(evaluation.data), table)
        found[name] = results.Accuracies(**metrics.accuracy_fields(table, unit))
    return {"controls": found}


def _find_hindrance(
    evaluation: "Evaluation", recordings: Sequence[Responses], source: data.Source
) -> str:
    """Return why there are no controls; empty where there are."""
    options, split = evaluation.options, evaluation.options.by
    if other := [name for name in _OTHER_QUESTIONS if name in options.given()]:
        flags = ", ".join(map(choices.flag_of, other))
        return f"they answer no question with {flags}; evaluate once without"
    groups = np.array(split.groups_of(recordings))
    if any(split.sharing(groups, group).all() for group in groups.tolist()):
        return f"nothing is left to learn from when one {split.title} is held out"
    if not all(data.has(one, source) for one in recordings):
        return "some recordings have no vibration"
    try:
        for one in recordings:
            channel, encoding = source
            encoding.kept(one, channel.made_of, channel.lookback, options.cut)
    except InputError as error:
        return str(error)
    return ""


@dataclass(frozen=True)
class ControlsFound:
    """What `controls` found; `print` it.

    Attributes
    ----------
    table
        A row a control, first `as it is`; columns `accuracy` (percent, mean over the groups),
        `ci95_low` and `ci95_high`, and, by group, the accuracy where it was held out.
    chance
        Percent that is right when the texture that is there most often is named always.
    warnings
        What makes the model's accuracy doubtful, a sentence each.
    left_out
        Which controls could not be made, and why; else empty.
    about
        How much was tested.
    """

    table: pd.DataFrame
    chance: float
    warnings: tuple[str, ...]
    left_out: str
    about: str

    def __str__(self) -> str:
        """Return the table without single groups, then the warnings."""
        rows = [
            f"{_title(name):<18}{mean:5.1f}   {low:.1f} to {high:.1f}"
            for name, mean, low, high, *_ in self.table.itertuples(name=None)
        ]
        return "\n".join([
            f"Percent recognised, and 95% interval: {self.about}",
            *rows,
            f"{'chance':<18}{self.chance:5.1f}",
            *[f"Left out: {self.left_out}."] * bool(self.left_out),
            *(f"Warning: {sentence}." for sentence in self.warnings),
        ])  # fmt: skip


def controls(
    model: Any,
    X: Any,  # noqa: N803
    y: ArrayLike,
    *,
    groups: ArrayLike,
    recordings: ArrayLike | None = None,
    time_axis: int = 1,
) -> ControlsFound:
    """Test a model with each group held out, as it is and once something was taken from the data.

    What is recognised all the same rests on something else than was taken. Each group is held out
    in turn and all others train: nothing is set aside for validation. The controls are those of
    `evaluate`: labels permuted, time shuffled, offsets alone, amplitudes alone.

    Parameters
    ----------
    model
        A scikit-learn estimator or pipeline, any object with `fit` and `predict`, which is copied
        for each fit, or a function ``(X_train, y_train, X_test) -> predicted``.
    X
        Samples as the model takes them: (n, feature), or (n, time, channel) for all controls. A
        table is handed on as an array.
    y
        Texture of each sample, (n,): texts or whole numbers.
    groups
        What is held out, (n,): speeds in mm/s, forces, days, sensors; numbers or texts.
    recordings
        Name of the recording that each sample was cut from, (n,): time is shuffled within it,
        and its mean is its offset. Each sample is one of its own if not given.
    time_axis
        Of X: 2 where it is (n, channel, time).

    Returns
    -------
    ControlsFound
        A table in percent, and warnings.

    Raises
    ------
    InputError
        If lengths differ; X is not of finite numbers in one length; there is a single group; no
        texture is in two groups; y is no label; a recording is of two textures; the model fails.

    Examples
    --------
    >>> import numpy as np
    >>> from sklearn.linear_model import RidgeClassifier
    >>> rng = np.random.default_rng(0)
    >>> y, speed = np.tile([0, 1, 2], 40), np.repeat([10, 20, 40, 80], 30)
    >>> X = rng.normal(size=(120, 3)) + 3 * np.eye(3)[y]
    >>> found = controls(RidgeClassifier(), X, y, groups=speed)
    >>> found.table["accuracy"].round(1).to_dict()
    {'as it is': 96.7, 'permuted': 35.8}
    """
    if isinstance(model, type) or not (hasattr(model, "fit") or callable(model)):
        raise InputError(
            "the model: expected an object with fit and predict, or a function, found "
            f"{model!r}; make an object of a class first, as in RidgeClassifier()"
        )
    x, labels, of, names = _check_arrays(X, y, groups, recordings)
    folds = list(LeaveOneGroupOut().split(x, groups=of))
    if (timed := x.ndim > 2) and not 0 < time_axis < x.ndim:
        raise InputError(
            f"time_axis: expected an axis of X after that of samples, 1 to {x.ndim - 1}, found "
            f"{time_axis}"
        )
    found = {}
    for control in (AS_IT_IS, *taking.CONTROLS):
        left, named = x, labels
        if control == "permuted":
            named = taking.exchange_labels(labels, of)
        elif control != AS_IT_IS:
            if not timed:
                continue
            left = _take_away(x, control, names, time_axis)
        predicted = _predict_each(model, left, named, folds)
        found[control] = metrics.accuracy_interval(named, predicted, of)
    samples = metrics.tabulate_predictions(labels, labels, of, names)
    chance, n_recordings = metrics.chance_accuracy(samples), len(np.unique(names))
    table = pd.DataFrame({
        control: {
            "accuracy": 100 * one.mean_accuracy,
            "ci95_low": 100 * one.ci95[0],
            "ci95_high": 100 * one.ci95[1],
            **{group: 100 * share for group, share in one.by.items()},
        }
        for control, one in found.items()
    }).T  # fmt: skip
    left_out = []
    if not timed:
        left_out.append(
            f"shuffled, offsets and amplitudes, since X of shape {x.shape} has no time axis (give "
            "windows, and work features out within the model)"
        )
    if recordings is None:
        left_out.append(
            "samples of one recording on both sides of a split, since no recordings are named"
        )
    return ControlsFound(
        table,
        100 * chance,
        (*_find_doubts(found, chance, samples), *_find_exchanged_axes(x, time_axis)),
        "; ".join(left_out),
        f"{len(folds)} groups, each held out in turn, {len(labels)} samples"
        + f" of {n_recordings} recordings" * (recordings is not None),
    )


def _title(control: str) -> str:
    return taking.CONTROLS.get(control, control).partition(":")[0]


def _check_arrays(
    X: Any,  # noqa: N803
    y: ArrayLike,
    groups: ArrayLike,
    recordings: ArrayLike | None,
) -> tuple[Any, NDArray[Any], NDArray[Any], NDArray[np.str_]]:
    """Return samples, labels, groups and names of recordings, or refuse them."""
    x, labels, of = _check_samples(X), _check_labels(y), groups_of_samples(groups)
    given = np.arange(len(x)) if recordings is None else np.asarray(recordings)
    metrics.require_equal_lengths({"X": x, "y": labels, "groups": of, "recordings": given})
    names = given.astype(np.str_)
    if len(np.unique(of)) < 2:
        raise InputError(
            f"groups: expected at least 2, of which one is held out, found {len(np.unique(of))}; "
            "give what differs between recordings, such as their speed or day"
        )
    table = pd.DataFrame({"texture": labels, "group": of, "recording": names})
    if (mixed := table.groupby("recording")["texture"].nunique()).max() > 1:
        raise InputError(
            f"recordings: expected one texture in each, found {mixed.max()} in {mixed.idxmax()}; "
            "name recordings of different textures differently"
        )
    if table.groupby("texture")["group"].nunique().max() < 2:
        raise InputError(
            "groups: expected textures that are in several groups, found each in one alone, so "
            "that none is learnt when it is tested; hold out something else, or record more"
        )
    return x, labels, of, names


def _check_samples(X: Any) -> NDArray[Any]:  # noqa: N803
    """Return X as an array of finite numbers."""
    expected = "X: expected numbers, (n, feature) or (n, time, channel)"
    try:
        x = np.asarray(X)
    except ValueError:  # ragged lists
        x = np.empty(0, object)
    if x.dtype.kind not in "biuf":
        found = f"{x.dtype} values, or windows of different lengths"
        raise InputError(f"{expected}, found {found}; cut windows of one length")
    if x.ndim < 2:
        raise InputError(f"{expected}, found shape {x.shape}; one feature is X[:, np.newaxis]")
    if (bad := np.flatnonzero(~np.isfinite(x).all(axis=tuple(range(1, x.ndim))))).size:
        raise InputError(
            f"{expected}, found NaN or infinity in {bad.size} of {len(x)} samples, the first at "
            f"{bad[0]}; fill them or leave these samples out"
        )
    return x


def _check_labels(y: ArrayLike) -> NDArray[Any]:
    """Return labels as texts or whole numbers."""
    if np.ndim(y) != 1:
        raise InputError(
            f"y: expected a texture of each sample, (n,), found shape {np.shape(y)}; give labels "
            "rather than a column for each"
        )
    labels = pd.Series(np.asarray(y)).infer_objects()
    if labels.isna().any():
        raise InputError(
            f"y: expected the texture of every sample, found none for {int(labels.isna().sum())} "
            f"of {len(labels)}; leave these samples out"
        )
    if not pd.api.types.is_numeric_dtype(labels):
        return labels.astype(str).to_numpy().astype(np.str_)
    if not pd.api.types.is_float_dtype(labels):
        return labels.to_numpy()
    if (labels % 1 != 0).any():
        broken = labels[labels % 1 != 0].iloc[0]
        raise InputError(
            f"y: expected textures, as texts or whole numbers, found {broken:g}; regression is "
            "not meant, so name classes instead"
        )
    return labels.to_numpy(np.int64)


def _take_away(
    x: NDArray[Any], control: str, names: NDArray[np.str_], time_axis: int
) -> NDArray[np.floating]:
    """Return what a control leaves of samples, recording by recording."""
    rows = np.moveaxis(x if x.dtype.kind == "f" else x.astype(np.float32), time_axis, 1)
    left = np.empty(rows.shape, rows.dtype)
    parts = pd.Series(names).groupby(names).indices
    series = {name: rows[its].reshape(-1, *rows.shape[2:]) for name, its in parts.items()}
    usual = 0.0
    if control == "offsets":
        usual = float(np.median([taking.measure_spread(one) for one in series.values()]))
    for name, one in series.items():
        changed = taking.change_series(one, control, usual, taking.make_rng(str(name)))
        left[parts[name]] = changed.reshape(-1, *rows.shape[1:])
    return np.moveaxis(left, 1, time_axis)


def _predict_each(
    model: Any, x: Any, labels: NDArray[Any], folds: Sequence[tuple[Indices, Indices]]
) -> NDArray[Any]:
    """Return what is predicted of each sample where its group is held out, (n,)."""
    from sklearn.base import clone

    predicted, known = np.empty_like(labels), set(labels.tolist())
    what = f"one that learns from X of shape {('n', *x.shape[1:])} and names y".replace("'", "")
    do = "see that it takes windows, or put LogSpectra() before it, in a pipeline" * (x.ndim > 2)
    for train, test in folds:
        if len(set(labels[train].tolist())) == 1:  # which many estimators refuse
            predicted[test] = labels[train[0]]
            continue
        with reading("the model", what, do=do):
            if hasattr(model, "fit"):
                fresh = clone(model, safe=False)
                fresh.fit(x[train], labels[train])
                answer = np.ravel(fresh.predict(x[test]))
            else:
                answer = np.ravel(model(x[train], labels[train], x[test]))
        if len(answer) != len(test):
            raise InputError(
                f"the model: expected {len(test)} predictions, one a tested sample, found "
                f"{len(answer)}; return a label of y for each"
            )
        if other := set(answer.tolist()) - known:
            raise InputError(
                f"the model: expected labels of y, such as {labels[0]}, found {min(other)}; return "
                "labels rather than their numbers or scores"
            )
        predicted[test] = answer
    return predicted


def _find_doubts(
    found: dict[str, results.Accuracies], chance: float, samples: pd.DataFrame
) -> Iterator[str]:
    """Yield a sentence for all that makes an accuracy doubtful.

    That is a control that leaves about what the model recognises, and groups that don't separate
    what they should.
    """
    own = found[AS_IT_IS].mean_accuracy
    group, recording, texture, _ = (samples[name] for name in samples)
    for control in [name for name in _MEANS if name in found]:
        left = found[control].mean_accuracy
        compared_with = chance if control == "permuted" else own
        if taking.stands_out(left, compared_with, chance, recording.nunique()):
            compared = f"{left:.0%} right, where the model has {own:.0%} and chance {chance:.0%}"
            if control != "permuted" and found[control].ci95[0] <= chance:
                compared += " (its interval reaches chance: more textures or groups would tell)"
            yield f"{_title(control)}: {compared}: {_MEANS[control]}"
    checks = [
        (
            "recordings in several groups",
            group.groupby(recording).nunique().gt(1),
            "so that samples of one recording are on both sides of a split and may be remembered",
        ),
        (
            "groups with one texture only",
            texture.groupby(group).nunique().lt(2),
            "where accuracy does not show that textures are distinguished",
        ),
        (
            "textures in one group only",
            group.groupby(texture).nunique().lt(2),
            "which count as wrong, since nothing is learnt of them",
        ),
    ]
    for what, those, meaning in checks:
        if those.any():
            first = str(those.idxmax()).removesuffix(".0")
            yield f"{what}: {those.sum()} of {those.size}, such as {first}, {meaning}"


def _find_exchanged_axes(x: NDArray[Any], time_axis: int) -> Iterator[str]:
    """Yield a sentence where time and channels seem to be exchanged."""
    if x.ndim == 3 and (moments := x.shape[time_axis]) < (channels := x.shape[3 - time_axis]):
        yield (
            f"X was read as windows of {moments} moments of {channels} channels: if it is the "
            f"other way round, the controls are wrong; set time_axis={3 - time_axis}"
        )
