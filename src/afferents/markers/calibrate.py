"""A sensor file from clips at rest: how its markers look, and what layout they form."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from afferents.core.errors import InputError
from afferents.core.recording import GreyImage, Video
from afferents.markers.clips import Clip, Followed, follow_on, look_at_rest, seen_in_most
from afferents.markers.detect import Positions
from afferents.markers.image_quality import ImageQuality, image_quality
from afferents.markers.layout import FoundLayout, find_layout
from afferents.markers.sensor import Sensor

MADE_BY = "# Made by afferents calibrate; see the picture beside it."
"""First line of a sensor file that `calibrate` writes."""


@dataclass(frozen=True)
class Calibration:
    """What clips show of their sensor.

    Attributes
    ----------
    sensor
        Ready to be written.
    image
        The median picture of the first clip, (height, width).
    position
        Its markers, (n, 2), px.
    suspects
        What looks like markers there and is left out, (k, 2), px.
    found, picture
        Layout, light and focus.
    n_again, n_checked
        Markers found again in most of the frames that were not used, and how many frames.
    clips
        What was looked at.
    """

    sensor: Sensor
    image: GreyImage
    position: Positions
    suspects: Positions
    found: FoundLayout
    picture: ImageQuality
    n_again: int
    n_checked: int
    clips: tuple[Clip, ...]


def calibrate(
    video: Video | Sequence[Video], name: str, pitch_mm: float | None = None
) -> Calibration:
    """Find out how a sensor's markers look and what layout they form, from clips at rest.

    Parameters
    ----------
    video
        A clip, or several of the same sensor; markers are those that at least half of them show.
    name
        What the sensor is to be called.
    pitch_mm
        Distance of its markers on the skin, mm, where it is known.

    Raises
    ------
    InputError
        If a clip shows no markers, or another sensor than the first.
    """
    if pitch_mm is not None and not 0 < pitch_mm < math.inf:
        raise InputError("--pitch-mm", "a distance above 0, mm", f"{pitch_mm:g}")
    clips = tuple(
        look_at_rest(each) for each in (video if isinstance(video, Sequence) else [video])
    )
    _of_one_size(clips)
    first = clips[0]
    position = seen_in_most(clips)
    followed = [follow_on(clip, position) for clip in clips]
    still = np.any([each.still for each in followed], axis=0)
    again, n_checked = _found_again(followed)
    suspects = np.concatenate([first.seen.suspects, position[still]])
    position, again = position[~still], again[~still]
    found = find_layout(position)
    places: dict[str, object] = {"layout": found.layout, "n_markers": len(position)}
    if found.grid is not None:
        rows, columns = int(found.grid.row.max()) + 1, int(found.grid.column.max()) + 1
        places |= {"rows": rows, "columns": columns, "n_markers": rows * columns}
    else:
        order = np.lexsort((position[:, 0], position[:, 1]))
        position = position[order]
        places["markers"] = tuple((round(float(x), 1), round(float(y), 1)) for x, y in position)
    described = first.sensor.model_dump() | places | {"name": name, "rest_frame": 0}
    sensor = Sensor.model_validate(described | {"pitch_mm": pitch_mm})
    picture = image_quality(first.image, position)
    return Calibration(
        sensor, first.image, position, suspects, found, picture, int(again.sum()), n_checked, clips
    )


def _of_one_size(clips: Sequence[Clip]) -> None:
    """Refuse clips of another size than the first: lengths in px would not hold."""
    for clip in clips[1:]:
        height, width = clips[0].image.shape
        if clip.image.shape != (height, width):
            found = f"{clip.image.shape[1]} x {clip.image.shape[0]} px"
            expected = f"{width} x {height} px, as in {clips[0].video.path.name}"
            raise InputError(clip.video.path, expected, found, "calibrate each size by itself")


def _found_again(followed: Sequence[Followed]) -> tuple[np.ndarray, int]:
    """Return which markers are found in most of the frames that were not used, and these."""
    n_frames = sum(each.n_frames for each in followed)
    n_found = np.sum([each.n_found for each in followed], axis=0)
    return 2 * n_found > n_frames, n_frames


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
