"""Light, contrast and focus of a picture of markers."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents.quality.issues import Noted

GreyImage = NDArray[np.uint8]

SATURATED = 250
"""Grey levels from here on hold no more light."""
_BIN_PX = 0.5
_ENOUGH = 60
"""Markers from all over the picture that tell of it as much as all do."""
_ALONE_PX = 40.0
"""What is looked at round a single marker, px across."""
FAINT, OVEREXPOSED, BLURRED_PX = 40.0, 0.5, 4.0
"""Contrast in grey levels, share of saturated markers, and width of an edge that are named."""

BLACK, WHITE = 12.0, 243.0
"""A picture whose mean grey level lies beyond these shows nothing."""


def describe_no_light(image: GreyImage) -> str:
    """Describe the light of a picture that shows no markers; empty where it is not to blame."""
    mean = float(image.mean())
    if mean < BLACK:
        return f" in a picture that is black (mean grey level {mean:.0f})"
    if mean > WHITE:
        return f" in a picture that is overexposed (mean grey level {mean:.0f})"
    return ""


@dataclass(frozen=True)
class ImageQuality:
    """Light and focus in one frame.

    Attributes
    ----------
    disc_grey, skin_grey
        Median grey level of the markers' middles and of the skin between them.
    saturated
        Share of the markers whose middle is at `SATURATED` or above (or, of dark markers, of
        skin that is).
    edge_px
        Over how many px a marker's edge falls from 80% to 20% of its contrast; about 1 in a
        sharp picture.
    """

    disc_grey: float
    skin_grey: float
    saturated: float
    edge_px: float


def find_light_issues(picture: ImageQuality) -> dict[Noted, str]:
    """Find what is wrong with light and focus, if anything.

    Returns
    -------
    dict
        What is seen and to be done, for each of ``faint``, ``overexposed``, ``blurred`` it is.
    """
    disc, skin = picture.disc_grey, picture.skin_grey
    issues: dict[Noted, str] = {}
    if abs(disc - skin) < FAINT:
        issues["faint"] = (
            f"faint markers, at grey level {disc:.0f} on skin at {skin:.0f}; give more light"
        )
    if picture.saturated > OVEREXPOSED:
        issues["overexposed"] = (
            "most of them overexposed, so that edges carry little; give less light"
        )
    if picture.edge_px > BLURRED_PX:
        issues["blurred"] = f"edges {picture.edge_px:.1f} px wide; focus the camera"
    return issues


def measure_image_quality(
    image: GreyImage, position: NDArray[np.float64], spacing_px: float
) -> ImageQuality:
    """Measure light and focus from the markers of a frame.

    Parameters
    ----------
    image
        Grey levels, shape (height, width), uint8.
    position
        Of the markers, shape (n, 2), px, without NaN.
    spacing_px
        Distance of neighbouring markers, px; NaN for a single marker.
    """
    some = position[:: max(1, len(position) // _ENOUGH)]
    distance, grey = _sample_around(
        image, some, _ALONE_PX if math.isnan(spacing_px) else spacing_px
    )
    place, profile = _measure_profile(distance, grey)
    disc, skin = float(profile[0]), float(np.median(profile[-2:]))
    brighter = grey[distance < 1.5] if disc > skin else grey[distance > place[-1] - _BIN_PX]
    return ImageQuality(
        disc, skin, float((brighter >= SATURATED).mean()), _measure_edge(place, profile)
    )


def _sample_around(
    image: GreyImage, position: NDArray[np.float64], spacing_px: float
) -> tuple[NDArray[np.float64], GreyImage]:
    """Return distance to the nearest marker and grey level of the pixels round all markers."""
    reach = max(3, int(spacing_px / 2))
    offset = np.arange(-reach, reach + 1)
    nearest = np.rint(position).astype(int)
    x, y = (nearest[:, axis, None] + offset for axis in (0, 1))  # (marker, pixel along an axis)
    height, width = image.shape
    inside = ((y >= 0) & (y < height))[:, :, None] & ((x >= 0) & (x < width))[:, None, :]
    dx, dy = x - position[:, :1], y - position[:, 1:]
    distance = np.hypot(dx[:, None, :], dy[:, :, None])
    grey = image[np.clip(y, 0, height - 1)[:, :, None], np.clip(x, 0, width - 1)[:, None, :]]
    return (distance.ravel(), grey.ravel()) if inside.all() else (distance[inside], grey[inside])


def _measure_profile(
    distance: NDArray[np.float64], grey: GreyImage
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the middles of the bins of distance that hold pixels, px, and their median grey."""
    which = (distance / _BIN_PX).astype(np.int32)
    ordered = np.sort(which << 8 | grey) & 255  # by bin, then by grey level: one sort for all bins
    counts = np.bincount(which)
    seen = np.flatnonzero(counts)
    n = counts[seen]
    first = np.cumsum(n) - n
    profile = (ordered[first + (n - 1) // 2] + ordered[first + n // 2]) / 2
    return np.asarray(seen * _BIN_PX + _BIN_PX / 2), np.asarray(profile, np.float64)


def _measure_edge(place: NDArray[np.float64], profile: NDArray[np.float64]) -> float:
    """Return the distance between 80% and 20% of the contrast, from the middle outwards."""
    share = (profile - profile[-1]) / (profile[0] - profile[-1] or 1.0)
    crossings_px = []
    for level in (0.2, 0.8):
        if (after := int(np.argmax(share < level))) == 0:
            return float("nan")
        step = share[after - 1] - share[after]
        crossings_px.append(float(place[after - 1] + _BIN_PX * (share[after - 1] - level) / step))
    return crossings_px[0] - crossings_px[1]
