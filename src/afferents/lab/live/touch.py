"""A touch: what one frame shows of the skin, and its responses as images, filled as offline."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from afferents import dims, filling
from afferents.channels import CHANNELS, NO_DISPLACEMENT, Channel, Skin
from afferents.errors import InputError
from afferents.lab.live.prediction import Counters
from afferents.markers.detect import Positions
from afferents.markers.grid import Grid
from afferents.markers.places import make_images
from afferents.markers.sensor import Sensor

Response = NDArray[np.float32]
Pixels = NDArray[np.uint8]
NO_SOUND = np.zeros((0, 1), np.float32)
NO_TIMES = np.zeros(0)
MOVED_PX, MOVED_SHARE = 0.2, 0.05
"""Nothing touches the skin where no more markers than this share are this far from rest: tracking
alone moves them half as far."""
MOVED_GREY = 3.0
"""The same of cells, grey levels; noise alone is 1 or 2."""
SHOWN = (CHANNELS[dims.SA1], CHANNELS[dims.RA1])
"""Channels that the page shows, whatever models classify by."""
_CIVIDIS = np.array([
    (0, 34, 78), (18, 53, 112), (59, 73, 108), (87, 93, 109),
    (112, 113, 115), (138, 134, 120), (190, 174, 105), (254, 232, 56),
])  # fmt: skip
"""Cividis at eight places, as on the page (Nuñez et al., PLoS ONE 2018)."""


@dataclass(frozen=True, eq=False)
class Touch:
    """What one frame shows of the skin; arrays are float32, as in a store.

    Attributes
    ----------
    time_s
        When the frame was taken, on the source's clock, s. Frames that are missing are a gap.
    seen
        Where the picture shows markers, (marker, space), px, x right and y down; NaN where lost.
    now
        Where they are as an upright camera without distortion shows them, and where displacement
        counts from.
    before
        The same of the frame just before; None in the first, and after a gap.
    step_s
        How long ago that was, s.
    grid
        Places of the markers in a tactile image; None for layouts without.
    ra2, ra2_time_s
        What the microphone gave since the frame before: samples (n, channel), full scale 1, and
        when each was taken, (n,), s on the video's clock.
    late
        Whether the frame came so late that it shows the past.
    quality
        What was counted so far; see `Counters`.
    events
        In a sentence each: what happened since the frame before (sources that went and came, rest
        that was set anew or not).
    """

    time_s: float
    seen: Positions
    now: Skin
    before: Skin | None
    step_s: float
    grid: Grid | None
    late: bool
    quality: Counters
    events: tuple[str, ...] = ()
    ra2: Response = field(default_factory=lambda: NO_SOUND)
    ra2_time_s: NDArray[np.float64] = field(default_factory=lambda: NO_TIMES)

    @cached_property
    def position(self) -> Response:
        """Where the markers are, (marker, space), px; NaN where lost."""
        return self.now.position.astype(np.float32)

    @cached_property
    def sa1(self) -> Response:
        """SA-I of each marker (Eq. 1), (marker,), px (cells: grey levels); NaN where lost."""
        return self.now.distance.astype(np.float32)

    @cached_property
    def ra1(self) -> Response:
        """RA-I of each marker (Eq. 2), (marker,), that a frame; NaN where lost, and after a gap."""
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        return np.asarray(np.abs(self.now.distance - self.before.distance), np.float32)

    @cached_property
    def speed(self) -> Response:
        """How fast each marker moves, (marker,), px/s; NaN where lost, and after a gap.

        Raises
        ------
        InputError
            If these are cells, which don't move.
        """
        if self.now.grey is not None:
            raise InputError(NO_DISPLACEMENT)
        if self.before is None:
            return np.full(len(self.now.rest), np.nan, np.float32)
        way = np.hypot(*(self.now.position - self.before.position).T)
        return np.asarray(way / self.step_s, np.float32)

    @cached_property
    def shear(self) -> Response:
        """The six parts of the global shear (`channels.PARTS`), (6,), px; cells have none."""
        rest = self.now.rest.astype(np.float32).astype(np.float64)
        kept = Skin(self.position, rest, grey=self.now.grey)
        return np.asarray(CHANNELS[dims.SHEAR].step(kept, None), np.float32)

    @cached_property
    def detected(self) -> NDArray[np.bool_]:
        """Which markers were found, (marker,)."""
        return np.isfinite(self.seen[:, 0])

    @cached_property
    def lost(self) -> float:
        """Share of the markers that were not found."""
        return 1 - np.count_nonzero(self.detected) / len(self.detected)

    @cached_property
    def touching(self) -> bool:
        """Whether something touches the skin: more markers are off rest than tracking moves."""
        distance = self.now.distance
        least = MOVED_PX if self.now.grey is None else MOVED_GREY
        n_seen = np.count_nonzero(np.isfinite(distance))
        return bool(np.count_nonzero(distance > least) > MOVED_SHARE * n_seen)

    def image(self, name: str) -> Response:
        """Return `sa1`, `ra1` or `speed` as a tactile image, (row, column); NaN where lost.

        Raises
        ------
        InputError
            If the name is none of these, or the sensor file does not say where markers stand.
        """
        if name not in (dims.SA1, dims.RA1, "speed"):
            raise InputError(f"image: expected sa1, ra1 or speed, found {name!r}")
        if self.grid is None:
            raise InputError("image: expected a sensor file that says where the markers are")
        images = make_images(getattr(self, name)[np.newaxis], self.grid.row, self.grid.column)
        return np.asarray(images[0])


@dataclass(frozen=True, eq=False)
class Filled:
    """What one frame shows, with the responses of lost markers filled from their neighbours.

    Attributes
    ----------
    touch
        Of the frame, where lost markers are NaN.
    markers
        By name of the channel: (component, marker) in the layout's order. Without RA-I where no
        frame came before.
    """

    touch: Touch
    markers: Mapping[str, Response]

    def image(self, name: str) -> Response | None:
        """Return the image of a channel, (row, column) or (component, row, column) of a vector.

        None where it has no response to this frame, or none that is an image.
        """
        shown, grid = self.markers.get(name), self.touch.grid
        if shown is None or grid is None or shown.shape[1] != len(self.touch.seen):
            return None
        image = make_images(shown, grid.row, grid.column)
        return image if len(image) > 1 else image[0]


class Filling:
    """Fills responses frame by frame; each channel must be requested at every frame."""

    def __init__(self) -> None:
        """Nothing came before."""
        self._fillers: dict[str, filling.Filler] = {}

    def feed(self, touch: Touch, channels: Iterable[Channel]) -> dict[str, Response]:
        """Return responses of some channels, (component, marker) without NaN, filled as offline.

        A channel that this frame lacks, as RA-I where no frame came before, is left out.
        """
        filled = {}
        for channel in channels:
            response = channel.step(touch.now, touch.before)
            if response is None:
                continue
            if channel.name not in self._fillers:
                places = None
                if not channel.parts:
                    assert touch.grid is not None  # as `require_places` has checked
                    places = np.stack([touch.grid.row, touch.grid.column], axis=1)
                self._fillers[channel.name] = filling.Filler(places)
            stored = np.asarray(response, np.float32)[np.newaxis]
            filled[channel.name] = np.atleast_2d(self._fillers[channel.name].feed(stored)[0].T)
        return filled


def require_places(sensor: Sensor) -> None:
    """Refuse a sensor whose file does not give the places of its markers: it has no images.

    Raises
    ------
    InputError
        If it does not.
    """
    if sensor.layout not in ("square", dims.CELLS) and sensor.markers is None:
        raise InputError(
            f"sensor '{sensor.name}': expected a sensor file that says where the markers are, "
            f"found a {sensor.layout} layout without"
        )


def colour_image(image: Response, most: float) -> Pixels:
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
