"""What the trainings of an evaluation take: each kind of model is measured once."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from afferents.core.model import MODELS, Model
from afferents.core.protocol import Protocol
from afferents.core.samples import Samples
from afferents.pipeline.encode import Source, sources_of
from afferents.pipeline.estimate.amount import Amount
from afferents.pipeline.estimate.estimate import Work
from afferents.pipeline.estimate.measure import Measured, measure_encoding
from afferents.pipeline.recipe import Recipe
from afferents.reporting.published import published_costs
from afferents.training import TrainingConfig, learns_in_a_loop, recipe_of
from afferents.training.rate import Amounts, Rate, measure_rate

Left = Callable[[Model, Protocol], int]
"""How many trainings of a model under a protocol are not finished yet."""


@dataclass
class Trainings:
    """Measures trainings on the responses of one recording.

    Attributes
    ----------
    recipe
        What they go by.
    measured
        The recording.
    amount
        How much there is of such recordings.
    """

    recipe: Recipe
    measured: Measured
    amount: Amount
    _samples: dict[Source, tuple[Samples, float]] = field(default_factory=dict)
    _rates: dict[object, Rate] = field(default_factory=dict)

    def works(
        self, models: Sequence[Model], protocols: Sequence[Protocol], left: Left
    ) -> tuple[Work, ...]:
        """Return the work of all models of which something is left to be trained."""
        found: list[Work] = []
        group, before = 0, None
        for model in models:
            sources = sources_of(model, self.recipe.encodings)
            group += sources != before
            before = sources
            for protocol in protocols:
                if n_folds := left(model, protocol):
                    work = self._work(model, protocol)
                    found.append(replace(work, group=group, n_folds=n_folds))
        return tuple(found)

    def _work(self, model: Model, protocol: Protocol) -> Work:
        """Return the work of one fold."""
        if model.parts:  # a fusion learns each of its parts
            parts = [self._work(MODELS[name], protocol) for name in model.parts]
            fold_s, encode_s = (
                sum(getattr(part, name) for part in parts) for name in ("fold_s", "encode_s")
            )
            return replace(parts[0], model=model, fold_s=fold_s, encode_s=encode_s)
        (source,) = sources_of(model, self.recipe.encodings)
        if source not in self._samples:
            self._samples[source] = measure_encoding(self.measured, source, self.recipe.cut)
        samples, encode_s = self._samples[source]
        config = self.recipe.training(recipe_of(model, source.encoding))
        rate = self._rate(model, source, samples, protocol, config)
        n = len(samples) * self.amount.used
        amounts = amounts_of(n, self.amount.n_groups, protocol)
        if protocol.name == "nested" and not learns_in_a_loop(model):  # it needs no validation
            amounts = amounts._replace(train=amounts.train + amounts.validation)
        epochs = expected_epochs(model, config)
        return Work(
            model,
            protocol.name,
            0,
            rate.fold_s(amounts, protocol, config, epochs),
            1,
            None if rate.whole else epochs,
            rate.learnt(amounts, protocol, config)[0],
            1 / rate.learn_s if rate.learn_s else math.inf,
            encode_s * self.amount.used,
        )

    def _rate(
        self,
        model: Model,
        source: Source,
        samples: Samples,
        protocol: Protocol,
        config: TrainingConfig,
    ) -> Rate:
        """Return the rate of any model that learns such samples in such a way."""
        stretch = protocol.stretch if model.stretched else None
        kind = (id(model.classifier), source.encoding, stretch)
        if kind not in self._rates:
            self._rates[kind] = measure_rate(model, samples, source.encoding, protocol, config)
        return self._rates[kind]


def expected_epochs(model: Model, config: TrainingConfig) -> float:
    """Return how many epochs a fold is taken to need.

    Where training stops early nobody knows: as many as the authors' logs have in the mean, or for
    other models all.
    """
    logged = published_costs().get(model.name)
    if config.patience is None or logged is None:
        return float(config.max_epochs)
    return min(config.max_epochs, max(config.patience + 1, logged.epochs))


def amounts_of(n: float, n_groups: int, protocol: Protocol) -> Amounts:
    """Return how many of `n` samples train, validate and test a fold, if groups are alike."""
    of_group = n / n_groups
    if protocol.validation == "held-out-speed":
        return Amounts(n - of_group, of_group / 2, of_group / 2)
    return Amounts(n - 2 * of_group, of_group, of_group)
