"""What `evaluate` leaves in a results folder and others read: models of its files, and `Results`.

::

    RESULTS/
      config.json             what was evaluated: data, cut, preset, encodings, training
      summary.json            the numbers (schema in docs/results-format.md)
      predictions.parquet     one row a test sample
      folds/<model>/<protocol>/seed-<seed>/<speed>/
        fold.json, predictions.parquet, weights.safetensors

Code passes these models about. What is held out, a speed or a group of another split, has the same
keys in all. Other keys may stand next to those that are listed.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, model_validator

from afferents import choices, documents, files, plugins
from afferents.errors import InputError, reading
from afferents.folds.ablation import Ablation
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import SPEED, Group, GroupName, Split, SplitName, key_of, split_named
from afferents.folds.protocol import ProtocolName
from afferents.forms import Amount, Count, Share, Shares, Speed, Steady
from afferents.models.card import Source
from afferents.models.model import MODEL_NAME

CONFIG, SUMMARY, PREDICTIONS = "config.json", "summary.json", "predictions.parquet"
OPTIONS = "options"
"""In the configuration: what was chosen in the last run, which `--config` takes again."""
PROBABILITY = "p_"
"""Prefix of the predictions' probability columns, one a texture."""
SCHEMA = 3
AGAIN = "evaluate again into another folder"
FOLD_AGAIN = "remove its folder and evaluate again"

Points = Annotated[float, Field(ge=-1, le=1)]
ModelName = Annotated[str, Field(pattern=f"^{MODEL_NAME}$")]
Counted = bool | Count
Key = Annotated[str, Field(pattern=r"^\d+(\.\d+)?(e[+-]?\d+)?$")]
"""A length of touch, s, as the key of a table: ``1``, ``0.11``."""


class Schema(BaseModel):
    """Base of all that is kept in a results folder."""

    model_config = ConfigDict(
        frozen=True, extra="allow", use_attribute_docstrings=True, populate_by_name=True
    )

    @classmethod
    def read(cls, path: Path, what: str, do: str = AGAIN) -> Self:
        """Read a file.

        Raises
        ------
        InputError
            If it is missing or damaged: what it should be, which key is at fault, and what to do.
        """
        return documents.as_form(documents.read_json(path, what, do), cls, path, what, do)

    def content(self) -> dict[str, Any]:
        """Return what the file holds, ready for JSON: all that was given, and nothing else."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def write(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        files.write_json(path, self.content())


class Config(Schema):
    """`config.json`: what must agree for folds to stand in one folder."""

    data: tuple[Source, ...] = Field(min_length=1)
    without: dict[str, str]
    skipped: tuple[str, ...]
    cut: choices.Cut
    preset: str
    split: SplitName = SPEED.name
    steady_s: Steady | None = None
    disturb: Corruption = Corruption()
    disturb_training: Corruption = Corruption()
    spectral: dict[str, Any]
    ablation: Ablation = Ablation()
    options: dict[str, Any] = {}


class Accuracies(Schema):
    """Accuracy of samples, recordings or touches: mean over what was held out, and in each."""

    mean_accuracy: Share
    """Share of test samples recognised, mean over what was held out."""
    ci95: Shares
    """Its 95% interval, low and high."""
    by: dict[GroupName, Share]
    """Accuracy by what was held out: speeds in mm/s (keys such as `"10"`), or groups."""
    ci95_by: dict[GroupName, Shares]
    """Interval of each accuracy."""
    worst: GroupName
    """What was held out where accuracy is lowest."""


class WithInside(Accuracies):
    """Accuracy, and the same of the held-out speeds that lie between others."""

    inside: Accuracies | None
    """The same without the slowest and the fastest held-out speed. Null where none remain, and with
    other splits than by speed."""


class OfTouches(WithInside):
    """Accuracy of touches of about one length, each of the same number of consecutive samples."""

    seconds: Amount
    """What they last, s: whole samples come within a quarter of the length stated."""
    samples: Annotated[int, Field(ge=1)]
    """Samples of a touch; touches share none."""


class Reliability(Schema):
    """Samples gathered by confidence, the probability of the texture predicted."""

    ece: Share
    """Expected calibration error: the mean over samples of their bin's difference."""
    count: tuple[Count, ...]
    """Samples in each bin."""
    confidence: tuple[Share, ...]
    """Their mean confidence; 0 where there are none."""
    accuracy: tuple[Share, ...]
    """Share recognised; 0 where there are none."""


