"""How the trainings behind an outcome went: the epoch that was kept, and the first one."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from afferents.core.errors import AfferentsError
from afferents.core.split import Split, key_of
from afferents.evaluation.folds import FOLD, FoldKey, read_facts


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
