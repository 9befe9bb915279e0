"""The camera: where a point of the skin appears, and the picture of white discs on dark skin."""

import math
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator
from scipy.special import erf

from afferents.compiled import compiled
from afferents.store.recording import GreyImage

Points = NDArray[np.float64]
"""Shape (..., 2)."""

_OUTER_PX, _OUTER_OF_PX = 280.0, 640
_PER_GREY = 32
"""Pictures are summed in this many parts of a grey level, which fit 16 bits with room to spare."""
_LOUDEST_GREY = 500.0
"""Noise beyond this is cut off, for the same reason; the picture has 256 grey levels."""
_PLACES = 1 << 18
"""Noise is drawn once and read from one of this many places for each frame."""
_REACH_PX = 3.0
"""The edge of a disc is blurred no farther than this."""
_EDGE_STEPS = 64
"""Values a px in the table of a disc's edge."""
_STEPS = 64
"""A disc is drawn once for each of this many places within a pixel, along x and along y."""
_FULL = 255
"""A stamp's value where the disc covers the whole pixel."""
_LANES = 8
"""Stamps are a multiple of this wide, which suits processors."""


class RigCamera(BaseModel):
    """A camera behind the skin, and the ring of lights round it.

    Attributes
    ----------
    width, height, fps_hz
        Of the video (paper, section 2.1), px and Hz.
    px_per_mm
        Scale at the axis: 22 px for the 1.2 mm between two pins. Chosen so that all pins stay
        in the picture.
    roll_deg
        Angle from the image's x axis to the slide, from x towards y (published: 6.2).
    barrel
        How much the lens draws a point in, over its distance, at `outer_px` from the axis.
    marker_diameter_mm
        Of the white discs: 12.8 px, 129 px^2, amid what the published detector accepts (95 to
        180 px^2).
    marker_grey, skin_grey
        Grey levels in the middle of the picture.
    blur_px
        Standard deviation of the lens's blur, px.
    falloff
        Share of the light lost at `outer_px` from the axis.
    noise_grey
        Standard deviation of the sensor's noise, grey levels.
    marker_noise_px
        Standard deviation of what is seen of a marker round where it is, each axis, frame by
        frame, px: lights that flicker and shine unevenly on markers that are no perfect discs,
        rows that are exposed one after the other.
    marker_unequal
        How much markers differ in that, standard deviation of its logarithm.
    jpeg_quality
        Of the video's frames, 1 to 100. At 20 coding moves a tracked marker by 0.03 px (rms, each
        axis), nearly twice what `marker_noise_px` does; at 95 by 0.0025 px.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    width: int = Field(640, ge=16, multiple_of=2)
    height: int = Field(480, ge=16, multiple_of=2)
    fps_hz: float = Field(90.0, gt=0)
    px_per_mm: float = Field(18.3, gt=0)
    roll_deg: float = Field(6.2, ge=-45, le=45)
    barrel: float = Field(0.01, ge=0, le=0.1)
    marker_diameter_mm: float = Field(0.7, gt=0)
    marker_grey: float = Field(210.0, ge=0, le=255)
    skin_grey: float = Field(25.0, ge=0, le=255)
    blur_px: float = Field(0.7, ge=0)
    falloff: float = Field(0.2, ge=0, lt=1)
    noise_grey: float = Field(2.0, ge=0)
    marker_noise_px: float = Field(0.015, ge=0)
    marker_unequal: float = Field(0.25, ge=0)
    jpeg_quality: int = Field(20, ge=1, le=100)

    @model_validator(mode="after")
    def _markers_are_seen(self) -> Self:
        if self.marker_grey == self.skin_grey:
            raise ValueError("marker_grey must differ from skin_grey")
        return self

    @property
    def outer_px(self) -> float:
        """Distance of the outermost pins from the axis: 280 px at 18.3 px/mm in 640 px."""
        return _OUTER_PX * self.width / _OUTER_OF_PX

    @property
    def centre_px(self) -> Points:
        """The optical axis in the picture, px."""
        return np.array([(self.width - 1) / 2, (self.height - 1) / 2])


def project(position_mm: Points, camera: RigCamera) -> Points:
    """Return where points of the skin appear, px (pixel centres at integers).

    Parameters
    ----------
    position_mm
        Shape (..., 2), mm from the optical axis; x along the slide, y down.
    """
    roll = math.radians(camera.roll_deg)
    turn = np.array([[math.cos(roll), math.sin(roll)], [-math.sin(roll), math.cos(roll)]])
    ideal = position_mm @ turn * camera.px_per_mm
    radius2 = (ideal**2).sum(axis=-1, keepdims=True) / camera.outer_px**2
    return np.asarray(camera.centre_px + ideal * (1 - camera.barrel * radius2))


class Renderer:
    """Draws frames of a number of discs.

    A picture is summed in whole 1/32 grey levels: the lit skin with the sensor's noise, then every
    disc in a window of its own.

    Parameters
    ----------
    camera
        Optics and lights.
    seed
        Of the noise.
    """

    def __init__(self, camera: RigCamera, seed: int) -> None:
        """Draw the noise and light the empty skin."""
        self.camera = camera
        self._rng = np.random.default_rng(seed)
        y, x = np.indices((camera.height, camera.width))
        (centre_x, centre_y), outer_px = camera.centre_px, camera.outer_px
        radius2 = ((x - centre_x) ** 2 + (y - centre_y) ** 2) / outer_px**2
        # How brightly the ring lights each pixel, 1 in the middle.
        light = np.asarray(np.maximum(1 - camera.falloff * radius2, 0), np.float32)
        self._skin = _parts(light * camera.skin_grey)
        self._contrast = _parts(light * (camera.marker_grey - camera.skin_grey))
        noise = self._rng.standard_normal(light.size + _PLACES, dtype=np.float32)
        self._noise = _parts(noise * np.float32(camera.noise_grey))
        self._stamps = _stamps(camera)
        self._sum = np.empty(light.shape, np.int16)

    def draw(self, position_px: Points) -> GreyImage:
        """Draw one frame.

        Parameters
        ----------
        position_px
            Centres of the discs, shape (n, 2), px.

        Returns
        -------
        GreyImage
            Shape (height, width), 0 to 255.
        """
        start = int(self._rng.integers(_PLACES))
        grey = np.empty(self._sum.shape, np.uint8)
        noise = self._noise[start : start + self._sum.size].reshape(self._sum.shape)
        np.add(self._skin, noise, out=self._sum)
        position = np.asarray(position_px, np.float64)
        _add_discs(self._sum, self._contrast.ravel(), position, self._stamps)
        _expose(self._sum.ravel(), grey.ravel())
        return grey


def _parts(grey: NDArray[np.float32]) -> NDArray[np.int16]:
    """Return grey levels in whole parts of a level."""
    return np.rint(np.clip(grey, -_LOUDEST_GREY, _LOUDEST_GREY) * _PER_GREY).astype(np.int16)


@lru_cache(maxsize=4)
def _stamps(camera: RigCamera) -> NDArray[np.uint8]:
    """Return how much of each pixel round it a disc covers: (steps_y, steps_x, rows, columns).

    By the pixel's distance from the disc's edge: a straight edge, blurred by the lens and by the
    pixel's own width (1/sqrt(12) px); the disc's curve changes this by less than 1% of its
    contrast. The disc's centre is in pixel (rows // 2, columns // 2) or up to a pixel after it.
    """
    radius = camera.marker_diameter_mm * camera.px_per_mm / 2
    rows = 2 * math.ceil(radius + _REACH_PX) + 1
    columns = -(-rows // _LANES) * _LANES
    sigma = np.hypot(camera.blur_px, 12**-0.5)
    within = (np.arange(_STEPS, dtype=np.float32) + np.float32(0.5)) / np.float32(_STEPS)
    dy = np.arange(rows, dtype=np.float32) - rows // 2 - within[:, None]
    dx = np.arange(columns, dtype=np.float32) - columns // 2 - within[:, None]
    outside = np.sqrt(dy[:, None, :, None] ** 2 + dx[None, :, None, :] ** 2) - radius
    at = np.clip((outside + _REACH_PX) * _EDGE_STEPS, 0, 2 * _REACH_PX * _EDGE_STEPS)
    edge = np.arange(-_REACH_PX, _REACH_PX + 0.5 / _EDGE_STEPS, 1 / _EDGE_STEPS)
    cover = np.rint(_FULL * 0.5 * (1 - erf(edge / (sigma * 2**0.5)))).astype(np.uint8)
    return np.asarray(cover[at.astype(np.int16)], np.uint8)


@compiled()
def _add_discs(total, contrast, position, stamps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Light the pixels that discs cover."""
    height, width = total.shape
    flat = total.ravel()
    steps, rows, columns = stamps.shape[0], stamps.shape[2], stamps.shape[3]
    for i in range(len(position)):
        x, y = np.floor(position[i, 0]), np.floor(position[i, 1])
        # 255 parts of the contrast in 256: less than noise by far.
        stamp = stamps[int((position[i, 1] - y) * steps), int((position[i, 0] - x) * steps)]
        left, top = int(x) - columns // 2, int(y) - rows // 2
        first, last = max(0, -left), min(columns, width - left)
        for row in range(max(0, -top), min(rows, height - top)):
            at = (top + row) * width + left
            # Slices from 0: the compiler then works on many pixels at once.
            cover = stamp[row, first:last]
            pixels, lit = flat[at + first : at + last], contrast[at + first : at + last]
            for k in range(len(pixels)):
                parts = np.int32(cover[k]) * np.int32(lit[k]) + np.int32(128)
                pixels[k] += np.int16(parts >> np.int32(8))


@compiled()
def _expose(total, grey):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Round to grey levels."""
    for i in range(len(total)):
        value = (total[i] + np.int16(16)) >> np.int16(5)
        grey[i] = np.uint8(min(max(value, np.int16(0)), np.int16(255)))
