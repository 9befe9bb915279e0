"""The card of a trained model: all that must be known to run it, and how far to trust it.

It lies beside the weights as `model.json`, and in the metadata of an exported ONNX file.
"""

import json
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from afferents import dims
from afferents.choices import Statistics
from afferents.documents import as_form, parse_json, read_json
from afferents.encodings.wavenumbers import unseen_waves
from afferents.errors import InputError
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import (
    SPEED,
    Count,
    Group,
    GroupName,
    Share,
    Shares,
    Speed,
    Split,
    SplitName,
    Steady,
    split_named,
)
from afferents.models.model import MODELS

SCHEMA = 3
CARD, WEIGHTS, ESTIMATOR = "model.json", "weights.safetensors", "estimator.skops"
METADATA = "afferents"
"""Key of the card in an ONNX file's metadata."""
LARGEST = 1_000_000
"""Values of one sample: a card asks for memory before the weights that belong to it are seen."""

_WHAT = "the card of a model as 'afferents train' writes it"
_AGAIN = "train or export it again with this version"

_NOT_FELT = (
    "A scikit-learn estimator: it can be explained, and asked from Python, with the version of "
    "scikit-learn that it was trained with; it can't be exported or felt live."
)

Size = Annotated[int, Field(ge=1, le=10_000)]
"""Of a side of a sample, or frames."""


def _unsaid(usual: Any) -> Any:
    """Return a field that a card says nothing of where it is as usual."""
    return Field(default=usual, exclude_if=lambda value: value == usual)


def set_otherwise(recipe: Mapping[str, Any]) -> str:
    """Return in words, to go on a preset's name, what was set otherwise; nothing for nothing."""
    said = ", ".join(f"{name} = {value}" for name, value in recipe.items())
    return f" but {said}" if said else ""


class Source(BaseModel):
    """Data that were learnt from."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    source: str
    kind: Annotated[str, Field(min_length=1)]
    fingerprint: str
    n_recordings: Count
    simulated: bool


class Score(BaseModel):
    """What an evaluation found of this model: accuracy at speeds, or another split's groups.

    Attributes
    ----------
    mean_accuracy, ci95
        Over what was held out in turn, from 0 to 1, with a 95% interval.
    worst_accuracy, worst_mm_s, worst_group
        At the worst speed, or group of another split.
    split
        What was held out.
    recipe
        Hyperparameters of the network that were set otherwise than the preset has them.
    same_data
        Whether the evaluation learnt from the data that the model learnt from, cut and encoded
        alike, all of their textures, speeds and markers.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    protocol: str
    preset: str
    seeds: tuple[Count, ...]
    mean_accuracy: Share
    ci95: Shares
    worst_accuracy: Share
    worst_mm_s: Speed | None = _unsaid(None)
    worst_group: GroupName | None = _unsaid(None)
    split: SplitName = _unsaid(SPEED.name)
    same_data: bool
    disturb: Corruption = _unsaid(Corruption())
    disturb_training: Corruption = _unsaid(Corruption())
    recipe: dict[str, Any] = _unsaid({})

    @model_validator(mode="after")
    def _says_the_worst(self) -> Self:
        if (self.worst_mm_s if self.split == SPEED.name else self.worst_group) is None:
            raise ValueError("worst_mm_s must be given, or split and worst_group")
        return self

    def describe(self) -> str:
        """Return it in words."""
        low, high = (100 * bound for bound in self.ci95)
        other = "" if self.same_data else ", learnt from other data or parts of them"
        split = split_named(self.split)
        worst = self.worst_mm_s if self.worst_group is None else self.worst_group
        assert worst is not None
        return (
            f"{100 * self.mean_accuracy:.1f}% [{low:.1f}, {high:.1f}] at {split.many} held out "
            f"({self.protocol}, {self.preset}{set_otherwise(self.recipe)}{other}"
            f"{self._corrupted()}), "
            f"{100 * self.worst_accuracy:.1f}% {split.at([worst])}"
        )

    def _corrupted(self) -> str:
        """Return how the recordings were corrupted, in words; nothing if they were not."""
        said = {"tested": self.disturb, "learnt": self.disturb_training}
        return "".join(f", {what} corrupted by {by}" for what, by in said.items() if by)


