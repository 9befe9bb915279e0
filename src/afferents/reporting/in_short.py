"""What a newcomer reads first: what was held out, what won, how sure that is, what to do next."""

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from afferents.dims import RA2
from afferents.evaluation.schemas import Lost
from afferents.folds.held_out import key_of, split_of
from afferents.models.model import BEST, MODELS
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    Summary,
    and_seeds,
    groups_in,
    interval_note,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    texture_names,
)
from afferents.reporting.tables import mean_and_interval

WORST_SHOWN = 3
STORE = "store"
"""Kind of data that `extract` wrote; other kinds are tables, which nothing feels live."""
ONLY_EVALUATED = frozenset({
    *("ridge-te", "order-te", "order-te-measured", "order-te-speed-known", "rocket-te"),
    *("spike-rate", "sa-spike-rate", "spike-timing", "spike-images", "three-stems"),
    *("fusion", "fusion-speed-known", "fusion-networks", "fusion-joint", "fusion-shear"),
})  # fmt: skip
"""Models that `train` can't keep; a test holds this against `train` itself."""


@dataclass(frozen=True)
class Step:
    """Something to do next, and the command that does it, where there is one."""

    text: str
    command: str = ""


@dataclass(frozen=True)
class Winner:
    """The model that a report speaks of first, and what it came to under a protocol."""

    model: str
    protocol: str
    recommended: bool
    found: dict[str, Any]


def winner(summary: Summary) -> Winner | None:
    """Return the model that we recommend, where it was evaluated, else the best; None of none.

    Under the strictest protocol that was run.
    """
    for protocol in PROTOCOL_TITLES:
        found = _under(summary, protocol)
        if found:
            wanted = _recommended(found)
            best = max(found, key=lambda name: found[name]["mean_accuracy"])
            named = wanted if wanted in found else best
            return Winner(named, protocol, wanted in found, found[named])
    return None


def _recommended(found: Mapping[str, Any]) -> str:
    """Return what we recommend for such data: what markers show, if any model was given them."""
    of_markers = any(MODELS[name].channel != RA2 for name in found if name in MODELS)
    return BEST[0] if of_markers or BEST[0] in found else BEST[1]


def headline(summary: Summary) -> str:
    """Return the sentences that matter most: what won, its figure, and where it was worst."""
    won = winner(summary)
    if won is None:
        return "No model was evaluated."
    split, found = split_of(summary), won.found
    if at_chance(summary, won):
        return (
            f"Nothing was learnt: {model_title(won.model, summary)} names "
            f"{mean_and_interval(found)} % of the samples rightly at {split.many} that it never "
            f"learnt from ({PROTOCOL_TITLES[won.protocol]}), and guessing gives "
            f"{percent(summary['chance'])} %."
        )
    worst = found[split.worst]
    interval = "; 95% interval in brackets" if found.get("ci95") else ""
    why = "which we recommend" if won.recommended else "which did best"
    return (
        f"{model_title(won.model, summary)}, {why}, names {mean_and_interval(found)} % of the "
        f"samples rightly at {split.many} that it never learnt from "
        f"({PROTOCOL_TITLES[won.protocol]}{interval}), "
        f"where guessing gives {percent(summary['chance'])} %. It did worst "
        f"{split.at([worst])}, with {percent(found[split.by][worst])} %."
    )


def at_chance(summary: Summary, won: Winner) -> bool:
    """Tell whether guessing would do as well: the interval holds chance, or the mean is below."""
    interval, chance = won.found.get("ci95"), summary["chance"]
    return bool((interval[0] if interval else won.found["mean_accuracy"]) <= chance)


