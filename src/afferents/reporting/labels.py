"""How models, protocols and sources are written in tables and figures."""

from collections.abc import Iterator, Mapping
from typing import Any

from afferents.core.model import MODELS
from afferents.core.split import SPEED, Group, split_of
from afferents.core.steady import written
from afferents.reporting.texture_names import spacing_note

ABSENT = "—"
PROTOCOL_TITLES = {"nested": "nested protocol", "published": "published protocol"}

Summary = dict[str, Any]
"""The content of `RESULTS/summary.json`."""


def model_title(name: str, summary: Mapping[str, Any]) -> str:
    """Return the title of a model: of the package's, or of a user's own as a summary holds it."""
    if name in MODELS:
        return MODELS[name].title
    own: Mapping[str, str] = summary.get("titles", {})
    return own.get(name, name)


def model_order(summary: Summary) -> list[str]:
    """Return the evaluated models: the families in Table 1's order, then any others."""
    evaluated = summary["models"]
    return [name for name in MODELS if name in evaluated] + [
        name for name in evaluated if name not in MODELS
    ]


def outcome(summary: Summary, model: str, protocol: str) -> dict[str, Any] | None:
    """Return what came out for a model under a protocol, None where it was not run."""
    found: dict[str, Any] | None = summary["models"].get(model, {}).get(protocol)
    return found


def outcomes(summary: Summary) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield (model, protocol, outcome) of everything that was run, nested before published."""
    for model in model_order(summary):
        for protocol in PROTOCOL_TITLES:
            found = outcome(summary, model, protocol)
            if found is not None:
                yield model, protocol, found


def groups_in(summary: Summary) -> list[Group]:
    """Return the groups that were held out in turn: speeds in mm/s, or names."""
    return list(summary[split_of(summary).groups])


def speed_key(speed_mm_s: float) -> str:
    """Return a speed as the summary spells it: `10`, `12.5`."""
    return f"{speed_mm_s:g}"


def percent(fraction: float, decimals: int = 1) -> str:
    """Return a fraction as percent without the sign: 0.5014 gives `50.1`."""
    return f"{100 * fraction:.{decimals}f}"


def source_name(source: str) -> str:
    """Return the last part of a source's path; the rest says where it lies, not what it is."""
    return source.rstrip("/").rpartition("/")[2] or source


def source_line(summary: Summary) -> str:
    """Return what a figure was made from, in one line: data, textures, cut, preset, version."""
    return " · ".join(
        (
            f"Data: {data_line(summary)}",
            *([note] if (note := spacing_note(summary)) else []),
            f"cut {summary['cut']}",
            *choices(summary),
            f"preset {summary['preset']}{recipe_note(summary)}",
            f"afferents {summary['afferents']}",
        )
    )


def choices(summary: Summary) -> list[str]:
    """Return what was held out, and the part of the recordings, where these were chosen."""
    said, split = [], split_of(summary)
    if split != SPEED:
        said.append(f"held out: {split.name}")
    if summary.get("steady_s"):
        said.append(f"steady part {written(summary['steady_s'])} s")
    return said


def recipe_note(summary: Summary) -> str:
    """Return that hyperparameters were set otherwise than the preset has them, where they were."""
    return " with hyperparameters of its own" if summary.get("recipe") else ""


def preset_note(summary: Summary) -> str:
    """Return what a preset's numbers are good for, where that is little; else nothing."""
    if summary["preset"] != "quick":
        return ""
    return (
        "Preset quick: networks learnt for seconds from a few samples, to see that all of it runs; "
        "their numbers do not say how good a model is, those of --preset fast do."
    )


def data_line(summary: Summary) -> str:
    """Return every source with its number of recordings, and whether it is simulated."""
    return ", ".join(
        f"{source_name(data['source'])} ({data['n_recordings']} "
        f"{'simulated ' if data['simulated'] else ''}recordings)"
        for data in summary["data"]
    )
