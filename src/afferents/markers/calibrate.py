"""A sensor file from one clip at rest: how its markers look, and what layout they form."""

from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy.spatial import cKDTree

from afferents.core.errors import InputError
from afferents.core.recording import GreyImage, Video
from afferents.markers.detect import Positions, detect
from afferents.markers.estimate import estimate_detector
from afferents.markers.layout import FoundLayout, find_layout
from afferents.markers.picture import Picture, describe_picture
from afferents.markers.sensor import Sensor

N_FRAMES = 9
"""The picture is the median of so many frames: without noise, and without what flickers."""
MOST_MOVED_PX = 1.0
"""A skin whose markers move farther, in the median, within these frames is not at rest."""


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
    """

    sensor: Sensor
    image: GreyImage
    position: Positions
    found: FoundLayout
    picture: Picture


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
        If the clip is not at rest, or shows no markers.
    """
    images = [frame.image for frame in islice(video.frames(), N_FRAMES)]
    if not images:
        raise InputError(video.path, "a clip of the skin at rest", "no frames")
    image = np.asarray(np.median(images, axis=0), np.uint8)
    detector = estimate_detector(image, video.path)
    position = detect(image, detector)
    _require_rest(images, detector, video.path)
    found = find_layout(position)
    places: dict[str, object] = {"layout": found.layout, "n_markers": len(position)}
    if found.grid is not None:
        places["rows"] = int(found.grid.row.max()) + 1
        places["columns"] = int(found.grid.column.max()) + 1
    else:
        order = np.lexsort((position[:, 0], position[:, 1]))
        position = position[order]
        places["markers"] = tuple((round(float(x), 1), round(float(y), 1)) for x, y in position)
    described = detector.model_dump() | places | {"name": name, "rest_frame": 0}
    sensor = Sensor.model_validate(described | {"pitch_mm": pitch_mm})
    return Calibration(sensor, image, position, found, describe_picture(image, position))


def _require_rest(images: list[GreyImage], sensor: Sensor, where: object) -> None:
    """Refuse a clip in whose first frames the markers move."""
    first, last = (detect(image, sensor) for image in (images[0], images[-1]))
    if len(first) and len(last):
        moved = float(np.median(cKDTree(last).query(first)[0]))
        if moved > MOST_MOVED_PX:
            raise InputError(
                where,
                f"a skin at rest in the first {len(images)} frames",
                f"markers that move by {moved:.1f} px",
                "begin with the skin at rest, or cut the clip",
            )


def sensor_toml(sensor: Sensor) -> str:
    """Return a sensor file that `load_sensor` reads."""
    lines = [
        "# Lengths are in px of the camera image, so they hold for this image size alone.",
        "# Made by afferents calibrate; see the picture beside it.",
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
    lines += ["", "[detector]  # of OpenCV's SimpleBlobDetector"]
    lines += [f"{key} = {_toml(value)}" for key, value in sensor.detector.model_dump().items()]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else f"{value}"
