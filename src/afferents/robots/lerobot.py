"""A store as a LeRobot data set (format 3.0): an episode a recording, whole or not at all.

Tables in ``meta/`` say in which file each episode is
(https://huggingface.co/docs/lerobot/lerobot-dataset-v3). Here each has files of its own: a
recording of a minute fills them. Features of touch are named as proposals for LeRobot name them,
``observation.tactile.*`` (its pull requests 3175 and 4469).
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
import pandas as pd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from afferents import channels, dims, files, plugins
from afferents.errors import InputError
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.session import match_recordings
from afferents.store.recording import Video
from afferents.store.responses import Responses, speed_of
from afferents.store.zarr_store import open_whole

VERSION: Final = "v3.0"
DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
INFO, STATS, TASKS = "meta/info.json", "meta/stats.json", "meta/tasks.parquet"
FILES_A_CHUNK = 1000
DATA_MB, VIDEO_MB = 100, 200
"""LeRobot's own: up to these it puts several episodes into a file that it writes itself."""

CAMERA = "observation.images.fingertip"
DISPLACEMENT = "observation.tactile.fingertip.displacement"
DETECTED = "observation.tactile.fingertip.detected"
SA1, RA1 = "observation.tactile.fingertip.sa1", "observation.tactile.fingertip.ra1"
SHEAR, RA2 = "observation.tactile.fingertip.shear", "observation.tactile.fingertip.ra2"
TIME = "observation.capture_time"
STATE = "observation.state"

_OFF_RATE = 0.01
"""Frame rates of recordings may differ from each other, and from a whole number, by this share."""
_CODEC = {"crf": "18", "preset": "veryfast", "g": "2"}
"""Every second frame can be decoded by itself: LeRobot reads single frames at random."""
_SEEN = 100
"""Pictures of an episode that statistics are made of, evenly spread."""
_QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

Stats = dict[str, NDArray[Any]]


def export_lerobot(
    store: files.Place, out: files.Place, session: files.Place | None = None, quiet: bool = False
) -> int:
    """Write a store as a LeRobot data set (format 3.0): an episode a recording.

    Each frame of the camera holds the markers' displacement, SA-I, RA-I, the global shear, the
    sound until the next frame, when it was taken and the sliding speed, where it is known; the task
    is to feel the texture. Nothing acts, so there is no ``action``. LeRobot itself is not needed.

    Parameters
    ----------
    store
        A store that 'extract' wrote.
    out
        Folder to write.
    session
        Session folder that the store was extracted from, for its videos.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    int
        Number of episodes.

    Raises
    ------
    InputError
        If there is no store or half of one, it has no markers, sensors or frame rates differ, only
        some recordings have a speed, the session is another one's, `out` is there already, or the
        extra `parquet` is not installed.

    Examples
    --------
    >>> export_lerobot("responses.zarr", "touch-lerobot", session="session")
    130
    """
    plugins.import_extra("parquet", "export-lerobot", "pyarrow")
    store, out = Path(store), Path(out)
    files.require_free(out, files.holds_only())
    recordings = [
        one for one in open_whole(store) if dims.POSITION in one and not dims.of_cells(one)
    ]
    if not recordings:
        raise InputError(f"{store}: expected recordings with markers, found none")
    videos = {} if session is None else _find_videos(Path(session), recordings)
    fps = _require_alike(store, recordings)
    tasks = sorted({_task(one) for one in recordings})
    with Progress(quiet) as progress, files.write_aside(out, files.holds_only()) as partial:
        written = _DataSet(partial, fps, tasks)
        for responses in progress.track(recordings, "exporting", len(recordings)):
            written.add_episode(responses, videos.get(str(responses.attrs["name"])))
        written.add_meta(_describe_features(recordings[0], fps, next(iter(videos.values()), None)))
    return len(recordings)


