"""Videos: JPEGs in mp4, as cameras give them, with the times at which the frames were taken.

A frame is coded by itself. So no motion is held back, as by encoders that skip what hardly changed,
and the marker noise of the camera arrives as it was drawn.
"""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import av
import cv2

from afferents.core.recording import GreyImage
from afferents.rig.camera import Camera

_TICKS_HZ = 90_000
_TIME_BASE = Fraction(1, _TICKS_HZ)


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
    quality = [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg_quality]
    with av.open(f"file:{path}", "w", format="mp4", options=options) as container:
        stream = container.add_mux_stream(
            "mjpeg", rate=round(camera.fps_hz), width=camera.width, height=camera.height
        )
        stream.time_base = _TIME_BASE
        for time_s, image in frames:
            _, data = cv2.imencode(".jpg", image, quality)
            packet = av.Packet(data.tobytes())
            packet.stream, packet.time_base = stream, _TIME_BASE
            packet.pts = packet.dts = round(time_s * _TICKS_HZ)
            packet.is_keyframe = True
            container.mux(packet)
