"""What must stand in the files of a results folder for them to be read back.

Each form lists what the code goes by and the range that it may have; what else stands in a file
(docs/results-format.md) is let be. Written by `evaluate`, read by `report`, `status`, `train`, and
by `evaluate` itself when it goes on.
"""

from itertools import chain
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from afferents.choices import Cut
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import (
    Amount,
    Count,
    GroupName,
    Share,
    Shares,
    Speed,
    SplitName,
    Steady,
)
from afferents.folds.protocol import ProtocolName
from afferents.models.card import Source
from afferents.models.model import MODEL_NAME

SCHEMA = 2

Difference = Annotated[float, Field(ge=-1, le=1)]
ModelName = Annotated[str, Field(pattern=f"^{MODEL_NAME}$")]


def _counted(value: Any) -> Any:
    if not isinstance(value, int) or value < 0:
        raise ValueError("a count, true or false")
    return value


Counted = Annotated[Any, AfterValidator(_counted)]
Key = Annotated[str, Field(pattern=r"^\d+(\.\d+)?(e[+-]?\d+)?$")]
"""A speed or a spacing as the key of a table: ``10``, ``12.5``."""


class Form(BaseModel):
    """Base of all forms: other keys may stand beside those that are listed."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Used(Form):
    """What of the data was used: `Ablation`."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    textures: tuple[str, ...] = ()
    speeds_mm_s: tuple[Speed, ...] = ()
    markers: Share = 1.0
    train_speeds: Annotated[int, Field(ge=1)] | None = None
    test_only: tuple[str, str] | None = None


class Config(Form):
    """`config.json`: what must agree for folds to stand in one folder."""

    data: tuple[Source, ...] = Field(min_length=1)
    without: dict[str, str]
    skipped: tuple[str, ...]
    cut: Cut
    preset: str
    split: SplitName = "speed"
    steady_s: Steady | None = None
    disturb: Corruption = Corruption()
    disturb_training: Corruption = Corruption()
    spectral: dict[str, Any]
    ablation: Used = Used()


class Job(Form):
    """Which fold a training is of: `FoldKey`."""

    model: ModelName
    protocol: ProtocolName
    seed: Count
    split: SplitName | None = None
    held_out_mm_s: Speed | None = None
    held_out_group: GroupName | None = None

    @model_validator(mode="after")
    def _says_what_is_held_out(self) -> Self:
        return self._require("held_out_mm_s" if self.split is None else "held_out_group")

    def _require(self, name: str) -> Self:
        if getattr(self, name) is None:
            raise ValueError(f"{name} must be given")
        return self


class Plan(Form):
    """`plan.json`: what is to be done."""

    workers: int = Field(ge=1)
    cluster: str | None
    jobs: tuple[Job, ...]


class Running(Form):
    """``<group>.running``: which process is at work."""

    host: str
    pid: int = Field(ge=1, lt=1 << 31)
    since: Amount


class Failed(Form):
    """``<group>.failed``: why a training could not be done."""

    why: str


class EpochFacts(Form):
    """An epoch of a fold's history."""

    accuracy: Share
    validation_accuracy: Share


class FoldFacts(Job):
    """`fold.json`: a finished fold."""

    seconds: Amount
    job_seconds: Amount | None = None
    validation_mm_s: Speed | None = None
    validation_group: GroupName | None = None
    validation_accuracy: Share
    epochs: Count
    best_epoch: Count | None = None
    history: tuple[EpochFacts, ...] = ()
    leaks: dict[str, Counted]

    @model_validator(mode="after")
    def _says_what_validated(self) -> Self:
        return self._require("validation_mm_s" if self.split is None else "validation_group")


class Accuracies(Form):
    """Of samples or whole recordings, at some speeds held out, or groups of another split."""

    mean_accuracy: Share
    ci95: Shares | None = None
    by_speed: dict[Key, Share | None] | None = None
    worst_speed: str | None = None
    by_group: dict[GroupName, Share | None] | None = None
    ci95_by_speed: dict[Key, Shares] = {}
    ci95_by_group: dict[GroupName, Shares] = {}
    worst_group: str | None = None

    @model_validator(mode="after")
    def _worst_is_one_of_them(self) -> Self:
        what = "speed" if self.by_group is None else "group"
        by, worst = getattr(self, f"by_{what}"), getattr(self, f"worst_{what}")
        if by is None or by.get(worst) is None:
            raise ValueError(f"worst_{what} must be one of by_{what}")
        return self


class Touches(Accuracies):
    """The same, and of the speeds that lie between others; None of other groups."""

    inside: Accuracies | None = None


class OfLength(Touches):
    """Of touches of about one length, made of so many samples."""

    seconds: Amount
    samples: Annotated[int, Field(ge=1)]


class Bins(Form):
    """Reliability: samples gathered by confidence."""

    ece: Share
    count: tuple[Count, ...]
    confidence: tuple[Share, ...]
    accuracy: tuple[Share, ...]

    @model_validator(mode="after")
    def _are_as_many(self) -> Self:
        if not len(self.count) == len(self.confidence) == len(self.accuracy) or not any(self.count):
            raise ValueError("count, confidence and accuracy must be as many, of samples")
        return self


class FirstEpoch(Form):
    """Accuracies of the first epoch of a training."""

    training: Share
    validation: Share


