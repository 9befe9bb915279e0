"""How a network is trained: the presets by name, and what a user sets otherwise in a recipe."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from afferents.choices import Device, Precision, Preset, Statistics
from afferents.documents import as_form, read_toml
from afferents.errors import InputError

L2 = 0.005
"""Factor of the sum of squared kernels in the loss (train_static.ipynb, cell 4)."""

Dropped = Annotated[float, Field(ge=0, lt=1)]
"""Share of the values that a dropout layer sets to 0."""


class TrainingConfig(BaseModel):
    """What one training needs to know besides the data.

    Attributes
    ----------
    learning_rate
        Of Adam; with `one_cycle` the highest.
    one_cycle
        Whether the rate rises and falls once over `max_epochs` instead of staying (Smith & Topin,
        "Super-Convergence", 2019): as good in fewer passes, but only at the end of the cycle.
    batch_size
        Samples a step.
    patience
        Epochs without a better validation accuracy before training stops; None to train to the last
        epoch, as a cycle must.
    max_epochs
        Epochs at most.
    passes
        About how many samples go through, if `max_epochs` allow: few samples are gone through more
        often than many. None for `max_epochs`.
    training_samples
        How many samples to train on at most, stretched copies included; None for all. The
        caller thins; the test always uses all.
    validation_samples
        How many samples to validate on at most; None for all.
    image_epochs, image_passes, image_rate, frames_a_run
        Whether the CNN-LSTM is trained in stages (`train_in_stages`): epochs (at most), passes and
        learning rate of its image stack, and frames that it takes of each training run. 0 epochs
        for none: the published way.
    warm_up_statistics
        Whether batch normalisation's running statistics start as plain averages (`WarmUp`).
    precision
        `bfloat16` multiplies in bfloat16 and keeps weights, loss and statistics in float32, and
        LSTMs too on a CPU that has none in bfloat16; `auto` takes it where the processor has it.
    device
        `auto` takes a CUDA GPU where there is one.
    dropout
        Share that each dropout layer drops, or one for all; None for the network's own. ``light``
        for the network's `light_dropout`, for few passes; of one that has none, its own.
    l2
        Factor of the sum of squared kernels in the loss, of the layers that have the term.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    learning_rate: float = Field(gt=0)
    one_cycle: bool = False
    batch_size: int = Field(default=64, ge=2)
    patience: int | None = Field(default=None, ge=1)
    max_epochs: int = Field(default=150, ge=1)
    passes: int | None = Field(default=None, ge=1)
    training_samples: int | None = Field(default=None, ge=1)
    validation_samples: int | None = Field(default=None, ge=1)
    image_epochs: int = Field(default=0, ge=0)
    image_passes: int | None = Field(default=None, ge=1)
    image_rate: float = Field(default=1e-3, gt=0)
    frames_a_run: int = Field(default=1, ge=1)
    warm_up_statistics: bool = True
    precision: Precision = "auto"
    device: Device = "auto"
    dropout: Dropped | tuple[Dropped, ...] | Literal["light"] | None = Field(
        default=None, exclude_if=lambda dropout: dropout is None
    )
    l2: float = Field(default=L2, ge=0, exclude_if=lambda l2: l2 == L2)

    @model_validator(mode="after")
    def _ends_its_cycle(self) -> "TrainingConfig":
        if self.one_cycle and self.patience is not None:
            raise ValueError("a cycle must not be stopped: no patience with one_cycle")
        return self

    def epochs(self, n: int) -> int:
        """Return how many times, at most, it goes through n training samples."""
        if self.passes is None:
            return self.max_epochs
        return max(1, min(self.max_epochs, round(self.passes / n)))

    def of_images(self) -> "TrainingConfig":
        """Return how an image stack learns from single frames."""
        stage = {"passes": self.image_passes, "learning_rate": self.image_rate}
        return self.model_copy(update={"max_epochs": self.image_epochs, **stage})


_PAPER: dict[str, TrainingConfig] = {
    "spatial-net": TrainingConfig(learning_rate=1e-3, patience=20),
    "cnn-lstm": TrainingConfig(learning_rate=1e-4, patience=20),
    "vibration-net": TrainingConfig(learning_rate=1e-4, patience=10),
}

_QUICK: dict[str, TrainingConfig] = {
    "spatial-net": TrainingConfig(
        learning_rate=2e-3,
        batch_size=32,
        patience=3,
        max_epochs=4,
        training_samples=1300,
        validation_samples=520,
    ),
    "cnn-lstm": TrainingConfig(
        learning_rate=5e-3,
        batch_size=32,
        patience=6,
        max_epochs=25,
        training_samples=520,
        validation_samples=260,
        image_epochs=3,
        image_rate=2e-3,
        frames_a_run=2,
    ),
    "vibration-net": TrainingConfig(
        learning_rate=1e-3,
        batch_size=32,
        patience=4,
        max_epochs=8,
        training_samples=1400,
        validation_samples=520,
    ),
}

_FAST: dict[str, TrainingConfig] = {
    "spatial-net": TrainingConfig(
        learning_rate=8e-3,
        one_cycle=True,
        max_epochs=12,
        passes=48_000,
        training_samples=48_000,
        validation_samples=1000,
        dropout="light",
    ),
    "cnn-lstm": TrainingConfig(
        learning_rate=5e-3,
        one_cycle=True,
        batch_size=32,
        max_epochs=15,
        passes=30_000,
        training_samples=3000,
        validation_samples=500,
        image_epochs=12,
        image_passes=15_000,
        image_rate=4e-3,
        frames_a_run=5,
        dropout="light",
    ),
    "vibration-net": TrainingConfig(
        learning_rate=2e-3,
        one_cycle=True,
        batch_size=32,
        max_epochs=15,
        passes=35_000,
        training_samples=28_000,
        validation_samples=2000,
        dropout="light",
    ),
}