class FirstEpoch(Schema):
    """Accuracies of the first epoch of a training."""

    training: Share
    """Over the epoch's batches, with dropout, as Keras logs it too."""
    validation: Share
    """Of the validation samples."""


class Outcome(WithInside):
    """`models.<name>.<protocol>` of `summary.json`: what came out for a model under a protocol."""

    recordings: WithInside
    """The same of whole recordings, by the sum of their samples' log-probabilities."""
    by_touch: dict[Key, OfTouches | None]
    """The same of touches of about 0.11, 1 and 4 s (keys `"0.11"`, `"1"`, `"4"`), by the mean
    log-probability of their samples. Null where samples are longer, or recordings shorter."""
    macro_f1: Share
    """F1, mean over textures."""
    confusion: tuple[tuple[Count, ...], ...]
    """Counts, `[true][predicted]`, over all folds and seeds."""
    reliability: Reliability | None
    """Whether the model is right as often as it says; null where it gives no probabilities."""
    n_test: Count
    """Number of test samples."""
    seeds: tuple[Count, ...]
    """Seeds of the trainings."""
    validations: dict[GroupName, Speed | GroupName]
    """For each fold, the speed (mm/s) or group that validated."""
    validation_accuracy: dict[GroupName, tuple[Share, ...]]
    """For each fold and seed."""
    epochs: dict[GroupName, tuple[Count, ...]]
    """For each fold and seed."""
    best_epoch: dict[GroupName, tuple[Count, ...]]
    """The epoch whose weights were kept, from 1, for each fold and seed. Empty for models solved in
    one step."""
    first_epoch: dict[GroupName, tuple[FirstEpoch, ...]]
    """Accuracies of the first epoch, for each fold and seed; empty for the same models."""
    seconds: Amount
    """Seconds of training, in all."""
    leaks: dict[str, Counted]
    """Totals over folds; all 0 and false under `nested`."""


class Difference(Schema):
    """How much more accurate one is than another, paired, with the 95% interval of that."""

    difference: Points
    """Mean over what was held out."""
    ci95: tuple[Points, Points]
    """Its interval; each draw takes the same textures, or sessions, for both."""


class Comparison(Difference):
    """`comparisons` of `summary.json`: of two models under one protocol."""

    protocol: ProtocolName
    """Under which both were trained."""
    model: str
    """How much more accurate this one is."""
    than: str
    """Than this one."""


class Skipped(Schema):
    """A recording that was left out, and why."""

    recording: str
    reason: str


class WithIssues(Schema):
    """A recording that was used though something is wrong with it."""

    recording: str
    found: tuple[str, ...] = Field(min_length=1)


class Lost(Schema):
    """Share of marker positions that were lost from the rest frame on, 0 to 1."""

    median: Share
    """Over recordings."""
    worst: Share
    """Of the recording in which most were lost."""
    recording: str
    """Its name."""
    n: Annotated[int, Field(ge=1)]
    """Recordings with markers."""


class Intervals(Schema):
    """What intervals are drawn over, and how many there are."""

    bootstrap_unit: Literal["texture", "session"] = Field(alias="replicate")
    """What is drawn anew, whole."""
    n: Count
    """How many there are."""


