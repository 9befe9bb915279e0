"""How often a texture never felt is called unknown, and how often one that was felt is.

A table of novelty has one row a sample asked, with the columns held_out_speed_mm_s,
left_out (the texture of which nothing was learnt), texture (its own), recording, novelty
(above 1 the sample is called unknown) and recordings_limit (above which the mean over a recording
calls that unknown). A texture that is not left out is asked once for each that is.
"""

from typing import Any

import numpy as np
import pandas as pd

from afferents.core.replicate import TEXTURE
from afferents.evaluation.bootstrap import Accuracy, bootstrap_interval
from afferents.evaluation.metrics import accuracy_by_group
from afferents.evaluation.touches import inside_speeds, outside_speeds

FOLD = ["held_out_speed_mm_s", "left_out"]
"""What is held out together: a speed, and a texture."""


def summarise_unknown(table: pd.DataFrame, replicate: str = TEXTURE) -> dict[str, Any]:
    """Return what a table of novelty of one model comes to; docs/results-format.md.

    Parameters
    ----------
    table
        As above.
    replicate
        What is drawn anew for intervals, as `count_right` takes it.
    """
    table = table.reset_index(drop=True)
    touched = recordings_of(table)
    kinds = {"samples": table, "recordings": touched}
    never = {unit: rows["left_out"] == rows["texture"] for unit, rows in kinds.items()}
    return {
        "found": {
            unit: share_unknown(rows[never[unit]], replicate) for unit, rows in kinds.items()
        },
        "false_alarms": {
            unit: share_unknown(rows[~never[unit]], replicate) for unit, rows in kinds.items()
        },
        "auroc": {unit: _mean_auroc(rows) for unit, rows in kinds.items()},
        "auroc_inside": {
            unit: _mean_auroc(inner) if len(inner := inside_speeds(rows)) else None
            for unit, rows in kinds.items()
        },
        "auroc_outside": {
            unit: _mean_auroc(outside_speeds(rows)) if len(inside_speeds(rows)) else None
            for unit, rows in kinds.items()
        },
        "auroc_by_speed": {
            f"{v:g}": _mean_auroc(rows) for v, rows in table.groupby("held_out_speed_mm_s")
        },
        "by_texture": {
            str(texture): {
                **{
                    f"found_{unit}": _by_speed_mean(rows[rows["left_out"] == texture], True)
                    for unit, rows in kinds.items()
                },
                "false_alarms": _by_speed_mean(table[table["texture"] == texture], False),
                "auroc": _mean_auroc(table[table["left_out"] == texture]),
            }
            for texture in pd.unique(table["left_out"])
        },
        "n": int(never["samples"].sum()),
    }


def recordings_of(table: pd.DataFrame) -> pd.DataFrame:
    """Return one row a recording and fold: its novelty is the mean over its samples.

    It is measured by the recordings' own limit, so that above 1 is unknown here too.
    """
    rows = table.groupby([*FOLD, "texture", "recording"], sort=False, as_index=False)[
        ["novelty", "recordings_limit"]
    ].mean()
    return rows.assign(novelty=rows["novelty"] / rows["recordings_limit"])


def share_unknown(rows: pd.DataFrame, replicate: str = TEXTURE) -> dict[str, Any]:
    """Return the share of rows called unknown: mean over held-out speeds, and by speed.

    The 95% interval is by bootstrap over replicates, as of accuracies. The same of the speeds that
    lie between others, and of the slowest and the fastest, which lie outside what was learnt when
    they are held out; None where no speed lies between others.
    """
    called = _called(rows).reset_index(drop=True)
    inner, outer = inside_speeds(called), outside_speeds(called)
    return {
        **_mean_and_interval(called, replicate),
        "inside": _mean_and_interval(inner, replicate) if len(inner) else None,
        "outside": _mean_and_interval(outer, replicate) if len(inner) else None,
        "by_speed": {f"{speed:g}": share for speed, share in accuracy_by_group(called).items()},
    }


def auroc(rows: pd.DataFrame) -> float:
    """Return how often an unknown sample is more novel than a known one, of all pairs."""
    from sklearn.metrics import roc_auc_score  # workers need none of it

    return float(roc_auc_score(rows["left_out"] == rows["texture"], rows["novelty"]))


def _mean_and_interval(called: pd.DataFrame, replicate: str) -> dict[str, Any]:
    accuracy = Accuracy(called, replicate)
    interval = bootstrap_interval(accuracy)
    return {"mean": accuracy.mean(), "ci95": [interval.low, interval.high]}


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
