"""One model's opinion over time: percepts from samples, and the evidence they add up to."""

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.core.evidence import SURE, Evidence
from afferents.live.images import FrameImages
from afferents.live.network import Network
from afferents.live.percept import Counters, Percept, State
from afferents.live.quality import Quality
from afferents.live.session import Session


class ModelSession(Session):
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
        self._evidence = Evidence(len(self.card.textures), self.card.evidence_per_s)

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
