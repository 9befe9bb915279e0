"""From an extracted store to a LeRobot data set (format 3.0), whole or not at all."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.exchange import lerobot_files
from afferents.exchange.lerobot_files import (
    COUNTED,
    DATA,
    DATA_MB,
    FilePlace,
    Stats,
    VideoFiles,
    column,
    stats_of,
    together,
)
from afferents.files import Place, write_aside
from afferents.outputs import require_new_folder
from afferents.progress import Progress
from afferents.recordings.session import read_session
from afferents.store.recording import GreyImage, Recording, Video
from afferents.store.responses import Responses, speed_of
from afferents.store.zarr_store import open_responses

_OFF_RATE = 0.01
"""Frame rates of recordings may differ from each other, and from a whole number, by this share."""


@dataclass(frozen=True)
class LeRobotExport:
    """What is exported.

    Attributes
    ----------
    store, out
        The store, and the folder to write.
    session
        Folder that the store was extracted from, for its videos; None for no pictures.
    """

    store: Path
    out: Path
    session: Path | None = None


def write_lerobot(wanted: LeRobotExport, progress: Progress) -> int:
    """Write a store as a LeRobot data set: an episode a recording, a frame each of its pictures.

    Returns
    -------
    Number of episodes.

    Raises
    ------
    InputError
        If there is no store, it has no markers, sensors or frame rates differ, the session is
        another one's, or `out` is there already.
    """
    require_new_folder(wanted.out, "a new folder for a LeRobot data set")
    recordings = [one for one in open_responses(wanted.store) if dims.POSITION in one]
    if not recordings:
        raise InputError(f"{wanted.store}: expected recordings with markers, found none")
    videos = _videos(wanted.session, recordings)
    fps = _frame_rate(wanted.store, recordings)
    _require_one_shape(wanted.store, recordings)
    with write_aside(wanted.out) as partial:
        partial.mkdir(parents=True)
        _Writer(partial, fps, recordings, videos).write(progress)
    return len(recordings)


class _Writer:
    """Writes one data set.

    Parameters
    ----------
    root
        Its folder.
    videos
        By name of the recording; empty for none.
    """

    def __init__(
        self, root: Path, fps: int, recordings: Sequence[Responses], videos: Mapping[str, Video]
    ) -> None:
        """Write nothing yet."""
        self._root, self._fps, self._recordings, self._of = root, fps, recordings, videos
        self._tasks = sorted({_task(one) for one in recordings})
        self._place = FilePlace()
        self._table: Any = None
        self._n = 0
        self._video: VideoFiles | None = None
        if videos:
            first = next(iter(videos.values()))
            self._video = VideoFiles(root, fps, first.width, first.height)

    def write(self, progress: Progress) -> None:
        """Write all of it."""
        rows: list[dict[str, Any]] = []
        all_stats: list[dict[str, Stats]] = []
        recordings = progress.track(self._recordings, "exporting", len(self._recordings))
        for number, responses in enumerate(recordings):
            row, stats = self._episode(number, responses)
            rows.append(row)
            all_stats.append(stats)
        if self._table is not None:
            self._table.close()
        if self._video is not None:
            self._video.close()
        self._write_meta(rows, all_stats)

    def _episode(
        self, number: int, responses: Responses
    ) -> tuple[dict[str, Any], dict[str, Stats]]:
        """Write the frames of a recording; return its row in the table, and statistics."""
        values = _values(responses, self._fps)
        n = len(next(iter(values.values())))
        values |= {
            "timestamp": (np.arange(n) / self._fps).astype(np.float32),
            "frame_index": np.arange(n),
            "episode_index": np.full(n, number),
            "index": self._n + np.arange(n),
            "task_index": np.full(n, self._tasks.index(_task(responses))),
        }
        row: dict[str, Any] = {
            "episode_index": number,
            "tasks": [_task(responses)],
            "length": n,
            "dataset_from_index": self._n,
            "dataset_to_index": self._n + n,
            "data/chunk_index": self._place.chunk,
            "data/file_index": self._place.file,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            "recording": str(responses.attrs["name"]),
        }
        self._append(pa.table({name: column(value) for name, value in values.items()}))
        stats = {name: stats_of(value) for name, value in values.items()}
        if self._video is not None:
            video = self._of[str(responses.attrs["name"])]
            where, stats[lerobot_files.CAMERA] = self._video.write(_pictures(video, n), n)
            row |= where
        self._n += n
        said = {f"stats/{k}/{s}": v.tolist() for k, one in stats.items() for s, v in one.items()}
        return {**row, **said}, stats

    def _append(self, table: pa.Table) -> None:
        """Write an episode as a row group; begin a new file where this one is large."""
        path = self._root / self._place.path(DATA)
        if self._table is None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._table = pq.ParquetWriter(path, table.schema, compression="snappy")
        self._table.write_table(table)
        if path.stat().st_size > DATA_MB * 2**20:
            self._table.close()
            self._table, self._place = None, self._place.following()

    def _write_meta(self, rows: list[dict[str, Any]], all_stats: list[dict[str, Stats]]) -> None:
        episodes = self._root / lerobot_files.EPISODES
        episodes.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(rows), episodes)
        index = pd.Index(self._tasks, name="task")
        numbers = range(len(self._tasks))
        pd.DataFrame({"task_index": numbers}, index=index).to_parquet(
            self._root / lerobot_files.TASKS
        )
        whole = {name: together([one[name] for one in all_stats]) for name in all_stats[0]}
        said = {k: {s: v.tolist() for s, v in one.items()} for k, one in whole.items()}
        (self._root / lerobot_files.STATS).write_text(json.dumps(said, indent=4))
        (self._root / lerobot_files.INFO).write_text(json.dumps(self._info(), indent=4))

    def _info(self) -> dict[str, Any]:
        n_episodes = len(self._recordings)
        return {
            "codebase_version": lerobot_files.VERSION,
            "robot_type": "tactile_fingertip",
            "total_episodes": n_episodes,
            "total_frames": self._n,
            "total_tasks": len(self._tasks),
            "chunks_size": lerobot_files.FILES_A_CHUNK,
            "data_files_size_in_mb": DATA_MB,
            "video_files_size_in_mb": lerobot_files.VIDEO_MB,
            "fps": self._fps,
            "splits": {"train": f"0:{n_episodes}"},
            "data_path": DATA,
            "video_path": lerobot_files.VIDEO if self._video is not None else None,
            "features": self._features(),
        }

    def _features(self) -> dict[str, Any]:
        """Return every feature: what it holds, and what its numbers are called."""
        first = self._recordings[0]
        features = {
            name: lerobot_files.feature(
                str(value.dtype), (value.shape[1],), _names(name, value.shape[1])
            )
            for name, value in _values(first, self._fps).items()
        }
        if self._video is not None:
            video = next(iter(self._of.values()))
            features[lerobot_files.CAMERA] = lerobot_files.video_feature(
                video.width, video.height, self._fps
            )
        return features | {
            name: lerobot_files.feature(kind, (1,), None) for name, kind in COUNTED.items()
        }


def _values(responses: Responses, fps: int) -> dict[str, NDArray[Any]]:
    """Return what is known of each frame, (frame, n) each; what is lost is 0, and not detected."""
    position = responses[dims.POSITION].values
    moved = position - responses[dims.REST_POSITION].values
    n = len(position)
    seen = responses[dims.DETECTED].values & np.isfinite(moved).all(axis=2)
    values = {
        lerobot_files.DISPLACEMENT: np.where(seen[..., None], moved, 0).reshape(n, -1),
        lerobot_files.SA1: np.nan_to_num(responses[dims.SA1].values),
        lerobot_files.RA1: np.nan_to_num(responses[dims.RA1].values),
        lerobot_files.TIME: responses[dims.TIME].values[:, None],
        lerobot_files.STATE: np.full((n, 1), speed_of(responses) or np.nan),
    }
    if dims.RA2 in responses:
        values[lerobot_files.RA2] = _sound(responses, fps, n)
    floats = {name: value.astype(np.float32) for name, value in values.items()}
    return {**floats, lerobot_files.DETECTED: seen}


def _sound(responses: Responses, fps: int, n: int) -> NDArray[np.float32]:
    """Return the vibration from each frame until the next, (frame, sample x channel)."""
    vibration = responses[dims.RA2]
    rate_hz = float(vibration.attrs[dims.SAMPLE_RATE])
    size = max(1, round(rate_hz / fps))
    begins = np.rint(responses[dims.TIME].values * rate_hz).astype(int)
    values = vibration.values
    found = np.zeros((n, size, values.shape[1]), np.float32)
    for number, first in enumerate(np.maximum(begins, 0)):
        part = values[first : first + size]
        found[number, : len(part)] = part
    return found.reshape(n, -1)


def _names(name: str, n: int) -> list[str]:
    """Return what the numbers of a feature are called."""
    if name == lerobot_files.DISPLACEMENT:
        return [f"marker_{m:03d}.{axis}" for m in range(n // 2) for axis in ("dx_px", "dy_px")]
    if name in (lerobot_files.DETECTED, lerobot_files.SA1, lerobot_files.RA1):
        return [f"marker_{m:03d}" for m in range(n)]
    if name == lerobot_files.RA2:
        return [f"sample_{k:04d}" for k in range(n)]
    return ["speed_mm_s"] if name == lerobot_files.STATE else ["seconds"]


def _task(responses: Responses) -> str:
    return f"feel texture {responses.attrs[dims.TEXTURE]}"


def _pictures(video: Video, n: int) -> Iterator[GreyImage]:
    """Yield the first n pictures of a video."""
    found = 0
    for frame in video.frames():
        if found == n:
            return
        found += 1
        yield frame.image
    if found < n:
        raise InputError(f"{video.path}: expected {n} frames, as the store has, found {found}")


def _videos(session: Path | None, recordings: Sequence[Responses]) -> dict[str, Video]:
    """Return the session's videos by name of the recording, all of one size."""
    if session is None:
        return {}
    found: dict[str, Recording] = {one.name: one for one in read_session(session).recordings}
    videos: dict[str, Video] = {}
    for responses in recordings:
        name = str(responses.attrs["name"])
        video = found[name].video if name in found else None
        if video is None:
            raise InputError(
                f"{session}: expected the video of the recording '{name}' of the store, found none"
            )
        videos[name] = video
    sizes = {(video.width, video.height) for video in videos.values()}
    if len(sizes) > 1:
        found_sizes = " and ".join(f"{w} x {h} px" for w, h in sorted(sizes))
        raise InputError(f"{session}: expected videos of one size, found {found_sizes}")
    return videos


