"""Name touches by several models at once, from the predictions that `evaluate` left.

    python scripts/fuse_predictions.py RESULTS --models sa-wave-vector,vib-te-aug --touch 1,4

A touch is a stretch of a recording. Each model's samples that begin in it give a mean
log-probability, and the models' means are added with equal weights: nothing is chosen. Prints
percent named rightly: mean over held-out speeds, then each.
"""

import argparse
from functools import reduce
from pathlib import Path

import numpy as np
import pandas as pd

LEAST = 1e-6
"""Probabilities below are taken for it, so that one sample alone decides nothing."""
KEYS = ["held_out_speed_mm_s", "recording", "true_texture", "touch"]


def evidence(table: pd.DataFrame, model: str, protocol: str, touch_s: float) -> pd.DataFrame:
    """Return a model's mean log-probabilities, a row a touch and a column a texture."""
    mine = table[(table["model"] == model) & (table["protocol"] == protocol)]
    textures = [name for name in mine.columns if name.startswith("p_")]
    first = mine.groupby("recording")["start_s"].transform("min")
    touch = ((mine["start_s"] - first) // touch_s).astype(int)
    logs = np.log(mine[textures].clip(lower=LEAST))
    keys = [mine[name].astype(str) if name == "true_texture" else mine[name] for name in KEYS[:-1]]
    return logs.groupby([*keys, touch.rename("touch")]).mean()


def accuracy(tables: list[pd.DataFrame]) -> "pd.Series[float]":
    """Return percent of the touches that all models felt named rightly, by held-out speed."""
    felt = reduce(lambda a, b: a.intersection(b), (table.index for table in tables))
    total = reduce(lambda a, b: a + b, (table.loc[felt] for table in tables))
    named = total.idxmax(axis=1).str.removeprefix("p_")
    right = named.to_numpy() == total.index.get_level_values("true_texture").to_numpy()
    speeds = total.index.get_level_values("held_out_speed_mm_s")
    return 100 * pd.Series(right, index=speeds).groupby(level=0).mean()


def main() -> None:
    """Print a line a length of touch."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("--models", default="sa-wave-vector,vib-te-aug")
    parser.add_argument("--protocol", default="nested")
    parser.add_argument("--touch", default="1,4", help="lengths, s")
    asked = parser.parse_args()
    table = pd.read_parquet(asked.results / "predictions.parquet")
    for touch_s in map(float, asked.touch.split(",")):
        names = asked.models.split(",")
        by_speed = accuracy([evidence(table, n, asked.protocol, touch_s) for n in names])
        each = ", ".join(f"{speed:g}: {value:.0f}" for speed, value in by_speed.items())
        print(f"{touch_s:g} s: {by_speed.mean():.1f} ({each} mm/s)")


if __name__ == "__main__":
    main()
