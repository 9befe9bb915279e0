"""What a newcomer reads first: what was held out, what won, how sure that is, what to do next."""

import shlex
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from afferents.dims import RA2
from afferents.encodings.settings import Encodings
from afferents.evaluation.options import TrainingOptions, shell_words
from afferents.evaluation.results import Lost, Outcome, Summary
from afferents.folds.held_out import SPEED, ByPair
from afferents.models.model import MODELS
from afferents.reporting.comparisons import differ_in_one_thing, points
from afferents.reporting.labels import (
    PROTOCOL_TITLES,
    control_asked,
    interval_note,
    model_title,
    outcomes,
    percent,
    picked_by_tested,
    texture_names,
)
from afferents.reporting.published import published_families
from afferents.reporting.tables import across_modalities, mean_and_interval

WORST_SHOWN = 3
_OF_ANY_MODEL = ("split", "steady", "without", "held_out", "textures", "speeds")
"""Options of the data, which every model takes."""
STORE = "store"
"""Kind of data that `extract` wrote; other kinds are tables, which nothing feels live."""


@dataclass(frozen=True)
class Step:
    """Something to do next, and the command that does it, where there is one."""

    text: str
    command: str = ""


@dataclass(frozen=True)
class Winner:
    """The model that a report speaks of first, what it came to under a protocol, and the others.

    `rivals` are the outcomes of all models under that protocol, its own among them.
    """

    model: str
    protocol: str
    recommended: bool
    found: Outcome
    rivals: dict[str, Outcome]


def winner(summary: Summary) -> Winner | None:
    """Return the model that we recommend, where it was evaluated, else the best; None of none.

    Under the strictest protocol that was run.
    """
    for protocol in PROTOCOL_TITLES:
        found = {model: one for model, its, one in outcomes(summary) if its == protocol}
        if found:
            wanted = summary.recommended
            best = max(found, key=lambda name: found[name].mean_accuracy)
            named = wanted if wanted in found else best
            return Winner(named, protocol, wanted in found, found[named], found)
    return None


def headline(summary: Summary) -> str:
    """Return the sentences that matter most: what won, its figure, and where it was worst."""
    won = winner(summary)
    if won is None:
        return "No model was evaluated."
    split, found = summary.split, won.found
    title, protocol = model_title(won.model, summary), PROTOCOL_TITLES[won.protocol]
    where = f"at {split.many} that it never learnt from"
    where += f", in a {control_asked(summary)}" * (summary.control != "none")
    chance = f"guessing gives {percent(summary.chance)}%"
    if nothing_learnt(summary, won):
        return (
            f"Nothing was learnt: {title} recognises the texture in {mean_and_interval(found)}% of "
            f"the samples {where} ({protocol}), and {chance}."
        )
    return (
        f"{title}, {'which we recommend' if won.recommended else 'which did best'}, recognises the "
        f"texture in {mean_and_interval(found)}% of the samples {where} ({protocol}; 95% interval "
        f"in brackets), where {chance}.{_too_few(summary, found)} It did worst "
        f"{split.at([found.worst])}, with {percent(found.by[found.worst])}%."
    )


def nothing_learnt(summary: Summary, won: Winner) -> bool:
    """Tell whether guessing does as well."""
    return won.found.mean_accuracy <= summary.chance


def _too_few(summary: Summary, found: Outcome) -> str:
    """Return that so few can't tell a model from guessing, where the interval holds chance."""
    few = f" {summary.intervals.n} {summary.intervals.bootstrap_unit}s are too few to tell that"
    return f"{few} from guessing." if found.ci95[0] <= summary.chance else ""


def what_was_held_out(summary: Summary) -> str:
    """Return it in a line."""
    split, keys = summary.split, summary.held_out_keys
    whole = split.ordered and summary.all_held_out
    named = f"{keys[0]} to {keys[-1]}" if whole else ", ".join(keys)
    named += split.unit
    return f"Held out, each in turn: {len(keys)} {split.many}, {named}."


def what_was_asked(summary: Summary) -> str:
    """Return what was held out, for somebody who has not read the paper."""
    split, keys = summary.split, summary.held_out_keys
    n = f"{len(summary.textures)} textures"
    held_out = f"Each in turn was held out: {_learnt_and_tested(summary)}"
    if not summary.all_held_out:
        return f"{n}. Of the {split.many}, {', '.join(keys)}{split.unit} were held out. {held_out}"
    if not split.whole:
        return f"{split.divided} of {n} was divided into {len(keys)} {split.many}. {held_out}"
    if not split.ordered:
        return f"{n} were recorded with {len(keys)} {split.many}: {', '.join(keys)}. {held_out}"
    return (
        f"{n} were slid over at {len(keys)} {split.many}, {keys[0]} to {keys[-1]}{split.unit}. "
        f"{held_out} So a figure says how well textures are recognised at {split.one} that the "
        "model never learnt from."
    )