def _frame_rate(store: Path, recordings: Sequence[Responses]) -> int:
    """Return the frames a second of all recordings, which LeRobot wants to be a whole number."""
    rates = [float(1 / np.median(np.diff(one[dims.TIME].values))) for one in recordings]
    fps = round(float(np.median(rates)))
    if max(abs(rate / max(fps, 1) - 1) for rate in rates) > _OFF_RATE:
        found = f"{min(rates):.2f} to {max(rates):.2f} frames/s"
        raise InputError(
            f"{store}: expected one whole number of frames a second in all recordings, found "
            f"{found}"
        )
    return fps


def _require_one_shape(store: Path, recordings: Sequence[Responses]) -> None:
    """Refuse sensors or sounds that differ: features have one shape."""
    for what, shapes in (
        ("as many markers", {one.sizes[dims.MARKER] for one in recordings}),
        (
            "sound of one rate and as many channels",
            {
                (one[dims.RA2].attrs[dims.SAMPLE_RATE], one[dims.RA2].shape[1])
                if dims.RA2 in one
                else None
                for one in recordings
            },
        ),
    ):
        if len(shapes) > 1:
            found = " and ".join(sorted(map(str, shapes)))
            raise InputError(f"{store}: expected {what} in all recordings, found {found}")


def export_lerobot(
    store: Place, out: Place, session: Place | None = None, quiet: bool = False
) -> int:
    """Write a store as a LeRobot data set (format 3.0): an episode a recording.

    Each frame of the camera holds the markers' displacement, SA-I, RA-I, the sound until the next
    frame, when it was taken and the sliding speed; the task is to feel the texture. Nothing acts,
    so there is no ``action``. LeRobot itself is not needed.

    Parameters
    ----------
    store
        As `extract` writes it.
    out
        Folder to write.
    session
        The folder that the store was extracted from, for its videos; None for no pictures.
    quiet
        Whether no progress is shown.

    Returns
    -------
    int
        Number of episodes.

    Raises
    ------
    InputError
        If there is no store, sensors or frame rates differ, the session is another one's, or `out`
        is there already.

    Examples
    --------
    >>> export_lerobot("responses.zarr", "touch-lerobot", session="session")
    130
    """
    folder = None if session is None else Path(session)
    with Progress(quiet) as progress:
        return write_lerobot(LeRobotExport(Path(store), Path(out), folder), progress)
