"""Recordings made elsewhere, with time stamps of their own, brought into a session."""

import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np
import pandas as pd
import soundfile
from numpy.typing import NDArray

from afferents.devices.base import CameraSettings
from afferents.documents import read_json
from afferents.errors import InputError, reason_of
from afferents.files import checksum, write_aside, write_json
from afferents.outputs import require_new_folder, writing_alone
from afferents.recorder.files import CONTAINER, TICKS_HZ, TIME_BASE
from afferents.recorder.gate import Check, count, frames_checks
from afferents.recorder.plan import FASTEST_MM_S, Tolerance, is_texture
from afferents.recorder.run import AUDIO, VIDEO
from afferents.recorder.session import RUN
from afferents.recordings.run_log import FrameRow, Log
from afferents.recordings.session_file import SESSION_FILE
from afferents.recordings.video import VideoFile

TIME, SEQUENCE = "time_s", "sequence"
_DECLARED = ("fps_hz", "frame_width", "frame_height", "sample_rate_hz", "audio_channels")


@dataclass(frozen=True)
class Import:
    """What is imported.

    Attributes
    ----------
    video, audio
        Files; without sound `audio` is None.
    times
        CSV with a row a frame: `time_s`, and `sequence` where the camera numbers its frames.
    texture, speed_mm_s
        What was recorded.
    audio_start_s
        When the first sample was taken, on the clock of `times`; None for with the first frame.
    keep
        Whether it is imported although the gate refuses it.
    bag
        The bag of ROS that the files were taken out of; None for files of somebody's.
    """

    video: Path
    audio: Path | None
    times: Path
    session: Path
    texture: str
    speed_mm_s: float
    audio_start_s: float | None = None
    keep: bool = False
    bag: Path | None = None

    @property
    def name(self) -> str:
        """Of the recording."""
        return f"{self.texture}/{self.speed_mm_s:g}"


def import_recording(wanted: Import) -> list[Check]:
    """Write a recording of a session from files and their time stamps.

    Returns
    -------
    What the gate says.

    Raises
    ------
    InputError
        If a file or its times are not what they should be, the recording is there already, or
        the gate refuses it (unless `keep`).
    """
    _require_label(wanted)
    table = _times(wanted.times)
    video = VideoFile(wanted.video)
    declared = _declared(wanted, video, table)
    earlier = _earlier(wanted, declared)
    target = wanted.session / wanted.name
    if target.exists():
        raise InputError(
            f"{target}: expected a recording that is new, found one; choose another session"
        )
    log, checks = _judged(wanted, video, table)
    with writing_alone(wanted.session, "import"):
        with write_aside(target) as partial:
            partial.mkdir()
            zero_s = _write_sound(wanted, float(table[TIME].iloc[0]), partial / AUDIO)
            log.origin_s = zero_s
            _retime(wanted.video, table[TIME].to_numpy() - zero_s, partial / VIDEO)
            log.write(partial)
            write_json(partial / RUN, _about(partial, wanted, checks))
        _note(wanted.session, earlier, declared)
    return checks


def _require_label(wanted: Import) -> None:
    """Refuse a texture or speed that can't be a folder."""
    if not is_texture(wanted.texture):
        raise InputError(
            f"--texture: expected a name that a folder may have, found '{wanted.texture}'"
        )
    if not 0 < wanted.speed_mm_s <= FASTEST_MM_S:
        expected = f"a speed above 0 and up to {FASTEST_MM_S:g} mm/s"
        raise InputError(f"--speed: expected {expected}, found {wanted.speed_mm_s:g}")


