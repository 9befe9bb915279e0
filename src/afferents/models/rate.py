"""How fast a model learns and tells textures on this machine, measured on a few batches."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.folds.protocol import Fold, Protocol
from afferents.models.config import TrainingConfig, choose_device
from afferents.models.fitted import Fitting, Part, new_classifier
from afferents.models.fitting import fit, fit_network, learns_in_a_loop
from afferents.models.learning_set import learning_set, originals
from afferents.models.loop import predict
from afferents.models.model import Model
from afferents.models.networks import CnnLstm

MEASURED_S = 0.5
"""So long, about, each rate is measured."""
_BATCHES = 2
_TEXTURES, _SPEEDS = 13, 10
_FEW, _MORE = 6, 24
"""Samples of each recording by which a model that is solved at once is measured."""
Out = TypeVar("Out")


class Amounts(NamedTuple):
    """How many samples of a fold there are, nothing thinned and nothing stretched yet."""

    train: float
    validation: float
    test: float


@dataclass(frozen=True)
class Rate:
    """What a fold of a model costs, as measured.

    Attributes
    ----------
    learn_s
        For each sample learnt from, in each epoch.
    evaluate_s
        For each sample that is only named.
    stretch_s
        For each original of stretched copies.
    once_s
        Whatever the number of samples.
    whole
        Whether `learn_s` is of all epochs: of networks trained in stages, and of what has none.
    n_copies
        Stretched copies of a sample.
    """

    learn_s: float
    evaluate_s: float = 0.0
    stretch_s: float = 0.0
    once_s: float = 0.0
    whole: bool = False
    n_copies: int = 0

    def fold_s(
        self, amounts: Amounts, protocol: Protocol, config: TrainingConfig, epochs: float
    ) -> float:
        """Return how long a fold of so many epochs takes, s."""
        n, validation = self.learnt(amounts, protocol, config)
        learning = n * self.learn_s + validation * self.evaluate_s
        stretching = self.originals(amounts, protocol, config) * self.stretch_s
        passes = 1.0 if self.whole else epochs
        return self.once_s + passes * learning + stretching + amounts.test * self.evaluate_s

    def learnt(
        self, amounts: Amounts, protocol: Protocol, config: TrainingConfig
    ) -> tuple[float, float]:
        """Return how many samples are learnt from and validated on in an epoch."""
        times = self.n_copies + protocol.keep_originals if self.n_copies else 1
        train = self.originals(amounts, protocol, config) * times
        return train, min(amounts.validation, config.validation_samples or np.inf)

    def originals(self, amounts: Amounts, protocol: Protocol, config: TrainingConfig) -> float:
        """Return how many samples are learnt from, copies apart."""
        kept = originals(self.n_copies, protocol, config.training_samples)
        return min(amounts.train, kept or np.inf)


def measure_rate(
    model: Model,
    samples: Samples,
    encoding: object,
    protocol: Protocol,
    config: TrainingConfig,
) -> Rate:
    """Measure a model's rates on some samples, in one thread as each training has it.

    Processor time, so that what else runs here does not count; on a GPU time by the clock.

    Parameters
    ----------
    samples
        Of any recording; what they say is of no account.
    """
    with _one_thread():
        if learns_in_a_loop(model):
            return _of_network(model, samples, encoding, protocol, config)
        return _of_solved(model, samples, encoding, protocol, config)


def _of_network(
    model: Model,
    samples: Samples,
    encoding: object,
    protocol: Protocol,
    config: TrainingConfig,
) -> Rate:
    brief = config.model_copy(
        update={"training_samples": None, "validation_samples": None, "patience": None}
    )
    some = _labelled(samples, 64)
    rng = np.random.default_rng(0)
    index = np.arange(len(some))
    fold = Fold(1.0, 1.0, index, index[:2], index)
    measured = _clock(config)
    stretch_s, learnt = measured(
        lambda: learning_set(some, encoding, model.stretched, protocol, fold, brief, rng)
    )
    n_copies = getattr(encoding, "n_copies", 0) if model.stretched else 0
    shape = tuple(learnt.values.shape[1:])
    network = new_classifier(model, some, encoding, shape, 0)
    staged = bool(config.image_epochs) and isinstance(network, CnnLstm)
    brief = brief if staged else brief.model_copy(update={"max_epochs": 1})

    def learn(n: int) -> float:
        again = learnt.train[np.arange(n) % len(learnt.train)]
        few = type(learnt)(learnt.values, learnt.labels, again, learnt.validation, learnt.scale)
        return measured(lambda: fit_network(network, few, brief, 0))[0]

    least = _BATCHES * config.batch_size
    learn(least)  # the first steps choose and allocate
    learn_s = learn(least) / least
    if (n := int(MEASURED_S / learn_s)) > 2 * least:
        learn_s = learn(n) / n
    named = np.arange(4 * least) % len(learnt.values)
    predict(network, learnt.values, named, learnt.scale, config)
    evaluate_s = measured(lambda: predict(network, learnt.values, named, learnt.scale, config))[0]
    return Rate(
        learn_s,
        evaluate_s / len(named),
        stretch_s / len(some) if n_copies else 0.0,
        whole=staged,
        n_copies=n_copies,
    )


def _of_solved(
    model: Model, samples: Samples, encoding: object, protocol: Protocol, config: TrainingConfig
) -> Rate:
    """Fit folds of two sizes: what grows with the samples, and what does not."""
    measured, seconds, n = _clock(config), [], []
    for each in (_FEW, _MORE):
        some = _labelled(samples, each * _TEXTURES * _SPEEDS)
        speed = some[dims.SPEED].values
        test = np.flatnonzero(speed == 1.0)
        fold = Fold(1.0, 1.0, np.flatnonzero(speed != 1.0), test[:2], test)
        part = Part(some, fold, encoding)

        def once(part: Part = part) -> object:
            return fit(Fitting(model, [part], protocol, [config], 0, 0, lambda *_: None))

        once()
        seconds.append(measured(once)[0])
        n.append(len(fold.train))
    slope = max(0.0, (seconds[1] - seconds[0]) / (n[1] - n[0]))
    return Rate(slope, once_s=max(0.0, seconds[0] - slope * n[0]), whole=True)


def _labelled(samples: Samples, n: int) -> Samples:
    """Return `n` samples, of these again and again, as if of all textures and speeds."""
    some = samples.isel({dims.SAMPLE: np.arange(n) % len(samples)})
    number = np.arange(n) // max(1, n // (_TEXTURES * _SPEEDS)) % (_TEXTURES * _SPEEDS)
    texture, speed = number % _TEXTURES, 1.0 + number // _TEXTURES
    labels: dict[str, NDArray[np.generic]] = {
        dims.TEXTURE: texture.astype(np.str_),
        dims.SPEED: speed,
        dims.RECORDING: number.astype(np.str_),
    }
    return some.assign_coords({name: (dims.SAMPLE, values) for name, values in labels.items()})


def _clock(config: TrainingConfig) -> Callable[[Callable[[], Out]], tuple[float, Out]]:
    """Return what measures how long a function takes, s, and returns what it returns."""
    now = time.perf_counter if choose_device(config).type == "cuda" else time.process_time

    def measured(function: Callable[[], Out]) -> tuple[float, Out]:
        start = now()
        found = function()
        return now() - start, found

    return measured


@contextmanager
def _one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
