"""What is said of a sense over time: by a model, or looking on without one."""

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.live.events import Channel
from afferents.live.images import FrameImages
from afferents.live.network import Network
from afferents.live.percept import Counters, Percept, State
from afferents.live.quality import Quality
from afferents.models.evidence import SURE, EvidenceAccumulator


class PredictionSession(ABC):
    """Says what it makes of one sense's samples, a percept each.

    Parameters
    ----------
    name
        That its percepts carry.
    counters, quality
        Of the sense that it listens to; a copy goes out with every percept.
    """

    textures: Sequence[str] = ()
    """That it tells apart; none where it only looks."""

    def __init__(self, name: str, counters: Counters, quality: Quality) -> None:
        """Start without troubles."""
        self.name = name
        self.truth: str | None = None
        self._counters, self._quality = counters, quality
        self._troubles: list[str] = []

    @abstractmethod
    def introduction(self) -> dict[str, Any]:
        """Return what a page says of it once, ready for JSON."""

    def begin(self) -> None:
        """Another touch begins."""
        self.skip()

    @abstractmethod
    def skip(self) -> None:
        """Begin anew: what comes next does not follow what came before."""

    @abstractmethod
    def see(
        self, felt: FrameImages, time_s: float, every_s: float, arrived_s: float
    ) -> Percept | None:
        """Say what a frame shows; None where that takes more of them. See `feel`."""

    @abstractmethod
    def feel(
        self, sample: NDArray[np.float32], time_s: float, every_s: float, arrived_s: float
    ) -> Percept | None:
        """Say what a sample is; None where that takes more of them.

        Parameters
        ----------
        sample
            As the sense's encoding makes it.
        time_s
            Its end, s.
        every_s
            How often samples come, s.
        arrived_s
            When the last of it came, on the monotonic clock.
        """

    def interrupt(self, trouble: str) -> None:
        """Say it with the next percept."""
        self._troubles.append(trouble)

    def without(self, state: State, time_s: float) -> Percept:
        """Say that nothing fresh is known."""
        return self._percept(state, time_s)

    def _percept(self, state: State, time_s: float, **felt: Any) -> Percept:
        troubles, self._troubles = tuple(self._troubles), []
        return Percept(
            model=self.name,
            state=state,
            time_s=time_s,
            counters=self._counters.copy(),
            quality=dict(self._quality.numbers),
            troubles=troubles,
            truth=self.truth,
            **felt,
        )


# Looking on without a model: percepts that say when, how well, and nothing of texture.

NAMES: dict[Channel, str] = {"video": "camera", "audio": "microphone"}
"""That percepts carry where a model's would be."""


class LookSession(PredictionSession):
    """Says of every sample that it came, and of what quality the sense is.

    Parameters
    ----------
    channel
        Of the sense.
    counters, quality
        As for `Session`.
    """

    def __init__(self, channel: Channel, counters: Counters, quality: Quality) -> None:
        """Name it after what is looked at."""
        super().__init__(NAMES[channel], counters, quality)

    def introduction(self) -> dict[str, Any]:
        """Return what a page says of it once, ready for JSON."""
        title = self.name.title()
        return {"model": self.name, "title": title, "textures": [], "description": []}

    def skip(self) -> None:
        """Nothing is kept from one sample to the next."""

    def see(self, felt: FrameImages, time_s: float, every_s: float, arrived_s: float) -> Percept:
        """Say how many of a frame's markers are found."""
        return self._looked(time_s, arrived_s, markers_found=float(felt.detected.mean()))

    def feel(
        self, sample: NDArray[np.float32], time_s: float, every_s: float, arrived_s: float
    ) -> Percept:
        """Say that a sample came."""
        return self._looked(time_s, arrived_s)

    def _looked(self, time_s: float, arrived_s: float, **found: float) -> Percept:
        latency_ms = 1000 * (time.monotonic() - arrived_s)
        return self._percept("looking", time_s, latency_ms=latency_ms, **found)


# One model's opinion over time: percepts from samples, and the evidence they add up to.


class ModelSession(PredictionSession):
    """A network and what it has felt of this touch.

    Parameters
    ----------
    network
        The model.
    counters, quality
        As for `Session`.
    """

    def __init__(self, network: Network, counters: Counters, quality: Quality) -> None:
        """Start without evidence."""
        super().__init__(network.card.model, counters, quality)
        self.network, self.card = network, network.card
        self.textures = self.card.textures
        self._evidence = EvidenceAccumulator(len(self.card.textures), self.card.evidence_per_s)

    def introduction(self) -> dict[str, Any]:
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

    def see(
        self, felt: FrameImages, time_s: float, every_s: float, arrived_s: float
    ) -> Percept | None:
        """Say what a frame is, by the network's channel; None where it lacks that."""
        network = self.network
        image = (felt.images if network.of_pixels else felt.markers).get(network.channel.name)
        if image is None:
            return None
        found = float(felt.detected.mean())
        return self.feel(image, time_s, every_s, arrived_s, found)

    def feel(
        self,
        sample: NDArray[np.float32],
        time_s: float,
        every_s: float,
        arrived_s: float,
        markers_found: float | None = None,
    ) -> Percept | None:
        """Say what a sample is; None until a run of images is full. See `Session.feel`."""
        outcome = self.network.feel(sample)
        if outcome is None:
            return None
        unknown = not (outcome.novelty <= 1 and np.isfinite(outcome.probabilities).all())
        if unknown:
            self._evidence.fade(time_s)
        else:
            self._evidence.add(time_s, outcome.probabilities, every_s)
        return self._percept(
            "unknown" if unknown else "texture",
            time_s,
            texture=None if unknown else self.card.textures[int(outcome.probabilities.argmax())],
            probabilities=self._named(outcome.probabilities),
            novelty=outcome.novelty,
            latency_ms=1000 * (time.monotonic() - arrived_s),
            markers_found=markers_found,
        )

    def _percept(self, state: State, time_s: float, **felt: Any) -> Percept:
        evidence = self._named(no_surer(self._evidence.probabilities, self.card.most_sure))
        sure_after_s = self._evidence.sure_after_s if self.card.most_sure >= SURE else None
        return super()._percept(state, time_s, evidence=evidence, sure_after_s=sure_after_s, **felt)

    def _named(self, probabilities: NDArray[np.floating]) -> dict[str, float]:
        return dict(zip(self.card.textures, probabilities.tolist(), strict=True))


def no_surer(probabilities: NDArray[np.floating], most: float) -> NDArray[np.floating]:
    """Return probabilities of which none is higher than `most`, evened out as far as that needs."""
    even, highest = 1 / len(probabilities), float(probabilities.max())
    if highest <= most:
        return probabilities
    share = max(0.0, (most - even) / (highest - even))
    return even + share * (probabilities - even)