def _learnt_and_tested(summary: Summary) -> str:
    """Return from what models learnt where something was held out, and on what they were tested."""
    split, options = summary.split, summary.options
    learnt = "the recordings of" if split.whole else "the parts of recordings in"
    others = "those that share nothing with it" if isinstance(split, ByPair) else "the others"
    these = "this one"
    if "test_only" in options:
        only = ", ".join(f"{name}={value}" for name, value in options["test_only"].items())
        others, these = f"{others} that are not of {only}", f"{these} that is of {only}"
    if "train_speeds" in options:
        others = f"{options['train_speeds']} of {others}"
    half = {protocol for _, protocol, _ in outcomes(summary)} == {"published"}
    picked = half and any(picked_by_tested(summary, one) for _, _, one in outcomes(summary))
    return (
        f"a model learnt from {learnt} {others}, and then had to recognise the texture in "
        f"{'half of the samples' if half else 'every sample'} of {these}."
        f"{' The other half picked the model.' * picked}"
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
        "models are given the mean of the markers round a lost one. Where that can't be, the last "
        "value is kept: with the published tracker, without a known layout, and of the skin as a "
        "whole."
    )


def beside_the_winner(summary: Summary) -> list[str]:
    """Return what else there is to know of it: recordings, the worst groups, others, mistakes."""
    won = winner(summary)
    if won is None:
        return []
    recordings = mean_and_interval(won.found.recordings)
    split = summary.split
    whole = "whole recordings" if split.whole else f"the parts of recordings in {split.one}"
    whole = "halves of recordings" if won.protocol == "published" else whole
    said = [
        _within_modality(summary, won),
        across_modalities(summary.models).strip(),
        f"It recognises the texture of {recordings}% of {whole}, from all their samples together.",
        _worst_groups(summary, won),
        _others(summary, won),
        _mistake(summary, won),
    ]
    return [text for text in said if text]


def _within_modality(summary: Summary, won: Winner) -> str:
    """Return by how much the paper's models differ that differ in one thing, here and there."""
    paper = {name: family.mean_percent for name, family in published_families().items()}
    pairs = [
        f"{model_title(one.model, summary)} over {model_title(one.than, summary)} {points(one)}"
        + f" (paper {paper[one.model] - paper[one.than]:+d})" * (summary.split == SPEED)
        for one in summary.comparisons
        if one.protocol == won.protocol
        and {one.model, one.than} <= paper.keys()
        and differ_in_one_thing(one.model, one.than)
    ]
    return f"Within a modality, in percentage points: {'; '.join(pairs)}." if pairs else ""


def _worst_groups(summary: Summary, won: Winner) -> str:
    split, by = summary.split, won.found.by
    worst = sorted(by, key=lambda group: by[group])[:WORST_SHOWN]
    listed = ", ".join(f"{split.printed(group)} {percent(by[group])}%" for group in worst)
    return f"From the worst: {listed}." if len(by) > 1 else ""


def _others(summary: Summary, won: Winner) -> str:
    """Return which model did better, or how many it was better than."""
    best = max(won.rivals, key=lambda name: won.rivals[name].mean_accuracy)
    if len(won.rivals) == 1:
        return "No other model was evaluated."
    if won.rivals[best].mean_accuracy == won.found.mean_accuracy:
        return f"It did best of the {len(won.rivals)} models evaluated."
    title, better = model_title(best, summary), percent(won.rivals[best].mean_accuracy)
    return (
        f"{title} did better here, with {better}%. What we recommend was picked once, on the "
        "simulated rig, and not by this test."
    )


def _mistake(summary: Summary, won: Winner) -> str:
    """Return which texture it most often took for which other."""
    counts = np.array(won.found.confusion, dtype=float)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    np.fill_diagonal(share, 0)
    true, taken = np.unravel_index(share.argmax(), share.shape)
    if share[true, taken] == 0:
        return ""
    names = list(texture_names(summary.textures, summary.named_by_spacing).values())
    return (
        f"Its most frequent mistake is to take {names[true]} for {names[taken]}: "
        f"{percent(share[true, taken])}% of the samples of {names[true]}."
    )


def sureness(summary: Summary) -> str:
    """Return what intervals were drawn over, and what they leave out."""
    once = any(
        len(found.seeds) == 1 and any(map(any, found.epochs.values()))
        for _, _, found in outcomes(summary)
    )
    alone = " Networks were trained once: how far trainings differ is not in them (--seeds 3)."
    return interval_note(summary) + alone * once


