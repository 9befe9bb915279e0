"""A trained model's folder: its card, its weights, and a scikit-learn estimator where it is one.

Weights are safetensors, and an estimator is stored as skops does, never as a pickle: that runs
whatever it holds when it is read. A file of skops names the types in it, and is read only if all of
them are trusted: those that skops itself trusts, classes of scikit-learn, and estimator classes of
a user's own that the model's card names, which are imported. The weights of an estimator are what
calibrates it.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import nn

from afferents.errors import AfferentsError, InputError, raised, reading
from afferents.files import holds_only, write_aside
from afferents.models.base import Classifier, Task, build_classifier
from afferents.models.card import CARD, ESTIMATOR, WEIGHTS, Card, read_card
from afferents.models.classifiers import OwnEstimator, get_classifier
from afferents.models.deployed import Deployed, Recogniser
from afferents.plugins import imported, reference_of

_ESTIMATOR = "an estimator whose types are scikit-learn's, or estimators of a module of your own"


def is_model_folder(folder: Path) -> bool:
    """Return whether a folder is a model's, and holds nothing else."""
    return (folder / CARD).is_file() and holds_only(CARD, WEIGHTS, ESTIMATOR)(folder)


def save_model(deployed: Deployed, card: Card, folder: Path) -> None:
    """Write a model's folder, whole or not at all; one that is there is replaced."""
    with write_aside(folder, replaces=is_model_folder) as partial:
        partial.mkdir()
        (partial / WEIGHTS).write_bytes(dump_weights(deployed))
        if isinstance(deployed.network, OwnEstimator):
            (partial / ESTIMATOR).write_bytes(_dump_estimator(deployed.network.fitted))
        (partial / CARD).write_text(card.to_json(indent=2) + "\n", encoding="utf-8")


def load_model(folder: Path) -> Recogniser:
    """Read a model's folder.

    Raises
    ------
    InputError
        If it is none, one of its files is damaged, or its classifier is of a user's own and can't
        be imported.
    """
    path = folder / CARD
    if not path.is_file():
        raise InputError(
            f"{folder}: expected a model's folder with {CARD}, found none; run 'afferents train'"
        )
    card = read_card(path)
    task = Task(len(card.textures), card.shape, card.sample_dims)
    if card.estimator is None:
        name = card.classifier
        network = build_classifier(get_classifier(imported(name) if ":" in name else name), task)
    else:
        path = folder / ESTIMATOR
        with reading(path, _ESTIMATOR, OSError):
            content = path.read_bytes()
        fitted = _load_estimator(content, card.estimator, path)
        network = build_classifier(get_classifier(fitted), task)
        network.fitted = fitted
    deployed = Deployed(network, len(card.textures), card.scale)
    load_weights(deployed, folder / WEIGHTS)
    return Recogniser(card, deployed.eval())


def dump_weights(model: nn.Module) -> bytes:
    """Return the content of a file of a network's weights and running statistics."""
    return save({name: value.cpu().contiguous() for name, value in model.state_dict().items()})


def load_weights(model: nn.Module, path: Path) -> None:
    """Read weights into a network of the same layers, in place.

    Raises
    ------
    InputError
        If the file is missing, is no safetensors file, or belongs to another network.
    """
    with reading(path, "weights as safetensors", OSError, SafetensorError):
        weights = load(path.read_bytes())
    try:
        model.load_state_dict(weights)
    except RuntimeError as error:
        found = str(error).splitlines()[-1].strip()
        raise InputError(
            f"{path}: expected weights of {type(model).__name__}, found {found}"
        ) from error


def find_own_types(classifier: Classifier) -> tuple[str, ...] | None:
    """Return the classes of a user's own in a fitted estimator, each as ``module:NAME``.

    None if the classifier is no estimator.

    Raises
    ------
    InputError
        If it can't be stored, or holds what could not be trusted when it is read: a function, or a
        class of a script or a notebook.
    """
    from skops.io import get_untrusted_types

    if not isinstance(classifier, OwnEstimator):
        return None
    content = _dump_estimator(classifier.fitted)
    names = get_untrusted_types(data=content)
    own = tuple(
        reference_of(_import_type(name)) for name in names if not name.startswith("sklearn.")
    )
    _load_estimator(content, own, "classifier")
    return own


def _dump_estimator(fitted: Any) -> bytes:
    from skops.io import dumps

    try:
        return bytes(dumps(fitted))
    except Exception as error:
        raise InputError(
            f"classifier: expected an estimator that skops can store, found {raised(error)}"
        ) from error


def _load_estimator(content: bytes, own: Sequence[str], where: object) -> Any:
    """Return a fitted estimator; `own` are the user's classes that may be in it, as module:NAME."""
    from sklearn.base import BaseEstimator
    from skops.io import get_untrusted_types, loads

    trusted = [imported(reference) for reference in own]
    for one, reference in zip(trusted, own, strict=True):
        if not (isinstance(one, type) and issubclass(one, BaseEstimator)):
            raise InputError(f"{where}: expected {_ESTIMATOR}, found {reference}")
    try:
        names = get_untrusted_types(data=content)
        for name in (one for one in names if one.startswith("sklearn.")):
            found = _import_type(name)
            # What scikit-learn has imported from elsewhere is none of its classes.
            if not isinstance(found, type) or not found.__module__.startswith("sklearn."):
                raise InputError(f"estimator: expected {_ESTIMATOR}, found {name}")
            trusted.append(found)
        fitted = loads(content, trusted=trusted)
    except AfferentsError:
        raise
    except Exception as error:
        raise InputError(f"{where}: expected {_ESTIMATOR}, found {raised(error)}") from error
    if not (hasattr(fitted, "predict_proba") and hasattr(fitted, "classes_")):
        kind = type(fitted).__name__
        raise InputError(f"{where}: expected a fitted estimator with predict_proba, found {kind}")
    return fitted


def _import_type(name: str) -> Any:
    """Return what skops names ``module.NAME``."""
    return imported(":".join(name.rpartition(".")[::2]))
