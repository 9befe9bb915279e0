"""How models, protocols, sources, textures and intervals are written in tables and figures.

A texture has one name in all of a report. Textures of the paper's series get its letters, a to m,
where the session names textures by their bump spacing (`by_spacing`: the published layout does, and
so the rig) and all of an evaluation's are of the series; what the letters stand for is written once
on the page and once in a figure. Other textures keep the names of their session: a user's own plate
3 is no drum with bumps 3 mm apart. Captions of tables and figures are in `captions.txt`.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from afferents.evaluation.intervals import SESSION
from afferents.evaluation.results import Outcome, Summary
from afferents.folds.controls import CONTROLS
from afferents.folds.held_out import SPEED
from afferents.models.model import MODELS
from afferents.reporting.published import published_textures
from afferents.store import recording, trimming

FEW_SESSIONS = 5
"""Below this number an interval over sessions is wide for want of sessions alone."""
ABSENT = "—"
PROTOCOL_TITLES = {"nested": "nested protocol", "published": "published protocol"}
ABBREVIATIONS = {
    "SE": "spatial encoding, one tactile image",
    "STE": "spatio-temporal encoding, a run of images",
    "TE": "temporal encoding, a spectrum of vibration",
}
"""Of the models' titles, with the paper's words (sections 2.2.1 and 2.4.1)."""


def name_replicates(summary: Summary) -> str:
    """Return what intervals are drawn over: `13 textures, each with all its speeds`."""
    n = summary.intervals.n
    if summary.intervals.bootstrap_unit == SESSION:
        return f"{n} sessions"
    return f"{n} textures, each with all its {summary.split.many}"


def has_several_seeds(summary: Summary) -> bool:
    """Return whether training seeds were drawn as well, since there were several."""
    return any(len(found.seeds) > 1 for _, _, found in outcomes(summary))


def interval_note(summary: Summary) -> str:
    """Return how 95% intervals were made and what they leave out."""
    seeds = ", and over training seeds" if has_several_seeds(summary) else ""
    made = f"95% intervals are drawn over {name_replicates(summary)}{seeds}."
    n = summary.intervals.n
    if summary.intervals.bootstrap_unit == SESSION:
        few = f" {n} are few, and few make them wide." if n < FEW_SESSIONS else ""
        return f"{made} So they say how much a further session like these may differ.{few}"
    here = "this one session" if len(summary.data) == 1 else "these sessions"
    return (
        f"{made} So they say how much other textures like these may differ in {here}. "
        "They do not say how much another session would: another day, mounting or sensor."
    )


def texture_letter(texture: str, by_spacing: bool) -> str | None:
    """Return the paper's letter (a to m) of a texture folder, None if it is none of the 13."""
    names = published_textures()
    return recording.LETTERS[names.index(texture)] if by_spacing and texture in names else None


def are_published(summary: Summary) -> bool:
    """Return whether speeds were held out of the paper's 13 textures, as its accuracies are of."""
    of_paper = summary.named_by_spacing and summary.textures == published_textures()
    return of_paper and summary.split == SPEED


def texture_names(textures: Sequence[str], by_spacing: bool) -> dict[str, str]:
    """Return by what name each texture is shown: its letter if all have one, else its own."""
    letters = {texture: texture_letter(texture, by_spacing) for texture in textures}
    return {texture: texture if None in letters.values() else str(letters[texture])
            for texture in textures}  # fmt: skip


def texture_labels(textures: Sequence[str], by_spacing: bool) -> dict[str, str]:
    """Return the same with the spacing after each letter: `i (4 mm)`."""
    named = texture_names(textures, by_spacing)
    return {t: name if name == t else f"{name} ({t} mm)" for t, name in named.items()}


def spacing_note(summary: Summary) -> str:
    """Return what letters stand for: `a: smooth; b to m: bumps 0.5 to 6 mm apart`; else nothing."""
    named = texture_names(summary.textures, summary.named_by_spacing)
    if list(named) == list(named.values()):
        return ""
    bumpy = {texture: name for texture, name in named.items() if texture != "0"}
    names, spacings = list(bumpy.values()), list(bumpy)
    if len(names) > 3 and "".join(names) in "".join(recording.LETTERS):
        names, spacings = ([f"{one[0]} to {one[-1]}"] for one in (names, spacings))
    note = f"{', '.join(names)}: bumps {', '.join(spacings)} mm apart"
    return "a: smooth; " * ("0" in named) + note


def texture_axis(textures: Sequence[str], by_spacing: bool) -> str:
    """Return `texture`, and what its names mean where they are bump spacings in mm."""
    lettered = any(name != own for own, name in texture_names(textures, by_spacing).items())
    numbered = all(recording.spacing_mm(name) is not None for name in textures)
    return "texture (bump spacing, mm)" if numbered and by_spacing and not lettered else "texture"


