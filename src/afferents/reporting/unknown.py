"""The tables of an evaluation that asks whether a texture never felt is recognised as unknown."""

from collections.abc import Callable, Mapping
from typing import Any

from afferents.core.results import ROUGHNESS, UNKNOWN
from afferents.reporting.labels import model_title, percent
from afferents.reporting.replicates import drawn_over
from afferents.reporting.roughness import roughness_table
from afferents.reporting.table import Cell, Table
from afferents.reporting.texture_names import spacing_note, texture_names


def texture_tables(summaries: Mapping[str, dict[str, Any]]) -> list[Table]:
    """Return the tables of `--split texture`, from its summaries by question."""
    unknown, mm = summaries.get(UNKNOWN), summaries.get(ROUGHNESS)
    tables = [unknown_table(unknown), unknown_by_texture(unknown)] if unknown else []
    return tables + ([roughness_table(mm)] if mm else [])


def unknown_table(summary: dict[str, Any]) -> Table:
    """Return false alarms stated and measured, and what is found, of every model."""
    stated = percent(summary["false_alarms_stated"], 0)
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(title),
            Cell(speeds),
            *_outcome(found, unit, key),
        )
        for model, found in summary["models"].items()
        for unit, title in (("samples", "a sample"), ("recordings", "a recording"))
        for speeds, key in _SPEEDS.items()
        if _has(found, unit, key)
    ]
    return Table(
        "Textures never felt, recognised as unknown at speeds held out of training",
        f"Percent, mean over held-out speeds, with 95% interval in brackets (over "
        f"{drawn_over(summary)}). Inside: those that lie between others, for which {stated} % "
        f"false alarms are stated. Outside: the slowest and the fastest, which lie outside what "
        f"was learnt when they are held out; no rate is stated there, and 'unknown' says nothing. "
        f"For each texture left out at each speed held out, a model learns from the others and "
        f"calls unknown what lies farther from them than "
        f"{percent(1 - summary['false_alarms_stated'], 0)} in 100 samples of known textures do at "
        f"other speeds, each left out in its turn. A recording is judged by the mean over its "
        f"samples, with a limit of its own.",
        ("Model", "Of", "Speeds", f"False alarms ({stated} stated)", "Found unknown", "AUROC",
         "Most false alarms, at mm/s", "Fewest found, at mm/s"),
        tuple(rows),
        n_headers=3,
    )  # fmt: skip


def unknown_by_texture(summary: dict[str, Any]) -> Table:
    """Return, for each texture, how often it is called unknown: left out, and learnt from."""
    note = spacing_note(summary)
    rows = [
        (
            Cell(model_title(model, summary)),
            Cell(title),
            *(_cell(found["by_texture"][t][key]) for t in summary["textures"]),
        )
        for model, found in summary["models"].items()
        for key, title in (("found_samples", "never felt"), ("false_alarms", "felt"))
    ]
    return Table(
        "Called unknown, by texture",
        "Percent of samples. Never felt: few where a texture is hidden between its neighbours, "
        f"which it is taken for. Felt: false alarms. {note[:1].upper()}{note[1:]}".rstrip(),
        ("Model", "Texture was", *texture_names(summary["textures"], summary).values()),
        tuple(rows),
        n_headers=2,
    )


_SPEEDS = {"inside": "inside", "outside what was learnt": "outside", "all": ""}
"""Held-out speeds in words, and by their key; all where none lie between others."""


def _has(found: dict[str, Any], unit: str, key: str) -> bool:
    """Tell whether some held-out speeds have a row of their own."""
    shares = found["found"][unit]
    return bool(shares.get(key)) if key else not shares.get("outside")


def _outcome(found: dict[str, Any], unit: str, key: str) -> tuple[Cell, ...]:
    """Return the cells of samples or recordings, at speeds inside, outside or at all."""
    alarms, finds = (found[what][unit] for what in ("false_alarms", "found"))
    area = found[f"auroc_{key}" if key else "auroc"][unit]
    return (
        Cell(_share(alarms[key] if key else alarms)),
        Cell(_share(finds[key] if key else finds)),
        Cell(f"{area:.3f}"),
        Cell(_worst(alarms["by_speed"], key, max)),
        Cell(_worst(finds["by_speed"], key, min)),
    )


def _share(found: dict[str, Any]) -> str:
    low, high = found["ci95"]
    return f"{percent(found['mean'])} [{percent(low)}, {percent(high)}]"


def _worst(by_speed: dict[str, float], key: str, worse: Callable[..., str]) -> str:
    ranked = sorted(by_speed, key=float)
    speeds = {"inside": ranked[1:-1], "outside": [ranked[0], ranked[-1]]}.get(key, ranked)
    worst = worse(speeds, key=lambda key: by_speed[key])
    return f"{percent(by_speed[worst])} at {worst}"


def _cell(share: float) -> Cell:
    return Cell(percent(share), 100 * share)
