"""Folds on disk: each finished one is written whole, at once, and never trained again."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.evaluation.results import (
    CONFIG,
    OPTIONS,
    OWN_MODELS,
    PREDICTIONS,
    PROBABILITY,
    read_config,
    read_predictions,
)
from afferents.evaluation.schemas import Counted, ModelName, Schema
from afferents.files import (
    holds_only,
    require_free,
    require_same_config,
    write_aside,
    write_json,
)
from afferents.folds.held_out import (
    SPEED,
    Amount,
    Count,
    Group,
    GroupName,
    Share,
    Speed,
    Split,
    SplitName,
    folder_name,
    order,
    split_named,
)
from afferents.folds.protocol import Fold, ProtocolName
from afferents.folds.splits import Leaks
from afferents.models.model import MODELS

FOLDS, PLAN = "folds", "plan.json"
FOLD, WEIGHTS = "fold.json", "weights.safetensors"
AGAIN = "remove its folder and evaluate again"


class FoldKey(Schema):
    """What names a fold in a results folder: whose it is, and which group is held out."""

    model: ModelName
    """Of which model."""
    protocol: ProtocolName
    """`nested` or `published`."""
    seed: Count
    """Of the training."""
    split_name: SplitName = Field(default=SPEED.name, alias="split")
    """By what was split: `speed`, or another split's name."""
    held_out: Speed | GroupName
    """The speed held out, mm/s; with another split the group."""

    @classmethod
    def of(
        cls, model: str, protocol: str, seed: int, held_out: Group, split: Split = SPEED
    ) -> "FoldKey":
        """Return the key of a fold."""
        named = {"model": model, "protocol": protocol, "seed": seed, "split": split.name}
        return FoldKey(**named, held_out=held_out)

    @property
    def split(self) -> Split:
        """What is held out: a speed, or a group of another split."""
        return split_named(self.split_name)

    def folder(self, results: Path) -> Path:
        """Return the folder of this fold."""
        seeds = results / FOLDS / self.model / self.protocol
        return seeds / f"seed-{self.seed}" / folder_name(self.held_out)

    def mark(self, results: Path, kind: str) -> Path:
        """Return the file beside its folder that says `running` or `failed`, or a `checkpoint`."""
        folder = self.folder(results)
        return folder.with_name(f"{folder.name}.{kind}")

    def __str__(self) -> str:
        """Return it in words."""
        held_out = f"{self.split.printed(self.held_out)} held out"
        return f"{self.model}, {self.protocol}, seed {self.seed}, {held_out}"


def finished(results: Path, key: FoldKey) -> bool:
    """Tell whether a fold is there: present means complete."""
    return (key.folder(results) / FOLD).is_file()


def finished_keys(results: Path) -> list[FoldKey]:
    """List the finished folds of a results folder, in order of model, protocol, seed, group."""
    keys = [read_facts(path).key for path in results.glob(f"{FOLDS}/*/*/*/*/{FOLD}")]
    rank = {name: i for i, name in enumerate(MODELS)}

    def place(key: FoldKey) -> tuple[int, str, str, int, tuple[float, str]]:
        own = rank.get(key.model, len(rank))
        return own, key.model, key.protocol, key.seed, order(key.held_out)

    return sorted(keys, key=place)


class Epoch(Schema):
    """An epoch of a training."""

    accuracy: Share
    """Over its batches, with dropout."""
    validation_accuracy: Share
    """After it."""


class FoldFacts(FoldKey):
    """`fold.json`: a finished fold, and how its training went."""

    seconds: Amount
    """Of training, testing included."""
    job_seconds: Amount | None = None
    """The same with what was read and encoded for it."""
    prediction_ms: Amount | None = None
    """Of one test sample alone, median, ms; of models that can be asked so, under `nested`."""
    validated_by: Speed | GroupName
    """The speed that validated, mm/s; with another split the group."""
    validation_accuracy: Share
    """Of the weights that were kept."""
    epochs: Count
    """That were trained; 0 for models that are solved at once."""
    best_epoch: Count | None = None
    """Number, from 1, of the epoch whose weights were kept."""
    history: tuple[Epoch, ...] = ()
    """`accuracy`, `validation_accuracy` and losses of each epoch."""
    leaks: dict[str, Counted]
    """What was seen of the test samples before the test; all 0 and false under `nested`."""

    @property
    def key(self) -> FoldKey:
        """Of which fold."""
        return FoldKey.of(self.model, self.protocol, self.seed, self.held_out, self.split)


