"""What can be said of the picture itself: light, contrast, focus, and frames that repeat."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from afferents.markers.detect import Positions, spacing_px
from afferents.store.recording import GreyImage

SATURATED = 250
"""Grey levels from here on hold no more light."""
_BIN_PX = 0.5
_ENOUGH = 60
"""Markers from all over the picture that tell of it as much as all do."""
_ALONE_PX = 40.0
"""What is looked at round a single marker, px across."""
REPEATED_SHARE = 0.2
"""A repeated frame changes less than this share of what changes before and after it."""
MOVING = 0.1
"""Change means motion where it is this share of the most that frames change (95%)."""

FAINT, OVEREXPOSED, BLURRED_PX = 40.0, 0.5, 4.0
"""Contrast in grey levels, share of saturated markers, and width of an edge that are named."""

BLACK, WHITE = 12.0, 243.0
"""A picture whose mean grey level lies beyond these shows nothing."""


def fault_of_light(image: GreyImage) -> str:
    """Return what is wrong with a picture that shows no markers, or nothing."""
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


def doubts_of_light(picture: ImageQuality) -> dict[str, str]:
    """Say what is wrong with light and focus, if anything.

    Returns
    -------
    dict
        A sentence for each of ``faint``, ``overexposed`` and ``blurred`` that it is.
    """
    disc, skin = picture.disc_grey, picture.skin_grey
    doubts = {}
    if abs(disc - skin) < FAINT:
        doubts["faint"] = (
            f"Faint: markers at grey level {disc:.0f} on skin at {skin:.0f}; give more light."
        )
    if picture.saturated > OVEREXPOSED:
        doubts["overexposed"] = (
            "Overexposed: most markers are at full white, so edges carry little; give less light."
        )
    if picture.edge_px > BLURRED_PX:
        doubts["blurred"] = f"Out of focus: edges are {picture.edge_px:.1f} px wide."
    return doubts


def image_quality(image: GreyImage, position: Positions) -> ImageQuality:
    """Measure light and focus from the markers of a frame.

    Parameters
    ----------
    position
        Shape (n, 2), px, without NaN.
    """
    some = position[:: max(1, len(position) // _ENOUGH)]
    distance, grey = _around(image, some, spacing_px(position) if len(position) > 1 else _ALONE_PX)
    edges = np.arange(0, distance.max(initial=1.0) + _BIN_PX, _BIN_PX)
    which = np.digitize(distance, edges) - 1
    seen = np.unique(which)
    profile = np.array([np.median(grey[which == k]) for k in seen])
    place = edges[seen] + _BIN_PX / 2
    disc, skin = float(profile[0]), float(np.median(profile[-2:]))
    brighter = grey[distance < 1.5] if disc > skin else grey[distance > place[-1] - _BIN_PX]
    return ImageQuality(disc, skin, float((brighter >= SATURATED).mean()), _edge(place, profile))


def _around(
    image: GreyImage, position: Positions, spacing: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return distance to the nearest marker and grey level of the pixels round all markers."""
    reach = max(3, int(spacing / 2))
    offset = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 2), axis=-1).reshape(-1, 2)
    pixel = np.rint(position).astype(int)[:, None] + offset
    height, width = image.shape
    inside = ((pixel >= 0) & (pixel < (width, height))).all(axis=2)
    distance = np.hypot(*(pixel - position[:, None])[inside].T)
    return distance, image[pixel[inside][:, 1], pixel[inside][:, 0]].astype(float)


def _edge(place: NDArray[np.float64], profile: NDArray[np.float64]) -> float:
    """Return the distance between 80% and 20% of the contrast, from the middle outwards."""
    share = (profile - profile[-1]) / (profile[0] - profile[-1] or 1.0)
    high, low = (int(np.argmax(share < level)) for level in (0.8, 0.2))
    if high == 0 or low == 0:
        return float("nan")
    return float(_crossing(place, share, low, 0.2) - _crossing(place, share, high, 0.8))


def _crossing(
    place: NDArray[np.float64], share: NDArray[np.float64], after: int, level: float
) -> float:
    step = share[after - 1] - share[after]
    return float(place[after - 1] + _BIN_PX * (share[after - 1] - level) / step)


def repeated_frames(change: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which frames repeat the one before: all still between two that moved.

    Cameras and converters write a frame twice to keep a rate up. A skin at rest changes no more
    than such a frame, so both neighbours must have moved.

    Parameters
    ----------
    change
        Of each frame from the one before, shape (n_frames,); the first is NaN.
    """
    filled = np.nan_to_num(change)
    padded = np.pad(filled, 2)
    before = np.maximum(padded[:-4], padded[1:-3])
    after = np.maximum(padded[4:], padded[3:-1])
    moved = np.minimum(before, after)
    most = np.quantile(filled, 0.95) if len(filled) else 0.0
    return (filled < REPEATED_SHARE * moved) & (moved > MOVING * most) & ~np.isnan(change)


def dropped_frames(time_s: NDArray[np.float64]) -> int:
    """Return how many frames are missing in gaps of the times of the others."""
    step = np.diff(time_s)
    if len(step) == 0:
        return 0
    period = np.median(step)
    return int(np.maximum(np.rint(step / period) - 1, 0).sum()) if period > 0 else 0
