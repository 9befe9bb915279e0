"""The summary of a results folder; its schema is documented in docs/results-format.md."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from afferents.core.files import write_aside, write_json
from afferents.core.results import PREDICTIONS, SCHEMA, SUMMARY
from afferents.evaluation.folds import FoldKey, load_fold
from afferents.evaluation.metrics import accuracy_by_speed, bootstrap_interval, confusion, macro_f1


def summarise(
    results: Path, keys: Sequence[FoldKey], textures: list[str], about: Mapping[str, Any]
) -> dict[str, Any]:
    """Read the folds of `keys`, write predictions.parquet and summary.json, return the summary.

    Parameters
    ----------
    about
        What the summary says of the whole (data, cut, preset, skipped recordings).
    """
    loaded = [(key, *load_fold(results, key)) for key in keys]
    models: dict[str, dict[str, Any]] = {}
    for model, protocol in dict.fromkeys((key.model, key.protocol) for key in keys):
        mine = [
            entry for entry in loaded if (entry[0].model, entry[0].protocol) == (model, protocol)
        ]
        predictions = pd.concat([table for _, _, table in mine])
        facts = [fact for _, fact, _ in mine]
        models.setdefault(model, {})[protocol] = _summary_of(predictions, facts, textures)
    with write_aside(results / PREDICTIONS) as partial:
        pd.concat([table for _, _, table in loaded]).to_parquet(
            partial, compression="zstd", index=False
        )
    summary = {"schema": SCHEMA, **about, "textures": textures, "models": models}
    write_json(results / SUMMARY, summary)
    return summary


def _summary_of(
    predictions: pd.DataFrame, facts: list[dict[str, Any]], textures: list[str]
) -> dict[str, Any]:
    by_speed = accuracy_by_speed(predictions)
    interval = bootstrap_interval(predictions)
    worst = min(by_speed, key=lambda speed: by_speed[speed])
    return {
        "mean_accuracy": sum(by_speed.values()) / len(by_speed),
        "ci95": [interval.low, interval.high],
        "by_speed": {f"{speed:g}": accuracy for speed, accuracy in by_speed.items()},
        "worst_speed": f"{worst:g}",
        "macro_f1": macro_f1(predictions, textures),
        "confusion": confusion(predictions, textures).tolist(),
        "n_test": len(predictions),
        "seeds": sorted({fact["seed"] for fact in facts}),
        "validation_speeds": _by_speed(facts, "validation_mm_s", first=True),
        "validation_accuracy": _by_speed(facts, "validation_accuracy"),
        "epochs": _by_speed(facts, "epochs"),
        "seconds": sum(fact["seconds"] for fact in facts),
        "leaks": _total_leaks(facts),
    }


def _by_speed(facts: list[dict[str, Any]], name: str, first: bool = False) -> dict[str, Any]:
    """Collect a fact by held-out speed: one value a seed, or the first seed's alone."""
    collected: dict[str, list[Any]] = {}
    for fact in facts:
        collected.setdefault(f"{fact['held_out_mm_s']:g}", []).append(fact[name])
    return {speed: values[0] if first else values for speed, values in collected.items()}


def _total_leaks(facts: list[dict[str, Any]]) -> dict[str, Any]:
    total: dict[str, Any] = {}
    for fact in facts:
        for name, value in fact["leaks"].items():
            seen = isinstance(value, bool)
            total[name] = (total.get(name, False) or value) if seen else total.get(name, 0) + value
    return total
