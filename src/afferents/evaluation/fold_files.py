"""A results folder while it fills: finished folds, marks of jobs, the plan, the configuration.

Each finished fold is written whole, at once, and never trained again. Jobs leave a mark next to the
folder that they will write: ``<group>.running`` while they train, ``<group>.failed`` if they could
not. A mark names the process and the machine that made it, so that a run that was killed is
distinguished from one at work.
"""

import hashlib
import inspect
import json
import os
import socket
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Any, Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import Field

from afferents import channels, dims, documents, files
from afferents.encodings.samples import Samples, list_textures
from afferents.encodings.settings import ENCODINGS, Encodings
from afferents.errors import InputError
from afferents.evaluation import results
from afferents.folds import held_out
from afferents.folds.held_out import SPEED, Group, GroupName, Split, SplitName
from afferents.folds.protocol import Fold, ProtocolName
from afferents.forms import Amount, Count, Share, Speed
from afferents.models.model import MODELS, Model, pick_own

FOLDS, PLAN, OWN_MODELS = "folds", "plan.json", "own_models.json"
FOLD, WEIGHTS = "fold.json", "weights.safetensors"
FRAMES = "frames"
"""Field of encodings whose samples are runs of images: their length."""
State = Literal["done", "running", "failed", "stopped", "to do"]
_REMOVE = "remove it: it is only shown"


class FoldKey(results.Schema):
    """What names a fold in a results folder: whose it is, and which group is held out."""

    model: results.ModelName
    """Of which model."""
    protocol: ProtocolName
    """`nested` or `published`."""
    seed: Count
    """Of the training."""
    split_name: SplitName = Field(default=SPEED.name, alias="split")
    """By what was split: `speed`, or another split's name."""
    held_out: Speed | GroupName
    """The speed held out, mm/s; with another split the group."""

    @classmethod
    def of(
        cls, model: str, protocol: str, seed: int, held_out: Group, split: Split = SPEED
    ) -> "FoldKey":
        """Return the key of a fold."""
        named = {"model": model, "protocol": protocol, "seed": seed, "split": split.name}
        return FoldKey(**named, held_out=held_out)

    @property
    def split(self) -> Split:
        """What is held out: a speed, or a group of another split."""
        return held_out.split_named(self.split_name)

    def folder(self, out: Path) -> Path:
        """Return the folder of this fold."""
        seeds = out / FOLDS / self.model / self.protocol
        return seeds / f"seed-{self.seed}" / held_out.folder_name(self.held_out)

    def mark(self, out: Path, kind: str) -> Path:
        """Return the file next to its folder: that it is `running`, `failed`, a `checkpoint`."""
        folder = self.folder(out)
        return folder.with_name(f"{folder.name}.{kind}")

    def __str__(self) -> str:
        """Return it in words."""
        held_out = f"{self.split.printed(self.held_out)} held out"
        return f"{self.model}, {self.protocol}, seed {self.seed}, {held_out}"


class Epoch(results.Schema):
    """An epoch of a training."""

    accuracy: Share
    """Over its batches, with dropout."""
    validation_accuracy: Share
    """After it."""


class FoldFacts(FoldKey):
    """`fold.json`: a finished fold, and how its training went."""

    seconds: Amount
    """Of training and testing."""
    job_seconds: Amount | None = None
    """The same with reading and encoding."""
    prediction_ms: Amount | None = None
    """Of one test sample alone, median, ms; under `nested`."""
    validated_by: Speed | GroupName
    """The speed (mm/s) or group that validated."""
    validation_accuracy: Share
    """Of the weights that were kept."""
    epochs: Count
    """Number of epochs; 0 for models solved in one step."""
    best_epoch: Count | None = None
    """The epoch whose weights were kept, from 1."""
    history: tuple[Epoch, ...] = ()
    """`accuracy`, `validation_accuracy` and losses of each epoch."""
    leaks: dict[str, results.Counted]
    """What was seen of the test samples before the test."""

    @property
    def key(self) -> FoldKey:
        """Of which fold."""
        return FoldKey.of(self.model, self.protocol, self.seed, self.held_out, self.split)


