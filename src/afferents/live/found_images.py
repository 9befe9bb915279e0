"""Images of a sensor that nobody has described: its markers are found while they are at rest."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.recording import Frame, Video
from afferents.live.images import FrameImages, Images
from afferents.markers import Sensor
from afferents.markers.calibrate import calibrate
from afferents.markers.rest import N_FRAMES

AGAIN_S = 1.0
"""Where there are no markers to be found they are looked for this often, s."""
NAME = "found"
"""Of a sensor that was found here."""


class FoundImages:
    """Finds a sensor's markers in the first frames, as `calibrate` does, and follows them.

    Parameters
    ----------
    sensor
        As it was found before, see `found_in`; None to wait for frames.

    Attributes
    ----------
    sensor
        As it was found; None until then.
    """

    def __init__(self, sensor: Sensor | None = None) -> None:
        """Wait for frames."""
        self.sensor = sensor
        self._images = None if sensor is None else Images(sensor)
        self._first: list[Frame] = []
        self._again_s: float | None = None

    def begin(self) -> None:
        """Begin anew: the next frame is the first of a recording."""
        if self._images is not None:
            self._images.begin()

    def skip(self) -> None:
        """Frames are missing before the next one: it has no RA-I."""
        if self._images is not None:
            self._images.skip()

    def describe(self) -> str:
        """Say in a sentence what was found, or that nothing was."""
        sensor = self.sensor
        if sensor is None:
            return "No sensor file (--sensor): markers are looked for, with the skin at rest."
        n = sensor.n_markers if sensor.markers is None else len(sensor.markers)
        shade = "bright" if sensor.detector.blob_colour else "dark"
        return (
            f"No sensor file (--sensor): {n} {shade} markers were found, in a {sensor.layout} "
            "layout; 'afferents calibrate' writes them to a file, with a picture to check."
        )

    def feed(self, frame: Frame) -> FrameImages | None:
        """Take in the next frame; None until the markers are found.

        Raises
        ------
        InputError
            If these frames show none.
        """
        if self._images is not None:
            try:
                return self._images.feed(frame)
            except InputError:  # the skin has moved since: it is looked for anew
                self._images = self.sensor = None
                raise
        if self._again_s is not None and 0 <= self._again_s - frame.time_s <= AGAIN_S:
            return None
        self._first.append(frame._replace(luma=frame.luma.copy()))
        if len(self._first) == N_FRAMES:
            first, self._first = self._first, []
            self._again_s = frame.time_s + AGAIN_S
            self.sensor = found_in(_Clip(first))
            self._images = Images(self.sensor)
        return None


def found_in(clip: Video) -> Sensor:
    """Return the sensor that a clip shows, which begins with the skin at rest.

    Raises
    ------
    InputError
        If it shows no markers.
    """
    return calibrate(clip, NAME).sensor


@dataclass(frozen=True)
class _Clip:
    """Frames of a running source as a video."""

    taken: Sequence[Frame]
    path: Path = Path("the first pictures")

    @property
    def fps_hz(self) -> float:
        """Frames a second, by their times."""
        span_s = self.taken[-1].time_s - self.taken[0].time_s
        return (len(self.taken) - 1) / span_s if span_s > 0 else 0.0

    @property
    def width(self) -> int:
        """Width, px."""
        return int(self.taken[0].luma.shape[1])

    @property
    def height(self) -> int:
        """Height, px."""
        return int(self.taken[0].luma.shape[0])

    def frames(self) -> Iterator[Frame]:
        """Return them from the first."""
        return iter(self.taken)