@dataclass
class _DataSet:
    """A data set that is being written.

    Attributes
    ----------
    root
        Its folder.
    fps
        Frames a second.
    tasks
        All that there are.
    rows, stats
        Of each episode that is written: its row in the table of episodes, and statistics of its
        features.
    """

    root: Path
    fps: int
    tasks: list[str]
    rows: list[dict[str, Any]] = field(default_factory=list)
    stats: list[dict[str, Stats]] = field(default_factory=list)

    def add_episode(self, responses: Responses, video: Video | None) -> None:
        """Write a recording, whose frames are numbered on from those of the one before."""
        number, fps = len(self.rows), self.fps
        first = self.rows[-1]["dataset_to_index"] if self.rows else 0
        chunk, file = divmod(number, FILES_A_CHUNK)
        place = {"chunk_index": chunk, "file_index": file}
        frames = {name: values for name, (values, _) in _features(responses, fps).items()}
        n = len(frames[TIME])
        frames |= {
            "timestamp": (np.arange(n) / fps).astype(np.float32),
            "frame_index": np.arange(n),
            "episode_index": np.full(n, number),
            "index": first + np.arange(n),
            "task_index": np.full(n, self.tasks.index(_task(responses))),
        }
        _write_table(self.root / DATA.format(**place), frames)
        stats = {name: compute_stats(values) for name, values in frames.items()}
        row = {
            "episode_index": number,
            "tasks": [_task(responses)],
            "length": n,
            "dataset_from_index": first,
            "dataset_to_index": first + n,
            "data/chunk_index": chunk,
            "data/file_index": file,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            "recording": str(responses.attrs["name"]),
        }
        if video is not None:
            path = self.root / VIDEO.format(video_key=CAMERA, **place)
            stats[CAMERA] = _write_video(path, video, n, fps)
            where = {**place, "from_timestamp": 0.0, "to_timestamp": n / fps}
            row |= {f"videos/{CAMERA}/{key}": value for key, value in where.items()}
        row |= {f"stats/{k}/{s}": v.tolist() for k, one in stats.items() for s, v in one.items()}
        self.rows.append(row)
        self.stats.append(stats)

    def add_meta(self, features: dict[str, Any]) -> None:
        """Write what is known of all episodes, which are there; see `_describe_features`."""
        import pyarrow as pa
        import pyarrow.parquet as pq

        episodes, n_tasks = self.root / EPISODES, len(self.tasks)
        episodes.parent.mkdir(parents=True)
        pq.write_table(pa.Table.from_pylist(self.rows), episodes.absolute())
        named = pd.DataFrame({"task_index": range(n_tasks)}, pd.Index(self.tasks, name="task"))
        named.to_parquet((self.root / TASKS).absolute())
        whole = {name: merge_stats([one[name] for one in self.stats]) for name in self.stats[0]}
        info = {
            "codebase_version": VERSION,
            "robot_type": "tactile_fingertip",
            "total_episodes": len(self.rows),
            "total_frames": self.rows[-1]["dataset_to_index"],
            "total_tasks": n_tasks,
            "chunks_size": FILES_A_CHUNK,
            "data_files_size_in_mb": DATA_MB,
            "video_files_size_in_mb": VIDEO_MB,
            "fps": self.fps,
            "splits": {"train": f"0:{len(self.rows)}"},
            "data_path": DATA,
            "video_path": VIDEO if CAMERA in features else None,
            "features": features,
        }
        stats = {name: {s: v.tolist() for s, v in one.items()} for name, one in whole.items()}
        for path, content in ((STATS, stats), (INFO, info)):
            (self.root / path).write_text(json.dumps(content, indent=4))


