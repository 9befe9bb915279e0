"""The files of a LeRobot data set: their layout, statistics and videos."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any, Final, NamedTuple

import av
import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from afferents.store.recording import GreyImage

# Which files a LeRobot data set has, and what its features are called.
#
# LeRobot's format 3.0 keeps many episodes in one table and one video; tables in ``meta/`` say where
# each lies (https://huggingface.co/docs/lerobot/lerobot-dataset-v3). Features of touch are named as
# proposals for LeRobot name them, ``observation.tactile.*`` (its pull requests 3175 and 4469).

VERSION: Final = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
FILES_A_CHUNK = 1000
DATA_MB, VIDEO_MB = 100, 200
"""A file is closed after the recording by which it grows beyond this."""

CAMERA = "observation.images.fingertip"
DISPLACEMENT = "observation.tactile.fingertip.displacement"
DETECTED = "observation.tactile.fingertip.detected"
SA1, RA1 = "observation.tactile.fingertip.sa1", "observation.tactile.fingertip.ra1"
RA2 = "observation.tactile.fingertip.ra2"
TIME = "observation.capture_time"
STATE = "observation.state"

COUNTED = {
    "timestamp": "float32",
    "frame_index": "int64",
    "episode_index": "int64",
    "index": "int64",
    "task_index": "int64",
}
"""What every LeRobot data set has of each frame."""


class FilePlace(NamedTuple):
    """A file among those of a kind."""

    chunk: int = 0
    file: int = 0

    def following(self) -> "FilePlace":
        """Return the next."""
        last = self.file + 1 == FILES_A_CHUNK
        return FilePlace(self.chunk + last, 0 if last else self.file + 1)

    def path(self, template: str, key: str = "") -> str:
        """Return where it lies in the data set."""
        return template.format(chunk_index=self.chunk, file_index=self.file, video_key=key)


def feature(dtype: str, shape: tuple[int, ...], names: list[str] | None) -> dict[str, Any]:
    """Return a feature as `meta/info.json` has it."""
    return {"dtype": dtype, "shape": list(shape), "names": names}


def video_feature(width: int, height: int, fps: int) -> dict[str, Any]:
    """Return the camera's feature."""
    info = {
        "video.height": height, "video.width": width, "video.codec": "h264",
        "video.pix_fmt": "yuv420p", "video.is_depth_map": False, "video.fps": fps,
        "video.channels": 3, "has_audio": False,
    }  # fmt: skip
    names = ["height", "width", "channels"]
    return {**feature("video", (height, width, 3), names), "info": info}


def column(values: np.ndarray[Any, Any]) -> pa.Array:
    """Return values, (frame,) or (frame, n), as a column of numbers or of lists of n."""
    if values.ndim == 1 or values.shape[1] == 1:
        return pa.array(values.reshape(-1))
    flat = pa.array(np.ascontiguousarray(values).reshape(-1))
    return pa.FixedSizeListArray.from_arrays(flat, values.shape[1])


# Statistics of features, as LeRobot normalises with them.

_QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
Stats = dict[str, NDArray[Any]]
SEEN = 100
"""So many pictures of an episode are looked at, evenly spread."""


def stats_of(values: NDArray[Any]) -> Stats:
    """Return least, largest, mean, standard deviation, quantiles and number, over the frames.

    Parameters
    ----------
    values
        (frame,) or (frame, n).
    """
    rows = values.reshape(len(values), -1).astype(np.float64)
    return {
        "min": rows.min(axis=0),
        "max": rows.max(axis=0),
        "mean": rows.mean(axis=0),
        "std": rows.std(axis=0),
        "count": np.array([len(rows)]),
        **{name: np.quantile(rows, share, axis=0) for name, share in _QUANTILES.items()},
    }


def stats_of_pictures(pictures: NDArray[np.uint8]) -> Stats:
    """Return the same of each colour, 0 to 1, (3, 1, 1), from some grey pictures (n, h, w)."""
    found = stats_of(pictures.reshape(-1, 1) / 255)
    shaped = {name: np.tile(value, 3).reshape(3, 1, 1) for name, value in found.items()}
    return {**shaped, "count": np.array([len(pictures)])}


def together(parts: list[Stats]) -> Stats:
    """Return the statistics of all episodes, from those of each; quantiles are mean ones.

    Chan, Golub & LeVeque 1979 put means and variances together, as LeRobot does.
    """
    n = np.array([part["count"][0] for part in parts], np.float64)
    share = (n / n.sum()).reshape(-1, *[1] * parts[0]["mean"].ndim)
    mean = (share * np.stack([part["mean"] for part in parts])).sum(axis=0)
    apart = np.stack([part["mean"] - mean for part in parts])
    variance = (share * (np.stack([part["std"] for part in parts]) ** 2 + apart**2)).sum(axis=0)
    return {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": np.array([int(n.sum())]),
        **{q: (share * np.stack([part[q] for part in parts])).sum(axis=0) for q in _QUANTILES},
    }


# The pictures of many recordings in few video files, frames at a constant rate.

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
        self._place, self._frames = FilePlace(), 0
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
