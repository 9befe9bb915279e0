"""How fast clocks of devices go apart from this machine's."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from afferents.pipeline.record.gate import Check
from afferents.pipeline.record.sound_clock import LIMIT_FRAMES, SURE, Drift

_PARTS = 6
"""Of the time that was looked at; in each, what arrived with the least delay counts."""


def drift_of(own_s: Sequence[float], arrived_s: Sequence[float]) -> Drift:
    """Return how a clock drifts, from its times and when this machine heard of them, s.

    What arrives late says nothing of the clock: of each sixth of the time only what arrived soonest
    is taken, and a straight line is laid through these.

    Examples
    --------
    >>> own = [0.01 * n for n in range(150)]
    >>> drift_of(own, [1.001 * t + 0.005 for t in own]).said()
    '-999 ppm (error 0)'
    """
    own, arrived = np.array(own_s), np.array(arrived_s)
    soonest = [_soonest(part, own, arrived) for part in np.array_split(np.arange(len(own)), _PARTS)]
    time = arrived[soonest] - arrived[soonest].mean()
    ahead = own[soonest] - arrived[soonest]
    slope = float((time * ahead).sum() / (time**2).sum())
    rest = ahead - ahead.mean() - slope * time
    error = float(np.sqrt((rest**2).sum() / (_PARTS - 2) / (time**2).sum()))
    return Drift(slope, error)


def _soonest(
    part: NDArray[np.int64], own: NDArray[np.float64], arrived: NDArray[np.float64]
) -> int:
    return int(part[np.argmin(arrived[part] - own[part])])


def clocks(camera: Drift, microphone: Drift | None, fps_hz: float, run_s: float) -> Check:
    """Judge whether sound and picture stay together for a run.

    The camera's is the clock of its frames' times, the microphone's that of its samples.
    """
    limit = LIMIT_FRAMES / fps_hz / run_s
    said = f"camera {camera.said()}"
    apart = camera
    if microphone is not None:
        apart = Drift(
            camera.share - microphone.share, float(np.hypot(camera.error, microphone.error))
        )
        said += f", microphone {microphone.said()} from this machine's, {apart.said()} apart"
    else:
        said += " from this machine's"
    passes = abs(apart.share) <= limit + SURE * apart.error
    found = f"{said}; half a frame in a run is {1e6 * limit:.0f} ppm"
    return Check("clocks", passes, found, "make runs shorter, or take another sound card or camera")