def _times(path: Path) -> pd.DataFrame:
    """Read the table of times.

    Raises
    ------
    InputError
        If it has no times, or they do not rise.
    """
    what = f"a CSV with a column {TIME}, a row a frame"
    try:
        table = pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: expected {what}, found {reason_of(error)}") from error
    if TIME not in table:
        raise InputError(
            f"{path}: expected {what}, found columns {', '.join(map(str, table.columns))}"
        )
    if len(table) < 2:
        raise InputError(f"{path}: expected {what}, of at least 2 frames, found {len(table)} rows")
    try:
        table = table.astype({TIME: float, **({SEQUENCE: int} if SEQUENCE in table else {})})
    except ValueError as error:
        raise InputError(f"{path}: expected numbers, found {reason_of(error)}") from error
    wrong = np.flatnonzero(~(np.diff(table[TIME]) > 0))
    if len(wrong) or not np.isfinite(table[TIME]).all():
        row = int(wrong[0]) + 1 if len(wrong) else 0
        raise InputError(
            f"{path}: expected times that rise, found {table[TIME].iloc[row]} in row {row + 1}"
        )
    return table


def _numbers(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frames' numbers as their times tell: each step is a whole number of frames."""
    step_s = np.diff(time_s)
    return np.concatenate([[0], np.cumsum(np.maximum(1, np.rint(step_s / np.median(step_s))))])


def _rate_hz(time_s: NDArray[np.float64]) -> float:
    """Return the frame rate over the whole time, on which the jitter of single frames is lost."""
    return float(_numbers(time_s)[-1] / (time_s[-1] - time_s[0]))


def _judged(wanted: Import, video: VideoFile, table: pd.DataFrame) -> tuple[Log, list[Check]]:
    """Let the gate look at the frames; numbers that are missing are worked out from the times."""
    time_s = table[TIME].to_numpy()
    rate_hz = _rate_hz(time_s)
    numbers = table[SEQUENCE] if SEQUENCE in table else _numbers(time_s)
    log = Log(origin_s=float(time_s[0]))
    log.frames = [
        FrameRow(int(number), float(at_s), float("nan"), False, False, True)
        for number, at_s in zip(numbers, time_s, strict=True)
    ]
    settings = CameraSettings(str(wanted.video), "file", video.width, video.height, rate_hz)
    counts = count(log, settings, (time_s[-1] - time_s[0]) + 1 / rate_hz)
    checks = frames_checks(counts, Tolerance())
    failed = [check for check in checks if not check.passes]
    if failed and not wanted.keep:
        raise InputError(
            f"{wanted.bag or wanted.times}: expected a recording that the gate lets pass, found "
            f"{'; '.join(f'{check.name}: {check.found}' for check in failed)}; record it again, "
            "or import it nevertheless with --keep"
        )
    return log, checks


def _retime(video: Path, time_s: NDArray[np.float64], target: Path) -> None:
    """Copy a video's frames, not encoded again, under other times.

    Raises
    ------
    InputError
        If there are more or fewer frames than times, or they are not in order of presentation.
    """
    try:
        with av.open(f"file:{video}") as source:
            packets = [packet for packet in source.demux(video=0) if packet.size]
            _require_frames(video, packets, len(time_s))
            with av.open(f"file:{target}", "w", format="mp4", options=CONTAINER) as out:
                stream = out.add_stream_from_template(source.streams.video[0])
                stream.time_base = TIME_BASE
                for packet, at_s in zip(packets, time_s, strict=True):
                    packet.stream, packet.time_base = stream, TIME_BASE
                    packet.pts = packet.dts = round(at_s * TICKS_HZ)
                    packet.duration = 0
                    out.mux(packet)
    except av.FFmpegError as error:
        raise InputError(
            f"{video}: expected a video that mp4 can hold, found {reason_of(error)}"
        ) from error


def _require_frames(video: Path, packets: "list[av.Packet[Any]]", n: int) -> None:
    if len(packets) != n:
        raise InputError(f"{video}: expected {n} frames, as there are times, found {len(packets)}")
    shown = [packet.pts for packet in packets if packet.pts is not None]
    if shown != sorted(shown):
        raise InputError(
            f"{video}: expected frames in the order in which they are shown, found B-frames; "
            f"encode it again: ffmpeg -i {video.name} -c:v libx264 -qp 0 -bf 0 OUT.mp4"
        )


def _write_sound(wanted: Import, first_s: float, target: Path) -> float:
    """Write the sound so that it and the video count from one moment; return which, s.

    Where the sound began after the video, silence stands for what is missing.
    """
    if wanted.audio is None:
        return first_s
    start_s = first_s if wanted.audio_start_s is None else wanted.audio_start_s
    if start_s <= first_s and wanted.audio.suffix.lower() == ".wav":
        shutil.copyfile(wanted.audio, target)
        return start_s
    samples, rate_hz = _samples(wanted.audio)
    missing = round(max(0.0, start_s - first_s) * rate_hz)
    padded = np.concatenate([np.zeros((missing, samples.shape[1]), samples.dtype), samples])
    soundfile.write(target, padded, rate_hz, "PCM_16", format="WAV")
    return start_s - missing / rate_hz


def _samples(audio: Path) -> tuple[NDArray[np.int16], int]:
    try:
        samples, rate_hz = soundfile.read(str(audio), dtype="int16", always_2d=True)
    except soundfile.SoundFileError as error:
        raise InputError(
            f"{audio}: expected a readable sound file, found {reason_of(error)}"
        ) from error
    return samples, int(rate_hz)


def _declared(wanted: Import, video: VideoFile, table: pd.DataFrame) -> dict[str, Any]:
    """Return what `session.json` is to say of the files."""
    said: dict[str, Any] = {
        "fps_hz": round(_rate_hz(table[TIME].to_numpy()), 3),
        "frame_width": video.width,
        "frame_height": video.height,
    }
    if wanted.audio is not None:
        try:
            info = soundfile.info(str(wanted.audio))
        except soundfile.SoundFileError as error:
            raise InputError(
                f"{wanted.audio}: expected a readable sound file, found {reason_of(error)}"
            ) from error
        said |= {
            "sample_rate_hz": info.samplerate,
            "audio_channels": info.channels,
            "sensor_channel": info.channels - 1,
        }
    return said


def _earlier(wanted: Import, declared: Mapping[str, Any]) -> dict[str, Any]:
    """Return what the session says already.

    Raises
    ------
    InputError
        If it holds something else, or recordings of other rates or sizes.
    """
    path = wanted.session / SESSION_FILE
    if not path.is_file():
        require_new_folder(wanted.session, "a new session")
        return {}
    earlier = read_json(path, "a session file")
    for key in _DECLARED:
        before, now = earlier.get(key), declared.get(key)
        if before is None or now is None or abs(before - now) <= 0.1 * before * (key == "fps_hz"):
            continue
        where = wanted.bag or wanted.video
        raise InputError(f"{where}: expected {key} {before:g}, as in {path}, found {now:g}")
    return earlier


def _about(folder: Path, wanted: Import, checks: list[Check]) -> dict[str, Any]:
    files = [path for name in (VIDEO, AUDIO) if (path := folder / name).is_file()]
    return {
        "checksums": {path.name: checksum(path) for path in files},
        "checks": [check.as_json() for check in checks],
        "imported": {"video": str(wanted.video), "audio": str(wanted.audio or "")}
        if wanted.bag is None
        else {"bag": str(wanted.bag)},
    }


def _note(session: Path, earlier: Mapping[str, Any], declared: Mapping[str, Any]) -> None:
    """Write `session.json`: what is not there of the grid are holes."""
    runs = {
        f"{path.parts[-3]}/{path.parts[-2]}": read_json(path, "a run")["checksums"]
        for path in sorted(session.glob(f"*/*/{RUN}"))
    }
    there = {tuple(name.split("/")) for name in runs}
    grid = {(texture, speed) for texture, _ in there for _, speed in there}
    holes = [[texture, float(speed)] for texture, speed in sorted(grid - there)]
    content = {**declared, **earlier, "holes": holes, "checksums": runs}
    write_json(session / SESSION_FILE, content)
