"""From frames to percepts, by SA-I and RA-I."""

from afferents.core.errors import InputError
from afferents.live.events import Begin, CameraFrame, Trouble
from afferents.live.images import SHOWN, FrameImages, Images
from afferents.live.network import Network
from afferents.live.percept import Percept
from afferents.live.sense import Sense, require_alike
from afferents.markers import Sensor

MISSING = 1.7
"""Frames farther apart than this multiple of their period have lost others between them."""
DOUBLED = 0.25
"""A frame that comes within this share of the period is the one before once more."""


class VideoSense(Sense):
    """Models of one sensor that feel by its camera.

    Parameters
    ----------
    networks
        One or more.

    Raises
    ------
    InputError
        If they learnt from different sensors or frame rates.
    """

    def __init__(self, networks: list[Network]) -> None:
        """Wait for the rest frame."""
        card = networks[0].card
        super().__init__("video", networks, card.fps_hz)
        require_alike(networks, ("sensor", "fps_hz"), "sensor and frame rate")
        self.sensor = networks[0].part(Sensor, card.sensor, "a sensor file")
        self.felt: FrameImages | None = None
        self.picture: CameraFrame | None = None
        felt_by = {network.channel for network in networks}
        self._images = Images(self.sensor, {*SHOWN, *felt_by})
        self._last_s: float | None = None

    def begin(self, event: Begin) -> None:
        """Wait for the rest frame of another recording."""
        self._images.begin()
        self._last_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next one."""
        self._images.skip()
        super().skip()

    def see(self, picture: CameraFrame) -> list[Percept]:
        """Take in a frame."""
        self.counters.frames += 1
        if picture.torn:
            self.counters.torn += 1
            self._last_s = picture.time_s
            self.skip()
            return []
        if self._comes_twice(picture.time_s):
            self.counters.doubled += 1
            return []
        self.now_s = picture.time_s + 1 / self.rate_hz
        self.picture = picture
        try:
            felt = self.felt = self._images.feed(picture.frame)
        except InputError as error:
            self._images.begin()
            return self.interrupt(Trouble("video", picture.time_s, str(error)), "waiting")
        late = self.is_late(picture.time_s, picture.arrived_s)
        if felt is None:
            return []
        if late:
            super().skip()  # the networks have not seen it; RA-I has
            return self.without("stalled")
        return self._feel(felt, picture.arrived_s)

    def _feel(self, felt: FrameImages, arrived_s: float) -> list[Percept]:
        percepts = []
        for session in self.sessions:
            network = session.network
            image = (felt.images if network.of_pixels else felt.markers).get(network.channel.name)
            if image is not None:
                found = float(felt.detected.mean())
                percept = session.feel(image, self.now_s, self.every_s, arrived_s, found)
                percepts += [percept] if percept else []
        return percepts

    def _comes_twice(self, time_s: float) -> bool:
        """Tell whether a frame is the last once more; count those missing before it."""
        last = self._last_s
        periods = 1.0 if last is None else (time_s - last) * self.rate_hz
        if periods < DOUBLED:
            return True
        if periods > MISSING:
            self.counters.dropped += round(periods) - 1
            self.skip()
        self._last_s = time_s
        return False
