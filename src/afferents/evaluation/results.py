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
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents.documents import read_checked
from afferents.errors import InputError, reading
from afferents.evaluation.schemas import (
    AGAIN,
    Config,
    Summary,
)
from afferents.folds.held_out import Split
from afferents.plugins import import_extra

CONFIG, SUMMARY, PREDICTIONS = "config.json", "summary.json", "predictions.parquet"
OPTIONS = "options"
"""In the configuration: what was chosen in the last run, which `--config` takes again."""
OWN_MODELS = "own_models.json"
"""What models of a user's own are."""
PROBABILITY = "p_"
"""Prefix of the predictions' probability columns, one a texture."""


@dataclass(frozen=True)
class Results:
    """A results folder in memory.

    Attributes
    ----------
    root
        The folder.
    config
        What was evaluated, as `config.json` holds it.
    found
        The numbers, as they are passed about.
    predictions
        Columns model, protocol, seed, held_out_speed_mm_s (held_out_group where something else
        than speed was held out), recording, start_s, stop_s, true_texture, predicted_texture and
        `p_<texture>` for every texture.
    """

    root: Path
    config: dict[str, Any]
    found: Summary
    predictions: pd.DataFrame

    @cached_property
    def summary(self) -> dict[str, Any]:
        """All numbers, as `summary.json` holds them; see docs/results-format.md."""
        return self.found.content()

    @property
    def accuracy(self) -> pd.DataFrame:
        """Share of test samples recognised, by model, protocol and speed or group held out.

        Columns model, protocol, held_out_speed_mm_s (or held_out_group), accuracy, ci95_low,
        ci95_high. The mean over speeds stands in a row without a speed. Intervals are of 95%.
        """
        split = self.split
        rows: list[tuple[Any, ...]] = []
        number, none = (float, np.nan) if split.ordered else (str, None)
        for model, of_protocol in self.found.models.items():
            for protocol, found in of_protocol.items():
                for group, accuracy in found.by.items():
                    rows.append((model, protocol, number(group), accuracy, *found.ci95_by[group]))
                rows.append((model, protocol, none, found.mean_accuracy, *found.ci95))
        names = ("model", "protocol", split.column, "accuracy", "ci95_low", "ci95_high")
        return pd.DataFrame(rows, columns=list(names))

    @property
    def split(self) -> Split:
        """What was held out."""
        return self.found.split

    @property
    def textures(self) -> list[str]:
        """Textures in natural order."""
        return list(self.found.textures)


def load_results(root: str | Path) -> Results:
    """Read a results folder.

    Parameters
    ----------
    root
        The folder that `evaluate` has written.

    Returns
    -------
    Results
        `accuracy`, a table of shares from 0 to 1 by model, protocol and held-out speed (mm/s);
        `predictions`, a table with a row for each test sample; `summary`, all numbers of the
        report. `afferents.plot` draws them.

    Raises
    ------
    InputError
        If the folder, or one of its files, is missing or of another schema.
    """
    root = Path(root)
    for name in (CONFIG, SUMMARY, PREDICTIONS):
        if not (root / name).is_file():
            reproduced = root / "results"
            there = (reproduced / SUMMARY).is_file()
            do = f"its results are in {reproduced}" if there else "run evaluate first"
            raise InputError(f"{root}: expected a results folder with {name}, found none; {do}")
    config, found = read_config(root), read_summary(root)
    return Results(root, config, found, read_predictions(root / PREDICTIONS))


def read_config(root: Path) -> dict[str, Any]:
    """Read what a results folder holds; see `load_results`."""
    return read_checked(root / CONFIG, Config, "the configuration of an evaluation", AGAIN)


def read_summary(root: Path) -> Summary:
    """Read the numbers of a results folder; see `load_results`."""
    return Summary.read(root / SUMMARY, "the summary of an evaluation")


def read_predictions(path: Path) -> pd.DataFrame:
    """Read a table of predictions.

    Raises
    ------
    InputError
        If the file is missing, damaged, or holds another table.
    """
    import_extra("train", str(path), "pyarrow")
    do = "remove its folder and evaluate again"
    with reading(path, "a table of predictions", do=do), path.open("rb") as file:
        return pd.read_parquet(file)
