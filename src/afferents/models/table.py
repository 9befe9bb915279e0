"""The classifiers by name, and those of a user's own."""

from typing import Any

from afferents.errors import InputError
from afferents.models.base import Classifier, Task, build_for
from afferents.models.networks import CnnLstm, SpatialNet, ThreeStems, VibrationNet
from afferents.models.orders import OrderSearch
from afferents.models.own import own_classifier
from afferents.models.solved import (
    Discriminant,
    JointFusion,
    LateFusion,
    MeanFusion,
    Ridge,
    SearchedRidge,
)

CLASSIFIERS: dict[str, type[Classifier]] = {
    kind.name: kind
    for kind in (
        SpatialNet, CnnLstm, VibrationNet, Ridge, SearchedRidge, OrderSearch, LateFusion,
        JointFusion, Discriminant, MeanFusion, ThreeStems,
    )
}  # fmt: skip
"""The paper's three networks, then ours."""


def classifier_of(wanted: Any) -> type[Classifier]:
    """Return the classifier of that name, or one that wraps what is given.

    Parameters
    ----------
    wanted
        A name; a `Classifier`; a scikit-learn estimator with `predict_proba`; or a function from
        the number of textures and the shape of a sample to a torch module.

    Raises
    ------
    InputError
        If it is none of these.
    """
    if isinstance(wanted, type) and issubclass(wanted, Classifier):
        return wanted
    if isinstance(wanted, str):
        if wanted not in CLASSIFIERS:
            known = f"one of {', '.join(CLASSIFIERS)}, or an object"
            raise InputError(f"classifier: expected {known}, found '{wanted}'")
        return CLASSIFIERS[wanted]
    return own_classifier(wanted)


def build(
    classifier: Any, n_classes: int, sample_shape: tuple[int, ...], seed: int = 0
) -> Classifier:
    """Return a classifier for samples of a shape, nothing learnt yet.

    Parameters
    ----------
    classifier
        See `classifier_of`.
    n_classes
        Number of textures, at least 2.
    sample_shape
        Of one sample: (row, column), (frame, row, column), (channel, frequency), whatever it takes.
    seed
        Of the first weights; the caller's random state is left as it was.

    Raises
    ------
    InputError
        If the samples have another number of dims or are too small, or there is nothing to tell
        apart.
    """
    kind = classifier_of(classifier)
    dims = kind.takes or tuple(f"dim_{i}" for i in range(len(sample_shape)))
    return build_for(kind, Task(n_classes, sample_shape, dims, seed=seed))
