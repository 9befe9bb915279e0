"""What is asked of sources before they are opened."""

from dataclasses import dataclass

from afferents.live.events import Channel
from afferents.markers import Sensor

BOTH: frozenset[Channel] = frozenset({"video", "audio"})


@dataclass(frozen=True)
class Wanted:
    """What a camera and a microphone are to give.

    Attributes
    ----------
    channels
        Which are opened; others are not needed.
    sensor
        That the camera looks at; None where nobody has described it.
    fps_hz
        Frames a second; None for the camera's own.
    sample_rate_hz, n_channels
        Of the microphone.
    """

    channels: frozenset[Channel] = BOTH
    sensor: Sensor | None = None
    fps_hz: float | None = None
    sample_rate_hz: float = 44100.0
    n_channels: int = 1