def read_facts(path: Path) -> FoldFacts:
    """Read a fold's facts.

    Raises
    ------
    InputError
        If they are missing or damaged.
    """
    return FoldFacts.read(path, "the facts of a fold", results.FOLD_AGAIN)


def finished(out: Path, key: FoldKey) -> bool:
    """Return whether a fold is there: present means complete."""
    return (key.folder(out) / FOLD).is_file()


def finished_keys(out: Path) -> list[FoldKey]:
    """List the finished folds of a results folder, in order of model, protocol, seed, group."""
    keys = [read_facts(path).key for path in out.glob(f"{FOLDS}/*/*/*/*/{FOLD}")]
    rank = {name: i for i, name in enumerate(MODELS)}  # a user's own models come last
    keys.sort(key=lambda key: (key.model, key.protocol, key.seed, held_out.order(key.held_out)))
    return sorted(keys, key=lambda key: rank.get(key.model, len(rank)))


def predictions_table(
    key: FoldKey,
    samples: Samples,
    fold: Fold,
    probabilities: NDArray[np.float32],
    speed_mm_s: NDArray[np.float64] | None = None,
) -> pd.DataFrame:
    """Return one row a test sample.

    Parameters
    ----------
    probabilities
        Shape (test sample, texture), textures in natural order.
    speed_mm_s
        Speed that the model estimated, (test sample,); None where it did not.
    """
    textures = list_textures(samples)
    tested = {name: samples[name].to_numpy()[fold.test] for name in dims.SAMPLE_COORDS}
    table = pd.DataFrame(
        {
            "model": key.model,
            "protocol": key.protocol,
            "seed": key.seed,
            key.split.column: key.held_out,
            dims.RECORDING: tested[dims.RECORDING],
            dims.START: tested[dims.START],
            dims.STOP: tested[dims.STOP],
            "true_texture": tested[dims.TEXTURE],
            "predicted_texture": np.array(textures)[probabilities.argmax(axis=1)],
        }
    )
    if speed_mm_s is not None:
        table["predicted_speed_mm_s"] = speed_mm_s
    columns = {f"{results.PROBABILITY}{t}": probabilities[:, i] for i, t in enumerate(textures)}
    return pd.concat([table, pd.DataFrame(columns)], axis=1)


def save_fold(out: Path, facts: FoldFacts, predictions: pd.DataFrame, weights: bytes) -> None:
    """Write a fold's predictions, facts, and the content of its weights file; all or nothing."""
    ours = files.holds_only(FOLD, results.PREDICTIONS, WEIGHTS)
    with files.write_aside(facts.folder(out), ours) as partial:
        partial.mkdir()
        with (partial / results.PREDICTIONS).open("wb") as file:
            predictions.to_parquet(file, compression="zstd", index=False)
        (partial / WEIGHTS).write_bytes(weights)
        facts.write(partial / FOLD)


def load_fold(out: Path, key: FoldKey) -> tuple[FoldFacts, pd.DataFrame]:
    """Read a finished fold: its facts and its predictions."""
    folder = key.folder(out)
    return read_facts(folder / FOLD), results.read_predictions(folder / results.PREDICTIONS)


class PlannedJobs(results.Schema):
    """`plan.json`: the requested trainings, and by how many processes."""

    workers: int = Field(ge=1)
    """Trainings side by side."""
    cluster: str | None
    """Address of a Dask scheduler, if not on this machine."""
    jobs: tuple[FoldKey, ...]
    """The folds."""


class Running(results.Schema):
    """``<group>.running``: which process trains the fold now."""

    host: str
    """Name of the machine."""
    pid: int = Field(ge=1, lt=1 << 31)
    """Number of the process."""
    since: Amount
    """Seconds since 1970."""


class Failed(results.Schema):
    """``<group>.failed``: why a fold could not be trained."""

    why: str
    """The error, in a sentence."""


@dataclass(frozen=True)
class JobStatus:
    """The status of one job.

    Attributes
    ----------
    state
        ``stopped`` is a job whose process ended without a mark: killed, or out of memory.
    seconds
        Time it took, or has taken so far; None where it has not begun.
    why
        Why it failed.
    """

    key: FoldKey
    state: State
    seconds: float | None = None
    why: str = ""


