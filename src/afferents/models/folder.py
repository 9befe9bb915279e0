"""A trained model on disk, made ready to recognise texture, and asked from Python."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self, cast

import numpy as np
import torch
import xarray as xr
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor, nn

from afferents import dims
from afferents.channels import channel_of
from afferents.encodings.samples import Samples, speeds_told
from afferents.encodings.settings import encoding_of
from afferents.errors import AfferentsError, InputError, raised, reading
from afferents.files import holds_only, write_aside
from afferents.models.base import Classifier, Task, build_for
from afferents.models.card import CARD, ESTIMATOR, WEIGHTS, Card, read_card, require_unit
from afferents.models.classifiers import OwnEstimator, classifier_of
from afferents.models.confidence import Novelty
from afferents.models.networks import CnnLstm
from afferents.plugins import imported, reference_of

# A trained network or ridge made ready to feel with: calibrated probabilities, and 'unknown'.
#
# A sample is unknown if its novelty (`models/calibrate.py`), measured on a network's last features
# or on a ridge's scores, is above 1.


class Deployed(nn.Module):
    """Probabilities and novelty of samples.

    Parameters
    ----------
    network
        A classifier that has learnt.
    n_classes
        Number of textures.
    scale
        Samples are divided by it.
    """

    temperature: Tensor

    def __init__(self, network: Classifier, n_classes: int, scale: float) -> None:
        """Start with temperature 1, and nothing known."""
        super().__init__()
        self.network = network
        self.scale = scale
        self.register_buffer("temperature", torch.ones(()))
        self.novelty = Novelty(n_classes, network.n_last)

    def forward(self, samples: Tensor) -> tuple[Tensor, Tensor]:
        """Return probabilities (batch, n_classes) and novelty (batch,)."""
        return self.outcome(self.last_features(samples))

    def last_features(self, samples: Tensor) -> Tensor:
        """Return what the scores are worked out of, (batch, feature)."""
        return self.network.last_features(samples * (1 / self.scale))

    def outcome(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Return probabilities and novelty of last features."""
        scores = self.network.scores_of(features)
        novelty = self.novelty(scores if self.network.novelty_of_scores else features)
        return (scores / self.temperature).softmax(1), novelty

    @torch.no_grad()
    def fit_novelty(self, features: Tensor, labels: Tensor, unseen: Tensor) -> None:
        """Learn what is known from last features of training samples, and of unseen ones the limit.

        Parameters
        ----------
        features, labels
            Of training samples, (n, feature) and (n,).
        unseen
            Last features of samples that were not learnt from, (m, feature).
        """
        network = self.network
        learnt, held = (
            network.scores_of(f) if network.novelty_of_scores else f for f in (features, unseen)
        )
        self.novelty.fit(learnt, labels, held)


