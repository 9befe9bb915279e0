"""Which files a LeRobot data set has, and what its features are called.

LeRobot's format 3.0 keeps many episodes in one table and one video; tables in ``meta/`` say where
each lies (https://huggingface.co/docs/lerobot/lerobot-dataset-v3). Features of touch are named as
proposals for LeRobot name them, ``observation.tactile.*`` (its pull requests 3175 and 4469).
"""

from typing import Any, Final, NamedTuple

import numpy as np
import pyarrow as pa

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


class Place(NamedTuple):
    """A file among those of a kind."""

    chunk: int = 0
    file: int = 0

    def following(self) -> "Place":
        """Return the next."""
        last = self.file + 1 == FILES_A_CHUNK
        return Place(self.chunk + last, 0 if last else self.file + 1)

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
