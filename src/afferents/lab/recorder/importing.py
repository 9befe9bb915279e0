"""Recordings made elsewhere, with time stamps of their own, brought into a session."""

import shutil
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import av
import numpy as np
import pandas as pd
import soundfile
from numpy.typing import NDArray

from afferents import documents, files, outputs
from afferents.errors import InputError, reading
from afferents.lab.recorder import bags, gate, plan
from afferents.lab.recorder.session import RUN, require_same_rates
from afferents.lab.writers import CONTAINER, TICKS_HZ, TIME_BASE
from afferents.recordings import media, run_log, session_file
from afferents.recordings.audio import WavFile, reading_sound, sound_name
from afferents.recordings.layouts import AUDIO, VIDEO, recording_folders
from afferents.recordings.video import VideoFile

TIME, SEQUENCE = "time_s", "sequence"
_RATES_HZ = 1.0, 5000.0
"""Of cameras: times at other rates are not in seconds."""


def import_recording(
    video: files.Place,
    audio: files.Place | None = None,
    times: files.Place | None = None,
    *,
    session: files.Place,
    texture: str,
    speed_mm_s: float,
    audio_start_s: float | None = None,
    keep: bool = False,
    image_topic: str | None = None,
    audio_topic: str | None = None,
    audio_rate_hz: int | None = None,
    audio_channels: int | None = None,
) -> list[gate.Check]:
    """Bring a recording made elsewhere into a session, with its own time stamps.

    Parameters
    ----------
    video
        Video, whose frames are not encoded again; or a bag of ROS (rosbag2, .mcap, .bag; extra
        mcap), which holds times and sound too.
    audio
        Sound that belongs to it.
    times
        CSV with a row a frame: time_s, and sequence if frames are numbered. Not of a bag.
    session
        Session folder to write, or to add to.
    texture
        Texture that was recorded.
    speed_mm_s
        Its sliding speed, mm/s.
    audio_start_s
        Time of the first sample on the clock of the times, s (default: with the first frame).
    keep
        Import it although frames are missing.
    image_topic
        Topic of a bag's pictures (default: the only one).
    audio_topic
        Topic of a bag's sound (default: the only one).
    audio_rate_hz
        Samples a second of a bag's sound, if it states none (default: 44100).
    audio_channels
        Channels of a bag's sound, if it states none (default: 1).

    Returns
    -------
    list
        What the checks of a run find in the frames, a `Check` each.

    Raises
    ------
    InputError
        If a file or its times are not what they should be, the recording is there already, or
        frames are missing (unless `keep`).
    """
    source, target = Path(video), Path(session)
    try:
        plan.require_texture(texture)
    except ValueError as error:
        raise InputError(f"--texture: expected {error}, found '{texture}'") from None
    if not 0 < speed_mm_s <= plan.FASTEST_MM_S:
        expected = f"a speed above 0 and up to {plan.FASTEST_MM_S:g} mm/s"
        raise InputError(f"--speed: expected {expected}, found {speed_mm_s:g}")
    if not media.is_bag(source):
        if times is None:
            raise InputError(
                "--times: expected a CSV with the time of each frame, found none; or give a bag"
            )
        sound = None if audio is None else Path(audio)
        time_s, sequence = _read_times(Path(times))
        start_s = float(time_s[0]) if audio_start_s is None else audio_start_s
        origin = {"video": str(source), "audio": str(sound or "")}
        given = bags.ImportedFiles(source, sound, time_s, start_s, source, origin, sequence)
        return _write(given, target, texture, speed_mm_s, keep)
    if audio is not None or times is not None:
        raise InputError(
            f"{source}: expected a bag alone, which holds sound and times, found more files"
        )
    wanted = image_topic, audio_topic, audio_rate_hz, audio_channels
    with tempfile.TemporaryDirectory(prefix="afferents-bag-") as folder:
        given = bags.extract_files(source, Path(folder), *wanted)
        if audio_start_s is not None:
            given = given._replace(audio_start_s=audio_start_s)
        return _write(given, target, texture, speed_mm_s, keep)


