"""A scikit-learn estimator of a user's own on a fold."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from afferents.core.model import Model
from afferents.core.samples import labels_of
from afferents.training.fitted import Fitted, Part, solved_facts
from afferents.training.solved import learn, new_solved, scores_of

Indices = NDArray[np.int64]


def fit_estimator(
    model: Model, part: Part, seed: int, check: Callable[[Sequence[Indices]], None]
) -> Fitted:
    """Let it learn from the fold's training samples, and say what the test samples are.

    Nothing is picked by the validation samples: what it says of them is for the record alone.
    """
    samples, fold = part.samples, part.fold
    check([fold.train])
    labels, estimator = labels_of(samples), new_solved(model, samples, part.encoding)
    learn(estimator, samples, labels, fold.train, seed, 0.0, fold.split)
    validated = scores_of(estimator, samples, fold.validation).argmax(1).numpy()
    accuracy = float((validated == labels[fold.validation]).mean())
    probabilities = scores_of(estimator, samples, fold.test).exp().numpy()
    return Fitted(
        estimator,
        probabilities.astype(np.float32),
        None,
        solved_facts(fold, len(fold.train), accuracy),
    )
