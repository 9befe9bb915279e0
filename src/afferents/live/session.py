"""What is said of a sense over time: the base of models, and of looking on without one."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from afferents.live.images import FrameImages
from afferents.live.percept import Counters, Percept, State
from afferents.live.quality import Quality


class Session(ABC):
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
