"""Videos: H.264 in mp4, frame by frame, with the times at which the frames were taken."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from afferents.core.recording import GreyImage
from afferents.rig.camera import Camera

_TICKS_HZ = 90_000
_BLACK, _WHITE = 16, 235
_LIMITED = np.round(np.arange(256) * (_WHITE - _BLACK) / 255 + _BLACK).astype(np.uint8)
"""Luma of each grey level (ITU-R BT.601)."""
_OPTIONS = {
    # One thread and no look ahead: the same frames give the same file, in little memory.
    "preset": "ultrafast",
    "tune": "zerolatency",
    "threads": "1",
}


def write_film(path: Path, frames: Iterable[tuple[float, GreyImage]], camera: Camera) -> None:
    """Write a video.

    Parameters
    ----------
    frames
        Time in s (kept to 1/90000 s, ascending) and grey image (height, width) of each frame.

    Raises
    ------
    OSError
        If the disk is full.
    """
    options = dict.fromkeys(("video_track_timescale", "movie_timescale"), str(_TICKS_HZ))
    with av.open(f"file:{path}", "w", format="mp4", options=options) as container:
        stream = container.add_stream("libx264", rate=round(camera.fps_hz), options=_OPTIONS)
        stream.width, stream.height, stream.pix_fmt = camera.width, camera.height, "yuv420p"
        stream.bit_rate = camera.bit_rate
        stream.time_base = stream.codec_context.time_base = Fraction(1, _TICKS_HZ)
        chroma = np.full((camera.height // 2, camera.width), 128, np.uint8)
        for time_s, image in frames:
            planes = np.concatenate([cv2.LUT(image, _LIMITED), chroma])
            frame = av.VideoFrame.from_ndarray(planes, format="yuv420p")
            frame.pts, frame.time_base = round(time_s * _TICKS_HZ), Fraction(1, _TICKS_HZ)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
