"""Recordings as ROS 2 bags in MCAP files: what each holds, as stamped messages in order of time.

Times count from the recording's own zero, that of its video and its sound.
"""

import heapq
import json
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import soundfile
import xarray as xr
from numpy.typing import NDArray

from afferents import dims, files
from afferents.errors import InputError, reading
from afferents.progress import Progress
from afferents.recordings.audio import reading_sound, sound_name
from afferents.recordings.ros_messages import NS, NUMBER, POSITIONS, TEXT, Bag, Messages, typestore
from afferents.robots.sources import QUALITY, Chosen, find_recordings, jpegs
from afferents.store.drum_path import DrumPath
from afferents.store.recording import Vibration
from afferents.store.responses import Responses
from afferents.version import __version__

ABOUT = "export.json"
"""Next to the bags: what was exported."""
CAMERA, MARKERS = "/camera/image/compressed", "/camera/markers"
SOUND, VIBRATION, PREDICTION = "/microphone", "/touch/ra2", "/touch/percept"
DRUM_POSITION, DRUM_SPEED = "/drum/position_mm", "/drum/speed_mm_s"
_BLOCK_S = 0.1


def export_mcap(
    source: files.Place,
    out: files.Place,
    store: files.Place | None = None,
    recordings: str | Sequence[str] = (),
    quality: int = QUALITY,
    percepts: files.Place | None = None,
    quiet: bool = False,
) -> list[Path]:
    """Write recordings as ROS 2 bags in MCAP files, for Foxglove, rerun and ``ros2 bag play``.

    A bag holds the camera's pictures as JPEGs, the sound, the drum's way and speed, and, of a
    store, the markers (drawn on the picture too), SA-I and RA-I. Times count from the recording's
    zero. Needs the extra ``mcap``; no ROS.

    Parameters
    ----------
    source
        A session, or a store that 'extract' wrote, which has no pictures.
    out
        Folder to write; in it a bag for each recording.
    store
        Store that was extracted from the session: its markers and responses are written as
        well.
    recordings
        Name of a recording, such as 4/60 (default: all); may be repeated.
    quality
        Of JPEGs, 1 to 100, where the camera gave none; its own are kept byte for byte.
    percepts
        File with what 'live --json' printed for the one recording that is named.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    list of Path
        The bags, each with an MCAP file and the ``metadata.yaml`` of rosbag2.

    Raises
    ------
    InputError
        If there is no such session, store or recording, `percepts` holds no line with a time, the
        package is missing, or `out` is there already.

    Examples
    --------
    >>> export_mcap("session", "bags", store="responses.zarr", recordings="4/60")
    [PosixPath('bags/4_60')]
    """
    types, out = typestore(), Path(out)
    files.require_free(out, files.holds_only())
    if not 1 <= quality <= 100:
        raise InputError(f"--quality: expected a number from 1 to 100, found {quality}")
    names = recordings.split(",") if isinstance(recordings, str) else recordings
    found = find_recordings(source, store, [name for name in names if name])
    if percepts is not None and len(found) != 1:
        expected = "one recording, named with --recording"
        raise InputError(f"--percepts: expected {expected}, found {len(found)}")
    lines = [] if percepts is None else _read_lines(Path(percepts))
    make, folders = Messages(types), files.safe_names(found)
    predictions = [Stamped(at, PREDICTION, *make.make(TEXT, data=line)) for at, line in lines]
    with Progress(quiet) as progress, files.write_aside(out, files.holds_only()) as partial:
        partial.mkdir(parents=True)
        for name, one in progress.track(found.items(), "exporting", len(found)):
            messages = [*_list_messages(make, one, quality), predictions]
            write_bag(partial / folders[name], types, messages, name)
        files.write_json(partial / ABOUT, {"afferents": __version__, "recordings": sorted(found)})
    return [out / folder for folder in folders.values()]


class Stamped(NamedTuple):
    """A message."""

    at_ns: int
    topic: str
    type: str
    data: bytes


def write_bag(path: Path, types: Any, messages: Sequence[Iterable[Stamped]], name: str) -> None:
    """Write a bag; its messages in order of time."""
    bag = Bag(path, types, {"recording": name, "version": __version__})
    with bag.writer:
        for message in heapq.merge(*messages, key=lambda message: message.at_ns):
            bag.put(*message)


