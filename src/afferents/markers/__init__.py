"""Finding the markers in the picture, following them, and placing them in the sensor's grid."""

from afferents.core.choices import Method
from afferents.markers.detect import Positions, detect
from afferents.markers.estimate import estimate_detector, recognise_sensor
from afferents.markers.grid import Grid, assign_grid, published_grid
from afferents.markers.lens import undistort, undistorted
from afferents.markers.quality import TrackingQuality, describe, doubt_markers, measure_quality
from afferents.markers.rest import check_size
from afferents.markers.rest_notes import rest_sentences
from afferents.markers.sensor import (
    BlobDetector,
    DiscDetector,
    Lens,
    Sensor,
    load_sensor,
    packaged_sensors,
)
from afferents.markers.track import (
    Tracked,
    Tracker,
    ordered_rest,
    rest_positions,
    track,
)

__all__ = [
    "BlobDetector",
    "DiscDetector",
    "Grid",
    "Lens",
    "Method",
    "Positions",
    "Sensor",
    "Tracked",
    "Tracker",
    "TrackingQuality",
    "assign_grid",
    "check_size",
    "describe",
    "detect",
    "doubt_markers",
    "estimate_detector",
    "load_sensor",
    "measure_quality",
    "ordered_rest",
    "packaged_sensors",
    "published_grid",
    "recognise_sensor",
    "rest_positions",
    "rest_sentences",
    "track",
    "undistort",
    "undistorted",
]
