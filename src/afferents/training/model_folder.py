"""A trained model on disk: a folder with its weights and its card.

A scikit-learn estimator lies beside them, and the weights are what calibrates it.
"""

from pathlib import Path
from typing import Any

from afferents.core.card import CARD, ESTIMATOR, WEIGHTS, Card, read_card
from afferents.core.errors import InputError
from afferents.core.files import holds_only, write_aside
from afferents.core.own import imported
from afferents.models import Classifier, Deployed, Task, build_for, classifier_of
from afferents.models.own import OwnEstimator
from afferents.training.estimator_file import load_estimator, save_estimator
from afferents.training.weights import load_weights, save_weights


def is_model_folder(folder: Path) -> bool:
    """Tell whether a folder is a model's, and holds nothing else."""
    return (folder / CARD).is_file() and holds_only(CARD, WEIGHTS, ESTIMATOR)(folder)


def save_model(deployed: Deployed, card: Card, folder: Path) -> None:
    """Write a model's folder, whole or not at all; one that is there is replaced."""
    with write_aside(folder, replaces=is_model_folder) as partial:
        partial.mkdir()
        save_weights(deployed, partial / WEIGHTS)
        if isinstance(deployed.network, OwnEstimator):
            save_estimator(deployed.network.fitted, partial / ESTIMATOR)
        (partial / CARD).write_text(card.to_json(indent=2) + "\n", encoding="utf-8")


def load_model(folder: Path) -> tuple[Card, Deployed]:
    """Read a model's folder.

    Raises
    ------
    InputError
        If it is none, one of its files is damaged, or its classifier is somebody's own and can't be
        imported.
    """
    path = folder / CARD
    if not path.is_file():
        raise InputError(folder, f"a model's folder with {CARD}", "none", "run 'afferents train'")
    card = read_card(path)
    task = Task(len(card.textures), card.shape, card.sample_dims)
    if card.estimator is None:
        network = build_for(_kind(card), task)
    else:
        fitted = load_estimator(folder / ESTIMATOR, card.estimator)
        network = OwnEstimator.of_fitted(fitted, task)
    deployed = Deployed(network, len(card.textures), card.scale)
    load_weights(deployed, folder / WEIGHTS)
    return card, deployed.eval()


def _kind(card: Card) -> type[Classifier]:
    wanted: Any = card.classifier
    return classifier_of(imported(wanted) if ":" in wanted else wanted)
