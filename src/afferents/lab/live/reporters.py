"""What reports on a sensor stream, sample by sample: a model, or the stream alone without one."""

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Counters, Prediction, State
from afferents.lab.live.quality import Quality
from afferents.lab.live.touch import Filled
from afferents.models.evidence import SURE, EvidenceAccumulator

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import TaughtNetwork


class Reporter:
    """Reports of every sample that it came, and of what quality the stream is: there is no model.

    Parameters
    ----------
    name
        That its predictions carry.
    counters, quality
        Of the stream; a copy goes out with every prediction.

    Attributes
    ----------
    textures
        Among which it decides; none without a model.
    truth
        What is touched, where the source knows.
    has_reported
        Whether it has made any prediction.
    """

    textures: Sequence[str] = ()

    def __init__(self, name: str, counters: Counters, quality: Quality) -> None:
        """Start without troubles."""
        self.name = name
        self.truth: str | None = None
        self.has_reported = False
        self._counters, self._quality = counters, quality
        self._troubles: list[str] = []

    def introduce(self) -> dict[str, Any]:
        """Return what a page shows of it once, ready for JSON."""
        title = self.name.title()
        return {"model": self.name, "title": title, "textures": [], "description": []}

    def begin(self) -> None:
        """Forget what was touched: another recording begins."""

    def note(self, *troubles: str) -> None:
        """Report them with the next prediction."""
        self._troubles += troubles

    def report_touch(
        self, filled: Filled, time_s: float, every_s: float, arrived_s: float, is_late: bool
    ) -> Prediction | None:
        """Report how many of a frame's markers are found; nothing fresh if it is late.

        See `report` for the other parameters.
        """
        if is_late:
            return self.predict("stalled", time_s)
        return self.predict("looking", time_s, arrived_s, markers_found=1 - filled.touch.lost)

    def report(
        self, sample: NDArray[np.float32], time_s: float, every_s: float, arrived_s: float
    ) -> Prediction | None:
        """Report what a sample is; None where that takes more of them.

        Parameters
        ----------
        sample
            As the stream's encoding makes it.
        time_s
            Its end, s.
        every_s
            How often samples come, s.
        arrived_s
            When the last of it came, on the monotonic clock.
        """
        return self.predict("looking", time_s, arrived_s)

    def predict(
        self, state: State, time_s: float, arrived_s: float | None = None, **found: Any
    ) -> Prediction:
        """Return a prediction of a state, with what the stream has counted and what was found."""
        self.has_reported = True
        troubles, self._troubles = tuple(self._troubles), []
        return Prediction(
            model=self.name,
            state=state,
            time_s=time_s,
            latency_ms=None if arrived_s is None else 1000 * (time.monotonic() - arrived_s),
            counters=Counters(**vars(self._counters)),
            quality=self._quality.numbers,
            troubles=troubles,
            truth=self.truth,
            **found,
        )


class ModelReporter(Reporter):
    """Reports what a model makes of samples, each alone and all of a touch together.

    Parameters
    ----------
    network
        The model.
    counters, quality
        As for `Reporter`.
    """

    def __init__(
        self, network: "Network | TaughtNetwork", counters: Counters, quality: Quality
    ) -> None:
        """Start without evidence."""
        super().__init__(network.card.model, counters, quality)
        self._rest: NDArray[np.floating] | None = None
        self.use(network)

    def use(self, network: "Network | TaughtNetwork") -> None:
        """Report from now on what a network recognises."""
        self.network, self.card = network, network.card
        self.textures = self.card.textures
        self._evidence = EvidenceAccumulator(len(self.card.textures), self.card.evidence_per_s)

    def introduce(self) -> dict[str, Any]:
        """Return what a page shows of the model once, ready for JSON."""
        return {
            "model": self.name,
            "title": self.card.title,
            "textures": self.card.textures,
            "named_by_spacing": self.card.named_by_spacing,
            "most_sure": self.card.most_sure,
            "description": self.card.describe(),
        }

    def begin(self) -> None:
        """Forget evidence and the run of images: another touch begins."""
        self.network.skip()
        self._evidence.reset()

    def report_touch(
        self, filled: Filled, time_s: float, every_s: float, arrived_s: float, is_late: bool
    ) -> Prediction | None:
        """Report what a frame is, by the network's channel; None where it lacks that.

        While nothing touches the skin there is no evidence; a touch begins after that. Before
        anything was taught there is only a look.
        """
        touch = filled.touch
        if touch.now.rest is not self._rest:  # what was recognised before counted from another
            self._rest = touch.now.rest
            self.begin()
        if touch.before is None or is_late:
            self.network.skip()
        if is_late or not self.textures:
            return super().report_touch(filled, time_s, every_s, arrived_s, is_late)
        found = 1 - touch.lost
        if found and not touch.touching:
            self.begin()
            return self.predict("untouched", time_s, arrived_s, markers_found=found)
        network, name = self.network, self.network.channel.name
        image = filled.image(name) if network.of_pixels else filled.markers.get(name)
        return None if image is None else self.report(image, time_s, every_s, arrived_s, found)

    def report(
        self,
        sample: NDArray[np.float32],
        time_s: float,
        every_s: float,
        arrived_s: float,
        markers_found: float | None = None,
    ) -> Prediction | None:
        """Report what a sample is; None until a run of images is full. See `Reporter.report`."""
        outcome = self.network.predict(sample)
        if outcome is None:
            return None
        probabilities, novelty = outcome
        unknown = not (novelty <= 1 and np.isfinite(probabilities).all())
        if unknown:
            self._evidence.fade(time_s)
        else:
            self._evidence.add(time_s, probabilities, every_s)
        return self.predict(
            "unknown" if unknown else "texture",
            time_s,
            arrived_s,
            texture=None if unknown else self.textures[int(probabilities.argmax())],
            probabilities=dict(zip(self.textures, probabilities.tolist(), strict=True)),
            novelty=novelty,
            markers_found=markers_found,
        )

    def predict(
        self, state: State, time_s: float, arrived_s: float | None = None, **found: Any
    ) -> Prediction:
        """Add what the touch so far shows. See `Reporter.predict`."""
        so_far = limit_confidence(self._evidence.probabilities, self.card.most_sure)
        found["evidence"] = dict(zip(self.textures, so_far.tolist(), strict=True))
        found["sure_after_s"] = self._evidence.sure_after_s if self.card.most_sure >= SURE else None
        return super().predict(state, time_s, arrived_s, **found)


def limit_confidence(probabilities: NDArray[np.floating], most: float) -> NDArray[np.floating]:
    """Return probabilities of which none is higher than `most`, evened out as far as that needs."""
    highest = float(probabilities.max(initial=0))
    if highest <= most or len(probabilities) == 1:
        return probabilities
    even = 1 / len(probabilities)
    share = max(0.0, (most - even) / (highest - even))
    return even + share * (probabilities - even)
