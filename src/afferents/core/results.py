"""Results of an evaluation: what `evaluate` leaves in its folder and `report` reads.

::

    RESULTS/
      config.json             what was evaluated: data, cut, preset, encodings, training
      summary.json            the numbers (schema in docs/results-format.md)
      predictions.parquet     one row a test sample
      folds/<model>/<protocol>/seed-<seed>/<speed>/
        fold.json, predictions.parquet, weights.safetensors
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa

from afferents.core.errors import InputError
from afferents.core.files import read_json

SCHEMA = 1
CONFIG, SUMMARY, PREDICTIONS = "config.json", "summary.json", "predictions.parquet"
UNKNOWN, ROUGHNESS = "unknown", "roughness"
"""What `--split texture` asks: names of its summaries (JSON) and tables (Parquet)."""
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
    config = read_json(root / CONFIG, "the configuration of an evaluation")
    summary = read_json(root / SUMMARY, "the summary of an evaluation")
    if summary.get("schema") != SCHEMA:
        raise InputError(root / SUMMARY, f"schema {SCHEMA}", f"{summary.get('schema')}")
    return Results(root, config, summary, read_predictions(root / PREDICTIONS))


def read_predictions(path: Path) -> pd.DataFrame:
    """Read a table of predictions.

    Raises
    ------
    InputError
        If the file is missing or damaged.
    """
    try:
        return pd.read_parquet(path)
    except (OSError, pa.ArrowException) as error:
        raise InputError(
            path, "a table of predictions", f"{error}", "remove its folder and evaluate again"
        ) from error
