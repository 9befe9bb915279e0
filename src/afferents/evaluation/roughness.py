"""Roughness as a number: bump spacing in mm, of textures held out at speeds held out.

A texture held out has no class to be recognised as, but it lies somewhere among those learnt. So a
ridge regression on spacing learns from the others at the other speeds, and is asked for mm. Two
questions, each at a speed held out: of textures learnt at other speeds (`seen`), and of a texture
left out altogether (`unseen`).

Intervals are 90% intervals by errors inside the training data: as wide as nine in ten errors of the
same kind there, where speeds, or textures and speeds, are left out in turn. They promise nothing
of what is held out, which is unlike the rest, most of all a texture held out; which share of the
samples they did hold is in the results, of both kinds.
"""

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray
from torch import Tensor

from afferents import dims
from afferents.encodings.base import Encoding
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.evaluation.metrics import inside_speeds
from afferents.evaluation.schemas import RoughnessOutcome
from afferents.evaluation.unknown import ConditionSums
from afferents.models.fit_solved import new_solved
from afferents.models.model import Model
from afferents.progress import Progress
from afferents.store.recording import spacing_mm

COVERAGE = 0.9
"""Share of the errors inside the training data that an interval is as wide as."""
PENALTY = 0.01
"""Of the penalty, for each condition learnt from; chosen on a tuning session."""
LEAST_TEXTURES = 4
"""With bumps: one is left out, another inside, and two span a range."""

Condition = tuple[float, float]
"""Spacing, mm, and speed, mm/s."""


def can_ask_mm(textures: Collection[str]) -> bool:
    """Tell whether textures named by their spacing are all numbers, and enough to lie between."""
    spacings = [spacing_mm(texture) for texture in textures]
    return None not in spacings and sum(bool(spacing) for spacing in spacings) >= LEAST_TEXTURES


def ask_mm(model: Model, samples: Samples, encoding: Encoding, progress: Progress) -> pd.DataFrame:
    """Ask a model for the mm of every sample of a texture with bumps; a row a sample and kind.

    Raises
    ------
    InputError
        If there are fewer than 4 textures with bumps or 3 speeds.
    """
    spacing = np.array([float(t) for t in samples[dims.TEXTURE].values])
    bumpy = samples.isel({dims.SAMPLE: np.flatnonzero(spacing > 0)})
    # Flat, or over cycles per mm where the speed is known.
    speed = torch.from_numpy(bumpy[dims.SPEED].values)
    solved = new_solved(model, bumpy, encoding)
    values = solved.over_texture(torch.from_numpy(bumpy.values), speed)
    return _ask(model, sums_of(bumpy, values), bumpy, progress)


def summarise_mm(table: pd.DataFrame) -> dict[str, Any]:
    """Return the fields of `RoughnessSummary` that the tables of all models come to."""
    return {
        "coverage_asked": COVERAGE,
        "models": {
            str(model): {str(kind): _summary_of(part) for kind, part in of_model.groupby("kind")}
            for model, of_model in table.groupby("model", sort=False)
        },
    }


def sums_of(samples: Samples, values: Tensor) -> ConditionSums:
    """Gather samples (n, ...) by spacing and speed, each condition of the same weight."""
    spacing = np.array([float(t) for t in samples[dims.TEXTURE].values])
    speed = samples[dims.SPEED].values
    _, number, count = np.unique(
        np.stack([spacing, speed]), axis=1, return_inverse=True, return_counts=True
    )
    targets, weight = torch.from_numpy(spacing)[:, None], torch.from_numpy(1 / count[number])
    sums = ConditionSums(values, spacing, speed, targets, weight)
    n_spacings, n_speeds = len(sums.there(0)), len(sums.there(1))
    if n_spacings < LEAST_TEXTURES or n_speeds < 3:
        raise InputError(
            f"the data: expected at least {LEAST_TEXTURES} textures with bumps and 3 speeds to "
            f"ask for mm, found {n_spacings} and {n_speeds}"
        )
    return sums


def _predict(
    sums: ConditionSums,
    asked: Collection[Condition],
    spacings: Collection[float],
    speeds: Collection[float],
) -> dict[Condition, NDArray[np.float64]]:
    """Return spacings in mm of the samples of some conditions, learnt without these others."""
    n_learnt = sum(c[0] not in spacings and c[1] not in speeds for c in sums.where)
    weight, constant = sums.without(spacings, speeds).solve(PENALTY * n_learnt)
    return {
        c: (sums.values[torch.from_numpy(sums.where[c])] @ weight + constant)[:, 0].double().numpy()
        for c in asked
    }


