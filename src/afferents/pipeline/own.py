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
    }


def titles_kept(results: Path) -> dict[str, str]:
    """Return the titles of the models of a user's own that a folder holds results of."""
    path = results / OWN_MODELS
    kept = read_json(path, "models of one's own") if path.is_file() else {}
    return {name: str(found["title"]) for name, found in kept.items()}


def keep_own_models(results: Path, models: Sequence[Model], encodings: Encodings) -> None:
    """Put down what the models of a user's own are, beside those of earlier runs.

    Raises
    ------
    InputError
        If a name stood for another model before.
    """
    path = results / OWN_MODELS
    kept = read_json(path, "models of one's own") if path.is_file() else {}
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
        write_json(path, kept)
