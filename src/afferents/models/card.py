"""The card of a trained model: all that must be known to run it, and how far to trust it.

It lies next to the weights as `model.json`, and in the metadata of an exported ONNX file.
"""

import json
from collections.abc import Mapping
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from afferents import choices, dims
from afferents.documents import as_form, parse_json, read_json
from afferents.encodings.wavenumbers import unseen_waves
from afferents.errors import InputError
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import SPEED, Group, GroupName, Split, SplitName, split_named
from afferents.forms import Count, Share, Shares, Speed, Steady
from afferents.models.model import MODELS

SCHEMA = 3
CARD, WEIGHTS, ESTIMATOR = "model.json", "weights.safetensors", "estimator.skops"
METADATA = "afferents"
"""Key of the card in an ONNX file's metadata."""
LARGEST = 1_000_000
"""Values of one sample: a card asks for memory before the weights that belong to it are seen."""

_WHAT = "the card of a model as 'afferents train' writes it"
_AGAIN = "train or export it again with this version"

Size = Annotated[int, Field(ge=1, le=10_000)]
"""Of a side of a sample, or frames."""


def _omitted_if(usual: Any) -> Any:
    """Return a field that a card leaves out where it is as usual."""
    return Field(default=usual, exclude_if=lambda value: value == usual)


