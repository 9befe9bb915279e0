"""Commands of single models: train one, explain it, export it."""

from pathlib import Path
from typing import Annotated, Any

import typer

from afferents.cli.encodings import takes_encodings
from afferents.cli.printing import say
from afferents.cli.shared import (
    SEED,
    CutName,
    Data,
    DeviceName,
    Force,
    Json,
    ModelFolder,
    PrecisionName,
    PresetName,
    Quiet,
    SteadyPart,
)


@takes_encodings
def train(
    data: Data,
    out: Annotated[Path, typer.Argument(help="Folder to write the model to.")],
    model: Annotated[
        str,
        typer.Option(
            "--model",
            help="Its name; 'best' is what we recommend for such data; FILE.py:NAME is one of "
            "your own.",
        ),
    ] = "best",
    results: Annotated[
        Path | None,
        typer.Option(help="Results of 'evaluate', whose accuracy the model's card is to state."),
    ] = None,
    preset: PresetName = "fast",
    cut: CutName = "all",
    seed: Annotated[int, typer.Option(**SEED, help="Random seed of the training.")] = 0,
    force: Force = False,
    device: DeviceName = "auto",
    precision: PrecisionName = "auto",
    split: Annotated[
        str,
        typer.Option(
            help="Calibrate it with the middle 'speed', or with the middle value of a condition "
            "that all recordings carry, such as 'trial'."
        ),
    ] = "speed",
    steady: SteadyPart = None,
    as_json: Json = False,
    quiet: Quiet = False,
    **encoding: Any,
) -> None:
    """Train one model for use, not for a test.

    It learns from all speeds but one, which calibrates its probabilities.
    """
    from afferents import commands
    from afferents.core.steady import parse_steady

    card = commands.train(
        data, out, model, preset, cut, seed, results, force, device, precision, quiet or as_json,
        split, parse_steady(steady), **encoding,
    )  # fmt: skip
    say(as_json, card.model_dump(mode="json"), *card.describe(), f"Model: {out}")


def explain(
    model: ModelFolder,
    data: Data,
    out: Annotated[Path, typer.Option(help="Folder for the pictures.")],
    cut: CutName = "all",
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show what a model relies on: the markers, waves or frequencies that it fails without."""
    from afferents import commands

    found = commands.explain(model, data, out, cut, quiet or as_json)
    pictures = [f"Picture: {path}" for path in found.pictures]
    say(as_json, found.facts, *found.sentences, *pictures)


def export(
    model: ModelFolder,
    out: Annotated[Path, typer.Argument(help="File to write, such as model.onnx.")],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a trained model, with its card, as one ONNX file: what 'live' takes."""
    from afferents.pipeline.export import export_model

    card = export_model(model, out, force)
    say(as_json, card.model_dump(mode="json"), *card.describe(), f"ONNX: {out}")