def _write(
    given: bags.ImportedFiles, session: Path, texture: str, speed_mm_s: float, keep: bool
) -> list[gate.Check]:
    """Write a recording of a session."""
    declared, earlier = _declare(given), dict[str, Any]()
    if (file := session / session_file.SESSION_FILE).is_file():
        earlier = documents.read_json(file, "a session file")
        require_same_rates(given.where, file, earlier, declared)
    else:
        files.require_free(session, files.holds_only())
    target = session / f"{texture}/{speed_mm_s:g}"
    files.require_free(target)
    log, checks = _check(given, keep)
    with outputs.writing_alone(session, "import"):
        with files.write_aside(target) as partial:
            partial.mkdir()
            log.origin_s = _write_sound(given, partial / AUDIO)
            _retime(given.video, given.time_s - log.origin_s, partial / VIDEO)
            log.write(partial)
            written = [path for name in (VIDEO, AUDIO) if (path := partial / name).is_file()]
            about = {
                "checksums": {path.name: files.checksum(path) for path in written},
                "checks": [check.as_json() for check in checks],
                "imported": given.origin,
            }
            files.write_json(partial / RUN, about)
            if not earlier:  # before the recording appears: killed here, another can still join
                files.write_json(file, declared)
        _write_session(session, earlier, declared)
    return checks


def _read_times(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64] | None]:
    """Return the times of frames, s, and their numbers, if a table has any.

    Raises
    ------
    InputError
        If it has no times, or they do not rise, or are not in seconds.
    """
    what = f"a CSV with a column {TIME}, a row a frame"
    with reading(path, what, OSError, ValueError):
        table = pd.read_csv(path, dtype={TIME: float})
        table = table.astype({SEQUENCE: int} if SEQUENCE in table else {})
    if TIME not in table or len(table) < 2:
        found = f"{len(table)} rows of columns {', '.join(map(str, table.columns))}"
        raise InputError(f"{path}: expected {what}, of at least 2 frames, found {found}")
    time_s = table[TIME].to_numpy()
    wrong = np.flatnonzero(~(np.diff(time_s) > 0))
    if len(wrong) or not np.isfinite(time_s).all():
        row = int(wrong[0]) + 1 if len(wrong) else 0
        raise InputError(f"{path}: expected times that rise, found {time_s[row]} in row {row + 1}")
    low, high = _RATES_HZ
    if not low <= (rate_hz := _measure_rate(time_s)) <= high:
        raise InputError(
            f"{path}: expected times in s, found {rate_hz:.3g} frames/s; are they in ms or ns?"
        )
    return time_s, table[SEQUENCE].to_numpy() if SEQUENCE in table else None


