"""How models, protocols, sources, textures and intervals are written in tables and figures."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from afferents.dims import NAMED_BY_SPACING
from afferents.evaluation.intervals import SESSION
from afferents.folds.held_out import SPEED, Group, split_of
from afferents.models.model import MODELS
from afferents.reporting.published import published_textures
from afferents.store.recording import LETTERS, spacing_mm
from afferents.store.trimming import written

FEW_SESSIONS = 5
"""Below so many an interval over sessions is wide for want of sessions alone."""


def drawn_over(summary: dict[str, Any]) -> str:
    """Return what was drawn anew: `13 textures, each with all its speeds`, `5 sessions`."""
    found = summary.get("intervals")
    if found is None:
        return "recordings"
    if found["replicate"] == SESSION:
        return f"{found['n']} sessions"
    return f"{found['n']} textures, each with all its {split_of(summary).many}"


def and_seeds(summary: dict[str, Any]) -> str:
    """Return that training seeds were drawn as well, where there were several."""
    several = any(len(found["seeds"]) > 1 for _, _, found in outcomes(summary))
    return ", and over training seeds" if several else ""


def interval_note(summary: dict[str, Any], seeds: str = "") -> str:
    """Return how 95% intervals were made and what they leave out; `seeds` as `and_seeds`."""
    found, over = summary.get("intervals"), drawn_over(summary)
    made = f"95% intervals are drawn over {over}{seeds}."
    if found is None:
        return (
            f"{made} This folder was written by an earlier version: recordings of one texture are "
            "no independent trials, so the intervals are too narrow. To have them over textures, "
            "repeat the command at the end of this page; finished trainings are kept."
        )
    if found["replicate"] == SESSION:
        few = f" {found['n']} are few, and few make them wide." if found["n"] < FEW_SESSIONS else ""
        return f"{made} So they say how much a further session like these may differ.{few}"
    return (
        f"{made} So they say how much other textures like these may differ in this one session. "
        "They do not say how much another session would: another day, mounting or sensor."
    )


# One name for each texture in all tables and figures of a report.
#
# Textures of the paper's series get its letters, a to m, where the session names textures by their
# bump spacing (the published layout does, and so the rig) and all of an evaluation's are of the
# series; what the letters stand for is said once on the page and once in a figure. Other textures
# keep the names of their session: somebody's own plate 3 is no drum with bumps 3 mm apart.
#
# `about` is what says how textures are named: a summary, or the attributes of samples or responses.

About = Mapping[Any, Any]


def texture_letter(texture: str, about: About) -> str | None:
    """Return the paper's letter (a to m) of a texture folder, None if it is none of the 13."""
    names = published_textures()
    known = about.get(NAMED_BY_SPACING) and texture in names
    return LETTERS[names.index(texture)] if known else None


def are_published(about: About) -> bool:
    """Return whether a summary's textures are the paper's, all 13: its accuracies are of these."""
    return bool(about.get(NAMED_BY_SPACING)) and tuple(about["textures"]) == published_textures()


def texture_names(textures: Sequence[str], about: About) -> dict[str, str]:
    """Return by what name each texture is shown: its letter if all have one, else its own."""
    letters = {texture: texture_letter(texture, about) for texture in textures}
    if None in letters.values():
        return {texture: texture for texture in textures}
    return {texture: str(letter) for texture, letter in letters.items()}


def texture_labels(textures: Sequence[str], about: About) -> dict[str, str]:
    """Return the same with the spacing beside each letter, `i (4 mm)`, where it is said there."""
    named = texture_names(textures, about)
    return {t: name if name == t else f"{name} ({t} mm)" for t, name in named.items()}


def spacing_note(summary: About) -> str:
    """Return what the letters stand for: `a to m: bumps 0 to 6 mm apart`; nothing of others."""
    textures = summary["textures"]
    names = list(texture_names(textures, summary).values())
    if names == list(textures) or not names:
        return ""
    first, last = LETTERS.index(names[0]), LETTERS.index(names[-1])
    if len(names) > 3 and names == list(LETTERS[first : last + 1]):
        return f"{names[0]} to {names[-1]}: bumps {textures[0]} to {textures[-1]} mm apart"
    return f"{', '.join(names)}: bumps {', '.join(textures)} mm apart"


def texture_axis(textures: Sequence[str], about: About) -> str:
    """Return `texture`, and what its names mean where they are bump spacings in mm."""
    if texture_names(textures, about) != {texture: texture for texture in textures}:
        return "texture"
    numbered = all(spacing_mm(name) is not None for name in textures)
    named = numbered and about.get(NAMED_BY_SPACING)
    return "texture (bump spacing, mm)" if named else "texture"


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
