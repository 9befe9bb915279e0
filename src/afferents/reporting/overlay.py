"""A video with its markers drawn in: names, trails, and the lost in red."""

from collections.abc import Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import av
import cv2
import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.files import MARK, write_aside
from afferents.store.recording import Frame, GreyImage

ENLARGED = 2
"""So that names can be read between markers 20 px apart."""
TRAIL_FRAMES = 20
_QUICK = {"crf": "20", "preset": "ultrafast"}
"""Of x264: encoding is most of the work, and the file is only to be looked at."""
_RED, _ORANGE, _WHITE, _BLACK = (40, 40, 255), (0, 159, 230), (255, 255, 255), (0, 0, 0)
"""Blue, green, red."""
_TICKS_HZ = 90_000
_COMMENT = f"{MARK}: a video with its markers drawn in"
_SUBPIXEL_BITS = 4

Colour = tuple[int, int, int]
Picture = NDArray[np.uint8]
"""Shape (height, width, 3), blue, green, red."""


def write_overlay(
    path: Path,
    frames: Iterable[Frame],
    position: NDArray[np.float64],
    detected: NDArray[np.bool_],
    fps_hz: float,
    masks: Sequence[tuple[str, tuple[float, float, float]]] = (),
) -> Path:
    """Write an mp4 of the frames, twice as large, with their markers.

    Parameters
    ----------
    frames
        Of the video, from its first.
    position, detected
        As `markers.track` gives them, shapes (n_frames, n, 2), px, and (n_frames, n).
    masks
        Circles (x, y, radius), px, each with its key: ``keep`` or ``hide``.

    Raises
    ------
    OSError
        If the file can't be written.
    """
    last_seen = pd.DataFrame(position.reshape(len(position), 2 * position.shape[1])).ffill()
    last = last_seen.to_numpy().reshape(position.shape)  # NaN before the first time
    with (
        write_aside(path) as partial,
        av.open(f"file:{partial}", "w", format="mp4") as container,
    ):
        container.metadata["comment"] = _COMMENT
        stream = container.add_stream("libx264", rate=max(1, round(fps_hz)), options=_QUICK)
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, _TICKS_HZ)
        for index, frame in enumerate(frames):
            image = frame.in_colour() if frame.in_colour else frame.image
            picture = draw_overlay(image, last, detected, index)
            for key, (x, y, radius) in masks:
                middle = _points(np.array([x, y])).tolist()
                size = round(ENLARGED * radius * (1 << _SUBPIXEL_BITS))
                colour = _WHITE if key == "keep" else _RED
                cv2.circle(picture, middle, size, colour, 1, cv2.LINE_AA, _SUBPIXEL_BITS)
            if index == 0:
                stream.height, stream.width = picture.shape[:2]
            drawn = av.VideoFrame.from_ndarray(picture, format="bgr24")
            drawn.pts = round(frame.time_s * _TICKS_HZ)
            drawn.time_base = Fraction(1, _TICKS_HZ)
            container.mux(stream.encode(drawn))
        container.mux(stream.encode(None))
    return path


def is_overlay(path: Path) -> bool:
    """Return whether a file is a video that `write_overlay` wrote."""
    try:
        with av.open(f"file:{path}") as container:
            return container.metadata.get("comment") == _COMMENT
    except (av.FFmpegError, OSError):
        return False


def draw_overlay(
    image: GreyImage, position: NDArray[np.float64], detected: NDArray[np.bool_], index: int
) -> Picture:
    """Draw the markers of frame `index`, with the way that they came.

    Parameters
    ----------
    image
        Grey, shape (height, width), or in colour, (height, width, 3), blue, green, red.
    position
        Where each marker was last seen, shape (n_frames, n, 2), px.
    """
    large = cv2.resize(image, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_LINEAR)
    if large.ndim == 2:  # grey
        large = cv2.cvtColor(large, cv2.COLOR_GRAY2BGR)
    picture: Picture = np.ascontiguousarray(large, np.uint8)
    shown = np.flatnonzero(~np.isnan(position[index, :, 0]))
    way = position[max(0, index - TRAIL_FRAMES) : index + 1]
    points = _points(way)
    trails = [points[~np.isnan(way[:, n, 0]), n] for n in shown]
    cv2.polylines(picture, trails, False, _ORANGE, 1, cv2.LINE_8, _SUBPIXEL_BITS)
    for n in shown:
        seen = bool(detected[index, n])
        where = (int(points[-1, n, 0]), int(points[-1, n, 1]))
        radius = 5 << _SUBPIXEL_BITS
        colour = _colour(n) if seen else _RED
        cv2.circle(picture, where, radius, colour, 1 if seen else 2, cv2.LINE_8, _SUBPIXEL_BITS)
        place = ((where[0] >> _SUBPIXEL_BITS) + 6, (where[1] >> _SUBPIXEL_BITS) - 5)
        _write(picture, f"{n}", place, 0.3, colour)
    title = f"{int(detected[index].sum())} of {detected.shape[1]}, frame {index}"
    _write(picture, title, (8, 20), 0.55, _WHITE)
    return picture


def _write(
    picture: Picture, text: str, place: tuple[int, int], size: float, colour: Colour
) -> None:
    """Write on a dark rim, which makes it legible on whatever lies behind."""
    for ink, width in ((_BLACK, 3), (colour, 1)):
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, ink, width, cv2.LINE_8)


def _points(position: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return positions in the enlarged picture, in sixteenths of its pixels."""
    enlarged = (position + 0.5) * ENLARGED - 0.5
    return np.asarray(np.nan_to_num(np.rint(enlarged * (1 << _SUBPIXEL_BITS))), np.int32)


@lru_cache(maxsize=4096)
def _colour(n: int) -> Colour:
    """Return a colour for a marker, far from its neighbours' and from red."""
    hue = 25 + (n * 47) % 130
    pixel = cv2.cvtColor(np.array([[[hue, 160, 255]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0]
    return int(pixel[0]), int(pixel[1]), int(pixel[2])
