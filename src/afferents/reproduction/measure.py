"""Rates of this machine, measured on a few frames and batches, and what they come to."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import cv2
import torch

from afferents.choices import Cut, Method
from afferents.encodings.samples import Samples
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.encode import Source, best_of, encode, lacking, sources_of
from afferents.evaluation.fold_files import FoldKey, finished
from afferents.evaluation.recipe import Recipe
from afferents.extraction.extract import responses_of, watched
from afferents.folds.held_out import Group
from afferents.folds.protocol import Protocol
from afferents.markers.sensor import Sensors
from afferents.models.config import TrainingConfig
from afferents.models.fitting import learns_in_a_loop, recipe_of
from afferents.models.model import MODELS, Model
from afferents.models.rate import Amounts, Rate, measure_rate
from afferents.recordings.session import Session
from afferents.reporting.published import published_costs
from afferents.reproduction.estimate import (
    Amount,
    Estimate,
    Work,
    amount_of,
    lengthened,
    n_frames,
    typical,
)
from afferents.store.recording import Frame, Recording, Video
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses, responses_there

TRACKED_S = 0.7
"""So long, about, tracking is measured."""
_AFTER_REST = 20
"""So many frames after the rest frame: by then the markers have been found at rest."""
_FEWEST, _MOST = 5, 600
_TRIED = 5
"""So many recordings are tried before it is said that none can be tracked."""


@dataclass
class Clip:
    """The first part of a video, that counts its frames and their processor time.

    Attributes
    ----------
    early
        Frames that are not measured.
    n, seconds
        Frames that were decoded and tracked after these, and how long that took.
    """

    video: Video
    early: int
    n: int = 0
    seconds: float = 0.0

    @property
    def path(self) -> Path:
        """The file."""
        return self.video.path

    @property
    def fps_hz(self) -> float:
        """Nominal frame rate, Hz."""
        return self.video.fps_hz

    @property
    def width(self) -> int:
        """Width, px."""
        return self.video.width

    @property
    def height(self) -> int:
        """Height, px."""
        return self.video.height

    def frames(self) -> Iterator[Frame]:
        """Decode from the start, until enough has been measured."""
        coming = self.video.frames()
        yield from islice(coming, self.early)
        begun = time.process_time()
        for self.n, frame in enumerate(coming, start=1):
            yield frame
            self.seconds = time.process_time() - begun
            enough = self.seconds > TRACKED_S and self.n >= _FEWEST
            if enough or self.n >= _MOST:
                return

    @property
    def frame_s(self) -> float:
        """How long a frame takes in one process, s."""
        return self.seconds / self.n if self.n else 0.0


class Measured(NamedTuple):
    """One recording: as it was read, its responses at full length, and what a frame takes, s."""

    recording: Recording
    responses: Responses
    frame_s: float


def measure_recording(
    recordings: Sequence[Recording], sensors: Sensors, method: Method
) -> Measured:
    """Track the first frames of the first recording that can be; the others will be like it.

    Raises
    ------
    AfferentsError
        If none of the first few recordings can be tracked.
    """
    fault: AfferentsError | None = None
    for recording in recordings[:_TRIED]:
        try:
            return _measured(recording, sensors, method)
        except AfferentsError as error:
            fault = fault or error
    raise fault or InputError("the session: expected a recording that is long enough, found none")


def _measured(recording: Recording, sensors: Sensors, method: Method) -> Measured:
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)  # as every process that extracts has it
    try:
        sensor = sensors.of(recording)
        video, early = recording.video, sensor.rest_frame + _AFTER_REST
        clip = Clip(video, early) if video is not None else None
        found = responses_of(watched(replace(recording, video=clip)), sensor, method)
    finally:
        cv2.setNumThreads(threads)
    return Measured(recording, lengthened(found, recording), clip.frame_s if clip else 0.0)


def measure_encoding(measured: Measured, source: Source, cut: Cut) -> tuple[Samples, float]:
    """Encode the measured recording; return its samples, and how long that took, s.

    Raises
    ------
    InputError
        If it is too short for the cut.
    """
    begun = time.process_time()
    samples = encode(measured.responses, source, cut)
    return samples, time.process_time() - begun


# What the trainings of an evaluation take: each kind of model is measured once.

Left = Callable[[Model, Protocol], int]
"""How many trainings of a model under a protocol are not finished yet."""


@dataclass
class Trainings:
    """Measures trainings on the responses of one recording.

    Attributes
    ----------
    recipe
        What they go by.
    measured
        The recording.
    amount
        How much there is of such recordings.
    """

    recipe: Recipe
    measured: Measured
    amount: Amount
    _samples: dict[Source, tuple[Samples, float]] = field(default_factory=dict)
    _rates: dict[object, Rate] = field(default_factory=dict)

    def works(
        self, models: Sequence[Model], protocols: Sequence[Protocol], left: Left
    ) -> tuple[Work, ...]:
        """Return the work of all models of which something is left to be trained."""
        found: list[Work] = []
        group, before = 0, None
        for model in models:
            sources = sources_of(model, self.recipe.encodings)
            group += sources != before
            before = sources
            for protocol in protocols:
                if n_folds := left(model, protocol):
                    work = self._work(model, protocol)
                    found.append(replace(work, group=group, n_folds=n_folds))
        return tuple(found)

    def _work(self, model: Model, protocol: Protocol) -> Work:
        """Return the work of one fold."""
        if model.parts:  # a fusion learns each of its parts
            parts = [self._work(MODELS[name], protocol) for name in model.parts]
            fold_s, encode_s = (
                sum(getattr(part, name) for part in parts) for name in ("fold_s", "encode_s")
            )
            return replace(parts[0], model=model, fold_s=fold_s, encode_s=encode_s)
        (source,) = sources_of(model, self.recipe.encodings)
        if source not in self._samples:
            self._samples[source] = measure_encoding(self.measured, source, self.recipe.options.cut)
        samples, encode_s = self._samples[source]
        config = self.recipe.options.training(recipe_of(model, source.encoding))
        rate = self._rate(model, source, samples, protocol, config)
        n = len(samples) * self.amount.used
        amounts = amounts_of(n, self.amount.n_groups, protocol)
        if protocol.name == "nested" and not learns_in_a_loop(model):  # it needs no validation
            amounts = amounts._replace(train=amounts.train + amounts.validation)
        epochs = expected_epochs(model, config)
        return Work(
            model,
            protocol.name,
            0,
            rate.fold_s(amounts, protocol, config, epochs),
            1,
            None if rate.whole else epochs,
            rate.learnt(amounts, protocol, config)[0],
            1 / rate.learn_s if rate.learn_s else math.inf,
            encode_s * self.amount.used,
        )

    def _rate(
        self,
        model: Model,
        source: Source,
        samples: Samples,
        protocol: Protocol,
        config: TrainingConfig,
    ) -> Rate:
        """Return the rate of any model that learns such samples in such a way."""
        stretch = protocol.stretch if model.stretched else None
        kind = (id(model.classifier), source.encoding, stretch)
        if kind not in self._rates:
            self._rates[kind] = measure_rate(model, samples, source.encoding, protocol, config)
        return self._rates[kind]


def expected_epochs(model: Model, config: TrainingConfig) -> float:
    """Return how many epochs a fold is taken to need.

    Where training stops early nobody knows: as many as the authors' logs have in the mean, or for
    other models all.
    """
    logged = published_costs().get(model.name)
    if config.patience is None or logged is None:
        return float(config.max_epochs)
    return min(config.max_epochs, max(config.patience + 1, logged.epochs))


def amounts_of(n: float, n_groups: int, protocol: Protocol) -> Amounts:
    """Return how many of `n` samples train, validate and test a fold, if groups are alike."""
    of_group = n / n_groups
    if protocol.validation == "held-out-speed":
        return Amounts(n - of_group, of_group / 2, of_group / 2)
    return Amounts(n - 2 * of_group, of_group, of_group)


# The estimate of a whole reproduction: what is left to be tracked and trained.


def estimate_of(
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
    """Measure this machine on a few frames and batches, and multiply.

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
        If no recording can be tracked, or what is measured is too short to be encoded.
    """
    missing = [r for r in session.recordings if not _is_there(store, r)]
    candidates = typical(session.recordings, recipe.options.cut, recipe.options.steady)
    measured = (
        measure_recording(candidates, sensors, method) if missing else _stored(candidates, store)
    )
    able = [model for model in recipe.models if lacking(model, [measured.responses]) is None]
    best = best_of([measured.responses]) if with_best else None
    models = able if best is None or best in able else [*able, best]
    options = recipe.options
    how = options.cut, recipe.split, held_out, options.ablation, options.steady
    amount = amount_of(session, measured.recording, *how)

    def left(model: Model, protocol: Protocol) -> int:
        keys = (
            FoldKey.of(model.name, protocol.name, seed, group, recipe.split)
            for seed in seeds
            for group in amount.groups
        )
        return sum(not finished(recipe.out, key) for key in keys)

    trainings = Trainings(replace(recipe, models=models), measured, amount)
    return Estimate(
        float(sum(n_frames(recording) for recording in missing)),
        measured.frame_s,
        len(missing),
        trainings.works(models, protocols, left),
        recipe.options.device != "cpu" and torch.cuda.is_available(),
    )


def _stored(recordings: Sequence[Recording], store: Path) -> Measured:
    """Return a recording that has been extracted: nothing is left to be tracked."""
    if not recordings:
        raise InputError("the session: expected a recording that is long enough, found none")
    first = recordings[0]
    there = {str(responses.attrs["name"]): responses for responses in open_responses(store)}
    return Measured(first, there[first.name], 0.0)


def _is_there(store: Path, recording: Recording) -> bool:
    return responses_there(store, recording.name) is not None
