"""What a newcomer reads first: what was held out, what won, how sure that is, what to do next."""

import shlex
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from afferents.dims import RA2
from afferents.encodings.settings import Encodings
from afferents.evaluation.options import TrainingOptions, shell_words
from afferents.evaluation.results import Lost, Outcome, Summary
from afferents.folds.held_out import SPEED, ByPair
from afferents.models.model import MODELS
from afferents.reporting import compare, labels, published, tables

WORST_SHOWN = 3
_OF_ANY_MODEL = ("split", "steady", "without", "held_out", "textures", "speeds")
"""Options of the data, which every model takes."""
STORE = "store"
"""Kind of data that `extract` wrote; other kinds are tables, which no live model reads."""


@dataclass(frozen=True)
class Step:
    """Something to do next, and the command that does it, where there is one."""

    text: str
    command: str = ""


@dataclass(frozen=True)
class Winner:
    """The model that a report speaks of first, and what all came to under one protocol.

    `rivals` are the outcomes of all models under that protocol, its own among them.
    """

    model: str
    protocol: str
    recommended: bool
    rivals: dict[str, Outcome]

    @property
    def found(self) -> Outcome:
        """What it came to."""
        return self.rivals[self.model]


def find_best(rivals: Mapping[str, Outcome]) -> str:
    """Return the name of the most accurate model, the first of equals."""
    return max(rivals, key=lambda name: rivals[name].mean_accuracy)


def winner(summary: Summary) -> Winner | None:
    """Return the model that we recommend, where it was evaluated, else the best; None of none.

    Under the strictest protocol that was run.
    """
    protocols = labels.list_protocols(summary)
    if not protocols:
        return None
    found = {model: one for model, its, one in labels.outcomes(summary) if its == protocols[0]}
    recommended = summary.recommended in found
    named = summary.recommended if recommended else find_best(found)
    return Winner(named, protocols[0], recommended, found)


def headline(summary: Summary) -> str:
    """Return the sentences that matter most: what won, its figure, and where it was worst."""
    won = winner(summary)
    if won is None:
        return "No model was evaluated."
    split, found = summary.split, won.found
    title, protocol = labels.model_title(won.model, summary), labels.PROTOCOL_TITLES[won.protocol]
    where = f"at {split.many} that it never learnt from"
    where += f", in a {labels.name_control(summary)}" * (summary.control != "none")
    accuracy, chance = tables.mean_and_interval(found), labels.percent(summary.chance)
    if won.found.mean_accuracy <= summary.chance:
        return (
            f"Nothing was learnt: {title} recognises the texture in {accuracy}% of the samples "
            f"{where} ({protocol}), and guessing gives {chance}%."
        )
    unit = f"{summary.intervals.n} {summary.intervals.bootstrap_unit}s"
    few = f" {unit} are too few to tell that from guessing." * (found.ci95[0] <= summary.chance)
    return (
        f"{title}, {'which we recommend' if won.recommended else 'which did best'}, recognises the "
        f"texture in {accuracy}% of the samples {where} ({protocol}; 95% interval in brackets), "
        f"where guessing gives {chance}%.{few} It did worst {split.at([found.worst])}, with "
        f"{labels.percent(found.by[found.worst])}%."
    )


def describe_held_out(summary: Summary) -> str:
    """Return what was held out, in a line."""
    split, keys = summary.split, summary.held_out_keys
    whole = split.ordered and summary.all_held_out
    named = f"{keys[0]} to {keys[-1]}" if whole else ", ".join(keys)
    return f"Held out, each in turn: {len(keys)} {split.many}, {named}{split.unit}."


def describe_question(summary: Summary) -> str:
    """Return what was held out, learnt from and tested, for who has not read the paper."""
    split, keys, options = summary.split, summary.held_out_keys, summary.options
    learnt = "the recordings of" if split.whole else "the parts of recordings in"
    others = "those that share nothing with it" if isinstance(split, ByPair) else "the others"
    these = "this one"
    if "test_only" in options:
        only = ", ".join(f"{name}={value}" for name, value in options["test_only"].items())
        others, these = f"{others} that are not of {only}", f"{these} that is of {only}"
    if "train_speeds" in options:
        others = f"{options['train_speeds']} of {others}"
    half = labels.list_protocols(summary) == ["published"]
    picked = half and any(
        labels.picked_by_tested(summary, one) for _, _, one in labels.outcomes(summary)
    )
    held_out = (
        f"Each in turn was held out: a model learnt from {learnt} {others}, and then had to "
        f"recognise the texture in {'half of the samples' if half else 'every sample'} of {these}."
        f"{' The other half picked the model.' * picked}"
    )
    n = f"{len(summary.textures)} textures"
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


def describe_lost(lost: Lost | None) -> str:
    """Return how many markers were lost, and what models are given in their place; of any."""
    if lost is None:
        return ""
    if not lost.worst:
        return "No marker was lost."
    whose = (
        f"median of {lost.n} recordings; at most {labels.percent(lost.worst)}%, in recording"
        if lost.n > 1
        else "in recording"
    )
    return (
        f"Of the marker positions {labels.percent(lost.median)}% were lost ({whose} "
        f"{lost.recording}): models are given the mean of the markers round a lost one. Where "
        "that can't be, the last value is kept: with the published tracker, without a known "
        "layout, and of the skin as a whole."
    )


