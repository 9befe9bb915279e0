"""Hyperparameters of the networks that a user sets, over those of a preset: ``--recipe mine.toml``.

A table for each network; what stands outside of tables holds for all three::

    max_epochs = 40

    [spatial-net]
    learning_rate = 5e-4
    dropout = [0.5, 0.5, 0.2]
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torch import nn

from afferents.core.choices import Preset, Statistics
from afferents.core.documents import as_form, read_toml
from afferents.core.errors import InputError
from afferents.training.config import RECIPES, Compute, TrainingConfig, training_config

DROPOUT_LAYERS = {"spatial-net": 3, "cnn-lstm": 3, "vibration-net": 1}
"""How many there are in each network, from the input to the output."""
_OPTIONS = {"device", "precision"}
"""What is computed on is no hyperparameter, and has options of its own."""
_WHAT = "hyperparameters of networks as TOML"


@dataclass(frozen=True)
class Hyperparameters:
    """What is set otherwise than a preset has it.

    Attributes
    ----------
    changed
        By network (see `RECIPES`), then by name of a field of `TrainingConfig`.
    source
        The file that says so; empty for none.
    """

    changed: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
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
            return cls(_changed(given, "recipe", preset))
        content = read_toml(Path(given), _WHAT)
        return cls(_changed(content, given, preset), str(given))

    def of_network(self, network: str) -> Mapping[str, Any]:
        """Return what is set of a network's training, by name of the field."""
        return self.changed.get(network, {})

    def training(
        self,
        preset: Preset,
        network: str,
        compute: Compute | None = None,
        statistics: Statistics = "warmed-up",
    ) -> TrainingConfig:
        """Return how a network is trained, to be computed so."""
        return training_config(preset, network, compute, self.of_network(network), statistics)

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return it ready for JSON."""
        return {network: dict(fields) for network, fields in self.changed.items()}

    def words(self) -> list[str]:
        """Return the words of a command line that say the same, where they are in a file."""
        return ["--recipe", self.source] if self.source else []


def _changed(
    content: Mapping[str, Any], where: object, preset: Preset
) -> dict[str, dict[str, Any]]:
    """Return what is changed of each network, after checking that its training is then whole."""
    tables = {name: value for name, value in content.items() if isinstance(value, Mapping)}
    if unknown := [name for name in tables if name not in RECIPES]:
        raise InputError(where, f"tables named {', '.join(RECIPES)}", f"[{unknown[0]}]")
    for_all = {name: value for name, value in content.items() if name not in tables}
    changed = {}
    for network in RECIPES:
        fields = {**for_all, **tables.get(network, {})}
        if fields:
            _require_known(fields, where)
            changed[network] = _checked(network, fields, where, preset)
    if not changed:
        raise InputError(where, _WHAT, "nothing")
    return changed


def _require_known(fields: Mapping[str, Any], where: object) -> None:
    names = [name for name in TrainingConfig.model_fields if name not in _OPTIONS]
    for name in fields:
        if name in _OPTIONS:
            raise InputError(where, "hyperparameters", f"'{name}'", f"give it as --{name}")
        if name not in names:
            raise InputError(where, f"some of {', '.join(names)}", f"'{name}'")


def _checked(
    network: str, fields: Mapping[str, Any], where: object, preset: Preset
) -> dict[str, Any]:
    """Return the fields as their forms have them, such as lists as tuples."""
    whole = {**training_config(preset, network).model_dump(), **fields}
    config = as_form(whole, TrainingConfig, where, f"hyperparameters of {network} over '{preset}'")
    n, dropout = DROPOUT_LAYERS[network], config.dropout
    if isinstance(dropout, tuple) and len(dropout) != n:
        expected = f"one share, or {n}, of the dropout layers of {network}"
        raise InputError(where, expected, f"{len(dropout)}")
    return {name: config.model_dump(mode="json")[name] for name in fields}


def set_dropout(network: nn.Module, dropout: float | tuple[float, ...] | None) -> None:
    """Set the shares that a network's dropout layers drop; None to leave them.

    Raises
    ------
    InputError
        If there is another number of layers.
    """
    layers = [module for module in network.modules() if isinstance(module, nn.Dropout)]
    if dropout is None:
        return
    shares = dropout if isinstance(dropout, tuple) else (dropout,) * len(layers)
    if len(shares) != len(layers):
        found = f"{len(shares)} shares"
        raise InputError("dropout", f"one for each of {len(layers)} dropout layers", found)
    for layer, share in zip(layers, shares, strict=True):
        layer.p = share
