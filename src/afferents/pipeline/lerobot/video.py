"""The pictures of many recordings in few video files, frames at a constant rate."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

from afferents.core.recording import GreyImage
from afferents.pipeline.lerobot.layout import CAMERA, VIDEO, VIDEO_MB, Place
from afferents.pipeline.lerobot.stats import SEEN, Stats, stats_of_pictures

_CODEC = {"crf": "18", "preset": "veryfast", "g": "2"}
"""Every second frame can be decoded by itself: LeRobot reads single frames at random."""


class VideoFiles:
    """Videos that are being written, one after another.

    Parameters
    ----------
    root
        Of the data set.
    fps
        Frames a second.
    """

    def __init__(self, root: Path, fps: int, width: int, height: int) -> None:
        """Write nothing yet."""
        self._root, self._fps, self._size = root, fps, (width, height)
        self._place, self._frames = Place(), 0
        self._out: Any = None
        self._stream: Any = None

    def write(self, frames: Iterable[GreyImage], n: int) -> tuple[dict[str, float], Stats]:
        """Write the frames of a recording.

        Parameters
        ----------
        frames
            Each (height, width); so many as `n`.

        Returns
        -------
        tuple
            Where they lie, as the table of episodes says it; and their statistics.
        """
        if self._out is None:
            self._open()
        first, seen = self._frames, []
        for number, image in enumerate(frames):
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")
            frame.pts, frame.time_base = self._frames, Fraction(1, self._fps)
            self._out.mux(self._stream.encode(frame))
            self._frames += 1
            if number % max(1, n // SEEN) == 0:
                seen.append(image[::4, ::4])
        where = {
            f"videos/{CAMERA}/chunk_index": self._place.chunk,
            f"videos/{CAMERA}/file_index": self._place.file,
            f"videos/{CAMERA}/from_timestamp": first / self._fps,
            f"videos/{CAMERA}/to_timestamp": self._frames / self._fps,
        }
        if self._path.stat().st_size > VIDEO_MB * 2**20:
            self.close()
            self._place = self._place.following()
        return where, stats_of_pictures(np.stack(seen))

    def close(self) -> None:
        """Write what is left."""
        if self._out is not None:
            self._out.mux(self._stream.encode(None))
            self._out.close()
            self._out, self._frames = None, 0

    @property
    def _path(self) -> Path:
        return self._root / self._place.path(VIDEO, CAMERA)

    def _open(self) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._out = av.open(f"file:{self._path}", "w", format="mp4")
        self._stream = self._out.add_stream("libx264", rate=self._fps, options=_CODEC)
        self._stream.width, self._stream.height = self._size
        self._stream.pix_fmt = "yuv420p"