def read_facts(path: Path) -> FoldFacts:
    """Read a fold's facts.

    Raises
    ------
    InputError
        If they are missing or damaged.
    """
    return FoldFacts.read(path, "the facts of a fold", AGAIN)


def predictions_table(
    key: FoldKey,
    samples: Samples,
    fold: Fold,
    probabilities: NDArray[np.float32],
    textures: list[str],
    speed_mm_s: NDArray[np.float64] | None = None,
) -> pd.DataFrame:
    """Return one row a test sample.

    Parameters
    ----------
    probabilities
        Shape (test sample, texture).
    speed_mm_s
        What the model took the speed for, (test sample,); None where it did not.
    """
    tested = {name: samples[name].to_numpy()[fold.test] for name in dims.SAMPLE_COORDS}
    table = pd.DataFrame(
        {
            "model": key.model,
            "protocol": key.protocol,
            "seed": key.seed,
            key.split.column: key.held_out,
            dims.RECORDING: tested[dims.RECORDING],
            dims.START: tested[dims.START],
            dims.STOP: tested[dims.STOP],
            "true_texture": tested[dims.TEXTURE],
            "predicted_texture": np.array(textures)[probabilities.argmax(axis=1)],
        }
    )
    if speed_mm_s is not None:
        table["predicted_speed_mm_s"] = speed_mm_s
    columns = {f"{PROBABILITY}{t}": probabilities[:, i] for i, t in enumerate(textures)}
    return pd.concat([table, pd.DataFrame(columns)], axis=1)


def save_fold(
    results: Path,
    key: FoldKey,
    predictions: pd.DataFrame,
    facts: Mapping[str, Any],
    leaks: Leaks,
    weights: bytes,
) -> None:
    """Write a fold's predictions, facts, and the content of its weights file; all or nothing."""
    with write_aside(key.folder(results), holds_only(FOLD, PREDICTIONS, WEIGHTS)) as partial:
        partial.mkdir()
        with (partial / PREDICTIONS).open("wb") as file:
            predictions.to_parquet(file, compression="zstd", index=False)
        (partial / WEIGHTS).write_bytes(weights)
        found = {**key.content(), **facts, "leaks": leaks.describe(key.split)}
        FoldFacts.model_validate(found).write(partial / FOLD)


def load_fold(results: Path, key: FoldKey) -> tuple[FoldFacts, pd.DataFrame]:
    """Read a finished fold: its facts and its predictions."""
    folder = key.folder(results)
    return read_facts(folder / FOLD), read_predictions(folder / PREDICTIONS)


def check_results_folder(results: Path, config: Mapping[str, Any]) -> None:
    """Check that a folder is new, empty, or holds results of this configuration.

    Raises
    ------
    InputError
        If it holds something else, or the results of another configuration.
    """
    if (results / CONFIG).is_file():
        earlier = read_config(results)
        require_same_config(results, "results", _comparable(earlier), _comparable(config))
    else:
        require_free(results, holds_only(PLAN, FOLDS, OWN_MODELS))


def _without_paths(config: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out where data lie: their fingerprint tells them, and they may move.

    And what was chosen in one run: other models, seeds or processes stand in the same folder.
    """
    data = [{k: v for k, v in d.items() if k != "source"} for d in config.get("data", [])]
    return {**{k: v for k, v in config.items() if k != OPTIONS}, "data": data}


def _comparable(config: Mapping[str, Any]) -> dict[str, Any]:
    """Return a configuration with what it leaves unsaid."""
    return {"split": SPEED.name, "steady_s": "as recorded", **_without_paths(config)}


def claim_results_folder(results: Path, config: Mapping[str, Any]) -> None:
    """Write the configuration, as far as another did not; called when a fold is about to be kept.

    Raises
    ------
    InputError
        If an evaluation with another configuration was quicker.
    """
    if (results / CONFIG).is_file():
        check_results_folder(results, config)
    else:
        write_json(results / CONFIG, dict(config))


def digest_of(config: Mapping[str, Any]) -> str:
    """Return what tells a configuration from others, wherever its data lie."""
    text = json.dumps(_without_paths(config), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
