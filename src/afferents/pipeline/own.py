"""Models of a user's own in a results folder: one name must stand for one model."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from afferents.channels import channel_of
from afferents.core.documents import read_json
from afferents.core.errors import InputError
from afferents.core.files import write_json
from afferents.core.model import Model, own_of
from afferents.encodings import Encodings
from afferents.pipeline.lengths import lengths_kept

OWN_MODELS = "own_models.json"


def describe(model: Model, encodings: Encodings) -> dict[str, Any]:
    """Return what tells a model from another of its name, as far as it can be put down."""
    encoding, classifier = encodings.of(model.encoding), model.classifier
    where = f"{getattr(classifier, '__module__', '')}:{getattr(classifier, '__qualname__', '')}"
    return {
        "title": model.title,
        "channel": channel_of(model.channel).name,
        "encoding": encoding.describe(),
        "classifier": where if callable(classifier) else repr(classifier),
        "recipe": model.recipe,
        "stretched": model.stretched,
        **({"variant_of": model.variant_of} if model.variant_of else {}),
    }


def own_kept(results: Path) -> dict[str, Any]:
    """Return what the models of a user's own are that a folder holds results of; see `describe`."""
    path = results / OWN_MODELS
    return read_json(path, "models of one's own") if path.is_file() else {}


def said_of_own(results: Path) -> dict[str, Any]:
    """Return what a summary says of models that are none of the package's, if there are any."""
    kept = own_kept(results)
    titles = {name: str(found["title"]) for name, found in kept.items()}
    said = {"titles": titles, "lengths": lengths_kept(kept)}
    return {name: content for name, content in said.items() if content}


def keep_own_models(results: Path, models: Sequence[Model], encodings: Encodings) -> None:
    """Put down what the models of a user's own are, beside those of earlier runs.

    Raises
    ------
    InputError
        If a name stood for another model before.
    """
    kept = own_kept(results)
    for model in own_of(models):
        found = describe(model, encodings)
        if kept.setdefault(model.name, found) != found:
            raise InputError(
                results,
                f"results of the model '{model.name}' as it is now",
                "those of another that had its name",
                "give it another name, or choose another --out",
            )
    if kept:
        write_json(results / OWN_MODELS, kept)
