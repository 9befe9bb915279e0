"""Who says something of a sensor stream, sample by sample: a model, or nobody but the stream."""

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from afferents.lab.live.images import Filled
from afferents.lab.live.network import Network
from afferents.lab.live.prediction import Counters, Prediction, State
from afferents.lab.live.quality import Quality
from afferents.models.evidence import SURE, EvidenceAccumulator

if TYPE_CHECKING:  # what learns is slow to import
    from afferents.lab.live.lessons import TaughtNetwork


class Reporter:
    """Says of every sample that it came, and of what quality the stream is: there is no model.

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
    spoke
        Whether it has said anything.
    """

    textures: Sequence[str] = ()

    def __init__(self, name: str, counters: Counters, quality: Quality) -> None:
        """Start without troubles."""
        self.name = name
        self.truth: str | None = None
        self.spoke = False
        self._counters, self._quality = counters, quality
        self._troubles: list[str] = []

    def introduce(self) -> dict[str, Any]:
        """Return what a page says of it once, ready for JSON."""
        title = self.name.title()
        return {"model": self.name, "title": title, "textures": [], "description": []}

    def begin(self) -> None:
        """Another recording begins."""
        self.skip()

    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""

    def report_frame(
        self, felt: Filled, time_s: float, every_s: float, arrived_s: float
    ) -> Prediction | None:
        """Say how many of a frame's markers are found. See `report`."""
        found = 1 - felt.touch.lost
        return self.predict("looking", time_s, latency_ms=_since(arrived_s), markers_found=found)

    def report(
        self, sample: NDArray[np.float32], time_s: float, every_s: float, arrived_s: float
    ) -> Prediction | None:
        """Say what a sample is; None where that takes more of them.

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
        return self.predict("looking", time_s, latency_ms=_since(arrived_s))

    def interrupt(self, trouble: str) -> None:
        """Say it with the next prediction."""
        self._troubles.append(trouble)

    def predict(self, state: State, time_s: float, **found: Any) -> Prediction:
        """Say what state it is in, what the stream has counted, and what else was found."""
        self.spoke = True
        troubles, self._troubles = tuple(self._troubles), []
        return Prediction(
            model=self.name,
            state=state,
            time_s=time_s,
            counters=Counters(**vars(self._counters)),
            quality=self._quality.numbers,
            troubles=troubles,
            truth=self.truth,
            **found,
        )


def _since(arrived_s: float) -> float:
    """Return how long ago something arrived, ms."""
    return 1000 * (time.monotonic() - arrived_s)


class ModelReporter(Reporter):
    """Says what a model makes of samples, each alone and all of a touch together.

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
        self.use(network)

    def use(self, network: "Network | TaughtNetwork") -> None:
        """Say from now on what a network recognises."""
        self.network, self.card = network, network.card
        self.textures = self.card.textures
        self._evidence = EvidenceAccumulator(len(self.card.textures), self.card.evidence_per_s)

    def introduce(self) -> dict[str, Any]:
        """Return what a page says of the model once, ready for JSON."""
        return {
            "model": self.name,
            "title": self.card.title,
            "textures": self.card.textures,
            "named_by_spacing": self.card.named_by_spacing,
            "most_sure": self.card.most_sure,
            "description": self.card.describe(),
        }

    def begin(self) -> None:
        """Another touch begins."""
        super().begin()
        self._evidence.reset()

    def skip(self) -> None:
        """Begin a new run of images."""
        self.network.skip()

    def report_frame(
        self, felt: Filled, time_s: float, every_s: float, arrived_s: float
    ) -> Prediction | None:
        """Say what a frame is, by the network's channel; None where it lacks that.

        While nothing touches the skin there is no evidence; a touch begins after that. Before
        anything was taught there is only a look.
        """
        if not self.textures:
            return super().report_frame(felt, time_s, every_s, arrived_s)
        found = 1 - felt.touch.lost
        if found and not felt.touch.touching:
            self.begin()
            latency_ms = _since(arrived_s)
            return self.predict("untouched", time_s, latency_ms=latency_ms, markers_found=found)
        network, name = self.network, self.network.channel.name
        image = felt.image(name) if network.of_pixels else felt.markers.get(name)
        if image is None:
            return None
        return self.report(image, time_s, every_s, arrived_s, found)

    def report(
        self,
        sample: NDArray[np.float32],
        time_s: float,
        every_s: float,
        arrived_s: float,
        markers_found: float | None = None,
    ) -> Prediction | None:
        """Say what a sample is; None until a run of images is full. See `Reporter.report`."""
        outcome = self.network.predict(sample)
        if outcome is None:
            return None
        unknown = not (outcome.novelty <= 1 and np.isfinite(outcome.probabilities).all())
        if unknown:
            self._evidence.fade(time_s)
        else:
            self._evidence.add(time_s, outcome.probabilities, every_s)
        return self.predict(
            "unknown" if unknown else "texture",
            time_s,
            texture=None if unknown else self.card.textures[int(outcome.probabilities.argmax())],
            probabilities=self._by_texture(outcome.probabilities),
            novelty=outcome.novelty,
            latency_ms=_since(arrived_s),
            markers_found=markers_found,
        )

    def predict(self, state: State, time_s: float, **found: Any) -> Prediction:
        """Say also what the touch so far tells. See `Reporter.predict`."""
        most = self.card.most_sure
        evidence = self._by_texture(limit_confidence(self._evidence.probabilities, most))
        sure_after_s = self._evidence.sure_after_s if most >= SURE else None
        return super().predict(state, time_s, evidence=evidence, sure_after_s=sure_after_s, **found)

    def _by_texture(self, probabilities: NDArray[np.floating]) -> dict[str, float]:
        return dict(zip(self.card.textures, probabilities.tolist(), strict=True))


def limit_confidence(probabilities: NDArray[np.floating], most: float) -> NDArray[np.floating]:
    """Return probabilities of which none is higher than `most`, evened out as far as that needs."""
    highest = float(probabilities.max(initial=0))
    if highest <= most or len(probabilities) == 1:
        return probabilities
    even = 1 / len(probabilities)
    share = max(0.0, (most - even) / (highest - even))
    return even + share * (probabilities - even)
