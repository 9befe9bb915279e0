"""Signals of a fingertip: which there are, what comes with them, and where they go.

They are given out as JSON lines, by Lab Streaming Layer, or into an MCAP file.
"""

import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from afferents import choices, dims, plugins, stopping
from afferents.channels import PARTS
from afferents.errors import InputError, reason_of
from afferents.files import free_bytes, require_free
from afferents.lab.live.fingertip import Fingertip
from afferents.lab.live.touch import Touch
from afferents.recordings.ros_messages import NS, POSITIONS, TEXT, Bag, Messages, typestore
from afferents.version import __version__

UNITS = {
    dims.POSITION: dims.PIXELS,
    dims.SA1: dims.PIXELS,
    dims.RA1: dims.PIXELS_PER_FRAME,
    "speed": dims.PIXELS_PER_SECOND,
    dims.SHEAR: dims.PIXELS,
    dims.RA2: "full scale",
}
"""Signals that can be given out, and their units; those of cells differ, see `give_signals`."""
DIGITS = 4
STDOUT, LSL, MCAP = "-", "lsl", "mcap"
ABOUT, STATUS = "/touch/about", "/touch/status"
"""Topics of the header, and of the status of each frame."""
ROOM_BYTES = 16_000_000
"""An MCAP file is ended where the disk has less: its last messages and its index need room."""
_DIMS = {
    dims.POSITION: (dims.MARKER, dims.SPACE),
    dims.SHEAR: (dims.SHEAR,),
    dims.RA2: (dims.AUDIO_TIME, dims.CHANNEL),
}
"""Of arrays that are not one number a marker."""
Content = dict[str, Any]
"""By name, as JSON has it."""


class Writer(Protocol):
    """Gives signals out at one place."""

    def write(self, touch: Touch, status: Content) -> None:
        """Give out the signals of a frame, and its status (`give_signals`)."""

    def close(self) -> None:
        """End it, so that what was given out is whole."""


Place = Callable[[Content, Touch], Writer]
"""Opens a writer, given the header and the first touch, which is then written as the others."""


def parse_signals(text: str | Sequence[str], has_sound: bool) -> list[str]:
    """Return the names of signals that a text holds, separated by commas.

    Raises
    ------
    InputError
        If there is none of that name, or vibration is among them without a source of sound.
    """
    names = list(dict.fromkeys(choices.words_in(text)))
    unknown = [name for name in names if name not in UNITS]
    if unknown or not names:
        found = f"'{unknown[0]}'" if unknown else "none"
        raise InputError(f"--signals: expected of {', '.join(UNITS)}, found {found}")
    if dims.RA2 in names and not has_sound:
        raise InputError("--signals: expected a source of sound for ra2 (--audio), found none")
    return names


def give_signals(
    fingertip: Fingertip, names: Sequence[str], places: Sequence[Place], name: str = ""
) -> None:
    """Run a fingertip until its sources end, and give its signals out.

    The header says which sensor it is, where its markers are at rest, the units, and of a camera
    how far the Unix clock is ahead of the monotonic one, by which its frames are timed. The status
    of a frame is its `time_s`, the share of markers that are `lost`, how many frames were `dropped`
    before it, whether something is `touching` the skin, and `events` where something happened; rest
    that was set anew comes with it. Events and dropped frames are printed on standard error, too.

    Parameters
    ----------
    names
        Of the signals, see `UNITS`.
    places
        Where they go; see `prepare_places`.
    name
        Of the fingertip, where there are several.
    """
    dropped = 0
    with fingertip, ExitStack() as opened:
        writers: list[Writer] = []
        for touch in fingertip:
            status: Content = {
                "time_s": round(touch.time_s, 6),
                "lost": round(touch.lost, DIGITS),
                "dropped": touch.quality.dropped - dropped,
                "touching": touch.touching,
            }
            if dims.RA2 in names:
                status["ra2_time_s"] = touch.ra2_time_s[:1].round(6).tolist()
            if touch.events:
                status["events"] = touch.events
                status[dims.REST_POSITION] = round_values(touch.now.rest)
            dropped = touch.quality.dropped
            sys.stderr.writelines(f"{touch.time_s:.2f} s: {event}\n" for event in touch.events)
            with stopping.stop_later():
                for place in places[len(writers) :]:
                    writers.append(place(_make_header(fingertip, touch, names, name), touch))
                    opened.callback(writers[-1].close)
                for writer in writers:
                    writer.write(touch, status)
    if dropped:
        hint = "" if fingertip.is_live else "; --speed max drops none of a clip"
        sys.stderr.write(f"{dropped} frames were dropped{hint}\n")


