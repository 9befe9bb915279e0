"""A sensor file from one clip at rest: how its markers look, and what layout they form."""

import math
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.spatial import cKDTree

from afferents.core.errors import InputError
from afferents.core.recording import GreyImage, Video
from afferents.markers.detect import Positions, detect, without_loners
from afferents.markers.estimate import estimate_detector
from afferents.markers.image_quality import ImageQuality, image_quality
from afferents.markers.layout import FoundLayout, find_layout
from afferents.markers.sensor import Sensor

N_FRAMES = 9
"""The picture is the median of so many frames: without noise, and without what flickers."""
MADE_BY = "# Made by afferents calibrate; see the picture beside it."
"""First line of a sensor file that `calibrate` writes."""
MOST_MOVED_PX = 0.5
"""A skin whose markers moved farther since the first frame, in the median, is not at rest."""


@dataclass(frozen=True)
class Calibration:
    """What a clip shows of its sensor.

    Attributes
    ----------
    sensor
        Ready to be written.
    image
        The median picture, (height, width).
    position
        Its markers, (n, 2), px.
    found, picture
        Layout, light and focus.
    n_still, n_looked
        Frames from the first in which the skin did not move, of those looked at.
    """

    sensor: Sensor
    image: GreyImage
    position: Positions
    found: FoundLayout
    picture: ImageQuality
    n_still: int
    n_looked: int


def calibrate(video: Video, name: str, pitch_mm: float | None = None) -> Calibration:
    """Find out how a sensor's markers look and what layout they form, from a clip at rest.

    Parameters
    ----------
    name
        What the sensor is to be called.
    pitch_mm
        Distance of its markers on the skin, mm, where it is known.

    Raises
    ------
    InputError
        If the clip shows no markers.
    """
    if pitch_mm is not None and not 0 < pitch_mm < math.inf:
        raise InputError("--pitch-mm", "a distance above 0, mm", f"{pitch_mm:g}")
    images = [frame.image for frame in islice(video.frames(), N_FRAMES)]
    if not images:
        raise InputError(video.path, "a clip of the skin at rest", "no frames")
    n_still = _count_still(images, estimate_detector(images[0], video.path))
    image = np.asarray(np.median(images[:n_still], axis=0), np.uint8)
    detector = estimate_detector(image, video.path)
    position = without_loners(detect(image, detector))
    found = find_layout(position)
    places: dict[str, object] = {"layout": found.layout, "n_markers": len(position)}
    if found.grid is not None:
        rows, columns = int(found.grid.row.max()) + 1, int(found.grid.column.max()) + 1
        places |= {"rows": rows, "columns": columns, "n_markers": rows * columns}
    else:
        order = np.lexsort((position[:, 0], position[:, 1]))
        position = position[order]
        places["markers"] = tuple((round(float(x), 1), round(float(y), 1)) for x, y in position)
    described = detector.model_dump() | places | {"name": name, "rest_frame": 0}
    sensor = Sensor.model_validate(described | {"pitch_mm": pitch_mm})
    picture = image_quality(image, position)
    return Calibration(sensor, image, position, found, picture, n_still, len(images))


def _count_still(images: list[GreyImage], sensor: Sensor) -> int:
    """Return how many frames, from the first on, show the skin where the first one does."""
    first = detect(images[0], sensor)
    for n, image in enumerate(images[1:], start=1):
        found = detect(image, sensor)
        if len(found) == 0 or np.median(cKDTree(found).query(first)[0]) > MOST_MOVED_PX:
            return n
    return len(images)


def sensor_toml(sensor: Sensor) -> str:
    """Return a sensor file that `load_sensor` reads."""
    lines = [
        MADE_BY,
        "# Lengths are in px of the camera image, so they hold for this image size alone.",
        "",
    ]
    values = sensor.model_dump(exclude={"detector", "markers"}, exclude_none=True)
    lines += [f"{key} = {_toml(value)}" for key, value in values.items()]
    if sensor.radius_px is None:
        lines.append("radius_px = inf")
    if sensor.markers is not None:
        lines.append("# Where the markers are at rest, in the order that they keep.")
        lines.append("markers = [")
        lines += [f"  [{x:.1f}, {y:.1f}]," for x, y in sensor.markers]
        lines.append("]")
    lines += ["", "[detector]"]
    lines += [f"{key} = {_toml(value)}" for key, value in sensor.detector.model_dump().items()]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value}"