def write_plan(
    out: Path, keys: Iterable[FoldKey], workers: int, cluster: str | None = None
) -> None:
    """Write the plan of the jobs to do, and keep the jobs of earlier plans that have results.

    Parameters
    ----------
    workers
        Trainings side by side.
    cluster
        Where they are, if not on this machine.
    """
    begun = (out / PLAN).is_file() and (out / results.CONFIG).is_file()
    earlier = read_plan(out).jobs if begun else ()
    jobs = tuple(dict.fromkeys([*earlier, *keys]))
    PlannedJobs(workers=workers, cluster=cluster, jobs=jobs).write(out / PLAN)


def read_plan(out: Path) -> PlannedJobs:
    """Return what is planned in a folder."""
    return PlannedJobs.read(out / PLAN, "a plan of trainings", _REMOVE)


@contextmanager
def mark_running(out: Path, key: FoldKey) -> Iterator[None]:
    """Mark a job as running inside, and as failed if it raises."""
    running, failed = key.mark(out, "running"), key.mark(out, "failed")
    failed.unlink(missing_ok=True)
    Running(host=socket.gethostname(), pid=os.getpid(), since=time.time()).write(running)
    try:
        yield
    except Exception as error:
        Failed(why=str(error) or type(error).__name__).write(failed)
        raise
    finally:
        running.unlink(missing_ok=True)


def job_statuses(out: Path) -> list[JobStatus]:
    """Return the status of every planned job, in the order of the plan.

    Raises
    ------
    InputError
        If nothing was planned in this folder.
    """
    if not (out / PLAN).is_file():
        raise InputError(f"{out}: expected a results folder that evaluate has begun, found none")
    return [_read_status(out, key) for key in read_plan(out).jobs]


def _read_status(out: Path, key: FoldKey) -> JobStatus:
    if finished(out, key):
        facts = read_facts(key.folder(out) / FOLD)
        seconds = facts.seconds if facts.job_seconds is None else facts.job_seconds
        return JobStatus(key, "done", seconds)
    failed, running = key.mark(out, "failed"), key.mark(out, "running")
    if failed.is_file():
        return JobStatus(key, "failed", why=Failed.read(failed, "a mark", _REMOVE).why)
    if not running.is_file():
        return JobStatus(key, "to do")
    mark = Running.read(running, "a mark", _REMOVE)
    state: State = "running"
    # Processes of another machine can't be seen; on Windows, os.kill with 0 is Ctrl-C.
    if mark.host == socket.gethostname() and sys.platform != "win32":
        try:
            os.kill(mark.pid, 0)
        except ProcessLookupError:
            state = "stopped"
        except PermissionError:  # it is there, and another user's
            pass
    return JobStatus(key, state, time.time() - mark.since)


def seconds_left(statuses: list[JobStatus], workers: int) -> float | None:
    """Return how long what is not done will take, s, if it goes on as so far; None if unknown.

    A job takes what others of its model took.
    """
    took: dict[str, list[float]] = {}
    for status in statuses:
        if status.state == "done" and status.seconds is not None:
            took.setdefault(status.key.model, []).append(status.seconds)
    if not took:
        return None
    of_any = [seconds for each in took.values() for seconds in each]
    left = 0.0
    for status in statuses:
        if status.state != "done":
            begun = status.seconds if status.state == "running" else None
            left += max(0.0, mean(took.get(status.key.model, of_any)) - (begun or 0.0))
    return left / workers


def check_results_folder(out: Path, config: Mapping[str, Any]) -> None:
    """Check that a folder is new, empty, or holds results of this configuration.

    Raises
    ------
    InputError
        If it holds something else, or the results of another configuration.
    """
    if (out / results.CONFIG).is_file():
        usual = {"split": SPEED.name, "steady_s": "as recorded"}  # what goes without a key
        earlier, now = (
            {**usual, **_without_paths(one)} for one in (results.read_config(out), config)
        )
        files.require_same_config(out, "results", earlier, now)
    else:
        files.require_free(out, files.holds_only(PLAN, FOLDS, OWN_MODELS))


