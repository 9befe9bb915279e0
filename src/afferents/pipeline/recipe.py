"""What an evaluation consists of: data, models, and how they are trained and tested."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from afferents.core.choices import Penalty, Statistics
from afferents.core.cut import Cut
from afferents.core.extras import import_extra
from afferents.core.model import Model
from afferents.core.responses import Responses
from afferents.core.results import SCHEMA
from afferents.core.split import SPEED, Split
from afferents.core.steady import Steady, with_steady
from afferents.encodings import Encodings
from afferents.evaluation.ablation import Ablation
from afferents.evaluation.disturbance import Disturbances
from afferents.pipeline.data import OpenedData, Origin, recordings_in
from afferents.training import (
    RECIPES,
    Compute,
    Hyperparameters,
    Preset,
    TrainingConfig,
)


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
    without
        Conditions of recordings that are left out.
    ablation
        What of the data is used.
    disturbances
        What spoils the recordings that are tested, and those that are learnt from.
    split
        What is held out.
    steady_s
        Start and end of constant speed, s, of all recordings; None for what each says of its own.
    penalty
        Whether that of every ridge is chosen inside each fold, or of those alone that have none.
    statistics
        Running statistics of the networks' batch normalisation: see `WarmUp`.
    compute
        What the networks run on, and in which precision.
    hyperparameters
        Of the networks' training, where not the preset's.
    skipped
        Recordings that no model uses, and why; found out when the evaluation begins.
    tested
        Recordings that alone are tested, and never learnt from; none for all alike. As `skipped`.
    """

    out: Path
    data: tuple[Origin, ...]
    models: Sequence[Model]
    preset: Preset
    cut: Cut
    encodings: Encodings
    without: Mapping[str, str] = field(default_factory=dict)
    ablation: Ablation = field(default_factory=Ablation)
    disturbances: Disturbances = field(default_factory=Disturbances)
    split: Split = SPEED
    steady_s: Steady | None = None
    penalty: Penalty = "fixed"
    statistics: Statistics = "warmed-up"
    compute: Compute = field(default_factory=Compute)
    hyperparameters: Hyperparameters = field(default_factory=Hyperparameters)
    skipped: Mapping[str, str] = field(default_factory=dict)
    tested: frozenset[str] = frozenset()

    @property
    def config(self) -> dict[str, Any]:
        """Return what must agree for folds to stand in one results folder: its `config.json`."""
        training = {name: self.training(name).model_dump(mode="json") for name in RECIPES}
        return {
            "schema": SCHEMA,
            "data": [origin.describe() for origin in self.data],
            "without": dict(self.without),
            "skipped": sorted(self.skipped),
            "cut": self.cut,
            "preset": self.preset,
            **self.encodings.describe(),
            "training": training,
            **({"ablation": ablation} if (ablation := self.ablation.describe()) else {}),
            **self.choices,
        }

    @property
    def choices(self) -> dict[str, Any]:
        """Return what is held out and whatever else was chosen, ready for JSON."""
        split = {} if self.split == SPEED else {"split": self.split.name}
        steady = {} if self.steady_s is None else {"steady_s": list(self.steady_s)}
        penalty = {} if self.penalty == "fixed" else {"penalty": self.penalty}
        kept = {} if self.statistics == "warmed-up" else {"statistics": self.statistics}
        recipe = {"recipe": own} if (own := self.hyperparameters.describe()) else {}
        return split | steady | penalty | kept | recipe | self.disturbances.describe()

    def recordings(self, data: Sequence[OpenedData]) -> list[Responses]:
        """Return the recordings that are used, with the part of them that is."""
        return with_steady(self.ablation.recordings(recordings_in(data)), self.steady_s)

    def located(self) -> "Recipe":
        """Return it with a results folder that any process finds, wherever it was started."""
        return replace(self, out=self.out.resolve())

    def packed(self) -> bytes:
        """Return it for a worker, with the code of what only this process knows.

        Dask's own pickler names classes and functions, and a worker that can't import one is lost.
        """
        cloudpickle = import_extra("cluster", "--cluster", "cloudpickle")
        return bytes(cloudpickle.dumps(self))

    def model(self, name: str) -> Model:
        """Return the model of that name."""
        return next(model for model in self.models if model.name == name)

    def training(self, network: str) -> TrainingConfig:
        """Return how a network is trained; by name, see `RECIPES`."""
        return self.hyperparameters.training(self.preset, network, self.compute, self.statistics)