class Summary(Schema):
    """`summary.json`."""

    schema_version: Literal[3] = Field(alias="schema")
    """Version of this format."""
    afferents: str
    """The version that wrote it."""
    data: tuple[Source, ...] = Field(min_length=1)
    """For each source: `source`, `kind` (`store`, `dataset`, `fabricslide`, or your own),
    `fingerprint`, `n_recordings`, `simulated`."""
    without: dict[str, str] = {}
    """Conditions of recordings that were left out."""
    n_used: Count | None = None
    """How many recordings were used, if not all."""
    options: dict[str, Any] = {}
    """Other options, as `--config` takes them."""
    cut: choices.Cut
    """Part of the recordings that was used."""
    preset: str
    """Training recipe."""
    skipped: tuple[Skipped, ...]
    """`recording` and `reason` of what `--keep-going` left out."""
    issues: tuple[WithIssues, ...] = ()
    """`recording`, and sentences on what was `found` wrong with it."""
    lost: Lost | None = None
    """Share of marker positions that were lost."""
    named_by_spacing: bool = False
    """True if textures are named by the spacing of their bumps in mm. Tables and figures then show
    the paper's letters."""
    steady_s: Steady | None = None
    """Start and stop, s, of the part that was used, with `--steady`."""
    control: str = "none"
    """What was removed from all recordings, with `--control`."""
    penalty: str = "fixed"
    """`searched` with `--penalty searched`."""
    statistics: str = "warmed-up"
    """`keras` with `--statistics keras`."""
    recipe: dict[str, dict[str, Any]] = {}
    """Hyperparameters that `--recipe` set, by network."""
    disturb: Corruption = Corruption()
    """How the recordings tested were corrupted (`--disturb`): `markers` (px), `sound`, `frames` and
    `lost` (shares), and `seed`, without those that are 0."""
    disturb_training: Corruption = Corruption()
    """The same of those learnt from (`--disturb-training`)."""
    textures: tuple[str, ...] = Field(min_length=1)
    """Classes in order."""
    speeds_mm_s: tuple[Speed, ...] = ()
    """Speeds that were held out in turn."""
    split_name: SplitName = Field(default=SPEED.name, alias="split")
    """With another split: what was held out, the condition's name."""
    groups: tuple[GroupName, ...] = ()
    """With another split: values of the condition as text, or numbers of arcs."""
    chance: Share
    """Accuracy of always answering the most frequent texture."""
    recommended: str = ""
    """The model that `best` stands for with these data; empty if none."""
    left_out: tuple[str, ...] = ()
    """Requested models that the data do not support."""
    titles: dict[str, str] = {}
    """Titles of models of your own, by name."""
    lengths: dict[str, dict[Annotated[str, Field(pattern=r"^[1-9][0-9]{0,8}$")], str]] = {}
    """With several lengths (`--frames 1,2,5`), for each model: the model of each length. These are
    in `models` and `titles`, as models of your own are."""
    intervals: Intervals
    """What intervals are drawn over: `replicate` (`texture` or `session`), and how many, `n`."""
    models: dict[str, dict[ProtocolName, Outcome]]
    """The outcome of each model, by name and protocol (below)."""
    selection_effect: dict[str, Difference] = {}
    """By model, published minus nested accuracy: `difference` and its `ci95`."""
    controls: dict[str, Accuracies] = {}
    """Of data without markers: what a linear discriminant on log spectra recognises (`nested`) of
    the recordings as they are (`none`), and after something was removed (`permuted`,
    `shuffled`, `offsets`, `amplitudes`)."""
    controls_left_out: str = ""
    """Of data without markers: why there are no `controls`."""
    comparisons: tuple[Comparison, ...] = ()
    """For each two models under one protocol: `protocol`, `model`, `than`, `difference`, `ci95`."""

    @property
    def split(self) -> Split:
        """What was held out."""
        return split_named(self.split_name)

    @model_validator(mode="after")
    def _says_what_was_held_out(self) -> Self:
        if not self.held_out:
            raise ValueError("speeds_mm_s must be given, or groups")
        return self

    @property
    def held_out(self) -> list[Group]:
        """What was held out in turn: speeds in mm/s, or names of groups."""
        return list(self.speeds_mm_s or self.groups)

    @property
    def all_held_out(self) -> bool:
        """Whether each group of the data was, rather than those that were requested."""
        return "held_out" not in self.options

    @property
    def held_out_keys(self) -> list[str]:
        """The same as the keys of tables."""
        return [key_of(group) for group in self.held_out]


