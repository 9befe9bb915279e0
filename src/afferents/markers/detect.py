"""Where the markers are in one image: by OpenCV's SimpleBlobDetector, or as discs."""

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.core.recording import GreyImage
from afferents.markers.discs import find_discs
from afferents.markers.sensor import BlobDetector, Detector, DiscDetector, Sensor

Positions = NDArray[np.float64]
"""Shape (n, 2): x right and y down, px, pixel centres at integers."""


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
    return find_markers(image, sensor.detector)[0]


def find_markers(image: GreyImage, detector: Detector) -> tuple[Positions, NDArray[np.float64]]:
    """Find markers: their centres, shape (n, 2), px, and their areas, shape (n,), px^2."""
    if isinstance(detector, DiscDetector):
        return find_discs(image, detector)
    return find_blobs(image, detector)


def find_blobs(image: GreyImage, parameters: BlobDetector) -> tuple[Positions, NDArray[np.float64]]:
    """Find blobs: their centres, shape (n, 2), px, and their areas, shape (n,), px^2.

    The published method (preprocess/afferent_response.py). The area is that of a disc of the
    blob's mean radius.
    """
    blobs = _detector(parameters).detect(image)
    centre = np.array([blob.pt for blob in blobs], dtype=np.float64).reshape(-1, 2)
    diameter = np.array([blob.size for blob in blobs], dtype=np.float64)
    return centre, np.pi / 4 * diameter**2


def spacing_px(position: Positions) -> float:
    """Return the median distance of a marker from its nearest neighbour, px."""
    distance, _ = cKDTree(position).query(position, k=2)
    return float(np.median(distance[:, 1]))


@lru_cache(maxsize=8)
def _detector(parameters: BlobDetector) -> cv2.SimpleBlobDetector:
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
