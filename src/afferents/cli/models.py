"""Commands of single models: train one, explain it, export it."""

from pathlib import Path
from typing import Annotated, Any

import typer

from afferents.cli.options import fields_of, of_encodings, shows, takes
from afferents.cli.printing import say
from afferents.cli.shared import SEED, CutName, Data, Force, Json, ModelFolder, Quiet


@shows("data", "out", "model", "preset", "results", "split", "seed", "force", "quiet")
@takes(fields_of("TrainingOptions"), of_encodings)
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
    seed: Annotated[int, typer.Option(**SEED, help="Random seed of the training.")] = 0,
    split: Annotated[
        str,
        typer.Option(
            help="Calibrate it with the middle 'speed', or with the middle value of a condition "
            "that all recordings carry, such as 'trial'."
        ),
    ] = "speed",
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    **options: Any,
) -> None:
    """Train one model for use, not for a test.

    It learns from all speeds but one, which calibrates its probabilities.
    """
    import afferents

    card = afferents.train(
        data, out, model, seed, results, force, quiet or as_json, split=split, **options
    )
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
    import afferents

    found = afferents.explain(model, data, out, cut, quiet or as_json)
    pictures = [f"Picture: {path}" for path in found.pictures]
    say(as_json, found.facts, *found.sentences, *pictures)


def export(
    model: ModelFolder,
    out: Annotated[Path, typer.Argument(help="File to write, such as model.onnx.")],
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Write a trained model, with its card, as one ONNX file: what 'live' takes."""
    import afferents
    from afferents.models.card import CARD, read_card

    afferents.export(model, out, force)
    card = read_card(model / CARD)
    say(as_json, card.model_dump(mode="json"), *card.describe(), f"ONNX: {out}")
