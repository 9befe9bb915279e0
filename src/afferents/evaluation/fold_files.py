"""Folds on disk: each finished one is written whole, at once, and never trained again."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents import dims
from afferents.documents import read_checked
from afferents.encodings.samples import Samples
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.results import (
    CONFIG,
    OPTIONS,
    PREDICTIONS,
    PROBABILITY,
    read_config,
    read_predictions,
)
from afferents.evaluation.schemas import FoldFacts
from afferents.files import PARTIAL_PREFIX, holds_only, require_same_config, write_aside, write_json
from afferents.folds.held_out import SPEED, Group, Split, folder_name, key_of, order, split_named
from afferents.folds.protocol import Fold
from afferents.folds.splits import Leaks
from afferents.models.model import MODELS
from afferents.outputs import LOCK

FOLDS, PLAN = "folds", "plan.json"
FOLD, WEIGHTS = "fold.json", "weights.safetensors"
AGAIN = "remove its folder and evaluate again"


@dataclass(frozen=True)
class FoldKey:
    """What names a fold in a results folder: whose it is, and which group is held out."""

    model: str
    protocol: str
    seed: int
    held_out: Group
    split: Split = SPEED

    @classmethod
    def of(cls, facts: Mapping[str, Any]) -> "FoldKey":
        """Return the key that a document names; see `describe`."""
        split = split_named(facts.get("split", SPEED.name))
        whose = {name: facts[name] for name in ("model", "protocol", "seed")}
        return cls(**whose, held_out=facts[split.held_out], split=split)

    def describe(self) -> dict[str, Any]:
        """Return it as documents hold it."""
        which = {} if self.split == SPEED else {"split": self.split.name}
        whose = {"model": self.model, "protocol": self.protocol, "seed": self.seed}
        return {**whose, **which, self.split.held_out: self.held_out}

    def folder(self, results: Path) -> Path:
        """Return the folder of this fold."""
        return (
            results
            / FOLDS
            / self.model
            / self.protocol
            / f"seed-{self.seed}"
            / folder_name(self.held_out)
        )

    def checkpoint(self, results: Path) -> Path:
        """Return the file that holds this fold's checkpoint."""
        folder = self.folder(results)
        return folder.with_name(f"{folder.name}.checkpoint")

    def __str__(self) -> str:
        """Return it in words."""
        held_out = f"{self.split.printed(self.held_out)} held out"
        return f"{self.model}, {self.protocol}, seed {self.seed}, {held_out}"


def finished(results: Path, key: FoldKey) -> bool:
    """Tell whether a fold is there: present means complete."""
    return (key.folder(results) / FOLD).is_file()


def finished_keys(results: Path) -> list[FoldKey]:
    """List the finished folds of a results folder, in order of model, protocol, seed, group."""
    keys = [_key_of(results, path) for path in results.glob(f"{FOLDS}/*/*/*/*/{FOLD}")]
    rank = {name: i for i, name in enumerate(MODELS)}

    def place(key: FoldKey) -> tuple[int, str, str, int, tuple[float, str]]:
        own = rank.get(key.model, len(rank))
        return own, key.model, key.protocol, key.seed, order(key.held_out)

    return sorted(keys, key=place)


def read_facts(path: Path) -> dict[str, Any]:
    """Read a fold's facts.

    Raises
    ------
    InputError
        If they are missing or damaged.
    """
    return read_checked(path, FoldFacts, "the facts of a fold", AGAIN)


def _key_of(results: Path, path: Path) -> FoldKey:
    """Return the key of the fold whose facts lie at `path`."""
    key = FoldKey.of(read_facts(path))
    if key.folder(results) != path.parent:
        raise InputError(
            f"{path}: expected the facts of the fold that its folder names, found {key!s}; {AGAIN}"
        )
    return key


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
    if dims.VARIANT in samples.coords:
        variant = samples[dims.VARIANT].values[fold.test]
        if (variant != variant[0]).any():
            table[dims.VARIANT] = variant
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
        write_json(partial / FOLD, {**key.describe(), **facts, "leaks": leaks.describe(key.split)})


def load_fold(results: Path, key: FoldKey) -> tuple[dict[str, Any], pd.DataFrame]:
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
    elif results.exists() and (not results.is_dir() or _foreign(results)):
        raise InputError(
            f"{results}: expected a new, empty or results folder, found something else; choose "
            "another --out"
        )


def _foreign(results: Path) -> bool:
    """Say whether a folder without finished folds holds other than what a run leaves at first."""
    names = (path.name for path in results.iterdir())
    return any(not (n in (PLAN, FOLDS, LOCK) or n.startswith(PARTIAL_PREFIX)) for n in names)


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


# How the trainings behind an outcome went: the epoch that was kept, and the first one.


def course_of(facts: Iterable[Mapping[str, Any]], split: Split) -> dict[str, dict[str, list[Any]]]:
    """Return the best and the first epoch by group held out, one value a seed.

    Parameters
    ----------
    facts
        Of folds of one model under one protocol, as `fold.json` holds them. What was solved at
        once has no epochs and is passed over.
    split
        What was held out.

    Returns
    -------
    dict
        ``best_epoch``: the number, from 1, of the epoch whose weights were kept. ``first_epoch``:
        its accuracies, shares from 0 to 1, as ``training`` (over the epoch's batches, with
        dropout, as Keras logs it too) and ``validation``.
    """
    best: dict[str, list[int]] = {}
    first: dict[str, list[dict[str, float]]] = {}
    for fact in facts:
        history = fact.get("history", ())
        if not history or fact.get("best_epoch") is None:
            continue
        group, epoch = key_of(fact[split.held_out]), history[0]
        best.setdefault(group, []).append(fact["best_epoch"])
        first.setdefault(group, []).append(
            {"training": epoch["accuracy"], "validation": epoch["validation_accuracy"]}
        )
    return {"best_epoch": best, "first_epoch": first}


def read_course(
    results: Path,
    model: str,
    protocol: str,
    seeds: Sequence[int],
    groups: Sequence[Any],
    split: Split,
) -> dict[str, dict[str, list[Any]]]:
    """Return the same of a results folder, from the folds that are still there.

    For summaries written before these were recorded. A fold that is gone or damaged is passed
    over: its numbers stand in the summary all the same.
    """  # fmt: skip
    keys = [FoldKey(model, protocol, seed, group, split) for group in groups for seed in seeds]
    return course_of(filter(None, (_facts(key.folder(results) / FOLD) for key in keys)), split)


def _facts(path: Path) -> dict[str, Any] | None:
    try:
        return read_facts(path)
    except (AfferentsError, OSError):
        return None