def claim_results_folder(out: Path, config: Mapping[str, Any]) -> None:
    """Write the configuration unless it is there; called before the first fold is kept.

    Raises
    ------
    InputError
        If an evaluation with another configuration was quicker.
    """
    if (out / results.CONFIG).is_file():
        check_results_folder(out, config)
    else:
        files.write_json(out / results.CONFIG, dict(config))


def config_digest(config: Mapping[str, Any]) -> str:
    """Return what identifies a configuration, wherever its data lie."""
    text = json.dumps(_without_paths(config), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def _without_paths(config: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out where data lie: their fingerprint identifies them, and they may move.

    And what was chosen in one run: other models, seeds or processes stand in the same folder.
    """
    data = [{k: v for k, v in d.items() if k != "source"} for d in config.get("data", [])]
    return {**{k: v for k, v in config.items() if k != results.OPTIONS}, "data": data}


def keep_own_models(out: Path, models: Sequence[Model], encodings: Encodings) -> None:
    """Put down what a user's own models are, next to those of earlier runs.

    One name must stand for one model.

    Raises
    ------
    InputError
        If a name stood for another model before, of which a fold was learnt or begun.
    """
    kept = _read_own_models(out)
    for model in pick_own(models):
        found = _describe_model(model, encodings)
        there = (out / FOLDS / model.name).rglob("*")
        begun = any(path.name == FOLD or path.suffix == ".checkpoint" for path in there)
        earlier, kept[model.name] = kept.get(model.name, found), found
        if begun and earlier != found:
            raise InputError(
                f"{out}: expected results of the model '{model.name}' as it is now, found "
                "those of another that had its name; give it another name, or choose another "
                "--out"
            )
    if kept:
        files.write_json(out / OWN_MODELS, kept)


def _read_own_models(out: Path) -> dict[str, Any]:
    path = out / OWN_MODELS
    return documents.read_json(path, "your own models") if path.is_file() else {}


def _describe_model(model: Model, encodings: Encodings) -> dict[str, Any]:
    """Return what distinguishes a model from another of its name, as far as it can be put down."""

    def checksum(maker: Any) -> str:
        """Return that of the file in which something is written; empty where there is none."""
        try:
            return files.checksum(Path(inspect.getsourcefile(maker) or ""))
        except (TypeError, OSError):
            return ""

    encoding, classifier = encodings.of(model.encoding), model.classifier
    channel = channels.find_channel(model.channel)
    own: dict[str, type] = {}
    if channels.CHANNELS.get(channel.name) != channel:
        own[repr(channel)] = type(channel)
    if ENCODINGS.get(encoding.name) is not type(encoding):
        own[encoding.name] = type(encoding)
    where = f"{getattr(classifier, '__module__', '')}:{getattr(classifier, '__qualname__', '')}"
    return {
        "title": model.title,
        "channel": channel.name,
        "encoding": encoding.describe(),
        "classifier": where if callable(classifier) else repr(classifier),
        "source": checksum(classifier if callable(classifier) else type(classifier)),
        "recipe": model.recipe,
        "stretched": model.stretched,
        **({"variant_of": model.variant_of} if model.variant_of else {}),
        **({"own": {name: checksum(kind) for name, kind in own.items()}} if own else {}),
    }


def describe_own_models(out: Path) -> dict[str, Any]:
    """Return a summary's `titles` and `lengths` of a user's own models, if there are any.

    Lengths are by the name of the model that they are variants of, shortest first.
    """
    kept = _read_own_models(out)
    lengths: dict[str, dict[int, str]] = {}
    for name, described in kept.items():
        if base := described.get("variant_of"):
            lengths.setdefault(base, {})[int(described["encoding"][FRAMES])] = name
    found = {
        "titles": {name: str(described["title"]) for name, described in kept.items()},
        "lengths": {base: {str(n): of[n] for n in sorted(of)} for base, of in lengths.items()},
    }
    return {name: content for name, content in found.items() if content}