def _make_header(fingertip: Fingertip, touch: Touch, names: Sequence[str], name: str) -> Content:
    """Return the header.

    Raises
    ------
    InputError
        If these are cells, and a signal is of markers that move.
    """
    units = {name: UNITS[name] for name in names}
    if touch.now.grey is not None:
        for of_move in (name for name in names if name in ("speed", dims.SHEAR)):
            raise InputError(
                f"--signals: expected of sa1, ra1, position and ra2, found '{of_move}', which "
                "cells don't have, since they have no displacement; leave it out"
            )
        for of_grey in {dims.SA1, dims.RA1} & units.keys():
            units[of_grey] = units[of_grey].replace(dims.PIXELS, dims.GREY_LEVELS)
    assert fingertip.sensor is not None  # there is a touch
    return {
        **({"fingertip": name} if name else {}),
        "sensor": fingertip.sensor.name,
        "layout": fingertip.sensor.layout,
        "fps_hz": fingertip.fps_hz,
        "sample_rate_hz": fingertip.sample_rate_hz,
        "unix_ahead_s": time.time() - time.monotonic() if fingertip.is_live else None,
        "units": units,
        "shear": list(PARTS),
        dims.REST_POSITION: round_values(touch.now.rest),
    }


def round_values(values: NDArray[np.floating]) -> list[Any]:
    """Return an array as lists of numbers that are short as text."""
    listed: list[Any] = np.round(values.astype(float), DIGITS).tolist()
    return listed


def prepare_places(given: Sequence[str], read: Iterable[str | None]) -> list[Place]:
    """Return what opens the places that a user names; nothing is written yet.

    Parameters
    ----------
    given
        Each ``-`` or a file for JSON lines, ``lsl``, or ``mcap:FILE``.
    read
        Names of the sources, which must not be written.

    Raises
    ------
    InputError
        If a place is none of these or is given twice, a file is not free, or the packages that
        it needs are missing.
    """
    sources = [Path(one.removeprefix("replay:")) for one in read if one is not None]
    places: list[Place] = []
    files: list[Path] = []
    for place in given:
        kind, colon, name = place.partition(":")
        if place == STDOUT:
            places.append(partial(JsonLines, None))
        elif place == LSL:
            plugins.import_extra("lsl", "--to lsl", "pylsl")
            places.append(LslStreams)
        elif kind == MCAP and name:
            typestore()
            require_free(_unfinished(Path(name)))
            files.append(Path(name))
            places.append(partial(McapFile, files[-1]))
        elif (colon and kind.isalnum()) or Path(place).suffix in ("", ".mcap"):
            raise InputError(
                f"--to: expected {STDOUT}, {LSL}, {MCAP}:FILE, or a file of JSON lines such as "
                f"touch.jsonl, found '{place}'"
            )
        else:
            files.append(Path(place))
            places.append(partial(JsonLines, files[-1]))
    for file in files:
        require_free(file, reads=sources)
    if len({*files}) < len(files) or len({*given}) < len(given):
        raise InputError(f"--to: expected places that differ, found {', '.join(given)}")
    return places


class JsonLines:
    """A header, then a line of JSON a frame, in a file or (None) on standard output.

    In the lines null stands for NaN: for markers that are lost, and for RA-I after a gap. If the
    disk is full, the file ends with the last whole line.
    """

    def __init__(self, path: Path | None, header: Content, _: Touch) -> None:
        """Write the header."""
        self._path, self._names, self._file = path, [*header["units"]], None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = path.open("xb", buffering=0)
        self._append(header)

    def write(self, touch: Touch, status: Content) -> None:
        """Write a line."""
        self._append(status | {name: round_values(getattr(touch, name)) for name in self._names})

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _append(self, content: Content) -> None:
        line = to_json(content, inf_nan_mode="null") + b"\n"
        if self._file is None:
            sys.stdout.write(line.decode())
            sys.stdout.flush()
            return
        whole = self._file.tell()
        try:
            rest = memoryview(line)
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._file.truncate(whole)
            found = f"found {reason_of(error)}; the file ends with the last whole line"
            raise InputError(f"{self._path}: expected room on the disk, {found}") from error