def next_steps(summary: Summary, results: Path | None = None) -> list[Step]:
    """Return what to do next, the most urgent first; nothing of a control, or at chance.

    Parameters
    ----------
    results
        The folder that they lie in, which a model's card is to state.
    """
    won = winner(summary)
    if won is None or nothing_learnt(summary, won) or summary.control != "none":
        return []
    return list(_steps(summary, won, results))


def _steps(summary: Summary, won: Winner, results: Path | None) -> Iterator[Step]:
    sources = [data.source for data in summary.data]
    if summary.preset == "quick":
        yield Step(
            "Train longer. The preset quick only shows that all of it runs: repeat the command at "
            "the end of this page into another folder, with --preset fast."
        )
    wanted = summary.recommended
    if wanted and wanted not in {*won.rivals, *summary.lengths}:
        title, again = model_title(wanted, summary), ["afferents", "evaluate", *sources]
        asked = _handed_on(summary, _OF_ANY_MODEL)
        yield Step(
            f"Evaluate what we recommend for such recordings, {title}: it was not run here.",
            shlex.join([*again, *asked, "--models", "best", "--out", "BEST"]),
        )
    if any(data.simulated for data in summary.data):
        yield Step(
            "Record textures with a sensor: these are simulated. docs/recording.md says how; "
            "docs/your-data.md says how to bring recordings that you have.",
        )
    elif len(sources) == 1:
        yield Step(
            "Record the same textures again on another day, with the sensor taken off and mounted "
            "anew, and evaluate both sessions together: only then do intervals say how far "
            "sessions differ.",
        )
    split, keys, worst = summary.split, summary.held_out_keys, won.found.worst
    if split.ordered and summary.all_held_out and len(keys) >= 3:
        if worst in (keys[0], keys[-1]):
            end, more = ("slowest", "slower") if worst == keys[0] else ("fastest", "faster")
            yield Step(
                f"It did worst at {split.printed(worst)}, the {end} speed: with that held out, the "
                f"model must extrapolate. If you need that speed, record {more} ones too."
            )
        else:
            yield Step(f"Record at speeds near {split.printed(worst)}, where it did worst.")
    yield from _use_it(summary, won, results)


def _handed_on(summary: Summary, names: Collection[str]) -> list[str]:
    """Return the words that ask for the same cut and preset, and the same of these options."""
    same = {name: value for name, value in summary.options.items() if name in names}
    same |= {"cut": summary.cut} if summary.cut != "all" else {}
    return shell_words(same | ({"preset": "paper"} if summary.preset == "paper" else {}))


def _use_it(summary: Summary, won: Winner, results: Path | None) -> Iterator[Step]:
    """Yield how to keep a model and run it live: the one spoken of, or the best that can be."""
    # who only reads sentences needs no torch
    from afferents.evaluation.data import find_sources
    from afferents.evaluation.train import can_run_live

    able = [name for name in won.rivals if name in MODELS and can_run_live(MODELS[name])]
    title, why = model_title(won.model, summary), ""
    if not able:
        if won.model in MODELS:
            yield Step(f"{title} can be evaluated, but not trained to be kept.")
        return
    best = max(able, key=lambda name: won.rivals[name].mean_accuracy)
    name = won.model if won.model in able else best
    if name != won.model:
        accuracy = percent(won.rivals[name].mean_accuracy)
        why = (
            f"{title} can't be trained to be kept; of those evaluated the best that can is "
            f"{model_title(name, summary)} ({accuracy}%). "
        )
    source = summary.data[0].source  # `train` takes one
    encodings = [one.encoding for one in find_sources(MODELS[name], Encodings())]
    own = {name for one in encodings for name in one.options()}
    options = _handed_on(summary, own | TrainingOptions.model_fields.keys())
    options += ["--results", str(results)] if results else []
    train = shlex.join(["afferents", "train", source, "MODEL", "--model", name, *options])
    if any(data.kind != STORE for data in summary.data):
        yield Step(f"{why}Train it, and ask it from Python (docs/python.md).", train)
        return
    simulated = any(data.simulated for data in summary.data)
    if MODELS[name].channel != RA2:
        given = ["--video", "rig" if simulated else "camera:0"]
    else:
        given = ["--audio", "rig" if simulated else "mic:default"]
    live = shlex.join(["afferents", "live", "--model", "model.onnx", *given, "--web"])
    yield Step(
        f"{why}Train it, and run it live (docs/live.md). The figures above are "
        "no promise for another sensor or mounting.",
        f"{train}\nafferents export MODEL model.onnx\n{live}",
    )