@dataclass(frozen=True)
class Results:
    """A results folder in memory.

    Attributes
    ----------
    root
        The folder.
    config
        What was evaluated, as `config.json` holds it.
    found
        The numbers, as they are passed about.
    predictions
        Columns model, protocol, seed, held_out_speed_mm_s (held_out_group where something else
        than speed was held out), recording, start_s, stop_s, true_texture, predicted_texture and
        `p_<texture>` for every texture.
    """

    root: Path
    config: dict[str, Any]
    found: Summary
    predictions: pd.DataFrame

    @cached_property
    def summary(self) -> dict[str, Any]:
        """All numbers, as `summary.json` holds them; see docs/results-format.md."""
        return self.found.content()

    @property
    def accuracy(self) -> pd.DataFrame:
        """Share of test samples recognised, by model, protocol and speed or group held out.

        Columns model, protocol, held_out_speed_mm_s (or held_out_group), accuracy, ci95_low,
        ci95_high. The mean over speeds stands in a row without a speed. Intervals are of 95%.
        """
        split = self.split
        rows: list[tuple[Any, ...]] = []
        number, none = (float, np.nan) if split.ordered else (str, None)
        for model, of_protocol in self.found.models.items():
            for protocol, found in of_protocol.items():
                for group, accuracy in found.by.items():
                    rows.append((model, protocol, number(group), accuracy, *found.ci95_by[group]))
                rows.append((model, protocol, none, found.mean_accuracy, *found.ci95))
        names = ("model", "protocol", split.column, "accuracy", "ci95_low", "ci95_high")
        return pd.DataFrame(rows, columns=list(names))

    @property
    def split(self) -> Split:
        """What was held out."""
        return self.found.split

    @property
    def textures(self) -> list[str]:
        """Textures in natural order."""
        return list(self.found.textures)


def load_results(root: str | Path) -> Results:
    """Read a results folder.

    Parameters
    ----------
    root
        The folder that `evaluate` has written.

    Returns
    -------
    Results
        `accuracy`, a table of shares from 0 to 1 by model, protocol and held-out speed (mm/s);
        `predictions`, a table with a row for each test sample; `summary`, all numbers of the
        report. `afferents.plot` draws them.

    Raises
    ------
    InputError
        If the folder, or one of its files, is missing or of another schema.
    """
    root = Path(root)
    for name in (CONFIG, SUMMARY, PREDICTIONS):
        if not (root / name).is_file():
            reproduced = root / "results"
            there = (reproduced / SUMMARY).is_file()
            do = f"its results are in {reproduced}" if there else "run evaluate first"
            raise InputError(f"{root}: expected a results folder with {name}, found none; {do}")
    config, found = read_config(root), read_summary(root)
    return Results(root, config, found, read_predictions(root / PREDICTIONS))


def read_config(root: Path) -> dict[str, Any]:
    """Read what a results folder holds; see `load_results`."""
    return documents.read_checked(
        root / CONFIG, Config, "the configuration of an evaluation", AGAIN
    )


def read_summary(root: Path) -> Summary:
    """Read the numbers of a results folder; see `load_results`."""
    return Summary.read(root / SUMMARY, "the summary of an evaluation")


def read_predictions(path: Path) -> pd.DataFrame:
    """Read a table of predictions.

    Raises
    ------
    InputError
        If the file is missing, damaged, or holds another table.
    """
    plugins.import_extra("train", str(path), "pyarrow")
    with reading(path, "a table of predictions", do=FOLD_AGAIN), path.open("rb") as file:
        return pd.read_parquet(file)
