"""Responses to one frame as tactile images without gaps, as offline, and in colours."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, Channel
from afferents.errors import InputError
from afferents.filling import Filler
from afferents.lab.live.touch import Touch
from afferents.markers.places import images_of
from afferents.markers.sensor import Sensor

Image = NDArray[np.float32]
Pixels = NDArray[np.uint8]
SHOWN = (CHANNELS[dims.SA1], CHANNELS[dims.RA1])
"""Channels that the page shows, whatever models classify by."""
_CIVIDIS = np.array([
    (0, 34, 78), (18, 53, 112), (59, 73, 108), (87, 93, 109),
    (112, 113, 115), (138, 134, 120), (190, 174, 105), (254, 232, 56),
])  # fmt: skip
"""Cividis at eight places, as on the page (Nuñez et al., PLoS ONE 2018)."""


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
    markers: Mapping[str, Image]

    def image(self, name: str) -> Image | None:
        """Return the image of a channel, (row, column) or (component, row, column) of a vector.

        None where it has no response to this frame, or none that is an image.
        """
        shown, grid = self.markers.get(name), self.touch.grid
        if shown is None or grid is None or shown.shape[1] != len(self.touch.seen):
            return None
        image = images_of(shown, grid.row, grid.column)
        return image if len(image) > 1 else image[0]


class Filling:
    """Fills responses frame by frame; each channel must be requested at every frame."""

    def __init__(self) -> None:
        """Nothing came before."""
        self._fillers: dict[str, Filler] = {}

    def feed(self, touch: Touch, channels: Iterable[Channel]) -> dict[str, Image]:
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
                self._fillers[channel.name] = Filler(places)
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


def colour_image(image: Image, most: float) -> Pixels:
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