def what_was_asked(summary: Summary) -> str:
    """Return what was held out, for somebody who has not read the paper."""
    split, keys = split_of(summary), [key_of(group) for group in groups_in(summary)]
    n = f"{len(summary['textures'])} textures"
    held_out = (
        "Each in turn was held out: a model learnt from the recordings of the others, and then had "
        "to name the texture in every sample of this one."
    )
    if not split.ordered:
        return f"{n} were recorded with {len(keys)} {split.many}: {', '.join(keys)}. {held_out}"
    return (
        f"{n} were slid over at {len(keys)} {split.many}, {keys[0]} to {keys[-1]}{split.unit}. "
        f"{held_out} So a figure says how well textures are told apart at {split.one} that the "
        "model has never felt."
    )


def what_was_lost(lost: Lost | None) -> str:
    """Return how many markers were lost, and what models are given in their place; of any."""
    if lost is None:
        return ""
    if not lost.worst:
        return "No marker was lost."
    whose = (
        f"median of {lost.n} recordings; at most {percent(lost.worst)}%, in recording"
        if lost.n > 1
        else "in recording"
    )
    return (
        f"Of the marker positions {percent(lost.median)}% were lost ({whose} {lost.recording}): "
        "models are given values filled in from the markers round them."
    )


def beside_the_winner(summary: Summary) -> list[str]:
    """Return what else there is to know of it: recordings, the worst groups, others, mistakes."""
    won = winner(summary)
    if won is None:
        return []
    said = [_of_recordings(won), _worst_groups(summary, won), _others(summary, won)]
    return [text for text in (*said, _mistake(summary, won)) if text]


def next_steps(summary: Summary) -> list[Step]:
    """Return what to do next, the most urgent first; nothing where nothing was learnt."""
    won = winner(summary)
    if won is None or at_chance(summary, won):
        return []
    steps = [
        _train_longer(summary),
        _evaluate_best(summary, won),
        _another_session(summary),
        _worst_place(summary, won),
    ]
    steps.append(_use_it(summary, won))
    return [step for step in steps if step is not None]


def sureness(summary: Summary) -> str:
    """Return what intervals were drawn over, and what they leave out."""
    once = any(
        len(found["seeds"]) == 1 and any(map(any, found["epochs"].values()))
        for _, _, found in outcomes(summary)
    )
    alone = " Networks were trained once: how far trainings differ is not in them (--seeds 3)."
    return interval_note(summary, and_seeds(summary)) + (alone if once else "")


def _under(summary: Summary, protocol: str) -> dict[str, dict[str, Any]]:
    """Return what came out under a protocol, by model."""
    found = {name: outcome(summary, name, protocol) for name in model_order(summary)}
    return {name: result for name, result in found.items() if result is not None}


def _of_recordings(won: Winner) -> str:
    found = won.found.get("recordings")
    if found is None:
        return ""
    named = mean_and_interval(found)
    return f"Of whole recordings, by all their samples together, it names {named} %."


def _worst_groups(summary: Summary, won: Winner) -> str:
    split = split_of(summary)
    tested = {group: value for group, value in won.found[split.by].items() if value is not None}
    worst = sorted(tested, key=lambda group: tested[group])[:WORST_SHOWN]
    if len(tested) <= 1:
        return ""
    listed = ", ".join(f"{split.printed(group)} {percent(tested[group])} %" for group in worst)
    return f"From the worst: {listed}."


def _others(summary: Summary, won: Winner) -> str:
    """Return which model did better, or how many it was better than."""
    found = _under(summary, won.protocol)
    best = max(found, key=lambda name: found[name]["mean_accuracy"])
    if len(found) == 1:
        return "No other model was evaluated."
    if best == won.model:
        return f"It did best of the {len(found)} models evaluated."
    title, better = model_title(best, summary), percent(found[best]["mean_accuracy"])
    return (
        f"{title} did better here, with {better} %. What we recommend is not picked by this test."
    )


