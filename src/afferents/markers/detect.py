"""Where the markers are in one image: found as blobs or discs, undistorted, and linked to names.

Blobs are what OpenCV's SimpleBlobDetector finds, as in the paper. Discs are found by their
correlation with a drawn one, which knows neither brightness nor contrast: the light of an LED that
falls off, a pool of light on the skin or a reflection next to a marker change it little, where
cutting the image at grey levels runs the marker together with what is bright around it.
"""

from functools import lru_cache

import cv2
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from afferents import dims
from afferents.markers import kernel
from afferents.markers.sensor import BlobDetector, Detector, DiscDetector, Lens, Picture, Sensor
from afferents.store.recording import GreyImage

Positions = NDArray[np.float64]
"""Shape (n, 2): x right and y down, px, pixel centres at integers."""
Found = tuple[Positions, NDArray[np.float64]]
"""Centres, shape (n, 2), px, and areas, shape (n,), px^2."""

SURROUND = 0.4
"""Width of the skin round a disc that is looked at, as a share of its radius; 2 px at least."""
FAINTEST = 6.0
"""A disc that stands out by fewer grey levels is noise."""
TYPICAL = 0.8
"""Discs that correlate this well say what contrast is typical."""
NO_BLOB = -1
"""Index that stands for no blob."""


def detect(image: GreyImage, sensor: Sensor) -> Positions:
    """Find the markers in an image.

    Parameters
    ----------
    image
        Grey image, shape (height, width), uint8.
    sensor
        Gives the detector's parameters; its `radius_px` is not applied here.

    Returns
    -------
    Positions
        Centres of the blobs, shape (n, 2), px, in no particular order; (0, 2) for none.
    """
    return find_markers(image, sensor)[0]


def find_markers(image: GreyImage, sensor: Sensor) -> Found:
    """Find markers where the sensor's picture shows it: centres, (n, 2), px, and areas, px^2."""
    if (times := sensor.times) > 1:
        centre, area = find_markers(enlarged(image, times), sensor.enlarged())
        return scaled(centre, 1 / times), area / times**2
    image, detector = without_shine(image, sensor.looks), sensor.looks
    if isinstance(detector, DiscDetector):
        return find_discs(image, detector, sensor.picture)
    centre, area = find_blobs(image, detector)
    shown = sensor.picture.shows(centre)
    return centre[shown], area[shown]


def enlarged(image: GreyImage, times: int) -> GreyImage:
    """Return an image this many times as large, smoothly; `scaled` says where things are in it."""
    if times == 1:
        return image
    large = cv2.resize(image, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC)
    return np.asarray(large, np.uint8)


def scaled(position: Positions, times: float) -> Positions:
    """Return positions, (n, 2), px, in an image this many times as large."""
    return position if times == 1 else times * (position + 0.5) - 0.5


def without_shine(image: GreyImage, detector: Detector) -> GreyImage:
    """Return an image without highlights in dark markers, or dark spots in bright ones.

    A morphological opening (or closing), which leaves alone what is wider than `shine_px`; done
    again it changes nothing.
    """
    if detector.shine_px is None:
        return image
    spot = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (detector.shine_px,) * 2)
    how = cv2.MORPH_CLOSE if detector.blob_colour else cv2.MORPH_OPEN
    return np.asarray(cv2.morphologyEx(image, how, spot), np.uint8)


def find_blobs(image: GreyImage, parameters: BlobDetector) -> Found:
    """Find blobs: their centres, shape (n, 2), px, and their areas, shape (n,), px^2.

    The published method (preprocess/afferent_response.py). The area is that of a disc of the
    blob's mean radius.
    """
    blobs = _make_detector(parameters).detect(image)
    centre = np.array([blob.pt for blob in blobs], dtype=np.float64).reshape(-1, 2)
    diameter = np.array([blob.size for blob in blobs], dtype=np.float64)
    return centre, np.pi / 4 * diameter**2


def find_discs(image: GreyImage, parameters: DiscDetector, within: Picture) -> Found:
    """Find discs: their centres, shape (n, 2), px, and their areas, shape (n,), px^2.

    Peaks of the normalised cross-correlation (Lewis 1995), and the centroids there.

    Parameters
    ----------
    image
        Grey image, shape (height, width), uint8.
    within
        Discs elsewhere are none, nor do they say what contrast is typical.
    """
    radius = parameters.radius_px
    half = int(np.ceil(radius + max(2.0, SURROUND * radius)))
    from_middle = np.hypot(*np.mgrid[-half : half + 1, -half : half + 1][::-1])
    disc = np.clip(radius + 0.5 - from_middle, 0, 1).astype(np.float32)
    ring = (from_middle > radius + 1).astype(np.float32)
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
    side = 2 * int(np.ceil(radius)) + 1
    best = cv2.dilate(match, np.ones((side, side), np.uint8))
    row, column = np.nonzero((match == best) & (match > parameters.min_correlation))
    shown = within.shows(np.stack([column, row], axis=1))
    row, column = row[shown], column[shown]
    height, score = contrast[row, column], match[row, column]
    typical = np.median(height[score > TYPICAL]) if (score > TYPICAL).any() else 0.0
    stands_out = height > max(FAINTEST, parameters.min_contrast * typical)
    peak = np.stack([column, row], axis=1)[stands_out].astype(float)
    n, halves = len(peak), np.full(len(peak), round(radius + 1), np.int64)
    dark, bright, mass, centre = np.empty(n), np.empty(n), np.empty(n), np.empty((n, 2))
    kernel.levels(image, peak, halves, dark, bright)
    kernel.weigh(image, peak, dark, bright, halves, mass, kernel.working_room(halves), centre)
    off = np.abs(centre - peak).max(axis=1) > 1
    centre[off] = peak[off]
    # Two pixels of one top may correlate alike: of discs on one another the best is kept.
    score, keep = score[stands_out], np.ones(n, dtype=bool)
    for a, b in sorted(cKDTree(centre).query_pairs(radius)) if n else ():
        if keep[a] and keep[b]:
            keep[b if score[a] >= score[b] else a] = False
    return centre[keep], np.full(int(keep.sum()), np.pi * radius**2)


