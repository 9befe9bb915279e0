"""`--split texture`: what is said of a texture held out, at a speed held out.

Two questions: is it recognised as unknown (`unknown.py`), and, where the session names textures by
their bump spacing, how coarse is it in mm (`roughness.py`). The `nested` protocol alone: nothing of
the speed or the texture held out is seen before it is asked about.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import torch

from afferents.errors import InputError
from afferents.evaluation.choice import require_options
from afferents.evaluation.encode import encode_all, require_support, sources_of
from afferents.evaluation.fold_files import check_results_folder
from afferents.evaluation.intervals import SESSION, bootstrap_unit_of
from afferents.evaluation.recipe import Evaluation, Recipe
from afferents.evaluation.results import CONFIG, OPTIONS, ROUGHNESS, UNKNOWN
from afferents.evaluation.roughness import ask_mm, can_ask_mm, summarise_mm
from afferents.evaluation.run import require_images, skipped_recordings
from afferents.evaluation.schemas import About, Intervals, RoughnessSummary, UnknownSummary
from afferents.evaluation.unknown import ask_unknown, summarise_unknown
from afferents.files import remove_partials, write_aside, write_json
from afferents.folds.held_out import SPEED, TEXTURE
from afferents.models.classifiers import classifier_of
from afferents.models.confidence import KNOWN
from afferents.models.model import MODELS, Model
from afferents.outputs import writing_alone
from afferents.progress import Progress
from afferents.store.responses import Responses, named_by_spacing, speeds_of, textures_of

LEAST_TEXTURES, LEAST_SPEEDS = 3, 3
"""One held out, and of speeds one to set the limit at; two textures to tell apart."""


def can_be_asked(model: Model) -> bool:
    """Tell whether a model can answer for textures that are held out."""
    kind = classifier_of(model.classifier)
    return not model.parts and kind.asked_of_unseen_textures(model.speed_from)


def evaluate_textures(evaluation: Evaluation, progress: Progress) -> dict[str, About]:
    """Ask every model, write tables and summaries, and return the summaries by question.

    Raises
    ------
    InputError
        If a model can't be asked, an option makes no sense here, the folder holds something
        else, or there are too few textures or speeds.
    """
    _refuse(evaluation)
    torch.set_num_threads(1)
    recipe, everything = evaluation.recipe, evaluation.recordings
    require_support(recipe.models, everything, may_leave_out=False)
    require_options(recipe.models, recipe.encodings, everything)
    if recipe.options.ablation.markers != 1:
        require_images(recipe.models, recipe.encodings)
    SPEED.groups_of(everything)
    skipped = skipped_recordings(evaluation, recipe.models, everything)
    recordings = [r for r in everything if r.attrs["name"] not in skipped]
    textures = textures_of(recordings)
    _require_enough(textures, recordings)
    recipe = replace(recipe, skipped=skipped)
    config = recipe.config | {"split": TEXTURE}
    config[OPTIONS]["split"] = TEXTURE
    with writing_alone(recipe.out, "evaluate"):
        check_results_folder(recipe.out, config)
        remove_partials(recipe.out)
        asked = _ask(recipe, recordings, progress)
        about = replace(evaluation, recipe=recipe).about(recordings) | {
            "preset": "none: solved at once",
            "speeds_mm_s": speeds_of(recordings),
            "textures": tuple(textures),
        }
        write_json(recipe.out / CONFIG, config)
        return {name: _written(recipe.out, name, about, its) for name, its in asked.items()}


def _ask(
    recipe: Recipe, recordings: Sequence[Responses], progress: Progress
) -> dict[str, list[pd.DataFrame]]:
    """Return, by question, every model's table: of novelty, and where it can be asked, of mm."""
    questions = {UNKNOWN: ask_unknown}
    if named_by_spacing(recordings) and can_ask_mm(textures_of(recordings)):
        questions[ROUGHNESS] = ask_mm
    found: dict[str, list[pd.DataFrame]] = {name: [] for name in questions}
    for model in recipe.models:
        source = sources_of(model, recipe.encodings)[0]
        samples = encode_all(
            recordings, source, recipe.options.cut, progress, recipe.options.ablation
        )
        for name, ask in questions.items():
            found[name].append(ask(model, samples, source.encoding, progress))
    return found


def _written(out: Path, name: str, about: dict[str, Any], tables: Sequence[pd.DataFrame]) -> About:
    """Write the table and the summary of a question, with models of earlier runs; return it."""
    table = pd.concat(tables, ignore_index=True)
    if (out / f"{name}.parquet").is_file():
        earlier = pd.read_parquet(out / f"{name}.parquet")
        table = pd.concat([earlier[~earlier["model"].isin(table["model"])], table])
        table = table.reset_index(drop=True)
    summary: About
    if name == UNKNOWN:
        summary = UnknownSummary(**about, **_unknown_fields(table, len(about["data"])))
    else:
        summary = RoughnessSummary(**about, **summarise_mm(table))
    with write_aside(out / f"{name}.parquet") as partial, partial.open("wb") as file:
        table.to_parquet(file, compression="zstd", index=False)
    summary.write(out / f"{name}.json")
    return summary


def _unknown_fields(table: pd.DataFrame, n_sources: int) -> dict[str, Any]:
    unit, models = bootstrap_unit_of(n_sources, table), table.groupby("model", sort=False)
    n = n_sources if unit == SESSION else int(table["texture"].nunique())
    return {
        "false_alarms_stated": round(1 - KNOWN, 6),
        "intervals": Intervals(bootstrap_unit=unit, n=n),
        "models": {str(model): summarise_unknown(rows, unit) for model, rows in models},
    }


def _refuse(evaluation: Evaluation) -> None:
    """Refuse models and options that this split can't do with."""
    for model in evaluation.recipe.models:
        if not can_be_asked(model):
            able = ", ".join(name for name, other in MODELS.items() if can_be_asked(other))
            raise InputError(
                f"--models: expected some of {able} with --split texture, found {model.name}"
            )
    protocols = [protocol.name for protocol in evaluation.options.protocols]
    if protocols != ["nested"]:
        raise InputError(
            f"--protocol: expected nested with --split texture, found {' and '.join(protocols)}"
        )
    options = {
        "--held-out": evaluation.options.held_out,
        "--train-speeds": evaluation.options.ablation.train_speeds,
        "--test-only": evaluation.options.ablation.test_only,
        "--penalty": evaluation.recipe.choices.get("penalty"),
        "--recipe": evaluation.options.recipe.source or evaluation.recipe.choices.get("recipe"),
        "--disturb": " ".join(evaluation.recipe.corruptions.words()),
        "--cluster": evaluation.options.cluster,
        "--seeds": len(evaluation.options.seeds) if len(evaluation.options.seeds) > 1 else None,
    }
    for option, given in options.items():
        if given:
            raise InputError(
                f"{option}: expected none with --split texture, found {given}; leave it out"
            )


def _require_enough(textures: Sequence[str], recordings: Sequence[Responses]) -> None:
    speeds = speeds_of(recordings)
    if len(textures) < LEAST_TEXTURES or len(speeds) < LEAST_SPEEDS:
        raise InputError(
            f"the data: expected at least {LEAST_TEXTURES} textures and {LEAST_SPEEDS} speeds for "
            f"--split texture, found {len(textures)} and {len(speeds)}"
        )