def _number_frames(time_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the frames' numbers by their times: each step is a whole number of frames."""
    step_s = np.diff(time_s)
    return np.concatenate([[0], np.cumsum(np.maximum(1, np.rint(step_s / np.median(step_s))))])


def _measure_rate(time_s: NDArray[np.float64]) -> float:
    """Return the frame rate over the whole time, on which the jitter of single frames is lost."""
    return float(_number_frames(time_s)[-1] / (time_s[-1] - time_s[0]))


def _check(given: bags.ImportedFiles, keep: bool) -> tuple[run_log.Log, list[gate.Check]]:
    """Look at the frames; numbers that are missing are worked out from the times."""
    time_s, rate_hz = given.time_s, _measure_rate(given.time_s)
    numbers = _number_frames(time_s) if given.sequence is None else given.sequence
    log = run_log.Log(origin_s=float(time_s[0]))
    log.frames = [
        run_log.FrameRow(int(number), float(at_s), float("nan"), False, False, True)
        for number, at_s in zip(numbers, time_s, strict=True)
    ]
    counts = gate.count_frames(log, rate_hz, (time_s[-1] - time_s[0]) + 1 / rate_hz)
    checks = gate.check_frames(counts, plan.Tolerance())
    failed = [f"{check.name}: {check.found}" for check in checks if not check.passes]
    if failed and not keep:
        raise InputError(
            f"{given.where}: expected a recording without missing frames, found "
            f"{'; '.join(failed)}; record it again, or import it nevertheless with --keep"
        )
    return log, checks


def _retime(video: Path, time_s: NDArray[np.float64], target: Path) -> None:
    """Copy a video's frames, not encoded again, under other times.

    Raises
    ------
    InputError
        If there are more or fewer frames than times, they are not in order of presentation, or mp4
        can't hold them.
    """
    holds = reading(video, "a video that mp4 can hold", av.FFmpegError, ValueError)
    with holds, av.open(f"file:{video}") as source:
        packets = [packet for packet in source.demux(video=0) if packet.size]
        stream = source.streams.video[0]
        n, found = len(time_s), len(packets)
        if found != n:
            raise InputError(f"{video}: expected {n} frames, as there are times, found {found}")
        shown = [packet.pts for packet in packets if packet.pts is not None]
        # Of an AVI, which keeps none, times are made up in the order of decoding.
        if stream.codec_context.has_b_frames or shown != sorted(shown):
            raise InputError(
                f"{video}: expected frames in the order in which they are shown, found B-frames; "
                f"encode it again: ffmpeg -i {video.name} -c:v libx264 -qp 0 -bf 0 OUT.mp4"
            )
        with av.open(f"file:{target}", "w", format="mp4", options=CONTAINER) as out:
            # opaque: else PyAV wants an encoder, and has none for all that it decodes
            copied = out.add_stream_from_template(stream, opaque=True)
            copied.time_base = TIME_BASE
            for packet, at_s in zip(packets, time_s, strict=True):
                packet.stream, packet.time_base = copied, TIME_BASE
                packet.pts = packet.dts = round(at_s * TICKS_HZ)
                packet.duration = 0
                out.mux(packet)


def _write_sound(given: bags.ImportedFiles, target: Path) -> float:
    """Write the sound so that it and the video count from one moment; return which, s.

    Where the sound began after the video, silence stands for what is missing.
    """
    first_s = float(given.time_s[0])
    if given.audio is None:
        return first_s
    start_s = given.audio_start_s
    if start_s <= first_s and given.audio.suffix.lower() == ".wav":
        shutil.copyfile(given.audio, target)
        return start_s
    # read as int16, floats of -1 to 1 would all become 0
    kind = "float64" if WavFile(given.audio).header.subtype in ("FLOAT", "DOUBLE") else "int16"
    with reading_sound(given.audio):
        samples, rate_hz = soundfile.read(sound_name(given.audio), dtype=kind, always_2d=True)
    missing = round(max(0.0, start_s - first_s) * rate_hz)
    padded = np.pad(samples, ((missing, 0), (0, 0)))
    soundfile.write(target, padded, rate_hz, "PCM_16", format="WAV")
    return float(start_s - missing / rate_hz)


def _declare(given: bags.ImportedFiles) -> dict[str, Any]:
    """Return what `session.json` is to hold on the files; refuse sound outside of all frames."""
    sound: dict[str, Any] = {}
    if given.audio is not None:
        info = WavFile(given.audio).header
        start_s, (first_s, last_s) = given.audio_start_s, given.time_s[[0, -1]]
        end_s = start_s + info.duration
        if not (start_s <= last_s and end_s >= first_s):
            found = f"{start_s:.3f} to {end_s:.3f} s; is --audio-start on their clock?"
            expected = f"sound while there are frames, {first_s:.3f} to {last_s:.3f} s"
            raise InputError(f"{given.where}: expected {expected}, found {found}")
        sound = {
            "sample_rate_hz": info.samplerate,
            "audio_channels": info.channels,
            "sensor_channel": info.channels - 1,
        }
    video = VideoFile(given.video)
    rate_hz = round(_measure_rate(given.time_s), 3)
    return {"fps_hz": rate_hz, "frame_width": video.width, "frame_height": video.height} | sound


def _write_session(session: Path, earlier: Mapping[str, Any], declared: Mapping[str, Any]) -> None:
    """Write `session.json`: what is not there of the grid are holes."""
    names = {folder: folder.relative_to(session) for folder in recording_folders(session)}
    runs = {
        name.as_posix(): documents.read_json(folder / RUN, "a run")["checksums"]
        for folder, name in sorted(names.items())
        if (folder / RUN).is_file()  # of those that were recorded or imported here
    }
    there: set[tuple[str, float]] = set()
    for texture, speed, *_ in (name.parts for name in names.values()):
        with suppress(ValueError):  # a folder that no speed names is refused when it is read
            there.add((texture, float(speed)))
    grid = {(texture, speed) for texture, _ in there for _, speed in there}
    grid |= {(str(texture), float(speed)) for texture, speed in earlier.get("holes", ())}
    content = {
        **declared,
        **earlier,
        "holes": sorted(map(list, grid - there)),
        "checksums": {**earlier.get("checksums", {}), **runs},
    }
    files.write_json(session / session_file.SESSION_FILE, content)
