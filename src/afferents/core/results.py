"""Results of an evaluation: what `evaluate` leaves in its folder and `report` reads.

::

    RESULTS/
      config.json             what was evaluated: data, cut, preset, encodings, training
      summary.json            the numbers (schema in docs/results-format.md)
      predictions.parquet     one row a test sample
      folds/<model>/<protocol>/seed-<seed>/<speed>/
        fold.json, predictions.parquet, weights.safetensors
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from afferents.core.errors import InputError

SCHEMA = 1
CONFIG, SUMMARY, PREDICTIONS = "config.json", "summary.json", "predictions.parquet"
PROBABILITY = "p_"
"""Prefix of the predictions' probability columns, one a texture."""


@dataclass(frozen=True)
class Results:
    """A results folder in memory.

    `predictions` has the columns model, protocol, seed, held_out_speed_mm_s, recording,
    start_s, stop_s, true_texture, predicted_texture and `p_<texture>` for every texture.
    """

    root: Path
    config: dict[str, Any]
    summary: dict[str, Any]
    predictions: pd.DataFrame

    @property
    def textures(self) -> list[str]:
        """Textures in natural order."""
        return list(self.summary["textures"])


def load_results(root: Path) -> Results:
    """Read a results folder.

    Raises
    ------
    InputError
        If the folder, or one of its files, is missing or of another schema.
    """
    for name in (CONFIG, SUMMARY, PREDICTIONS):
        if not (root / name).is_file():
            raise InputError(root, f"a results folder with {name}", "none", "run evaluate first")
    config = json.loads((root / CONFIG).read_text(encoding="utf-8"))
    summary = json.loads((root / SUMMARY).read_text(encoding="utf-8"))
    if summary.get("schema") != SCHEMA:
        raise InputError(root / SUMMARY, f"schema {SCHEMA}", f"{summary.get('schema')}")
    return Results(root, config, summary, pd.read_parquet(root / PREDICTIONS))