def _features(responses: Responses, fps: int) -> dict[str, tuple[NDArray[Any], list[str]]]:
    """Return what is known of each frame; of a marker that is lost it is 0, and not detected.

    So is the shear of a frame with too few markers.

    Returns
    -------
    dict
        By name, values (frame, n), and what the n numbers are called.
    """
    position = responses[dims.POSITION].values
    moved = position - responses[dims.REST_POSITION].values
    seen = responses[dims.DETECTED].values & np.isfinite(moved).all(axis=2)
    n, n_markers = seen.shape
    shear = channels.CHANNELS[dims.SHEAR]
    markers = [f"marker_{marker:03d}" for marker in range(n_markers)]
    ways = [f"{marker}.{axis}" for marker in markers for axis in ("dx_px", "dy_px")]
    found = {
        DISPLACEMENT: (np.where(seen[..., None], moved, 0).reshape(n, -1), ways),
        SA1: (np.nan_to_num(responses[dims.SA1].values), markers),
        RA1: (np.nan_to_num(responses[dims.RA1].values), markers),
        SHEAR: (np.nan_to_num(shear.response(responses).values), list(shear.parts)),
        TIME: (responses[dims.TIME].values[:, None], ["seconds"]),
    }
    if (speed := speed_of(responses)) is not None:
        found[STATE] = np.full((n, 1), speed), ["speed_mm_s"]
    if dims.RA2 in responses:
        rate_hz = float(responses[dims.RA2].attrs[dims.SAMPLE_RATE])
        size = max(1, round(rate_hz / fps))  # from each frame until the next
        # after the end, silence
        padded = np.pad(responses[dims.RA2].values, ((0, size), (0, 0)))
        begins = np.rint(responses[dims.TIME].values * rate_hz).astype(int)
        windows = sliding_window_view(padded, size, axis=0)[np.clip(begins, 0, len(padded) - size)]
        sound = windows.swapaxes(1, 2).reshape(n, -1)  # (frame, sample x channel)
        found[RA2] = sound, [f"sample_{k:04d}" for k in range(sound.shape[1])]
    floats = {name: (values.astype(np.float32), names) for name, (values, names) in found.items()}
    return {**floats, DETECTED: (seen, markers)}


