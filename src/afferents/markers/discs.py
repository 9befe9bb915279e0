"""Where discs are in one image, by their correlation with a drawn one.

The correlation knows neither brightness nor contrast: the light of an LED that falls off, a pool
of light on the skin or a reflection next to a marker change it little, where cutting the image at
grey levels runs the marker together with what is bright around it.
"""

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.markers import kernel
from afferents.markers.sensor import (
    WHOLE,
    DiscDetector,
    Picture,
)
from afferents.store.recording import GreyImage

SURROUND = 0.4
"""Width of the skin round a disc that is looked at, as a share of its radius; 2 px at least."""
FAINTEST = 6.0
"""A disc that stands out by fewer grey levels is noise."""
TYPICAL = 0.8
"""Discs that correlate this well say what contrast is typical."""
Image = NDArray[np.float32]
Found = tuple[NDArray[np.float64], NDArray[np.float64]]
"""Centres, shape (n, 2), px, and areas, shape (n,), px^2."""


def find_discs(image: GreyImage, parameters: DiscDetector, within: Picture = WHOLE) -> Found:
    """Find discs: their centres, shape (n, 2), px, and their areas, shape (n,), px^2.

    Peaks of the normalised cross-correlation (Lewis 1995), and the centroids there.

    Parameters
    ----------
    image
        Grey image, shape (height, width), uint8.
    within
        Discs elsewhere are none, nor do they say what contrast is typical.
    """
    disc, ring = _draw_template(parameters.radius_px)
    if min(image.shape) < len(disc):
        return np.zeros((0, 2)), np.zeros(0)
    sign = np.float32(1 if parameters.blob_colour else -1)
    grey = sign * image.astype(np.float32)
    correlation = np.asarray(cv2.matchTemplate(grey, disc, cv2.TM_CCOEFF_NORMED), np.float32)
    # At the image's own pixels; none where the template does not fit.
    match = np.full(image.shape, -1, np.float32)
    (rows, columns), (height_px, width_px) = correlation.shape, image.shape
    top, left = (height_px - rows) // 2, (width_px - columns) // 2
    match[top : top + rows, left : left + columns] = correlation
    contrast = cv2.filter2D(grey, -1, disc / disc.sum() - ring / ring.sum())
    side = 2 * int(np.ceil(parameters.radius_px)) + 1
    best = cv2.dilate(match, np.ones((side, side), np.uint8))
    row, column = np.nonzero((match == best) & (match > parameters.min_correlation))
    shown = within.shows(np.stack([column, row], axis=1))
    row, column = row[shown], column[shown]
    height, score = contrast[row, column], match[row, column]
    typical = np.median(height[score > TYPICAL]) if (score > TYPICAL).any() else 0.0
    stands_out = height > max(FAINTEST, parameters.min_contrast * typical)
    peak = np.stack([column, row], axis=1)[stands_out].astype(float)
    centre = _refine(image, peak, parameters.radius_px)
    apart = _best_only(centre, score[stands_out], parameters.radius_px)
    return centre[apart], np.full(int(apart.sum()), np.pi * parameters.radius_px**2)


def _draw_template(radius: float) -> tuple[Image, Image]:
    """Return a disc in the middle of its surroundings, and the surroundings."""
    half = int(np.ceil(radius + max(2.0, SURROUND * radius)))
    y, x = np.mgrid[-half : half + 1, -half : half + 1]
    from_middle = np.hypot(x, y)
    disc = np.clip(radius + 0.5 - from_middle, 0, 1).astype(np.float32)
    return disc, (from_middle > radius + 1).astype(np.float32)


def _refine(image: GreyImage, peak: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the centroid of each disc; its peak, where that is not on it."""
    n = len(peak)
    half = np.full(n, round(radius + 1), np.int64)
    dark, bright, mass, centre = np.empty(n), np.empty(n), np.empty(n), np.empty((n, 2))
    kernel.levels(image, peak, half, dark, bright)
    kernel.weigh(image, peak, dark, bright, half, mass, kernel.working_room(half), centre)
    off = np.abs(centre - peak).max(axis=1) > 1
    return np.where(off[:, None], peak, centre)


def _best_only(
    centre: NDArray[np.float64], score: NDArray[np.float32], radius: float
) -> NDArray[np.bool_]:
    """Return which discs are not on a better one: two pixels of one top may correlate alike."""
    keep = np.ones(len(centre), dtype=bool)
    for a, b in sorted(cKDTree(centre).query_pairs(radius)) if len(centre) else ():
        if keep[a] and keep[b]:
            keep[b if score[a] >= score[b] else a] = False
    return keep
