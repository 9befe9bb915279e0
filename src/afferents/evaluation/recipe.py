"""Several lengths of window in one evaluation: ``--frames 1,2,5,10,20,50``.

Each length of a model is a model of its own, named by its length (`sa-ste-20`), so that results,
tables and figures hold it like any other.
"""

import inspect
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from afferents.channels import CHANNELS, channel_of
from afferents.documents import read_json
from afferents.encodings.base import Encoding
from afferents.encodings.settings import ENCODINGS, Encodings
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, Origin, recordings_in
from afferents.evaluation.encode import require_for, sources_of
from afferents.evaluation.fold_files import FOLD, FOLDS, digest_of
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.results import OPTIONS, OWN_MODELS
from afferents.evaluation.schemas import SCHEMA
from afferents.evaluation.summary import data_quality
from afferents.files import checksum, write_json
from afferents.folds.controls import controlled
from afferents.folds.held_out import SPEED, Split
from afferents.models.config import RECIPES
from afferents.models.model import Model, listed, pick_own
from afferents.store.responses import Responses, named_by_spacing
from afferents.store.trimming import with_steady
from afferents.version import __version__

FIELD, FLAG = "frames", "--frames"
"""Of encodings whose samples are runs of images: their length."""


def lengths_in(given: object) -> tuple[int, ...]:
    """Return the lengths that are asked for, in frames, if there are several; else none.

    Parameters
    ----------
    given
        A number, several with commas between, or a list of them; None for nothing.

    Raises
    ------
    InputError
        If one of several is no positive whole number.
    """
    parts = given.split(",") if isinstance(given, str) else given
    if not isinstance(parts, Sequence) or len(parts) < 2:
        return ()
    try:
        lengths = tuple(dict.fromkeys(int(str(part)) for part in parts))
    except ValueError:
        lengths = (0,)
    if min(lengths) < 1:
        expected = "whole numbers of frames with commas between, such as 1,2,5,10"
        raise InputError(f"{FLAG}: expected {expected}, found '{given}'")
    return lengths


def by_length(models: Sequence[Model], lengths: Sequence[int], encodings: Encodings) -> list[Model]:
    """Return a model of each length in place of each whose samples are runs of images.

    Raises
    ------
    InputError
        If none is.
    """
    require_for(FLAG, lambda model: _encoding(model, encodings) is not None, models)
    return [one for model in models for one in _variants(model, lengths, encodings)]


def _variants(model: Model, lengths: Sequence[int], encodings: Encodings) -> list[Model]:
    encoding = _encoding(model, encodings)
    if encoding is None:
        return [model]
    return [
        replace(
            model,
            name=f"{model.name}-{n}",
            title=f"{model.title}, {n} frame{'s' if n > 1 else ''}",
            encoding=encoding.changed(**{FIELD: n}),
            variant_of=model.name,
        )
        for n in lengths
    ]


def _encoding(model: Model, encodings: Encodings) -> Encoding | None:
    """Return the encoding of a model whose samples are runs of images; None of any other."""
    sources = () if model.parts else sources_of(model, encodings)
    of_runs = (one.encoding for one in sources if FIELD in type(one.encoding).model_fields)
    return next(of_runs, None)


def lengths_kept(own_models: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, str]]:
    """Return the models by the name that they are lengths of, then by length, shortest first."""
    found: dict[str, dict[int, str]] = {}
    for name, described in own_models.items():
        if base := described.get("variant_of"):
            found.setdefault(base, {})[int(described["encoding"][FIELD])] = name
    return {base: {str(n): of[n] for n in sorted(of)} for base, of in found.items()}


# Models of a user's own in a results folder: one name must stand for one model.


def describe(model: Model, encodings: Encodings) -> dict[str, Any]:
    """Return what tells a model from another of its name, as far as it can be put down."""
    encoding, classifier = encodings.of(model.encoding), model.classifier
    where = f"{getattr(classifier, '__module__', '')}:{getattr(classifier, '__qualname__', '')}"
    channel = channel_of(model.channel)
    own: dict[str, type] = {}
    if CHANNELS.get(channel.name) != channel:
        own[repr(channel)] = type(channel)
    if ENCODINGS.get(encoding.name) is not type(encoding):
        own[encoding.name] = type(encoding)
    return {
        "title": model.title,
        "channel": channel.name,
        "encoding": encoding.describe(),
        "classifier": where if callable(classifier) else repr(classifier),
        "source": _source_of(classifier if callable(classifier) else type(classifier)),
        "recipe": model.recipe,
        "stretched": model.stretched,
        **({"variant_of": model.variant_of} if model.variant_of else {}),
        **({"own": {name: _source_of(kind) for name, kind in own.items()}} if own else {}),
    }


def _source_of(maker: Any) -> str:
    """Return what tells the file in which something is written from another; empty of none."""
    try:
        return checksum(Path(inspect.getsourcefile(maker) or ""))
    except (TypeError, OSError):
        return ""


def own_kept(results: Path) -> dict[str, Any]:
    """Return what the models of a user's own are that a folder holds results of; see `describe`."""
    path = results / OWN_MODELS
    return read_json(path, "models of one's own") if path.is_file() else {}


