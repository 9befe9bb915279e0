"""A prediction: one message a sample, with everything that shows how far to trust it."""

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal

State = Literal["texture", "unknown", "untouched", "looking", "waiting", "stalled"]


@dataclass
class Counters:
    """What went wrong since the stream began.

    Attributes
    ----------
    frames, samples
        Taken in.
    dropped, lost_samples
        Missing, as the clocks show.
    doubled, torn, late
        Frames that came twice, came in part, or came so late that they show the past.
    troubles
        Everything that sources reported.
    """

    frames: int = 0
    samples: int = 0
    dropped: int = 0
    lost_samples: int = 0
    doubled: int = 0
    torn: int = 0
    late: int = 0
    troubles: int = 0


@dataclass(frozen=True)
class Prediction:
    """What a model recognises at one time, or what comes in without one.

    Attributes
    ----------
    model
        Its model, such as ``ra-ste``; ``camera`` or ``microphone`` where there is none.
    state
        ``texture``; ``unknown`` where nothing that was learnt fits; ``untouched`` while all markers
        lie where they were at rest, so that a touch is yet to begin; ``looking`` without a model;
        ``waiting`` before there is enough to classify; ``stalled`` where the source went silent or
        lags: nothing fresh is known.
    time_s
        End of the sample that it is of, on the video's clock, s.
    texture
        The likeliest; None unless the state is ``texture``.
    probabilities
        Of each texture, from this sample alone, calibrated; empty if nothing fresh is known.
    novelty
        Above 1 nothing that was learnt fits.
    evidence
        Of each texture, from all of the touch so far.
    sure_after_s
        How long the touch took until one texture had 95% of the evidence; None before that.
    latency_ms
        From the arrival of the sample's last frame or sound to this prediction.
    markers_found
        Share of the markers seen in the frame; None for vibration.
    counters
        See `Counters`.
    quality
        How good what comes in is, over the last second, by name; see `live.quality`.
    troubles
        What sources reported since the model's last prediction.
    truth
        What is touched, where the source knows.
    """

    model: str
    state: State
    time_s: float
    texture: str | None = None
    probabilities: Mapping[str, float] = field(default_factory=dict)
    novelty: float | None = None
    evidence: Mapping[str, float] = field(default_factory=dict)
    sure_after_s: float | None = None
    latency_ms: float | None = None
    markers_found: float | None = None
    counters: Counters = field(default_factory=Counters)
    quality: Mapping[str, float] = field(default_factory=dict)
    troubles: tuple[str, ...] = ()
    truth: str | None = None

    @property
    def fresh(self) -> bool:
        """Whether it is of what is touched now."""
        return self.state in ("texture", "unknown", "untouched", "looking")

    def to_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {**asdict(self), "fresh": self.fresh}


SHOWN_S = 1.0
"""Troubles are shown for this time: predictions of frames that follow hold none."""


class Newest:
    """The newest prediction of each name, with its troubles of the last second.

    Attributes
    ----------
    predictions
        By name: a prediction, and when it was taken, on the monotonic clock, s.
    """

    def __init__(self) -> None:
        """Nothing has come yet."""
        self.predictions: dict[str, tuple[Prediction, float]] = {}
        self._troubles: dict[str, tuple[tuple[str, ...], float]] = {}

    def take(self, prediction: Prediction) -> None:
        """Keep a prediction until the next of its name."""
        name, now_s = prediction.model, time.monotonic()
        if prediction.troubles:
            self._troubles[name] = prediction.troubles, now_s
        troubles, reported_s = self._troubles.get(name, ((), -math.inf))
        if now_s - reported_s < SHOWN_S:
            prediction = replace(prediction, troubles=troubles)
        self.predictions[name] = prediction, now_s