class Outcome(Touches):
    """What came out for a model under a protocol."""

    recordings: Touches | None = None
    by_touch: dict[Key, OfLength | None] = {}
    macro_f1: Share
    reliability: Bins | None = None
    n_test: Count
    seeds: tuple[Count, ...]
    seconds: Amount
    validation_speeds: dict[Key, Speed] | None = None
    validation_groups: dict[GroupName, GroupName] | None = None
    epochs: dict[GroupName, tuple[Count, ...]]
    best_epoch: dict[GroupName, tuple[Count, ...]] = {}
    first_epoch: dict[GroupName, tuple[FirstEpoch, ...]] = {}
    leaks: dict[str, Counted | None]


class Paired(Form):
    """How much better one is than another, with its interval."""

    difference: Difference
    ci95: tuple[Difference, Difference]


class Comparison(Paired):
    """Of two models under one protocol."""

    protocol: ProtocolName
    model: str
    than: str


class Skipped(Form):
    """A recording that was left out, and why."""

    recording: str
    reason: str


class Accepted(Form):
    """A recording that was kept as it is, and what is wrong with it."""

    recording: str
    found: tuple[str, ...] = Field(min_length=1)


class Lost(Form):
    """Share of marker positions that were lost: over recordings, and where most."""

    median: Share
    worst: Share
    recording: str
    n: Annotated[int, Field(ge=1)]


class Intervals(Form):
    """What was drawn anew for the intervals, and how many there are."""

    replicate: Literal["texture", "session"]
    n: Count


class About(Form):
    """What every summary says of the whole."""

    schema_version: Literal[2] = Field(alias="schema")
    afferents: str
    data: tuple[Source, ...] = Field(min_length=1)
    options: tuple[str, ...] = ()
    cut: Cut
    preset: str
    steady_s: Steady | None = None
    disturb: Corruption = Corruption()
    disturb_training: Corruption = Corruption()
    recipe: dict[str, dict[str, Any]] = {}
    textures: tuple[str, ...] = Field(min_length=1)
    named_by_spacing: bool = False
    intervals: Intervals | None = None
    skipped: tuple[Skipped, ...]
    accepted: tuple[Accepted, ...] = ()
    lost: Lost | None = None


class AboutSpeeds(About):
    """The same, where speeds are held out."""

    speeds_mm_s: tuple[Speed, ...] = Field(min_length=1)


class Summary(About):
    """`summary.json`."""

    split: SplitName | None = None
    speeds_mm_s: tuple[Speed, ...] = ()
    groups: tuple[GroupName, ...] = ()
    chance: Share
    titles: dict[str, str] = {}
    lengths: dict[str, dict[Annotated[str, Field(pattern=r"^[1-9][0-9]{0,8}$")], str]] = {}
    models: dict[str, dict[ProtocolName, Outcome]]
    selection_effect: dict[str, Paired] = {}
    comparisons: tuple[Comparison, ...] = ()

    @model_validator(mode="after")
    def _says_what_was_held_out(self) -> Self:
        listed, by = ("speeds_mm_s", "by_speed") if self.split is None else ("groups", "by_group")
        if not getattr(self, listed):
            raise ValueError(f"{listed} must name at least one")
        for name, outcomes in self.models.items():
            if any(getattr(outcome, by) is None for outcome in outcomes.values()):
                raise ValueError(f"models.{name} must have {by}")
        return self


# Summaries of `--split texture`.


class Unknown(Form):
    """Shares called unknown, at some held-out speeds."""

    mean: Share
    ci95: Shares


class UnknownBySpeed(Unknown):
    """The same at all of them and, where there are any, at those that lie between others."""

    inside: Unknown | None
    outside: Unknown | None = None
    by_speed: dict[Key, Share] = Field(min_length=1)

    @model_validator(mode="after")
    def _some_lie_between(self) -> Self:
        if self.inside is not None and len(self.by_speed) < 3:
            raise ValueError("inside must be null where by_speed has fewer than 3")
        return self


class Units(Form):
    """Of samples, and of whole recordings."""

    samples: UnknownBySpeed
    recordings: UnknownBySpeed


class Areas(Form):
    """Under the curve of false alarms against finds, of both."""

    samples: Share | None
    recordings: Share | None


class OfTexture(Form):
    """How often one texture is called unknown."""

    found_samples: Share
    false_alarms: Share


class UnknownOutcome(Form):
    """What a model makes of textures never felt."""

    found: Units
    false_alarms: Units
    auroc: Areas
    auroc_inside: Areas
    auroc_outside: Areas | None = None
    by_texture: dict[str, OfTexture]

    @model_validator(mode="after")
    def _areas_go_with_speeds(self) -> Self:
        known = [self.auroc] + [self.auroc_inside] * (self.found.samples.inside is not None)
        if None in chain.from_iterable((one.samples, one.recordings) for one in known):
            raise ValueError("auroc must be a number")
        return self


class UnknownSummary(AboutSpeeds):
    """`unknown.json`."""

    false_alarms_stated: Share
    models: dict[str, UnknownOutcome] = Field(min_length=1)

    @model_validator(mode="after")
    def _knows_all_textures(self) -> Self:
        for name, outcome in self.models.items():
            if missing := set(self.textures) - set(outcome.by_texture):
                raise ValueError(f"models.{name}.by_texture must have {min(missing)}")
        return self


class RoughnessOutcome(Form):
    """How far off a model is in mm."""

    mae_mm: Amount
    mae_mm_inside: Amount | None
    mae_mm_recordings: Amount
    by_speed: dict[Key, Amount] = Field(min_length=1)
    by_spacing: dict[Key, Amount] = Field(min_length=1)
    covered: Share
    half_interval_mm: Amount


class RoughnessSummary(AboutSpeeds):
    """`roughness.json`."""

    coverage_asked: Share
    models: dict[str, dict[Literal["seen", "unseen"], RoughnessOutcome]]
