"""What a tracker noticed on its way: identities in danger, and names put right."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents.markers.detect import Positions


class Found(Protocol):
    """Where markers are in a frame."""

    @property
    def position(self) -> Positions:
        """Shape (n, 2), px; NaN where a marker is lost."""
        ...

    @property
    def detected(self) -> NDArray[np.bool_]:
        """Which were seen, shape (n,)."""
        ...


@dataclass
class Audit:
    """How often identities were in danger.

    Attributes
    ----------
    shared
        Two markers held one blob; the one farther from its expected place was lost.
    strangers
        A marker did not move with its neighbours and was lost.
    jumps
        Frames whose common shift had to be searched.
    searches
        Frames in which the whole picture was searched for blobs.
    checks
        Frames in which names were in doubt and were checked by the layout's order.
    slips
        Of these, those in which markers had slipped to their neighbours' blobs, and were put right.
    """

    shared: int = 0
    strangers: int = 0
    jumps: int = 0
    searches: int = 0
    checks: int = 0
    slips: int = 0


class Renamed(NamedTuple):
    """Markers that had slipped: which, (n,), and since at most how many frames."""

    which: NDArray[np.bool_]
    n_frames: int

    def lose(self, tracked: Sequence[Found]) -> None:
        """Lose them in the frames before they were found slipped, back to the last check."""
        for frame in tracked[-self.n_frames : -1]:
            frame.position[self.which] = np.nan
            frame.detected[self.which] = False
