"""Refusing options that would do nothing for any of the models asked for."""

from collections.abc import Sequence

from afferents.core.choices import Penalty
from afferents.core.errors import InputError
from afferents.core.model import MODELS, Model
from afferents.encodings import Encodings
from afferents.evaluation.disturbance import Disturbances
from afferents.models import Solved, classifier_of
from afferents.pipeline.encode import sources_of
from afferents.training import Hyperparameters, learns_in_a_loop, recipe_of


def require_options(
    models: Sequence[Model],
    encodings: Encodings,
    disturbances: Disturbances,
    hyperparameters: Hyperparameters,
    penalty: Penalty = "fixed",
) -> None:
    """Refuse what would do nothing, or tell a model what it must not know.

    Raises
    ------
    InputError
        Naming the option.
    """
    require_disturbed(models, encodings, disturbances)
    require_searched(models, penalty)
    require_told(models, encodings)
    require_trained_so(models, encodings, hyperparameters)


def require_disturbed(
    models: Sequence[Model], encodings: Encodings, disturbances: Disturbances
) -> None:
    """Refuse disturbances that none of the models asked for would notice.

    Raises
    ------
    InputError
        Naming the option.
    """
    sources = [source for model in models for source in sources_of(model, encodings)]
    hears = any(source.encoding.of_vibration for source in sources)
    sees = any(not source.encoding.of_vibration for source in sources)
    options = [("--disturb", one) for one in disturbances.tests]
    for option, one in [*options, ("--disturb-training", disturbances.training)]:
        if one and not ((one.sound and hears) or (one.of_markers and sees)):
            names = ", ".join(model.name for model in models)
            raise InputError(option, f"models that notice {one}", names, "leave it out")


def require_searched(models: Sequence[Model], penalty: Penalty) -> None:
    """Refuse to choose penalties where no model has one to choose.

    Raises
    ------
    InputError
        Naming the models.
    """
    if penalty == "searched" and not any(_has_penalty(model) for model in models):
        able = ", ".join(name for name, model in MODELS.items() if _has_penalty(model))
        names = ", ".join(model.name for model in models)
        raise InputError("--penalty", f"models that have one ({able})", names, "leave it out")


def _has_penalty(model: Model) -> bool:
    kind = classifier_of(model.classifier)
    if issubclass(kind, Solved):
        return bool(kind.searched) or len(kind.penalties) > 1
    return any(_has_penalty(MODELS[name]) for name in model.parts)


def require_trained_so(
    models: Sequence[Model], encodings: Encodings, hyperparameters: Hyperparameters
) -> None:
    """Refuse hyperparameters of networks that none of the models asked for is.

    Raises
    ------
    InputError
        Naming the models.
    """
    if not hyperparameters.changed:
        return
    parts = (p for model in models for p in ([model] if learns_in_a_loop(model) else _parts(model)))
    learnt = [part for part in parts if learns_in_a_loop(part)]
    used = {recipe_of(part, encodings.of(part.encoding)) for part in learnt}
    if not used & set(hyperparameters.changed):
        networks = ", ".join(hyperparameters.changed)
        names = ", ".join(model.name for model in models)
        raise InputError("--recipe", f"models that learn as {networks}", names, "leave it out")


def require_told(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse lines that follow the speed where a model is not told it.

    They would be cut out where the recording's true speed puts them, and so tell it.

    Raises
    ------
    InputError
        Naming the model.
    """
    for model in models:
        for part in _parts(model):
            (source,) = sources_of(part, encodings)
            if source.encoding.needs_speed and part.speed_from != "robot":
                told = [name for name, one in MODELS.items() if one.speed_from == "robot"]
                raise InputError(
                    "--mask",
                    f"lines in Hz alone, or models that are told the speed ({', '.join(told)})",
                    f"lines in /mm for {model.name}, which would be told by where they lie",
                    "leave out the lines in /mm",
                )


def _parts(model: Model) -> list[Model]:
    """Return the models that a fusion is made of, or the model itself."""
    return [part for name in model.parts for part in _parts(MODELS[name])] or [model]
