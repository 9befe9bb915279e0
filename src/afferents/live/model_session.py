"""One model's opinion over time: percepts from samples, and the evidence they add up to."""

import time

import numpy as np
from numpy.typing import NDArray

from afferents.core.evidence import Evidence
from afferents.live.network import Network
from afferents.live.percept import Counters, Percept, State


class ModelSession:
    """A network and what it has felt of this touch.

    Parameters
    ----------
    network
        The model.
    counters
        Of the sense that it listens to; a copy goes out with every percept.
    """

    def __init__(self, network: Network, counters: Counters) -> None:
        """Start without evidence."""
        self.network, self.card = network, network.card
        self.truth: str | None = None
        self._counters = counters
        self._evidence = Evidence(len(self.card.textures), self.card.evidence_per_s)
        self._troubles: list[str] = []

    def begin(self) -> None:
        """Another touch begins."""
        self.network.skip()
        self._evidence.reset()

    def interrupt(self, trouble: str) -> None:
        """Say it with the next percept."""
        self._troubles.append(trouble)

    def feel(
        self,
        sample: NDArray[np.float32],
        time_s: float,
        every_s: float,
        arrived_s: float,
        markers_found: float | None = None,
    ) -> Percept | None:
        """Say what a sample is; None until a run of images is full.

        Parameters
        ----------
        sample
            As the network takes it.
        time_s
            Its end, s.
        every_s
            How often samples come, s.
        arrived_s
            When the last of it came, on the monotonic clock.
        """
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

    def without(self, state: State, time_s: float) -> Percept:
        """Say that nothing fresh is known."""
        return self._percept(state, time_s)

    def _percept(self, state: State, time_s: float, **felt: object) -> Percept:
        troubles, self._troubles = tuple(self._troubles), []
        return Percept(
            model=self.card.model,
            state=state,
            time_s=time_s,
            evidence=self._named(self._evidence.probabilities),
            sure_after_s=self._evidence.sure_after_s,
            counters=self._counters.copy(),
            troubles=troubles,
            truth=self.truth,
            **felt,  # type: ignore[arg-type]
        )

    def _named(self, probabilities: NDArray[np.floating]) -> dict[str, float]:
        return dict(zip(self.card.textures, probabilities.tolist(), strict=True))
