"""A fitted scikit-learn estimator on disk, as skops stores it: never as a pickle.

A pickle runs whatever it holds when it is read. A file of skops names the types in it, and is read
only if all of them are trusted: those that skops itself trusts, classes of scikit-learn, and
estimator classes of a user's own that the model's card names, which are imported.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from afferents.core.errors import AfferentsError, InputError, raised
from afferents.core.own import imported, reference_of
from afferents.models import Classifier
from afferents.models.own import OwnEstimator

_WHAT = "an estimator whose types are scikit-learn's, or estimators of a module of one's own"


def save_estimator(fitted: Any, path: Path) -> None:
    """Write a fitted estimator; see `own_types` for what can be written."""
    path.write_bytes(_stored(fitted))


def own_types(classifier: Classifier) -> tuple[str, ...] | None:
    """Return the classes of a user's own in a fitted estimator, each as ``module:NAME``.

    None if the classifier is no estimator.

    Raises
    ------
    InputError
        If it can't be stored, or holds what could not be trusted when it is read: a function, or a
        class of a script or a notebook.
    """
    if not isinstance(classifier, OwnEstimator):
        return None
    content = _stored(classifier.fitted)
    own = [name for name in _untrusted(content) if not name.startswith("sklearn.")]
    found = [_of_name(name) for name in own]
    references = tuple(reference_of(one) for one in found)
    _load(content, references, "classifier")
    return references


def load_estimator(path: Path, own: Sequence[str]) -> Any:
    """Read a fitted estimator.

    Parameters
    ----------
    own
        Classes of a user's own that may be in it, each as ``module:NAME``; they are imported.

    Raises
    ------
    InputError
        If the file is missing, damaged, or holds anything else.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(path, "an estimator that can be read", raised(error)) from error
    return _load(content, own, path)


def _stored(fitted: Any) -> bytes:
    from skops.io import dumps

    try:
        return bytes(dumps(fitted))
    except Exception as error:
        raise InputError(
            "classifier", "an estimator that skops can store", raised(error)
        ) from error


def _load(content: bytes, own: Sequence[str], where: object) -> Any:
    from sklearn.base import BaseEstimator
    from skops.io import loads

    trusted = [imported(reference) for reference in own]
    for one, reference in zip(trusted, own, strict=True):
        if not (isinstance(one, type) and issubclass(one, BaseEstimator)):
            raise InputError(where, _WHAT, reference)
    try:
        trusted += [
            _of_sklearn(name) for name in _untrusted(content) if name.startswith("sklearn.")
        ]
        found = loads(content, trusted=trusted)
    except AfferentsError:
        raise
    except Exception as error:
        raise InputError(where, _WHAT, raised(error)) from error
    if not (hasattr(found, "predict_proba") and hasattr(found, "classes_")):
        raise InputError(where, "a fitted estimator with predict_proba", type(found).__name__)
    return found


def _of_sklearn(name: str) -> type:
    """Return a class of scikit-learn by its name, not one that it has imported from elsewhere."""
    found = _of_name(name)
    if not isinstance(found, type) or not found.__module__.startswith("sklearn."):
        raise InputError("estimator", _WHAT, name)
    return found


def _of_name(name: str) -> Any:
    """Return what skops names ``module.NAME``."""
    return imported(":".join(name.rpartition(".")[::2]))


def _untrusted(content: bytes) -> list[str]:
    from skops.io import get_untrusted_types

    return list(get_untrusted_types(data=content))
