"""The camera's optics: where a point of the skin appears in the picture."""

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

Points = NDArray[np.float64]
"""Shape (..., 2)."""

_OUTER_PX, _OUTER_OF_PX = 280.0, 640


class Camera(BaseModel):
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
        Of the video's frames, 1 to 100. At 20 coding moves a marker by 0.04 px (rms), a fifth of
        what `marker_noise_px` does.
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


def project(position_mm: Points, camera: Camera) -> Points:
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