RECIPES = tuple(_PAPER)
"""Names of the recipes, after the networks that they are for."""

_PRESETS: dict[str, dict[str, TrainingConfig]] = {
    "quick": _QUICK,
    "fast": _FAST,
    "paper": _PAPER,
}


def training_config(
    preset: Preset,
    recipe: str,
    changed: Mapping[str, Any] | None = None,
    statistics: Statistics = "warmed-up",
    device: Device = "auto",
    precision: Precision = "auto",
) -> TrainingConfig:
    """Return a recipe (see `RECIPES`) as a preset has it.

    `changed` sets fields of the `TrainingConfig` otherwise; a preset's passes give way to epochs.

    `paper` is what the authors' code does (Adam 1e-3 for single images, 1e-4 for the others,
    batches of 64, patience 20, 20 and 10, at most 150 epochs; train_*.ipynb, cells 4 to 9). The
    paper's text has another patience, and another dropout for single images.

    One thing differs from it, unless `statistics` is ``keras``: see `WarmUp`.

    `fast` is a shorter road, meant for about the same accuracy: frames are nearly equal, so it
    takes some of them, few passes with a rate that rises and falls once, light dropout, and trains
    the CNN-LSTM in stages. Found on simulated recordings of a seed that no number in the docs is
    of.

    `quick` is **not** their recipe: it thins the samples, has smaller batches and
    higher learning rates, stops sooner, and trains the CNN-LSTM in stages. A training takes
    seconds instead of an hour. Its accuracies show that the way of the data works, not how good
    the method is.

    Raises
    ------
    InputError
        If the recipe is unknown.
    """
    if recipe not in RECIPES:
        raise InputError(f"recipe: expected one of {', '.join(RECIPES)}, found '{recipe}'")
    others = {"warm_up_statistics": statistics == "warmed-up", **_without_passes(changed or {})}
    others |= {"device": device, "precision": precision}
    return TrainingConfig(**{**dict(_PRESETS[preset][recipe]), **others})


def _without_passes(changed: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is changed, and a preset's passes unset where their epochs are changed."""
    passes = {"max_epochs": "passes", "image_epochs": "image_passes"}
    return {**{passes[name]: None for name in changed if name in passes}, **changed}


DROPOUT_LAYERS = {"spatial-net": 3, "cnn-lstm": 3, "vibration-net": 1}
"""How many there are in each network, from the input to the output."""
_WHAT = "hyperparameters of networks as TOML"


@dataclass(frozen=True)
class Hyperparameters:
    """What a user sets otherwise than a preset has it: ``--recipe mine.toml``.

    A table for each network; what stands outside of tables holds for all three::

        max_epochs = 40

        [spatial-net]
        learning_rate = 5e-4
        dropout = [0.5, 0.5, 0.2]

    Attributes
    ----------
    changed
        By network (see `RECIPES`), then by name of a field of `TrainingConfig`; ready for JSON.
    source
        The file that it was read from; empty for none.
    """

    changed: dict[str, dict[str, Any]] = field(default_factory=dict)
    source: str = ""

    @classmethod
    def of(cls, given: str | Path | Mapping[str, Any] | None, preset: Preset) -> "Hyperparameters":
        """Read what a user gives: a TOML file, or the same as a mapping; None for nothing.

        Raises
        ------
        InputError
            If the file can't be read, or a network, a name, or a value is wrong.
        """
        if given is None:
            return cls()
        if isinstance(given, Mapping):
            return cls(_read_changes(given, "recipe", preset))
        return cls(_read_changes(read_toml(Path(str(given)), _WHAT), given, preset), str(given))


def _read_changes(
    content: Mapping[str, Any], where: object, preset: Preset
) -> dict[str, dict[str, Any]]:
    """Return what is changed of each network, after checking that its training is then whole."""
    tables = {name: value for name, value in content.items() if isinstance(value, Mapping)}
    if unknown := [name for name in tables if name not in RECIPES]:
        raise InputError(
            f"{where}: expected tables named {', '.join(RECIPES)}, found [{unknown[0]}]"
        )
    for_all = {name: value for name, value in content.items() if name not in tables}
    changed = {}
    for network in RECIPES:
        if fields := {**for_all, **tables.get(network, {})}:
            changed[network] = _check_fields(fields, network, where, preset)
    if not changed:
        raise InputError(f"{where}: expected {_WHAT}, found nothing")
    return changed


def _check_fields(
    fields: Mapping[str, Any], network: str, where: object, preset: Preset
) -> dict[str, Any]:
    """Return the fields as their forms have them, such as lists as tuples."""
    options = ("device", "precision")  # no hyperparameters, and options of their own
    names = [name for name in TrainingConfig.model_fields if name not in options]
    for name in fields:
        if name in options:
            raise InputError(
                f"{where}: expected hyperparameters, found '{name}'; give it as --{name}"
            )
        if name not in names:
            raise InputError(f"{where}: expected some of {', '.join(names)}, found '{name}'")
    whole = training_config(preset, network).model_dump() | _without_passes(fields)
    config = as_form(whole, TrainingConfig, where, f"hyperparameters of {network} over '{preset}'")
    n, dropout = DROPOUT_LAYERS[network], config.dropout
    if isinstance(dropout, tuple) and len(dropout) != n:
        expected = f"one share, or {n}, of the dropout layers of {network}"
        raise InputError(f"{where}: expected {expected}, found {len(dropout)}")
    found = config.model_dump(mode="json")  # without what is as usual
    return {name: found.get(name, getattr(config, name)) for name in fields}