def _ask(model: Model, sums: ConditionSums, samples: Samples, progress: Progress) -> pd.DataFrame:
    """Ask for the spacing of everything, at each speed in turn, seen and unseen."""
    rows = []
    speeds = sums.there(1)
    with progress.task(model.title, len(speeds)) as mark:
        for done, speed in enumerate(speeds, start=1):
            rows.append(_seen(sums, samples, speed))
            rows += [_unseen(sums, samples, x, speed) for x in sums.there(0)
                     if (x, speed) in sums.where]  # fmt: skip
            mark(done, f"{speed:g} mm/s held out")
    return pd.concat(rows, ignore_index=True).assign(model=model.name)


def _seen(sums: ConditionSums, samples: Samples, speed: float) -> pd.DataFrame:
    """Ask for all textures at a speed held out.

    Errors at the other speeds, each left out as well in its turn, give the interval.
    """
    at = [c for c in sums.where if c[1] == speed]
    errors = []
    for other in sums.there(1):
        if other != speed:
            there = [c for c in sums.where if c[1] == other]
            errors += _errors(_predict(sums, there, (), (speed, other)))
    return _rows("seen", sums, samples, _predict(sums, at, (), (speed,)), errors)


def _unseen(sums: ConditionSums, samples: Samples, spacing: float, speed: float) -> pd.DataFrame:
    """Ask for a texture and a speed held out.

    For the interval, each other texture is left out as well, with one of the other speeds.
    """
    errors = []
    others = [v for v in sums.there(1) if v != speed]
    for number, other in enumerate(x for x in sums.there(0) if x != spacing):
        there = (other, others[number % len(others)])
        if there in sums.where:
            errors += _errors(_predict(sums, [there], (spacing, other), (speed, there[1])))
    predicted = _predict(sums, [(spacing, speed)], (spacing,), (speed,))
    return _rows("unseen", sums, samples, predicted, errors)


def _errors(predicted: dict[Condition, NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    return [np.abs(mm - condition[0]) for condition, mm in predicted.items()]


def _rows(
    kind: str,
    sums: ConditionSums,
    samples: Samples,
    predicted: dict[Condition, NDArray[np.float64]],
    errors: Sequence[NDArray[np.float64]],
) -> pd.DataFrame:
    """Return a row a sample; half the width of its interval is that which held the errors."""
    if not errors or not any(map(len, errors)):
        raise InputError(
            "the data: expected textures that are learnt from at several speeds, found none where "
            "one is held out; record more textures at each speed"
        )
    half = float(np.quantile(np.concatenate(errors), COVERAGE))
    index = np.concatenate([sums.where[c] for c in predicted])
    return pd.DataFrame(
        {
            "kind": kind,
            "spacing_mm": np.concatenate([np.full(len(mm), c[0]) for c, mm in predicted.items()]),
            "held_out_speed_mm_s": samples[dims.SPEED].values[index],
            dims.RECORDING: samples[dims.RECORDING].values[index],
            dims.START: samples[dims.START].values[index],
            dims.STOP: samples[dims.STOP].values[index],
            "predicted_mm": np.concatenate(list(predicted.values())),
            "half_interval_mm": half,
        }
    )


def _summary_of(rows: pd.DataFrame) -> RoughnessOutcome:
    """Return mean absolute errors, of samples and of recordings' means, and what intervals held."""
    error = (rows["predicted_mm"] - rows["spacing_mm"]).abs()
    by = ["spacing_mm", "held_out_speed_mm_s", dims.RECORDING]
    recordings = rows.groupby(by, as_index=False)["predicted_mm"].mean()
    of_recording = (recordings["predicted_mm"] - recordings["spacing_mm"]).abs()
    speed = rows["held_out_speed_mm_s"]
    inner = inside_speeds(rows).index
    by_spacing = error.groupby(rows["spacing_mm"]).mean()
    return RoughnessOutcome(
        mae_mm=_mean_by(error, speed),
        mae_mm_inside=_mean_by(error[inner], speed[inner]) if len(inner) else None,
        mae_mm_recordings=_mean_by(of_recording, recordings["held_out_speed_mm_s"]),
        by_speed={f"{v:g}": float(e) for v, e in error.groupby(speed).mean().items()},
        by_spacing={f"{x:g}": float(e) for x, e in by_spacing.items()},
        covered=float((error <= rows["half_interval_mm"]).mean()),
        half_interval_mm=float(rows["half_interval_mm"].mean()),
        n=len(rows),
    )


def _mean_by(error: "pd.Series[float]", speed: "pd.Series[float]") -> float:
    """Return the mean over speeds of the mean error at each."""
    return float(error.groupby(speed).mean().mean())