def spacing_px(position: Positions) -> float:
    """Return the median distance of a marker from its nearest neighbour, px; NaN of one."""
    if len(position) < 2:
        return float("nan")
    distance, _ = cKDTree(position).query(position, k=2)
    return float(np.median(distance[:, 1]))


@lru_cache(maxsize=8)
def _make_detector(parameters: BlobDetector) -> cv2.SimpleBlobDetector:
    """Build the detector once for each set of parameters."""
    cv = cv2.SimpleBlobDetector.Params()
    cv.minThreshold = parameters.min_threshold
    cv.maxThreshold = parameters.max_threshold
    cv.thresholdStep = parameters.threshold_step
    cv.minRepeatability = parameters.min_repeatability
    cv.minDistBetweenBlobs = parameters.min_distance_px
    cv.filterByColor, cv.blobColor = True, parameters.blob_colour
    cv.filterByArea = True
    cv.minArea, cv.maxArea = parameters.min_area_px2, parameters.max_area_px2
    cv.filterByCircularity, cv.minCircularity = True, parameters.min_circularity
    cv.filterByConvexity, cv.minConvexity = True, parameters.min_convexity
    cv.filterByInertia, cv.minInertiaRatio = True, parameters.min_inertia_ratio
    return cv2.SimpleBlobDetector.create(cv)


def upright_tracks(tracks: xr.Dataset, sensor: Sensor) -> xr.Dataset:
    """Return tracks as an upright camera with a lens without distortion would have shown them, px.

    Only the positions change, after tracking: the pictures stay as they are, which costs nothing
    and blurs nothing.

    Parameters
    ----------
    tracks
        What `track` returns.
    sensor
        Without a lens and a turn it leaves them as they are.
    """
    return tracks.assign(
        {
            name: tracks[name].copy(data=upright(tracks[name].values, sensor))
            for name in (dims.POSITION, dims.REST_POSITION)
        }
    )


def upright(position: Positions, sensor: Sensor) -> Positions:
    """Return where points would be without the sensor's lens, and turned upright, (..., 2), px."""
    if sensor.lens is not None:
        position = undistort(position, sensor.lens)
    return turned(position, sensor) if sensor.picture.turn else position


def turned(position: Positions, sensor: Sensor, back: bool = False) -> Positions:
    """Return where points of the camera's picture are in the upright one, (..., 2), px; or back."""
    quarters, width, height = sensor.picture.turn // 90, sensor.width or 0, sensor.height or 0
    if back:
        width, height = (height, width) if quarters % 2 else (width, height)
        quarters = 4 - quarters
    for _ in range(quarters % 4):
        position = np.stack([height - 1 - position[..., 1], position[..., 0]], axis=-1)
        width, height = height, width
    return position


_UNTIL = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
"""Steps and px: OpenCV's own five steps leave tenths of a px at the rim of a strong lens."""


def undistort(position: Positions, lens: Lens) -> Positions:
    """Return where points would be without distortion, shape (..., 2), px; NaN stays NaN.

    The models are OpenCV's: Brown's radial and tangential one, or the fish-eye one of Kannala
    and Brandt (2006).
    """
    camera = np.array(
        [
            [lens.focal_px[0], 0, lens.centre_px[0]],
            [0, lens.focal_px[1], lens.centre_px[1]],
            [0, 0, 1],
        ]
    )
    straight = np.full(position.shape, np.nan)
    seen = ~np.isnan(position).any(axis=-1)
    if seen.any():
        points = np.asarray(position[seen], np.float64)[:, None]
        bent = np.array(lens.distortion)
        if lens.fish_eye:
            undone = cv2.fisheye.undistortPoints(points, camera, bent, R=np.eye(3), P=camera)
        else:
            undone = cv2.undistortImagePoints(points, camera, bent, None, _UNTIL)
        straight[seen] = undone[:, 0]
    return straight


def link_nearest(expected: Positions, blobs: Positions, gate_px: float) -> NDArray[np.intp]:
    """Give each marker the blob nearest to where it was: the published rule.

    Several markers may get the same blob (preprocess/afferent_response.py).

    Parameters
    ----------
    expected
        Where the markers were last, shape (n, 2), px.
    blobs
        Blobs of the new frame, shape (m, 2), px.
    gate_px
        A blob farther than this is not taken.

    Returns
    -------
    NDArray
        Index of each marker's blob, shape (n,), `NO_BLOB` for none.
    """
    if len(blobs) == 0:
        return np.full(len(expected), NO_BLOB, dtype=np.intp)
    distance, index = cKDTree(blobs).query(expected)
    return np.where(distance <= gate_px, index, NO_BLOB)


def link_one_to_one(expected: Positions, blobs: Positions, gate_px: float) -> NDArray[np.intp]:
    """Give each marker at most one blob and each blob to at most one marker.

    Of all such links the one with the least sum of squared distances is taken, where a marker
    without a blob costs the gate squared (Crocker & Grier 1996). Parameters and return value
    are those of `link_nearest`.
    """
    index = np.full(len(expected), NO_BLOB, dtype=np.intp)
    if len(blobs) == 0:
        return index
    cost = np.minimum(cdist(expected, blobs, "sqeuclidean"), gate_px**2)
    marker, blob = linear_sum_assignment(cost)
    linked = cost[marker, blob] < gate_px**2
    index[marker[linked]] = blob[linked]
    return index