def _write_table(path: Path, frames: dict[str, NDArray[Any]]) -> None:
    """Write columns, (frame,) or (frame, n), of numbers or of lists of n."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    path.parent.mkdir(parents=True, exist_ok=True)
    columns = {}
    for name, values in frames.items():
        columns[name] = pa.array(values.ravel())
        if values.size > len(values):
            columns[name] = pa.FixedSizeListArray.from_arrays(columns[name], values.shape[1])
    pq.write_table(pa.table(columns), path.absolute())


def _write_video(path: Path, video: Video, n: int, fps: int) -> Stats:
    """Write the first `n` pictures, at a constant rate.

    Returns
    -------
    Stats
        Of each colour, 0 to 1, (3, 1, 1), from some of the pictures.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    number, seen = 0, []
    with av.open(f"file:{path}", "w", format="mp4") as out:
        stream = out.add_stream("libx264", rate=fps, options=_CODEC)
        stream.width, stream.height, stream.pix_fmt = video.width, video.height, "yuv420p"
        for number, shown in enumerate(islice(video.frames(), n), 1):
            frame = av.VideoFrame.from_ndarray(shown.image, format="gray")
            frame = frame.reformat(format="yuv420p")
            frame.pts, frame.time_base = number - 1, Fraction(1, fps)
            out.mux(stream.encode(frame))
            if (number - 1) % max(1, n // _SEEN) == 0:
                seen.append(shown.image[::4, ::4])
        out.mux(stream.encode(None))
    if number < n:
        raise InputError(f"{video.path}: expected {n} frames, as the store has, found {number}")
    grey = compute_stats(np.stack(seen).reshape(-1, 1) / 255)
    colours = {name: np.tile(value, 3).reshape(3, 1, 1) for name, value in grey.items()}
    return {**colours, "count": np.array([len(seen)])}


def compute_stats(values: NDArray[Any]) -> Stats:
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


def merge_stats(parts: Sequence[Stats]) -> Stats:
    """Return the statistics of all episodes, from those of each; quantiles are mean ones.

    Chan, Golub & LeVeque 1979 put means and variances together, as LeRobot does.
    """
    of = {name: np.stack([part[name] for part in parts]) for name in parts[0]}
    n = of["count"].ravel()
    mean = np.average(of["mean"], axis=0, weights=n)
    variance = np.average(of["std"] ** 2 + (of["mean"] - mean) ** 2, axis=0, weights=n)
    return {
        "min": of["min"].min(axis=0),
        "max": of["max"].max(axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": np.array([n.sum()]),
        **{name: np.average(of[name], axis=0, weights=n) for name in _QUANTILES},
    }


def _describe_features(first: Responses, fps: int, video: Video | None) -> dict[str, Any]:
    """Return what each feature is, as `meta/info.json` has it."""
    found: dict[str, Any] = {
        name: {"dtype": str(values.dtype), "shape": [values.shape[1]], "names": names}
        for name, (values, names) in _features(first, fps).items()
    }
    if video is not None:
        about = {
            "video.height": video.height, "video.width": video.width, "video.codec": "h264",
            "video.pix_fmt": "yuv420p", "video.is_depth_map": False, "video.fps": fps,
            "video.channels": 3, "has_audio": False,
        }  # fmt: skip
        shape, names = [video.height, video.width, 3], ["height", "width", "channels"]
        found[CAMERA] = {"dtype": "video", "shape": shape, "names": names, "info": about}
    found["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        found[name] = {"dtype": "int64", "shape": [1], "names": None}
    return found


def _task(responses: Responses) -> str:
    return f"feel texture {responses.attrs[dims.TEXTURE]}"


def _find_videos(session: Path, recordings: Sequence[Responses]) -> dict[str, Video]:
    """Return the session's videos by name of the recording, all of one size."""
    found = match_recordings(read_session(session), recordings)
    videos: dict[str, Video] = {}
    for name in (str(responses.attrs["name"]) for responses in recordings):
        video = found[name].video
        if video is None:
            raise InputError(f"{session}: expected a video of the recording '{name}', found none")
        videos[name] = video
    sizes = sorted({(video.width, video.height) for video in videos.values()})
    if len(sizes) > 1 or any(px % 2 for px in sizes[0]):
        shown = " and ".join(f"{w} x {h} px" for w, h in sizes)
        raise InputError(
            f"{session}: expected videos of one size, of an even width and height, as H.264 wants "
            f"them, found {shown}; leave --session out"
        )
    return videos


def _require_alike(store: Path, recordings: Sequence[Responses]) -> int:
    """Return the frames a second of all recordings, which LeRobot wants to be a whole number.

    Refuse sensors or sounds that differ, or speeds that some lack: features have one shape.
    """
    rates = [float(1 / np.median(np.diff(one[dims.TIME].values))) for one in recordings]
    fps = round(float(np.median(rates)))
    if max(abs(rate / max(fps, 1) - 1) for rate in rates) > _OFF_RATE:
        raise InputError(
            f"{store}: expected one whole number of frames a second in all recordings, found "
            f"{min(rates):.2f} to {max(rates):.2f} frames/s"
        )
    shapes = set()
    for one in recordings:
        sound = "no sound"
        if dims.RA2 in one:
            rate_hz = one[dims.RA2].attrs[dims.SAMPLE_RATE]
            sound = f"sound of {one.sizes[dims.CHANNEL]} channels at {rate_hz:g} Hz"
        speed = "no speed" if speed_of(one) is None else "a speed"
        shapes.add(f"{one.sizes[dims.MARKER]} markers, {sound} and {speed}")
    if len(shapes) > 1:
        expected = "as many markers, sound of one rate and as many channels, and a speed or none"
        found = "; ".join(sorted(shapes))
        raise InputError(f"{store}: expected {expected}, in all recordings, found {found}")
    return fps