def _list_messages(make: Messages, source: Chosen, quality: int) -> list[Iterator[Stamped]]:
    """Return what there is of a recording, each in order of time."""
    recording, responses = source
    found: list[Iterator[Stamped]] = []
    if recording is not None and recording.video is not None:
        pictures = jpegs(recording.video, quality)
        found.append(
            Stamped(_ns(at_s), CAMERA, *make.picture(_ns(at_s), data)) for at_s, data in pictures
        )
    if recording is not None and recording.audio is not None:
        found.append(sound_messages(make, recording.audio))
    if (way := source.drum_path()) is not None:
        found.append(drum_messages(make, way))
    if responses is not None and dims.POSITION in responses:
        found.append(_marker_messages(make, responses))
    if responses is not None and dims.RA2 in responses and recording is None:
        found.append(_stored_sound_messages(make, responses[dims.RA2]))
    return found


def sound_messages(make: Messages, audio: Vibration) -> Iterator[Stamped]:
    """Yield all channels of a sound file in blocks of a tenth of a second."""
    with reading_sound(audio.path), soundfile.SoundFile(sound_name(audio.path)) as file:
        rate_hz, first = file.samplerate, 0
        size = max(1, round(_BLOCK_S * rate_hz))
        for samples in file.blocks(size, dtype="float32", always_2d=True):
            yield _make_sound(make, first, samples, rate_hz)
            first += len(samples)


def _stored_sound_messages(make: Messages, vibration: xr.DataArray) -> Iterator[Stamped]:
    """Yield the vibration of a store: as sound where it is sound, else as numbers."""
    rate_hz = float(vibration.attrs[dims.SAMPLE_RATE])
    is_sound = vibration.attrs.get(dims.UNITS) == "full scale" and rate_hz == round(rate_hz)
    size = max(1, round(_BLOCK_S * rate_hz))
    for first in range(0, len(vibration), size):
        values = vibration[first : first + size].values
        if is_sound:
            yield _make_sound(make, first, values, round(rate_hz))
        else:
            numbers = make.numbers(values, (dims.AUDIO_TIME, dims.CHANNEL))
            yield Stamped(_ns(first / rate_hz), VIBRATION, *numbers)


def _make_sound(make: Messages, first: int, samples: NDArray[np.float32], rate_hz: int) -> Stamped:
    """Return a block of sound as 16-bit samples: those of a 16-bit file are what they were."""
    at_ns, limits = first * NS // rate_hz, np.iinfo(np.int16)
    whole = np.clip(np.rint(samples * 2.0**15), limits.min, limits.max).astype(np.int16)
    return Stamped(at_ns, SOUND, *make.sound(at_ns, whole, rate_hz))


def _marker_messages(make: Messages, responses: Responses) -> Iterator[Stamped]:
    """Yield where the markers are, SA-I and RA-I of each frame."""
    names = [name for name in (dims.SA1, dims.RA1) if name in responses]
    values = {name: responses[name].values for name in names}
    position = responses[dims.POSITION].values
    for n, at_s in enumerate(responses[dims.TIME].values.tolist()):
        at_ns = _ns(at_s)
        yield Stamped(at_ns, MARKERS, *make.marks(at_ns, position[n]))
        yield Stamped(at_ns, POSITIONS, *make.numbers(position[n], (dims.MARKER, dims.SPACE)))
        for name, value in values.items():
            yield Stamped(at_ns, f"/touch/{name}", *make.numbers(value[n], (dims.MARKER,)))


def drum_messages(make: Messages, way: DrumPath) -> Iterator[Stamped]:
    """Yield the way of the drum's surface, mm, and its speed, mm/s."""
    speed = np.gradient(way.position_mm, way.time_s)
    for at_s, position, at_speed in zip(way.time_s, way.position_mm, speed, strict=True):
        at_ns = _ns(at_s)
        yield Stamped(at_ns, DRUM_POSITION, *make.make(NUMBER, data=float(position)))
        yield Stamped(at_ns, DRUM_SPEED, *make.make(NUMBER, data=float(at_speed)))


def _read_lines(path: Path) -> list[tuple[int, str]]:
    """Return the lines that ``live --json`` wrote, in order of time, and the time of each, ns."""
    what = "lines that 'afferents live --json' wrote"
    with reading(path, what, OSError, ValueError, TypeError):
        lines = path.read_text(encoding="utf-8").splitlines()
        parsed = [(json.loads(line), line) for line in lines if line.strip()]
        timed = sorted((_ns(one["time_s"]), line) for one, line in parsed if "time_s" in one)
    if not timed:
        raise InputError(f"{path}: expected {what}, found none with a time_s")
    return timed


def _ns(at_s: float) -> int:
    """Return a time as whole ns."""
    return round(float(at_s) * NS)