def list_findings(summary: Summary) -> list[str]:
    """Return what else is known of the winner: recordings, worst groups, rivals, mistakes."""
    won = winner(summary)
    if won is None:
        return []
    split, by = summary.split, won.found.by
    recordings = tables.mean_and_interval(won.found.recordings)
    whole = "whole recordings" if split.whole else f"the parts of recordings in {split.one}"
    whole = "halves of recordings" if won.protocol == "published" else whole
    worst = ", ".join(
        f"{split.printed(group)} {labels.percent(by[group])}%"
        for group in sorted(by, key=lambda group: by[group])[:WORST_SHOWN]
    )
    return [
        text
        for text in (
            _compare_within_modality(summary, won),
            labels.caption("across") if tables.spans_modalities(summary.models) else "",
            f"It recognises the texture of {recordings}% of {whole}, from all their samples "
            "together.",
            f"From the worst: {worst}." if len(by) > 1 else "",
            _compare_rivals(summary, won),
            _describe_mistake(summary, won),
        )
        if text
    ]


def _compare_within_modality(summary: Summary, won: Winner) -> str:
    """Return by how much the paper's models differ that differ in one thing, here and there."""
    paper = {name: one.mean_percent for name, one in published.published_families().items()}
    pairs = [
        f"{labels.model_title(one.model, summary)} over {labels.model_title(one.than, summary)} "
        f"{compare.format_points(one)}"
        + f" (paper {paper[one.model] - paper[one.than]:+d})"
        * (summary.split == SPEED)
        for one in summary.comparisons
        if one.protocol == won.protocol
        and {one.model, one.than} <= paper.keys()
        and compare.differ_in_one_thing(one.model, one.than)
    ]
    return f"Within a modality, in percentage points: {'; '.join(pairs)}." if pairs else ""


def _compare_rivals(summary: Summary, won: Winner) -> str:
    """Return which model did better, or how many it was better than."""
    if len(won.rivals) == 1:
        return "No other model was evaluated."
    best = find_best(won.rivals)
    accuracy = won.rivals[best].mean_accuracy
    if accuracy == won.found.mean_accuracy:
        return f"It did best of the {len(won.rivals)} models evaluated."
    return (
        f"{labels.model_title(best, summary)} did better here, with {labels.percent(accuracy)}%. "
        "What we recommend was picked once, on the simulated rig, and not by this test."
    )


def _describe_mistake(summary: Summary, won: Winner) -> str:
    """Return which texture it most often took for which other."""
    counts = np.array(won.found.confusion, dtype=float)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    np.fill_diagonal(share, 0)
    true, taken = np.unravel_index(share.argmax(), share.shape)
    if share[true, taken] == 0:
        return ""
    names = list(labels.texture_names(summary.textures, summary.named_by_spacing).values())
    return (
        f"Its most frequent mistake is to take {names[true]} for {names[taken]}: "
        f"{labels.percent(share[true, taken])}% of the samples of {names[true]}."
    )


def describe_uncertainty(summary: Summary) -> str:
    """Return what intervals were drawn over, and what they leave out."""
    once = any(
        len(found.seeds) == 1 and any(map(any, found.epochs.values()))
        for _, _, found in labels.outcomes(summary)
    )
    alone = " Networks were trained once: how far trainings differ is not in them (--seeds 3)."
    return labels.interval_note(summary) + alone * once


def list_next_steps(summary: Summary, results: Path | None = None) -> list[Step]:
    """Return what to do next, the most urgent first; nothing of a control, or at chance.

    Parameters
    ----------
    results
        The folder that they lie in, which a model's card is to state.
    """
    won = winner(summary)
    if won is None or won.found.mean_accuracy <= summary.chance or summary.control != "none":
        return []
    return [*_improve(summary, won), *_keep(summary, won, results)]


def _improve(summary: Summary, won: Winner) -> Iterator[Step]:
    """Yield what would make the numbers better, or say more."""
    sources = [data.source for data in summary.data]
    if summary.preset == "quick":
        yield Step(
            "Train longer. The preset quick only shows that all of it runs: repeat the command at "
            "the end of this page into another folder, with --preset fast."
        )
    wanted = summary.recommended
    if wanted and wanted not in {*won.rivals, *summary.lengths}:
        same = _repeat_options(summary, _OF_ANY_MODEL)
        again = ["afferents", "evaluate", *sources, *same, "--models", "best", "--out", "BEST"]
        title = labels.model_title(wanted, summary)
        yield Step(
            f"Evaluate what we recommend for such recordings, {title}: it was not run here.",
            shlex.join(again),
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


def _repeat_options(summary: Summary, names: Collection[str]) -> list[str]:
    """Return the words of a command for the same cut and preset, and the same of these options."""
    same = {name: value for name, value in summary.options.items() if name in names}
    same |= {"cut": summary.cut} if summary.cut != "all" else {}
    return shell_words(same | ({"preset": "paper"} if summary.preset == "paper" else {}))


def _keep(summary: Summary, won: Winner, results: Path | None) -> Iterator[Step]:
    """Yield how to keep a model and run it live: the one spoken of, or the best that can be."""
    # who only reads sentences needs no torch
    from afferents.evaluation.data import find_sources
    from afferents.evaluation.train import can_run_live

    able = {
        name: found
        for name, found in won.rivals.items()
        if name in MODELS and can_run_live(MODELS[name])
    }
    title, why = labels.model_title(won.model, summary), ""
    if not able:
        if won.model in MODELS:
            yield Step(f"{title} can be evaluated, but not trained to be kept.")
        return
    name = won.model if won.model in able else find_best(able)
    if name != won.model:
        why = (
            f"{title} can't be trained to be kept; of those evaluated the best that can is "
            f"{labels.model_title(name, summary)} ({labels.percent(able[name].mean_accuracy)}%). "
        )
    source = summary.data[0].source  # `train` takes one
    encodings = [one.encoding for one in find_sources(MODELS[name], Encodings())]
    own = {name for one in encodings for name in one.options()}
    options = _repeat_options(summary, own | TrainingOptions.model_fields.keys())
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