class Stepping(nn.Module):
    """A deployed CNN-LSTM frame by frame: what the image stack made of earlier frames is kept.

    The same as `Deployed` on the run, a tenth of the work.
    """

    def __init__(self, deployed: Deployed) -> None:
        """Take over a deployed CNN-LSTM."""
        super().__init__()
        self.deployed = deployed

    def forward(self, image: Tensor, past: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return probabilities, novelty, and `past` for the next frame.

        Parameters
        ----------
        image
            (1, row, column).
        past
            Features of the frames before it, (1, n_frames - 1, feature).
        """
        whole, network = self.deployed, cast("CnnLstm", self.deployed.network)
        newest = network.image((image * (1 / whole.scale)).unsqueeze(1))
        of_frames = torch.cat([past, newest.unsqueeze(1)], 1)
        last: Tensor = network.dense[:-1](network.after(of_frames))
        probabilities, novelty = whole.outcome(last)
        return probabilities, novelty, of_frames[:, 1:]


# Weights on disk as safetensors.


def save_weights(model: nn.Module, path: Path) -> None:
    """Write a network's weights and running statistics, whole or not at all."""
    with write_aside(path) as partial:
        partial.write_bytes(weights_of(model))


def weights_of(model: nn.Module) -> bytes:
    """Return the content of a file of weights."""
    state = {name: value.cpu().contiguous() for name, value in model.state_dict().items()}
    return save(state)


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


# A trained model on disk: a folder with its weights and its card.
#
# A scikit-learn estimator lies beside them, and the weights are what calibrates it.


def is_model_folder(folder: Path) -> bool:
    """Tell whether a folder is a model's, and holds nothing else."""
    return (folder / CARD).is_file() and holds_only(CARD, WEIGHTS, ESTIMATOR)(folder)


def save_model(deployed: Deployed, card: Card, folder: Path) -> None:
    """Write a model's folder, whole or not at all; one that is there is replaced."""
    with write_aside(folder, replaces=is_model_folder) as partial:
        partial.mkdir()
        save_weights(deployed, partial / WEIGHTS)
        if isinstance(deployed.network, OwnEstimator):
            (partial / ESTIMATOR).write_bytes(_stored(deployed.network.fitted))
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
        raise InputError(
            f"{folder}: expected a model's folder with {CARD}, found none; run 'afferents train'"
        )
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


# A fitted scikit-learn estimator on disk, as skops stores it: never as a pickle.
#
# A pickle runs whatever it holds when it is read. A file of skops names the types in it, and is
# read only if all of them are trusted: those that skops itself trusts, classes of scikit-learn,
# and estimator classes of a user's own that the model's card names, which are imported.

_ESTIMATOR = "an estimator whose types are scikit-learn's, or estimators of a module of one's own"


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
    with reading(path, _ESTIMATOR, OSError):
        content = path.read_bytes()
    return _load(content, own, path)


def _stored(fitted: Any) -> bytes:
    from skops.io import dumps

    try:
        return bytes(dumps(fitted))
    except Exception as error:
        raise InputError(
            f"classifier: expected an estimator that skops can store, found {raised(error)}"
        ) from error


def _load(content: bytes, own: Sequence[str], where: object) -> Any:
    from sklearn.base import BaseEstimator
    from skops.io import loads

    trusted = [imported(reference) for reference in own]
    for one, reference in zip(trusted, own, strict=True):
        if not (isinstance(one, type) and issubclass(one, BaseEstimator)):
            raise InputError(f"{where}: expected {_ESTIMATOR}, found {reference}")
    try:
        trusted += [
            _of_sklearn(name) for name in _untrusted(content) if name.startswith("sklearn.")
        ]
        found = loads(content, trusted=trusted)
    except AfferentsError:
        raise
    except Exception as error:
        raise InputError(f"{where}: expected {_ESTIMATOR}, found {raised(error)}") from error
    if not (hasattr(found, "predict_proba") and hasattr(found, "classes_")):
        raise InputError(
            f"{where}: expected a fitted estimator with predict_proba, found {type(found).__name__}"
        )
    return found


def _of_sklearn(name: str) -> type:
    """Return a class of scikit-learn by its name, not one that it has imported from elsewhere."""
    found = _of_name(name)
    if not isinstance(found, type) or not found.__module__.startswith("sklearn."):
        raise InputError(f"estimator: expected {_ESTIMATOR}, found {name}")
    return found


def _of_name(name: str) -> Any:
    """Return what skops names ``module.NAME``."""
    return imported(":".join(name.rpartition(".")[::2]))


def _untrusted(content: bytes) -> list[str]:
    from skops.io import get_untrusted_types

    return list(get_untrusted_types(data=content))


# A trained model that is asked from Python.

_BATCH = 256


@dataclass(frozen=True, eq=False)
class Recogniser:
    """A trained model, ready to be asked what it feels.

    Attributes
    ----------
    card
        What the model is, what it learnt from, and how far it was tested.
    """

    card: Card
    deployed: Deployed

    @classmethod
    def of_folder(cls, folder: Path) -> Self:
        """Read the model that is in a folder; see `models.folder.load_model`."""
        return cls(*load_model(folder))

    @torch.no_grad()
    def predict(self, samples: Samples) -> xr.Dataset:
        """Return what samples feel like.

        Parameters
        ----------
        samples
            As `afferents.samples` returns them for the card's channel and encoding, (sample, ...).

        Returns
        -------
        xarray.Dataset
            `probability (sample, texture)`, rows sum to 1; `novelty (sample)`, above 1 where a
            sample is unlike all that was learnt from; `speed_outside (sample)`, whether the
            sample's speed is known and slower or faster than all that was learnt from: novelty
            says nothing there, for known textures are novel too; and the coordinates of the
            samples.

        Raises
        ------
        InputError
            If a sample has another form than those that the model learnt from, or says that it is
            of another channel, or of cells and not of markers.
        """
        if dims.CHANNEL in samples.attrs:
            require_unit(self.card, bool(samples.attrs.get(dims.CELLS)), "samples")
        seen = encoding_of(self.card.encoding, "the card").seen(samples.values)
        if seen.shape[1:] != self.card.shape:
            raise InputError(
                f"samples: expected (sample, ...) of the form {self.card.shape}, as the model "
                f"learnt from, found {samples.shape[1:]}; encode {self.card.channel} as the "
                "card's 'encoding' says"
            )
        learnt = channel_of(self.card.channel).name
        if (found := samples.attrs.get(dims.CHANNEL, learnt)) != learnt:
            raise InputError(f"samples: expected some of {learnt}, found some of {found}")
        values = torch.as_tensor(seen, dtype=torch.float32)
        outcomes = [self.deployed(batch) for batch in torch.split(values, _BATCH)]
        probability, novelty = (torch.cat(parts).numpy() for parts in zip(*outcomes, strict=True))
        of_samples = {
            str(name): coordinate
            for name, coordinate in samples.coords.items()
            if coordinate.dims == (dims.SAMPLE,) and name != dims.TEXTURE
        }
        return xr.Dataset(
            {"probability": ((dims.SAMPLE, dims.TEXTURE), probability),
             "novelty": (dims.SAMPLE, novelty),
             "speed_outside": (dims.SAMPLE, self._outside(samples))},
            {**of_samples, dims.TEXTURE: list(self.card.textures)},
        )  # fmt: skip

    def _outside(self, samples: Samples) -> NDArray[np.bool_]:
        """Return which samples are known to be slower or faster than all that was learnt from."""
        learnt = self.card.learnt_from_mm_s
        if dims.SPEED not in samples.coords or not learnt:
            return np.zeros(len(samples), dtype=bool)
        speed = speeds_told(samples)
        return np.asarray((speed < min(learnt)) | (speed > max(learnt)))
