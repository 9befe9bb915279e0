"""About how long a reproduction will take: the first frames and batches are timed, and multiplied.

Once trainings have ended, `status` knows better, by what they took.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.choices import Cut, Method
from afferents.encodings.samples import Samples
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.encode import best_of, encode, lacking, sources_of
from afferents.evaluation.fold_files import FoldKey, finished
from afferents.evaluation.recipe import Recipe
from afferents.extraction.extract import responses_of, watched
from afferents.folds.held_out import Group
from afferents.folds.protocol import Fold, Protocol
from afferents.markers.sensor import Sensors
from afferents.models.base import Network
from afferents.models.classifiers import classifier_of
from afferents.models.config import TrainingConfig
from afferents.models.fitted import Fitting, Part
from afferents.models.fitting import fit, recipes_of
from afferents.models.learning_set import originals
from afferents.models.model import Model
from afferents.models.solved import MeanFusion
from afferents.recordings.check import ClipFile
from afferents.recordings.session import Session
from afferents.reporting.published import published_costs
from afferents.reproduction.run_folder import duration
from afferents.store.recording import Frame, Recording, Video
from afferents.store.responses import Responses, label
from afferents.store.trimming import cut_audio, cut_frames
from afferents.store.zarr_store import open_responses, responses_there

TRACKED, EARLY = 60, 20
"""So many frames are timed, after those at rest and so many more."""
TEXTURES, SPEEDS = 13, 10
IN_A_LOOP, AT_ONCE = 1, 24
"""Samples of each texture at each speed by which a model is timed: two batches of a network, and
enough of what is solved at once."""
_TRIED = 5
"""So many recordings are tried before it is said that none can be tracked."""


@dataclass(frozen=True)
class Work:
    """The trainings of one model under one protocol that are still to be done.

    Attributes
    ----------
    fold_s
        How long one takes in one process, s.
    epochs
        That it is taken to need; None of a model that is solved at once.
    samples
        Learnt from, in each epoch.
    """

    model: str
    protocol: str
    folds: int
    fold_s: float
    epochs: float | None
    samples: float


@dataclass(frozen=True)
class Estimate:
    """About how long what is left of a reproduction takes.

    Attributes
    ----------
    recordings, frames, frame_s
        To be tracked, and what a frame takes in one process, s.
    gpu
        Whether the trainings are done one after the other, on a GPU.
    """

    recordings: int
    frames: int
    frame_s: float
    trainings: tuple[Work, ...] = ()
    processes: int = 1
    cluster: bool = False
    gpu: bool = False

    @property
    def tracking_s(self) -> float:
        """Return how long tracking takes, s."""
        return self.frames * self.frame_s / self.processes

    @property
    def total_s(self) -> float:
        """Return how long all takes, s, as if nothing else ran."""
        trained = sum(work.folds * work.fold_s for work in self.trainings)
        return self.tracking_s + trained / (1 if self.gpu else self.processes)

    def describe(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "total_s": self.total_s,
            "processes": self.processes,
            "cluster": self.cluster,
            "tracking_s": self.tracking_s,
            "frames": self.frames,
            "trainings": [asdict(work) for work in self.trainings],
        }

    def sentence(self) -> str:
        """Return it in words."""
        folds = sum(work.folds for work in self.trainings)
        if not self.recordings and not folds:
            return "Nothing is left to be tracked or trained."
        where = "on the cluster" if self.cluster else "here"
        return (
            f"About {duration(self.total_s)} {where} with {self.processes} at work (--workers), an "
            f"estimate from the first frames and batches: tracking {self.frames:,} frames of "
            f"{self.recordings} recordings, and {folds} trainings. Once some have ended, "
            "'afferents status' knows better."
        )


def require_length(session: Session, cut: Cut) -> None:
    """Refuse recordings that are too short for the cut, before any is tracked.

    Raises
    ------
    InputError
        Naming the first.
    """
    for recording in session.recordings if cut == "published" else ():
        name, video, audio = recording.name, recording.video, recording.audio
        if isinstance(video, ClipFile):
            cut_frames(np.zeros(video.n_frames), cut, None, name)
        if audio is not None:
            cut_audio(audio.n_samples, audio.sample_rate_hz, cut, None, name)


def estimate(
    session: Session,
    sensors: Sensors,
    method: Method,
    store: Path,
    recipe: Recipe,
    protocols: Sequence[Protocol],
    seeds: Sequence[int],
    held_out: Sequence[Group],
    with_best: bool = False,
) -> Estimate:
    """Time the first frames of a recording and the first batches of each model, and multiply.

    Parameters
    ----------
    store
        Where responses go: recordings that it holds are not counted.
    recipe
        Of the trainings; those finished in its folder are not counted.
    with_best
        Whether the model that we recommend for such recordings is trained as well.

    Raises
    ------
    AfferentsError
        If a group or texture asked for is not there, no recording can be tracked, or what is
        timed is too short to be encoded.
    """
    named = [label(xr.Dataset(), recording) for recording in session.recordings]
    evaluated = recipe.options.ablation.recordings(named)
    there = recipe.split.groups_of(evaluated)
    recipe.split.require(held_out, there, "--held-out")
    missing = [r for r in session.recordings if responses_there(store, r.name) is None]
    one, frame_s = _timed(missing, sensors, method) if missing else (open_responses(store)[0], 0.0)
    able = [model for model in recipe.models if lacking(model, [one]) is None]
    best = [best_of([one])] if with_best else []
    works = []
    for model in dict.fromkeys([*able, *best]):
        for protocol in protocols:
            keys = (
                FoldKey.of(model.name, protocol.name, seed, group, recipe.split)
                for seed in seeds
                for group in held_out or there
            )
            if left := sum(not finished(recipe.out, key) for key in keys):
                shares = len(evaluated), len(there)
                works.append(time_fold(model, protocol, one, recipe, shares, left))
    return Estimate(
        len(missing),
        sum(n_frames(recording) for recording in missing),
        frame_s,
        tuple(works),
        gpu=on_gpu(recipe),
    )


# Tracking.


@dataclass
class FirstFrames:
    """The first part of a video, with the processor time that its later frames take."""

    video: Video
    n: int
    early: int
    seconds: float = field(default=0.0, init=False)

    def __getattr__(self, name: str) -> Any:
        """Be like the video in everything else."""
        return getattr(self.video, name)

    def frames(self) -> Iterator[Frame]:
        """Decode from the start."""
        begun = time.process_time()
        for number, frame in enumerate(islice(self.video.frames(), self.early + self.n)):
            if number == self.early:
                begun = time.process_time()
            yield frame
            self.seconds = (time.process_time() - begun) / max(1, number + 1 - self.early)


def _timed(
    recordings: Sequence[Recording], sensors: Sensors, method: Method
) -> tuple[Responses, float]:
    """Track the first recording that can be; return responses of its length, and s a frame."""
    fault: AfferentsError | None = None
    for recording in recordings[:_TRIED]:
        try:
            return track_first_frames(recording, sensors, method)
        except AfferentsError as error:
            fault = fault or error
    raise fault or InputError("the session: expected a recording that can be tracked, found none")


def track_first_frames(
    recording: Recording, sensors: Sensors, method: Method
) -> tuple[Responses, float]:
    """Track the first frames of a recording.

    Returns
    -------
    Its responses, repeated to its own length, and how long a frame took, s of one process.
    """
    if recording.video is None:
        return responses_of(recording), 0.0
    sensor = sensors.of(recording)
    first = FirstFrames(recording.video, TRACKED, sensor.rest_frame + EARLY)
    found = responses_of(watched(replace(recording, video=cast(Video, first))), sensor, method)
    seen = np.flatnonzero(found[dims.DETECTED].values.any(axis=1))
    n, rate_hz = n_frames(recording), recording.video.fps_hz
    repeated = found.isel({dims.TIME: seen[np.arange(n) % len(seen)]})
    return repeated.assign_coords({dims.TIME: np.arange(n) / rate_hz}), first.seconds


def n_frames(recording: Recording) -> int:
    """Return how many frames a recording's video declares; 0 if it can't be read."""
    try:
        return recording.video.n_frames if isinstance(recording.video, ClipFile) else 0
    except AfferentsError:  # which is said when it is extracted
        return 0


# Trainings.


def time_fold(
    model: Model,
    protocol: Protocol,
    responses: Responses,
    recipe: Recipe,
    shares: tuple[int, int],
    folds: int,
) -> Work:
    """Time a model on samples of one recording, as if of all; return its work.

    Parameters
    ----------
    shares
        How many recordings there are, all taken to be like this one, and in how many groups.
    folds
        That are to be trained.
    """
    n_recordings, n_groups = shares
    sources = sources_of(model, recipe.encodings)
    samples = [encode(responses, source, recipe.options.cut) for source in sources]
    lead = samples[0]
    looped = issubclass(classifier_of(model.classifier), Network | MeanFusion)
    each = IN_A_LOOP if looped else AT_ONCE
    parts = [
        Part(*_as_of_all(one, each), source.encoding)
        for one, source in zip(samples, sources, strict=True)
    ]
    configs = [recipe.options.training(name) for name in recipes_of(model, parts)]
    short = [_in_one_epoch(config) for config in configs]
    clock = time.perf_counter if on_gpu(recipe) else time.process_time
    threads = torch.get_num_threads()
    torch.set_num_threads(1)  # as each training has it
    try:
        for _ in range(2):  # the first one also compiles and allocates
            begun = clock()
            fit(Fitting(model, parts, protocol, short, 0, 0, lambda *_: None))
            seconds = clock() - begun
    finally:
        torch.set_num_threads(threads)
    n_copies = parts[0].encoding.n_copies if model.stretched else 0
    groups_left = n_groups - (1 if protocol.validation == "held-out-speed" else 2)
    available = len(lead) * n_recordings * groups_left / n_groups
    learnt = min(available, originals(n_copies, protocol, configs[0].training_samples) or np.inf)
    copies = n_copies + protocol.keep_originals if n_copies else 1
    epochs = expected_epochs(model, configs[0], round(learnt * copies)) if looped else None
    fold_s = seconds / len(parts[0].fold.train) * learnt * (epochs or 1)
    return Work(model.name, protocol.name, folds, fold_s, epochs, learnt * copies)


def on_gpu(recipe: Recipe) -> bool:
    """Tell whether networks are trained on a GPU."""
    return recipe.options.device != "cpu" and torch.cuda.is_available()


def _in_one_epoch(config: TrainingConfig) -> TrainingConfig:
    every = {"training_samples": None, "validation_samples": None, "patience": None}
    staged = {"image_epochs": min(1, config.image_epochs)}
    return config.model_copy(update={"max_epochs": 1, "passes": None, **every, **staged})


def _as_of_all(samples: Samples, each: int) -> tuple[Samples, Fold]:
    """Return samples, these again and again, as if of all textures and speeds, and a fold."""
    n = each * TEXTURES * SPEEDS
    number = np.arange(n) // each
    speed = 1.0 + number // TEXTURES
    labels: dict[str, NDArray[np.generic]] = {
        dims.TEXTURE: (number % TEXTURES).astype(np.str_),
        dims.SPEED: speed,
        dims.RECORDING: number.astype(np.str_),
    }
    some = samples.isel({dims.SAMPLE: np.arange(n) % len(samples)}).assign_coords(
        {name: (dims.SAMPLE, values) for name, values in labels.items()}
    )
    train, validation, test = map(np.flatnonzero, (speed > 2.0, speed == 2.0, speed == 1.0))
    return some, Fold(1.0, 2.0, train, validation, test)


def expected_epochs(model: Model, config: TrainingConfig, n: int) -> float:
    """Return how many epochs a fold is taken to need, of n training samples.

    Where training stops early nobody knows: as many as the authors' logs have in the mean, or for
    other models all.
    """
    logged = published_costs().get(model.name)
    if config.image_epochs:
        return float(config.of_images().epochs(n * config.frames_a_run))
    if config.patience is None or logged is None:
        return float(config.epochs(n))
    return min(config.max_epochs, max(config.patience + 1, logged.epochs))
