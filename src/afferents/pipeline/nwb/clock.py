"""One clock for a whole session: recordings are laid one after another."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.responses import Responses

GAP_S = 1.0
"""Between recordings: nobody knows how long it really was."""


@dataclass(frozen=True)
class Laid:
    """A recording's place on the session's clock.

    Attributes
    ----------
    responses
        Of the recording.
    start_s, stop_s
        When it began and ended.
    """

    responses: Responses
    start_s: float
    stop_s: float

    @property
    def name(self) -> str:
        """Its name, as a file's object may be called: without slashes."""
        return str(self.responses.attrs["name"]).replace("/", "_").replace(":", "_")

    @property
    def frame_times_s(self) -> NDArray[np.float64]:
        """`(time,)`, when its frames were taken, on the session's clock."""
        return self.start_s + np.asarray(self.responses[dims.TIME].values, np.float64)

    @property
    def sample_rate_hz(self) -> float:
        """Of its vibration."""
        return float(self.responses[dims.RA2].attrs[dims.SAMPLE_RATE])


def laid_out(recordings: Sequence[Responses]) -> list[Laid]:
    """Return recordings one after another, each from a whole second on.

    A store does not say at which time of day each recording was made, and NWB has one clock: it
    counts from the first recording's beginning.
    """
    found, start_s = [], 0.0
    for responses in recordings:
        stop_s = start_s + _duration_s(responses)
        found.append(Laid(responses, start_s, stop_s))
        start_s = float(np.ceil(stop_s + GAP_S))
    return found


def _duration_s(responses: Responses) -> float:
    """Return how long a recording lasts: its video or its sound, whichever is longer."""
    ends = [0.0]
    if dims.TIME in responses.coords:
        ends.append(float(responses[dims.TIME][-1]))
    if dims.RA2 in responses:
        rate = responses[dims.RA2].attrs[dims.SAMPLE_RATE]
        ends.append(responses.sizes[dims.AUDIO_TIME] / float(rate))
    return max(ends)