class LslStreams:
    """A regular stream of Lab Streaming Layer for each signal; NaN where a marker is lost.

    Streams are described as XDF describes those of motion capture, with the place of each marker at
    rest as `location`. Samples have the time of their frame by LSL's clock; those of recordings the
    time when they are sent. Nothing waits for a reader: LSL keeps six minutes for a slow one, and
    then drops the oldest.
    """

    def __init__(self, header: Content, first: Touch) -> None:
        """Announce the streams."""
        pylsl = plugins.import_extra("lsl", "--to lsl", "pylsl")
        is_live = header["unix_ahead_s"] is not None
        self._ahead_s = pylsl.local_clock() - time.monotonic() if is_live else None
        rest = header[dims.REST_POSITION]
        labels: dict[str, Sequence[Any]] = {
            dims.POSITION: [f"{n} {axis}" for n in range(len(rest)) for axis in "xy"],
            dims.SHEAR: PARTS,
            dims.RA2: range(first.ra2.shape[1]),
        }
        name = header.get("fingertip", "")
        called, source = f"afferents {name}".rstrip(), name or header["sensor"]
        self._outlets: dict[str, Any] = {}
        for name in header["units"]:
            of_name = labels.get(name, range(len(rest)))
            rate_hz = header["sample_rate_hz" if name == dims.RA2 else "fps_hz"]
            info = pylsl.StreamInfo(
                f"{called} {name}", "Touch", len(of_name), rate_hz, "float32",
                f"afferents-{source}-{name}",
            )  # fmt: skip
            channels = info.desc().append_child("channels")
            for n, label in enumerate(of_name):
                channel = channels.append_child("channel")
                channel.append_child_value("label", str(label))
                channel.append_child_value("unit", header["units"][name])
                if name not in (dims.SHEAR, dims.RA2):
                    marker = n * len(rest) // len(of_name)
                    channel.append_child_value("marker", str(marker))
                    location = channel.append_child("location")
                    for axis, place in zip("XY", rest[marker], strict=True):
                        location.append_child_value(axis, str(place))
            self._outlets[name] = pylsl.StreamOutlet(info)

    def write(self, touch: Touch, _: Content) -> None:
        """Send a sample of each signal, and all sound that came since the last."""
        for name, outlet in self._outlets.items():
            if (values := getattr(touch, name)).size:
                at_s = touch.ra2_time_s[-1] if name == dims.RA2 else touch.time_s
                stamp_s = 0.0 if self._ahead_s is None else at_s + self._ahead_s  # 0: as it is sent
                outlet.push_chunk(values.reshape(-1, outlet.channel_count), stamp_s)

    def close(self) -> None:
        """Withdraw the streams."""
        self._outlets.clear()


class McapFile:
    """A bag of ROS 2 in one MCAP file: an array a topic, header and status as JSON.

    Times are Unix time of a device, and a recording's own. The file has its name once it is whole;
    until then, and if the system fails, what is written lies in a folder ``FILE.part``.
    """

    def __init__(self, path: Path, header: Content, first: Touch) -> None:
        """Write the header."""
        self._path, self._names = path, [*header["units"]]
        self._ahead_s = header["unix_ahead_s"] or 0.0
        types = typestore()
        self._make = Messages(types)
        self._bag = Bag(_unfinished(path) / path.stem, types, {"version": __version__})
        with self._writing():
            self._bag.writer.open()
            self._put_text(first.time_s, ABOUT, header)

    def write(self, touch: Touch, status: Content) -> None:
        """Write the status, and a message of each signal."""
        with self._writing():
            if (free := free_bytes(self._path.parent)) < ROOM_BYTES:
                raise InputError(
                    f"{self._path}: expected {ROOM_BYTES / 1e6:g} MB that are free on the disk, "
                    f"found {free // 1_000_000}; the file is whole up to {touch.time_s:.2f} s, "
                    "make room for more"
                )
            self._put_text(touch.time_s, STATUS, status)
            for name in self._names:
                if (values := getattr(touch, name)).size:
                    at_s = touch.ra2_time_s[0] if name == dims.RA2 else touch.time_s
                    topic = POSITIONS if name == dims.POSITION else f"/touch/{name}"
                    numbers = self._make.numbers(values, _DIMS.get(name, (dims.MARKER,)))
                    self._bag.put(round((at_s + self._ahead_s) * NS), topic, *numbers)

    def close(self) -> None:
        """Write the index, and give the file its name."""
        if self._bag.writer.storage is None:  # the system has failed
            return
        with self._writing():
            self._bag.writer.close()
            require_free(self._path)
            (file,) = self._bag.writer.path.glob("*.mcap")
            file.rename(self._path)
            shutil.rmtree(_unfinished(self._path))

    def _put_text(self, at_s: float, topic: str, content: Content) -> None:
        text = to_json(content, inf_nan_mode="null").decode()
        message = self._make.make(TEXT, data=text)
        self._bag.put(round((at_s + self._ahead_s) * NS), topic, *message)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Name in a sentence what the system fails at; nothing can be written after that."""
        try:
            yield
        except OSError as error:
            with suppress(OSError):
                self._bag.writer.abort()
            raise InputError(
                f"{self._path}: expected room on the disk, found {reason_of(error)}; what is "
                f"written lies in {_unfinished(self._path)}, without its end"
            ) from error


def _unfinished(path: Path) -> Path:
    return path.with_name(f"{path.name}.part")