class Card(BaseModel):
    """What a trained model is.

    Attributes
    ----------
    model
        Such as ``ra-wave-vector``, or ``ra-ste`` of Table 1.
    textures
        Names of the classes, in order.
    named_by_spacing
        Whether these are the spacing of bumps, mm.
    channel
        What it feels with, such as ``ra1``.
    encoding
        How samples are made of that: the encoding's name, and its options by name.
    classifier
        A name in `models.classifiers.CLASSIFIERS`, or ``module:NAME`` of somebody's own.
    estimator
        Of a scikit-learn estimator, which lies in a file of its own beside the weights: the classes
        of somebody's own that may be in it, each ``module:NAME``; None of any other classifier.
    own
        Whether it is a model of somebody's own; else channel, encoding and classifier are those of
        the package's model of that name.
    waves
        None: earlier cards had options of an encoding here, and are refused.
    shape, sample_dims
        Of one sample, and the names of its dims: an image (row, column), a run of them (frame, row,
        column), a spectrum (channel, frequency), or waves (component, row_wavenumber,
        column_wavenumber).
    scale
        Inputs are divided by it (in the network that is exported).
    temperature
        Logits are divided by it: probabilities then are right as often as they say, at a speed
        that the weights have not seen (Guo et al., ICML 2017).
    evidence_per_s
        How many samples' worth of log-probabilities a second of touch is: neighbouring frames
        are nearly the same, and no news.
    most_sure
        No texture is recognised live with a higher probability: the least of the upper end of the
        95% interval of the validation accuracy (over recordings), how often a texture that had 95%
        of the evidence was the true one, and what so many recordings can show if all are right.
        Samples of one touch share its peculiarities, so evidence that adds up may become surer than
        the model ever was right.
    sensor
        The sensor file's content, for images; its rest frame is that of the recordings, where they
        share one.
    unlike_live
        In what its recordings were extracted otherwise than live follows or hears, in words.
    fps_hz, sample_rate_hz
        Of the camera (images) or the microphone (spectra).
    learnt_from_mm_s, validated_on_mm_s, validation_accuracy
        Speeds that the weights learnt from; the whole speed that chose the weights, temperature
        and limit, and the accuracy at it.
    validation_ci95
        Its 95% interval over recordings.
    split, learnt_from, validated_on
        Where not a speed but another split's group chose them: the split, and the same of it.
    steady_s
        Part of the recordings that it learnt from, s, where that was said when it was trained.
    disturb_training
        What corrupted the recordings that it learnt from: `--disturb-training`.
    recipe, statistics
        Of the network: what was set otherwise than the preset has it; `training_config` says what.
    scores
        Of an evaluation at held-out speeds; empty where there was none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["afferents model"] = "afferents model"
    schema_version: int = SCHEMA
    model: str
    title: str
    classifier: str
    estimator: tuple[str, ...] | None = None
    own: bool = False
    textures: tuple[str, ...] = Field(min_length=2)
    named_by_spacing: bool
    channel: str
    encoding: dict[str, Any]
    shape: tuple[Size, ...] = Field(min_length=1, max_length=4)
    sample_dims: tuple[str, ...]
    scale: float = Field(gt=0)
    temperature: float = Field(default=1.0, gt=0)
    evidence_per_s: float = Field(default=1.0, gt=0)
    most_sure: Share
    sensor: dict[str, Any] | None = None
    unlike_live: tuple[str, ...] = _unsaid(())
    fps_hz: float | None = Field(default=None, gt=0)
    sample_rate_hz: float | None = Field(default=None, gt=0)
    waves: None = None
    preset: str | None
    seed: Count
    learnt_from_mm_s: tuple[Speed, ...] = _unsaid(())
    validated_on_mm_s: Speed | None = _unsaid(None)
    split: SplitName = _unsaid(SPEED.name)
    learnt_from: tuple[GroupName, ...] = _unsaid(())
    validated_on: GroupName | None = _unsaid(None)
    steady_s: Steady | None = _unsaid(None)
    disturb_training: Corruption = _unsaid(Corruption())
    recipe: dict[str, Any] = _unsaid({})
    statistics: Statistics = _unsaid("warmed-up")
    validation_accuracy: Share
    validation_ci95: Shares
    data: tuple[Source, ...]
    scores: tuple[Score, ...] = ()
    versions: dict[str, str]

    @model_validator(mode="after")
    def _has_what_its_family_needs(self) -> Self:
        if self.schema_version != SCHEMA:
            raise ValueError(f"schema_version must be {SCHEMA}")
        if prod(self.shape) > LARGEST:
            raise ValueError(f"shape must make at most {LARGEST} values a sample")
        if len(set(self.textures)) < len(self.textures):
            raise ValueError("textures must each have a name of its own")
        if len(self.shape) != len(self.sample_dims):
            raise ValueError("shape must have a size for each of sample_dims")
        if not isinstance(self.encoding.get("name"), str):
            raise ValueError("encoding must have a name")
        self._require_groups()
        self._require_its_parts()
        needed = ["fps_hz", "sensor"] if self.sample_rate_hz is None else []
        for name in needed:
            if getattr(self, name) is None:
                raise ValueError(f"{name} must be given for {self.model}, or sample_rate_hz")
        return self

    def _require_groups(self) -> None:
        names = ("learnt_from", "validated_on")
        if self.split == SPEED.name:
            names = ("learnt_from_mm_s", "validated_on_mm_s")
        for name in names:
            if not getattr(self, name):
                raise ValueError(f"{name} must be given for the split by {self.split}")

    def _require_its_parts(self) -> None:
        if self.own:
            return
        if self.model not in MODELS:
            raise ValueError(f"model must be one of {', '.join(MODELS)}")
        row = MODELS[self.model]
        parts = (self.channel, self.encoding["name"], self.classifier)
        if parts != (row.channel, row.encoding, row.classifier):
            raise ValueError(f"channel, encoding and classifier must be those of {self.model}")

    def to_json(self, indent: int | None = None) -> str:
        """Return it as text, in ASCII: a source's path need not be text."""
        separators = (",", ": ") if indent else (",", ":")
        content = self.model_dump(mode="json")
        return json.dumps(content, indent=indent, separators=separators, allow_nan=False)

    @property
    def simulated(self) -> bool:
        """Whether it learnt from simulated recordings."""
        return any(data.simulated for data in self.data)

    @property
    def held_out(self) -> Split:
        """What is held out: groups of it were learnt from, all but one."""
        return split_named(self.split)

    @property
    def groups(self) -> tuple[Group, ...]:
        """The groups, by default speeds, that the weights learnt from."""
        return self.learnt_from_mm_s or self.learnt_from

    def describe(self) -> list[str]:
        """Return in sentences what it is and how far it has been tested."""
        split = self.held_out
        validated = split.at([self.validated_on_mm_s or self.validated_on or ""])
        kind = "simulated recordings" if self.simulated else "recordings"
        own = set_otherwise(self.recipe)
        recipe = f" (preset {self.preset}{own})" if self.preset else ""
        calibrated = "calibrated its probabilities"
        chose = f"chose its weights and {calibrated}" if self.preset else calibrated
        return [
            f"{self.title}: {len(self.textures)} textures. Of "
            f"{sum(data.n_recordings for data in self.data)} {kind} it learnt from those "
            f"{split.at(self.groups)}{recipe}.",
            f"{validated[0].upper()}{validated[1:]}, which {chose} and nothing "
            f"was learnt from, {100 * self.validation_accuracy:.1f}% are recognised.",
            *self._at_chance(),
            *self._speeds(),
            *self._limits(),
            *self._unlike_live(),
            *([] if self.steady_s is None else [_steady_sentence(self.steady_s)]),
            *self._corrupted(),
            *(f"Evaluated: {score.describe()}." for score in self.scores),
            *([] if self.scores else [f"Not evaluated at {split.many} held out."]),
            *([] if self.estimator is None else [_NOT_FELT]),
        ]

    def _at_chance(self) -> list[str]:
        """Return that nothing was learnt, where guessing may be as good: an interval holds chance.

        Evaluations say it, where there were any, else the speed that nothing was learnt from.
        """
        chance = 1 / len(self.textures)
        intervals = [one.ci95 for one in self.scores] or [self.validation_ci95]
        held = [ends for ends in intervals if ends[0] <= chance]
        if not held:
            return []
        low, high = (100 * end for end in held[0])
        return [
            f"Nothing was learnt that can be told from guessing ({100 * chance:.1f}%): the 95% "
            f"interval is [{low:.1f}, {high:.1f}]."
        ]

    def _speeds(self) -> list[str]:
        """Return between which speeds it can tell what is unknown, where it learnt from several."""
        slowest, fastest = min(self.groups), max(self.groups)
        if self.held_out != SPEED or slowest == fastest:
            return []
        return [
            f"Slower than {slowest:g} or faster than {fastest:g} mm/s the speed lies outside what "
            "was learnt: known textures, too, may be called unknown there."
        ]

    def _corrupted(self) -> list[str]:
        """Return by what the recordings were corrupted, if they were."""
        by = self.disturb_training
        return [f"The recordings that it learnt from were corrupted by {by}."] if by else []

    def _limits(self) -> list[str]:
        """Return what its fingertip keeps from it, where it relies on waves."""
        if dims.ROW_WAVENUMBER not in self.sample_dims or self.sensor is None:
            return []
        bumps = self.textures if self.named_by_spacing else ()
        return [unseen_waves(self.sensor.get("pitch_mm"), bumps)]

    def _unlike_live(self) -> list[str]:
        """Return that live gives it other images than it learnt from, where that is so."""
        how = " and ".join(self.unlike_live)
        what = "live does otherwise, and what was evaluated does not hold there"
        return [f"Its recordings were extracted with {how}: {what}."] if how else []


