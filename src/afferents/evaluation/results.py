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

from afferents.choices import Cut
from afferents.documents import as_form, read_checked, read_json
from afferents.errors import InputError, reading
from afferents.files import write_json
from afferents.folds.ablation import Ablation
from afferents.folds.corruption import Corruption
from afferents.folds.held_out import SPEED, Group, GroupName, Split, SplitName, key_of, split_named
from afferents.folds.protocol import ProtocolName
from afferents.forms import Amount, Count, Share, Shares, Speed, Steady
from afferents.models.card import Source
from afferents.models.model import MODEL_NAME
from afferents.plugins import import_extra

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
        return as_form(read_json(path, what, do), cls, path, what, do)

    def content(self) -> dict[str, Any]:
        """Return what the file holds, ready for JSON: all that was given, and nothing else."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def write(self, path: Path) -> None:
        """Write the file, whole or not at all."""
        write_json(path, self.content())


class Config(Schema):
    """`config.json`: what must agree for folds to stand in one folder."""

    data: tuple[Source, ...] = Field(min_length=1)
    without: dict[str, str]
    skipped: tuple[str, ...]
    cut: Cut
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
    """Mean over what was held out of the share of test samples recognised."""
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
    """The same of the held-out speeds between other held-out speeds: without the slowest and the
    fastest. Null where there are none, and with another split: groups lie on no scale."""


class OfTouches(WithInside):
    """Accuracy of touches of about one length, each of the same number of consecutive samples."""

    seconds: Amount
    """What they last, s: whole samples come within a quarter of the length stated."""
    samples: Annotated[int, Field(ge=1)]
    """Samples of a touch; touches share none."""


class Reliability(Schema):
    """Samples gathered by confidence, the probability of the texture that they are named."""

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
    """The same of whole recordings: each is named by the sum of its samples' log-probabilities."""
    by_touch: dict[Key, OfTouches | None]
    """The same of touches of about 0.11, 1 and 4 s (keys `"0.11"`, `"1"`, `"4"`), each named by the
    mean log-probability of its samples. Null where samples are longer, or recordings shorter."""
    macro_f1: Share
    """Mean over textures of F1, all that was held out together."""
    confusion: tuple[tuple[Count, ...], ...]
    """Counts, `[true][predicted]`, all that was held out and all seeds."""
    reliability: Reliability | None
    """Whether the model is right as often as it says; null where it gives no probabilities."""
    n_test: Count
    """Test samples."""
    seeds: tuple[Count, ...]
    """Seeds of the trainings."""
    validations: dict[GroupName, Speed | GroupName]
    """By what was held out, the speed (mm/s) or group that validated."""
    validation_accuracy: dict[GroupName, tuple[Share, ...]]
    """By what was held out, one value a seed."""
    epochs: dict[GroupName, tuple[Count, ...]]
    """By what was held out, one value a seed."""
    best_epoch: dict[GroupName, tuple[Count, ...]]
    """By what was held out, one value a seed: number, from 1, of the epoch whose weights were kept.
    Empty for models that are solved at once."""
    first_epoch: dict[GroupName, tuple[FirstEpoch, ...]]
    """By what was held out, one a seed: accuracies of the first epoch. Empty likewise."""
    seconds: Amount
    """Seconds of training, all together."""
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
    """Of the files."""
    afferents: str
    """The version that wrote it."""
    data: tuple[Source, ...] = Field(min_length=1)
    """For each source: `source`, `kind` (the data set: `store`, `dataset`, `fabricslide`, or the
    name of your own), `fingerprint`, `n_recordings`, `simulated`."""
    without: dict[str, str] = {}
    """Conditions of recordings that were left out."""
    n_used: Count | None = None
    """How many recordings of all sources were used; only where it was not all of them."""
    options: dict[str, Any] = {}
    """Further options by name, as `evaluate` and a file given to `--config` take them."""
    cut: Cut
    """Part of the recordings that was used."""
    preset: str
    """Training recipe."""
    skipped: tuple[Skipped, ...]
    """`recording` and `reason` of what `--keep-going` left out."""
    issues: tuple[WithIssues, ...] = ()
    """`recording`, and in sentences what was `found` wrong with it; only where there is any."""
    lost: Lost | None = None
    """Share of marker positions that were lost; only where there are markers."""
    named_by_spacing: bool = False
    """True where textures are named by the spacing of their bumps in mm, as the published layout
    has it: tables and figures then show the paper's letters; only where it is so."""
    steady_s: Steady | None = None
    """Start and stop, s, of the part of recordings that was used; only with `--steady`."""
    control: str = "none"
    """What was taken from all recordings; only with `--control`."""
    penalty: str = "fixed"
    """`searched` where `--penalty searched` was given."""
    statistics: str = "warmed-up"
    """`keras` where `--statistics keras` was given."""
    recipe: dict[str, dict[str, Any]] = {}
    """Hyperparameters by network that `--recipe` set; only where it was given."""
    disturb: Corruption = Corruption()
    """How recordings that are tested were corrupted: amounts of `markers` (px), `sound`, `frames`
    and `lost` (shares), and `seed`, without those that are 0; only with `--disturb`."""
    disturb_training: Corruption = Corruption()
    """How recordings that are learnt from were corrupted; only with `--disturb-training`."""
    textures: tuple[str, ...] = Field(min_length=1)
    """Classes in order."""
    speeds_mm_s: tuple[Speed, ...] = ()
    """Speeds that were held out in turn."""
    split_name: SplitName = Field(default=SPEED.name, alias="split")
    """With another split: what was held out, the condition's name."""
    groups: tuple[GroupName, ...] = ()
    """With another split: values of the condition as text, or numbers of arcs."""
    chance: Share
    """Accuracy of always naming the texture that is there most often: 1 / number of textures,
    where all have as many recordings."""
    recommended: str = ""
    """The model that `best` stands for with these data; empty where they support none."""
    left_out: tuple[str, ...] = ()
    """Requested models that the data don't support."""
    titles: dict[str, str] = {}
    """Titles of models of your own, by name; only where there are any."""
    lengths: dict[str, dict[Annotated[str, Field(pattern=r"^[1-9][0-9]{0,8}$")], str]] = {}
    """Where windows have several lengths (`--frames 1,2,5`): by name of the model, the model of
    each length; these stand under `models` and `titles` like models of your own."""
    intervals: Intervals
    """What intervals are drawn over: `replicate`, `texture` or `session`, and `n`, how many."""
    models: dict[str, dict[ProtocolName, Outcome]]
    """By name and protocol, the outcome of a model, see below."""
    selection_effect: dict[str, Difference] = {}
    """By model, published minus nested accuracy: `difference` and its `ci95`."""
    controls: dict[str, Accuracies] = {}
    """Of data without markers: what a quick model recognises of the recordings as they are
    (`none`), and once something was taken from them (`permuted`, `shuffled`, `offsets`,
    `amplitudes`). A linear discriminant on log spectra, `nested`."""
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
    return read_checked(root / CONFIG, Config, "the configuration of an evaluation", AGAIN)


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
    import_extra("train", str(path), "pyarrow")
    with reading(path, "a table of predictions", do=FOLD_AGAIN), path.open("rb") as file:
        return pd.read_parquet(file)