def _describe_changes(recipe: Mapping[str, Any]) -> str:
    """Return in words, to go on a preset's name, what was set otherwise; nothing for nothing."""
    return " but " * bool(recipe) + ", ".join(f"{name} = {value}" for name, value in recipe.items())


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
    worst_mm_s: Speed | None = _omitted_if(None)
    worst_group: GroupName | None = _omitted_if(None)
    split: SplitName = _omitted_if(SPEED.name)
    same_data: bool
    disturb: Corruption = _omitted_if(Corruption())
    disturb_training: Corruption = _omitted_if(Corruption())
    recipe: dict[str, Any] = _omitted_if({})

    @model_validator(mode="after")
    def _says_the_worst(self) -> Self:
        if (self.worst_mm_s if self.split == SPEED.name else self.worst_group) is None:
            raise ValueError("worst_mm_s must be given, or split and worst_group")
        return self

    def describe(self) -> str:
        """Return it in words."""
        low, high = (100 * bound for bound in self.ci95)
        split = split_named(self.split)
        worst = self.worst_mm_s if self.worst_group is None else self.worst_group
        assert worst is not None
        other = "" if self.same_data else ", learnt from other data or parts of them"
        if self.disturb:
            other += f", tested corrupted by {self.disturb}"
        if self.disturb_training:
            other += f", learnt corrupted by {self.disturb_training}"
        return (
            f"{100 * self.mean_accuracy:.1f}% [{low:.1f}, {high:.1f}] at {split.many} held out "
            f"({self.protocol}, {self.preset}{_describe_changes(self.recipe)}{other}), "
            f"{100 * self.worst_accuracy:.1f}% {split.at([worst])}"
        )


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
        That it takes, such as ``ra1``.
    encoding
        How samples are made of that: the encoding's name, and its options by name.
    classifier
        A name in `models.classifiers.CLASSIFIERS`, or ``module:NAME`` of a user's own.
    estimator
        Of a scikit-learn estimator, which lies in a file of its own next to the weights: a user's
        own classes that may be in it, each ``module:NAME``; None of any other classifier.
    own
        Whether it is a user's own model; else channel, encoding and classifier are those of the
        package's model of that name.
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
        of the evidence was the true one, and what that number of recordings can show if all are
        right.
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
        Part of the recordings that it learnt from, s, where that was given when it was trained.
    disturb_training
        What corrupted the recordings that it learnt from: `--disturb-training`.
    recipe, statistics
        Of the network: what was set otherwise than the preset has it; see `training_config`.
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
    unlike_live: tuple[str, ...] = _omitted_if(())
    fps_hz: float | None = Field(default=None, gt=0)
    sample_rate_hz: float | None = Field(default=None, gt=0)
    waves: None = None
    preset: str | None
    seed: Count
    learnt_from_mm_s: tuple[Speed, ...] = _omitted_if(())
    validated_on_mm_s: Speed | None = _omitted_if(None)
    split: SplitName = _omitted_if(SPEED.name)
    learnt_from: tuple[GroupName, ...] = _omitted_if(())
    validated_on: GroupName | None = _omitted_if(None)
    steady_s: Steady | None = _omitted_if(None)
    disturb_training: Corruption = _omitted_if(Corruption())
    recipe: dict[str, Any] = _omitted_if({})
    statistics: choices.Statistics = _omitted_if("warmed-up")
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
        unit = "_mm_s" if self.split == SPEED.name else ""
        for name in (f"learnt_from{unit}", f"validated_on{unit}"):
            if not getattr(self, name):
                raise ValueError(f"{name} must be given for the split by {self.split}")
        if not self.own:
            if self.model not in MODELS:
                raise ValueError(f"model must be one of {', '.join(MODELS)}")
            row = MODELS[self.model]
            parts = (self.channel, self.encoding["name"], self.classifier)
            if parts != (row.channel, row.encoding, row.classifier):
                raise ValueError(f"channel, encoding and classifier must be those of {self.model}")
        for name in ["fps_hz", "sensor"] if self.sample_rate_hz is None else []:
            if getattr(self, name) is None:
                raise ValueError(f"{name} must be given for {self.model}, or sample_rate_hz")
        return self

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
        split, preset = self.held_out, self.preset
        validated = split.at([self.validated_on_mm_s or self.validated_on or ""])
        kind = "simulated recordings" if self.simulated else "recordings"
        recipe = f" (preset {preset}{_describe_changes(self.recipe)})" if preset else ""
        chose = "chose its weights and " if preset else ""
        text = [
            f"{self.title}: {len(self.textures)} textures. Of "
            f"{sum(data.n_recordings for data in self.data)} {kind} it learnt from those "
            f"{split.at(self.groups)}{recipe}.",
            f"{validated[0].upper()}{validated[1:]}, which {chose}calibrated its probabilities and "
            f"nothing was learnt from, {100 * self.validation_accuracy:.1f}% are recognised.",
        ]
        # Evaluations show it, where there were any, else the speed that nothing was learnt from.
        chance = 1 / len(self.textures)
        intervals = [one.ci95 for one in self.scores] or [self.validation_ci95]
        for low, high in [ends for ends in intervals if ends[0] <= chance][:1]:
            text.append(
                f"Nothing was learnt that can be told from guessing ({100 * chance:.1f}%): the 95% "
                f"interval is [{100 * low:.1f}, {100 * high:.1f}]."
            )
        slowest, fastest = min(self.groups), max(self.groups)
        if split == SPEED and slowest != fastest:
            text.append(
                f"Slower than {slowest:g} or faster than {fastest:g} mm/s the speed lies outside "
                "what was learnt: known textures, too, may be called unknown there."
            )
        if dims.ROW_WAVENUMBER in self.sample_dims and self.sensor is not None:
            bumps = self.textures if self.named_by_spacing else ()
            text.append(unseen_waves(self.sensor.get("pitch_mm"), bumps))
        if self.unlike_live:
            text.append(
                f"Its recordings were extracted with {' and '.join(self.unlike_live)}: live does "
                "otherwise, and what was evaluated does not hold there."
            )
        if self.steady_s is not None:
            start, stop = self.steady_s
            text.append(f"Of each recording {start:g} to {stop:g} s were taken, as --steady says.")
        if by := self.disturb_training:
            text.append(f"The recordings that it learnt from were corrupted by {by}.")
        text += [f"Evaluated: {score.describe()}." for score in self.scores]
        if not self.scores:
            text.append(f"Not evaluated at {split.many} held out.")
        if self.estimator is not None:
            text.append(
                "A scikit-learn estimator: it can be explained, and used from Python, with the "
                "version of scikit-learn that it was trained with; it can't be exported or run "
                "live."
            )
        return text


def require_unit(card: Card, of_cells: bool, where: str) -> None:
    """Refuse cells, in grey levels, for a model that learnt from markers, in px; and the reverse.

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


def tensor_names(stepping: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
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