def _mistake(summary: Summary, won: Winner) -> str:
    """Return which texture it most often took for which other."""
    counts = np.array(won.found.get("confusion", []), dtype=float)
    textures = summary["textures"]
    if counts.shape != (len(textures), len(textures)):
        return ""
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    np.fill_diagonal(share, 0)
    true, taken = np.unravel_index(share.argmax(), share.shape)
    if share[true, taken] == 0:
        return ""
    names = list(texture_names(textures, summary).values())
    return (
        f"Its most frequent mistake is to take {names[true]} for {names[taken]}: "
        f"{percent(share[true, taken])} % of the samples of {names[true]}."
    )


def _train_longer(summary: Summary) -> Step | None:
    if summary["preset"] != "quick":
        return None
    return Step(
        "Train longer. The preset quick only shows that all of it runs: repeat the command at the "
        "end of this page into another folder, with --preset fast."
    )


def _evaluate_best(summary: Summary, won: Winner) -> Step | None:
    if won.recommended:
        return None
    title = model_title(_recommended(_under(summary, won.protocol)), summary)
    sources = [data["source"] for data in summary["data"]]
    return Step(
        f"Evaluate what we recommend for such recordings, {title}: it was not run here.",
        shlex.join(["afferents", "evaluate", *sources, "--models", "best", "--out", "BEST"]),
    )


def _another_session(summary: Summary) -> Step | None:
    sources = [data["source"] for data in summary["data"]]
    if any(data["simulated"] for data in summary["data"]):
        return Step(
            "Record textures with a sensor: these are simulated. docs/recording.md says how; "
            "docs/your-data.md says how to bring recordings that you have.",
        )
    if len(sources) > 1:
        return None
    return Step(
        "Record the same textures again on another day, with the sensor taken off and mounted "
        "anew, and evaluate both sessions together: only then do intervals say how far sessions "
        "differ.",
    )


def _worst_place(summary: Summary, won: Winner) -> Step | None:
    split, groups = split_of(summary), [key_of(group) for group in groups_in(summary)]
    worst = won.found[split.worst]
    if not split.ordered or len(groups) < 3:
        return None
    if worst not in (groups[0], groups[-1]):
        return Step(f"Record at speeds near {split.printed(worst)}, where it did worst.")
    end, more = ("slowest", "slower") if worst == groups[0] else ("fastest", "faster")
    return Step(
        f"It did worst at {split.printed(worst)}, the {end} speed: with that held out, the model "
        f"must extrapolate. If you need that speed, record {more} ones too."
    )


def _use_it(summary: Summary, won: Winner) -> Step | None:
    """Return how to keep a model and feel with it: the one spoken of, or the best that can be."""
    found = _under(summary, won.protocol)
    able = [name for name in found if name in MODELS and name not in ONLY_EVALUATED]
    title = model_title(won.model, summary)
    if not able:
        known = won.model in MODELS
        return Step(f"{title} can be evaluated, but not trained to be kept.") if known else None
    name = won.model if won.model in able else max(able, key=lambda n: found[n]["mean_accuracy"])
    why = ""
    if name != won.model:
        accuracy = percent(found[name]["mean_accuracy"])
        best = f"{model_title(name, summary)} ({accuracy} %)"
        why = (
            f"{title} can't be trained to be kept; of those evaluated the best that can is {best}. "
        )
    source = summary["data"][0]["source"]  # `train` takes one
    train = shlex.join(["afferents", "train", source, "MODEL", "--model", name])
    if any(data["kind"] != STORE for data in summary["data"]):
        return Step(f"{why}Train it on all speeds, and ask it from Python (docs/python.md).", train)
    simulated = any(data["simulated"] for data in summary["data"])
    if MODELS[name].channel != RA2:
        given = ["--video", "rig" if simulated else "camera:0"]
    else:
        given = ["--audio", "rig" if simulated else "mic:default"]
    live = shlex.join(["afferents", "live", "--model", "model.onnx", *given, "--web"])
    return Step(
        f"{why}Train it on all speeds, and feel with it live (docs/live.md). The figures above are "
        "no promise for another sensor or mounting.",
        f"{train}\nafferents export MODEL model.onnx\n{live}",
    )
