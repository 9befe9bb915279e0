"""From frames to percepts, by SA-I and RA-I."""

from collections.abc import Sequence
from typing import Self

from afferents.core.errors import InputError
from afferents.live.events import Begin, CameraFrame, Trouble
from afferents.live.images import SHOWN, FrameByFrame, FrameImages, Images
from afferents.live.network import Network
from afferents.live.percept import Percept
from afferents.live.raster import MarkerRaster
from afferents.live.sense import Sense, require_alike
from afferents.live.video_quality import VideoQuality
from afferents.markers import Sensor

MISSING = 1.7
"""Frames farther apart than this multiple of their period have lost others between them."""
DOUBLED = 0.25
"""A frame that comes within this share of the period is the one before once more."""


class VideoSense(Sense):
    """A sensor's camera: what models feel by it, or what is to be seen.

    Parameters
    ----------
    images
        Which follow the sensor's markers.
    rate_hz
        Frames a second.
    networks
        Models of this sensor; none to look only.
    """

    raster: MarkerRaster | None = None

    def __init__(
        self, images: FrameByFrame, rate_hz: float, networks: Sequence[Network] = ()
    ) -> None:
        """Wait for the rest frame."""
        self.picture_quality = VideoQuality(rate_hz)
        super().__init__("video", rate_hz, networks, self.picture_quality)
        self.felt: FrameImages | None = None
        self.picture: CameraFrame | None = None
        self.images = images
        self._last_s: float | None = None

    @classmethod
    def of(cls, networks: Sequence[Network]) -> Self:
        """Return the sense by which one or more models feel.

        Raises
        ------
        InputError
            If they learnt from different sensors or frame rates.
        """
        card = networks[0].card
        require_alike(networks, ("sensor", "fps_hz"), "sensor and frame rate")
        sensor = networks[0].part(Sensor, card.sensor, "a sensor file")
        felt_by = {network.channel for network in networks}
        assert card.fps_hz is not None
        return cls(Images(sensor, {*SHOWN, *felt_by}), card.fps_hz, networks)

    def begin(self, event: Begin) -> None:
        """Wait for the rest frame of another recording."""
        self.images.begin()
        self.felt = self._last_s = None
        super().begin(event)

    def skip(self) -> None:
        """Begin anew: frames are missing before the next one."""
        self.images.skip()
        if self.raster is not None:
            self.raster.skip()
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
            felt = self.felt = self.images.feed(picture.frame)
        except InputError as error:
            self.images.begin()
            self.felt = None
            self.picture_quality.take(picture, None)
            return self.interrupt(Trouble("video", picture.time_s, str(error)), "waiting")
        self.picture_quality.take(picture, felt)
        late = self.is_late(picture.time_s, picture.arrived_s)
        if felt is None:
            return []
        if self.raster is not None:
            self.raster.take(picture.time_s, felt)
        if late:
            super().skip()  # the networks have not seen it; RA-I has
            return self.without("stalled")
        said = [
            session.see(felt, self.now_s, self.every_s, picture.arrived_s)
            for session in self.sessions
        ]
        return [percept for percept in said if percept is not None]

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