def describe_custom_models(results: Path) -> dict[str, Any]:
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
        If a name stood for another model before, of which a fold was learnt or begun.
    """
    kept = own_kept(results)
    for model in pick_own(models):
        found = describe(model, encodings)
        files = (results / FOLDS / model.name).rglob("*")
        begun = any(path.name == FOLD or path.suffix == ".checkpoint" for path in files)
        earlier, kept[model.name] = kept.get(model.name, found), found
        if begun and earlier != found:
            raise InputError(
                f"{results}: expected results of the model '{model.name}' as it is now, found "
                "those of another that had its name; give it another name, or choose another "
                "--out"
            )
    if kept:
        write_json(results / OWN_MODELS, kept)


# What an evaluation consists of: data, models, and how they are trained and tested.


@dataclass(frozen=True, eq=False)
class Recipe:
    """What every training of an evaluation goes by, and nothing else: it is sent along with each.

    Recipes are told apart by who they are, for what they hold (a user's own model) may not compare.

    Attributes
    ----------
    out
        The results folder.
    data
        Where the data come from, for processes that read them themselves.
    models
        Those asked for, ``best`` and the like resolved.
    encodings
        How samples are made, as suits the data and as asked for.
    options
        What was chosen.
    skipped
        Recordings that no model uses, and why; found out when the evaluation begins.
    tested
        Recordings that alone are tested, and never learnt from; none for all alike. As `skipped`.
    """

    out: Path
    data: tuple[Origin, ...]
    models: Sequence[Model]
    encodings: Encodings
    options: EvaluationOptions = field(default_factory=EvaluationOptions)
    skipped: Mapping[str, str] = field(default_factory=dict)
    tested: frozenset[str] = frozenset()

    @property
    def config(self) -> dict[str, Any]:
        """Return what must agree for folds to stand in one results folder, and what was chosen.

        `config.json` holds it. The last entry, `options`, may differ from run to run.
        """
        training = {name: self.options.training(name).model_dump(mode="json") for name in RECIPES}
        ablation = self.options.ablation.describe()
        return {
            "schema": SCHEMA,
            "data": [origin.model_dump() for origin in self.data],
            "without": dict(self.options.without),
            "skipped": sorted(self.skipped),
            "cut": self.options.cut,
            "preset": self.options.preset,
            **self.encodings.describe(),
            "training": training,
            **({"ablation": ablation} if ablation else {}),
            **self.choices,
            OPTIONS: self.options.given(),
        }

    @property
    def choices(self) -> dict[str, Any]:
        """Return what is held out and whatever else was chosen, ready for JSON."""
        options = self.options
        found = {
            "split": options.split if options.split != SPEED.name else None,
            "steady_s": options.steady and list(options.steady),
            "control": options.control if options.control != "none" else None,
            "penalty": options.penalty if options.penalty != "fixed" else None,
            "statistics": options.statistics if options.statistics != "warmed-up" else None,
            "recipe": options.recipe.describe(),
            "disturb": options.disturb.describe(),
            "disturb_training": options.disturb_training.describe(),
        }
        return {name: v for name, v in found.items() if v}

    @property
    def split(self) -> Split:
        """What is held out."""
        return self.options.by

    def recordings(self, data: Sequence[OpenedData]) -> list[Responses]:
        """Return the recordings that are used, with the part of them that is."""
        used = self.options.ablation.recordings(recordings_in(data))
        return controlled(with_steady(used, self.options.steady), self.options.control, self.split)

    def to_json(self) -> str:
        """Return what a worker makes it from again, which reads the same files (`recipe_from`).

        Raises
        ------
        InputError
            If a model is an object of this process, which no other one can find.
        """
        if objects := [m.name for m in listed(self.options.models) if isinstance(m, Model)]:
            raise InputError(
                f"--cluster: expected models by name, or as FILE.py:NAME, which workers can read, "
                f"found the object {objects[0]}; give the file that it is made in"
            )
        return json.dumps(
            {
                "folder": str(Path.cwd()),
                "data": [origin.source for origin in self.data],
                "out": str(self.out),
                "options": self.options.given(),
                "skipped": dict(self.skipped),
                "tested": sorted(self.tested),
                "digest": digest_of(self.config),
            }
        )

    def model(self, name: str) -> Model:
        """Return the model of that name."""
        return next(model for model in self.models if model.name == name)


@dataclass(frozen=True)
class Evaluation:
    """What is evaluated: what all trainings go by, and their data, opened."""

    recipe: Recipe
    data: Sequence[OpenedData]

    @property
    def options(self) -> EvaluationOptions:
        """What was chosen."""
        return self.recipe.options

    @property
    def recordings(self) -> list[Responses]:
        """Return the recordings that are used, with the part of them that is."""
        return self.recipe.recordings(self.data)

    def about(self, recordings: Sequence[Responses]) -> dict[str, Any]:
        """Return what a summary says of the whole; see `schemas.Summary`."""
        recipe, n_used = self.recipe, len(recordings)
        some = n_used < sum(origin.n_recordings for origin in recipe.data)
        return {
            "schema": SCHEMA,
            "afferents": __version__,
            "data": [origin.model_dump() for origin in recipe.data],
            "without": dict(recipe.options.without),
            **({"n_used": n_used} if some else {}),
            OPTIONS: self.options.further(),
            "cut": recipe.options.cut,
            "preset": recipe.options.preset,
            "skipped": [{"recording": n, "reason": why} for n, why in recipe.skipped.items()],
            **data_quality(recordings),
            **named_by_spacing(recordings),
            **recipe.choices,
        }