def model_title(name: str, summary: Summary | None) -> str:
    """Return the title of a model: of the package's, or of a user's own as a summary holds it."""
    if name in MODELS:
        return MODELS[name].title
    return summary.titles.get(name, name) if summary else name


def order_models(names: Sequence[str]) -> list[str]:
    """Return models in Table 1's order, then the package's, then any others."""
    return [name for name in MODELS if name in names] + [n for n in names if n not in MODELS]


def list_models(summary: Summary) -> list[str]:
    """Return the evaluated models in the order of tables."""
    return order_models(list(summary.models))


def outcome(summary: Summary, model: str, protocol: str) -> Outcome | None:
    """Return what came out for a model under a protocol, None where it was not run."""
    return summary.models.get(model, {}).get(protocol)  # type: ignore[call-overload,no-any-return]


def outcomes_by_protocol(summary: Summary, model: str) -> dict[str, Outcome]:
    """Return what came out for a model by protocol, nested before published."""
    found = {protocol: outcome(summary, model, protocol) for protocol in PROTOCOL_TITLES}
    return {protocol: one for protocol, one in found.items() if one}


def outcomes(summary: Summary) -> Iterator[tuple[str, str, Outcome]]:
    """Yield (model, protocol, outcome) of everything that was run, nested before published."""
    for model in list_models(summary):
        for protocol, found in outcomes_by_protocol(summary, model).items():
            yield model, protocol, found


def list_protocols(summary: Summary) -> list[str]:
    """Return the protocols that were run, nested before published."""
    run = {protocol for _, protocol, _ in outcomes(summary)}
    return [protocol for protocol in PROTOCOL_TITLES if protocol in run]


def picked_by_tested(summary: Summary, found: Outcome) -> bool:
    """Return whether the group that was tested picked the model, as `published` lets it."""
    return bool(found.leaks.get(f"test_samples_of_a_{summary.split.leaks}_seen_in_validation"))


def percent(fraction: float, decimals: int = 1) -> str:
    """Return a fraction as percent without the sign: 0.5014 gives `50.1`."""
    return f"{100 * fraction:.{decimals}f}"


def shorten_list(names: Sequence[str], most: int = 16) -> str:
    """Return names with commas between, or the first of very many and the last."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])}, … {names[-1]}"


def textures_line(summary: Summary) -> str:
    """Return how many textures there are, their names and, once, what letters stand for."""
    named, note = texture_names(summary.textures, summary.named_by_spacing), spacing_note(summary)
    names = list(named.values())
    return f"{len(names)}: {shorten_list(names)}" + f"; letters as in the paper ({note})" * bool(
        note
    )


def data_line(summary: Summary) -> str:
    """Return every source with its number of recordings, whether it is simulated, how many served.

    Of a path the last part; the rest says where it lies, not what it is.
    """
    line = ", ".join(
        f"{data.source.rstrip('/').rpartition('/')[2] or data.source} ({data.n_recordings} "
        f"{'simulated ' if data.simulated else ''}recordings)"
        for data in summary.data
    )
    return line if summary.n_used is None else f"{line}, {summary.n_used} of them used"


def name_control(summary: Summary) -> str:
    """Return what was taken from all recordings: `control: labels permuted`; nothing of none."""
    none = summary.control == "none"
    return "" if none else f"control: {CONTROLS[summary.control].partition(':')[0]}"


def source_line(summary: Summary) -> str:
    """Return what a figure was made from, in one line: data, textures, cut, preset, version."""
    own = " with hyperparameters of its own" if summary.recipe else ""
    parts = (
        f"Data: {data_line(summary)}",
        name_control(summary),
        spacing_note(summary),
        f"cut {summary.cut}",
        "" if summary.split == SPEED else f"held out: {summary.split.title}",
        f"steady part {trimming.written(summary.steady_s)} s" if summary.steady_s else "",
        f"preset {summary.preset}{own}",
        f"afferents {summary.afferents}",
    )
    return " · ".join(filter(None, parts))


@cache
def _captions() -> Any:
    """Return the template of all captions, a function each."""
    environment = Environment(  # plain text: pages escape it
        loader=PackageLoader("afferents.reporting", "."), undefined=StrictUndefined
    )
    helpers = (are_published, has_several_seeds, list_protocols, name_control, name_replicates)
    shared = {helper.__name__: helper for helper in (*helpers, percent)}
    return environment.get_template("captions.txt", globals={**shared, "SPEED": SPEED}).module


def caption(name: str, *shown: Any) -> str:
    """Return a caption of `captions.txt`, in one line."""
    return " ".join(getattr(_captions(), name)(*shown).split())