def require_unit(card: Card, of_cells: bool, where: str) -> None:
    """Refuse to ask a model that learnt from markers, in px, about cells, in grey levels; or back.

    Raises
    ------
    InputError
        Naming both units.
    """
    units = (dims.PIXELS, dims.GREY_LEVELS)
    learnt = card.sensor is not None and card.sensor.get("layout") == dims.CELLS
    if card.sensor is not None and learnt != of_cells:
        raise InputError(
            f"{where}: expected SA-I and RA-I in {units[learnt]}, as {card.model} learnt from, "
            f"found {units[of_cells]}; train a model on such data"
        )


def _steady_sentence(steady_s: Steady) -> str:
    start, stop = steady_s
    return f"Of each recording {start:g} to {stop:g} s were taken, as --steady says."


def names_of(stepping: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the names of an exported model's inputs and outputs, in their order.

    Parameters
    ----------
    stepping
        Whether it takes the images of a run one by one, and what it made of those before.
    """
    outputs = ("probabilities", "novelty")
    if stepping:
        return ("image", "past"), (*outputs, "next_past")
    return ("sample",), outputs


def read_card(path: Path) -> Card:
    """Read the card of a model's folder.

    Raises
    ------
    InputError
        If it is none, or of another version of the package that changed its form.
    """
    return as_form(read_json(path, _WHAT, _AGAIN), Card, path, _WHAT, _AGAIN)


def parse_card(text: str, where: object) -> Card:
    """Read the card of an exported model from its text; see `read_card`."""
    return as_form(parse_json(text, where, _WHAT, _AGAIN), Card, where, _WHAT, _AGAIN)
