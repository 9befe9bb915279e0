"""Responses as tactile images, frame by frame: the same numbers as offline."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, Channel, Skin
from afferents.errors import InputError
from afferents.filling import Filler
from afferents.live.rest import NewRest, have_moved
from afferents.markers.calibrate import calibrate_from_clips
from afferents.markers.detect import Positions, undistort
from afferents.markers.grid import Grid
from afferents.markers.places import images_of
from afferents.markers.rest import MOST_STALE, N_FRAMES, STILL, check_size, stands_still_again
from afferents.markers.sensor import Sensor
from afferents.markers.track import Tracker
from afferents.store.recording import Frame, GreyImage, Video

Image = NDArray[np.float32]
Response = NDArray[np.floating]
SHOWN = (CHANNELS[dims.SA1], CHANNELS[dims.RA1])
"""Channels that the page shows, whatever models classify by."""


@dataclass(frozen=True, eq=False)
class FrameImages:
    """What one frame shows.

    Attributes
    ----------
    markers
        By name of the channel: (component, marker) in the layout's order. Lost markers are filled
        from their neighbours. Without RA-I where no frame came before.
    position
        Of the markers as the camera sees them, (n, 2), px, NaN where lost.
    detected
        Which were found, (n,).
    grid
        Where each stands in a tactile image.
    now, before
        Where the markers are, as a lens without distortion shows them, and where they are at rest;
        and the same of the frame just before, None where none came.
    """

    markers: Mapping[str, Image]
    position: NDArray[np.float64]
    detected: NDArray[np.bool_]
    grid: Grid
    now: Skin
    before: Skin | None

    @cached_property
    def at_rest(self) -> bool:
        """Whether the markers lie where they were at rest: nothing touches the skin."""
        return bool(self.detected.any() and not have_moved(self.now.distance))

    @property
    def share_found(self) -> float:
        """Share of the markers that were found."""
        return float(np.count_nonzero(self.detected) / len(self.detected))

    def image(self, name: str) -> Image | None:
        """Return the image of a channel, (row, column) or (component, row, column) of a vector.

        None where it has no response to this frame, or none that is an image.
        """
        shown = self.markers.get(name)
        if shown is None or shown.shape[1] != len(self.detected):
            return None
        image = images_of(shown, self.grid.row, self.grid.column)
        return image if len(image) > 1 else image[0]


class Images:
    """Follows the markers of a stream of frames.

    Parameters
    ----------
    sensor
        Which says where its markers are; the frame `sensor.rest_frame` is taken for the skin at
        rest.
    channels
        That `feed` gives; `SHOWN` are added by `show`, for which no prediction waits.

    Attributes
    ----------
    sensor
        Whose markers it follows; None while that is not known.
    rest_said
        Whether rest was set anew with the last frame, and that or why not in a sentence; None if
        nobody asked.

    Raises
    ------
    InputError
        If the sensor file does not say where the markers are.
    """

    def __init__(self, sensor: Sensor, channels: Collection[Channel] = SHOWN) -> None:
        """Wait for the rest frame."""
        if sensor.layout != "square" and sensor.markers is None:
            expected = "a sensor file that says where the markers are"
            where = f"sensor '{sensor.name}'"
            raise InputError(
                f"{where}: expected {expected}, found a {sensor.layout} layout without"
            )
        self.sensor: Sensor | None = sensor
        self._sensor = sensor
        self._channels = channels
        self.begin()

    def begin(self) -> None:
        """Begin anew: the next frame is the first of a recording."""
        self._n = 0
        self._newest: list[GreyImage] = []
        self._begin_at_rest()

    def _begin_at_rest(self) -> None:
        """Take the next frame for the skin at rest."""
        self._tracker: Tracker | None = None
        self._fillers: dict[str, Filler] = {}
        self._now: Skin | None = None
        self._before: Skin | None = None
        self._rest: Positions | None = None
        self._resting: NewRest | None = None
        self.rest_said: tuple[bool, str] | None = None

    def set_rest(self) -> None:
        """Let displacement count from where the next frames show the markers; see `NewRest`."""
        self._resting = NewRest()

    def skip(self) -> None:
        """Frames are missing before the next one: it has no RA-I."""
        self._now = None
        self._newest = []

    def describe(self) -> str:
        """Say in a sentence which sensor is followed."""
        sensor = self._sensor
        n = f", {sensor.n_markers} markers" if sensor.n_markers else ""
        return f"Sensor '{sensor.name}': {sensor.layout} layout{n}."

    def feed(self, frame: Frame) -> FrameImages | None:
        """Take in the next frame; None before the rest frame.

        Raises
        ------
        InputError
            If the rest frame does not show the sensor's markers, or is of another size.
        """
        self._n += 1
        n_tracked = self._n - 1 - self._sensor.rest_frame
        if n_tracked < 0:
            return None
        if n_tracked <= MOST_STALE + STILL:
            self._newest = [*self._newest[-STILL - 2 :], frame.image.copy()]
            if stands_still_again(self._newest, self._sensor):
                self._begin_at_rest()
        if self._tracker is None:
            check_size("the pictures", frame.luma.shape[::-1], self._sensor)
            self._tracker = Tracker(self._sensor, levels=frame.levels)
        position, detected = self._tracker.step(frame.luma)
        grid = self._tracker.grid
        assert grid is not None
        now = undistort(position, self._sensor.lens)
        if self._rest is None:
            self._rest = undistort(self._tracker.rest_position, self._sensor.lens)
        self.rest_said = None
        if self._resting and (done := self._resting.feed(now, self._rest)):
            (rest, what), self._resting = done, None
            self.rest_said = rest is not None, what
            if rest is not None:
                self._rest, self._now = rest, None
        self._before, self._now = self._now, Skin(now, self._rest)
        responses = self._responses(self._channels, grid)
        return FrameImages(responses, position, detected, grid, self._now, self._before)

    def show(self, images: FrameImages) -> FrameImages:
        """Add what only the page shows to the images that `feed` returned last."""
        more = [channel for channel in SHOWN if channel not in self._channels]
        return replace(images, markers={**images.markers, **self._responses(more, images.grid)})

    def _responses(self, channels: Collection[Channel], grid: Grid) -> dict[str, Image]:
        """Return responses to the last frame, filled as offline; without those that lack one."""
        assert self._now is not None
        found = {channel: channel.step(self._now, self._before) for channel in channels}
        return {c.name: self._filled(c, r, grid) for c, r in found.items() if r is not None}

    def _filled(self, channel: Channel, response: Response, grid: Grid) -> Image:
        """Return a response without NaN, (component, marker), filled as offline."""
        if channel.name not in self._fillers:
            places = None if channel.parts else np.stack([grid.row, grid.column], axis=1)
            self._fillers[channel.name] = Filler(places)
        stored = np.asarray(response, np.float32)
        return np.atleast_2d(self._fillers[channel.name].feed(stored[np.newaxis])[0].T)


# Images of a sensor that nobody has described: its markers are found while they are at rest.

AGAIN_S = 1.0
"""Where there are no markers to be found they are looked for this often, s."""
NAME = "found"
"""Of a sensor that was found here."""


class FoundImages(Images):
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
        self._first: list[Frame] = []
        self._again_s: float | None = None
        if sensor is not None:
            super().__init__(sensor)
        else:
            self.sensor, self._channels = None, SHOWN
            self.begin()

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
        if self.sensor is not None:
            try:
                return super().feed(frame)
            except InputError:  # the skin has moved since: it is looked for anew
                self.sensor = None
                raise
        if self._again_s is not None and 0 <= self._again_s - frame.time_s <= AGAIN_S:
            return None
        self._first.append(frame._replace(luma=frame.luma.copy()))
        if len(self._first) == N_FRAMES:
            first, self._first = self._first, []
            self._again_s = frame.time_s + AGAIN_S
            super().__init__(found_in(_Clip(first)))
        return None


def found_in(clip: Video) -> Sensor:
    """Return the sensor that a clip shows, which begins with the skin at rest.

    Raises
    ------
    InputError
        If it shows no markers.
    """
    return calibrate_from_clips(clip, NAME).sensor


class _Clip:
    """Frames of a running source as a video."""

    path = Path("the first pictures")

    def __init__(self, taken: Sequence[Frame]) -> None:
        self._taken = taken
        self.height, self.width = taken[0].luma.shape
        span_s = taken[-1].time_s - taken[0].time_s
        self.fps_hz = (len(taken) - 1) / span_s if span_s > 0 else 0.0

    def frames(self) -> Iterator[Frame]:
        """Return them from the first."""
        return iter(self._taken)


# Tactile images in colours.

Pixels = NDArray[np.uint8]
_CIVIDIS = np.array([
    (0, 34, 78), (18, 53, 112), (59, 73, 108), (87, 93, 109),
    (112, 113, 115), (138, 134, 120), (190, 174, 105), (254, 232, 56),
])  # fmt: skip
"""Cividis at eight places, as on the page (Nuñez et al., PLoS ONE 2018)."""


def in_colours(image: Image, most: float) -> Pixels:
    """Return a tactile image in colours, (row, column, 3): red, green, blue.

    Parameters
    ----------
    image
        Of a channel with one component, (row, column).
    most
        Value of the brightest colour; larger ones are no brighter. 0 is the darkest.
    """
    share = np.clip(image / most, 0, 1) * (len(_CIVIDIS) - 1)
    low = np.minimum(share.astype(int), len(_CIVIDIS) - 2)
    part = (share - low)[..., None]
    return np.asarray((1 - part) * _CIVIDIS[low] + part * _CIVIDIS[low + 1], np.uint8)
