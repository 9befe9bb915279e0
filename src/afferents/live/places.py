"""Where signals go: JSON lines, Lab Streaming Layer."""

import sys
import time
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pydantic_core import to_json

from afferents import dims
from afferents.channels import PARTS
from afferents.errors import InputError, reason_of
from afferents.files import require_free
from afferents.live.fingertip import Touch
from afferents.live.signals import UNITS, Content, Place, rounded
from afferents.plugins import import_extra

STDOUT, LSL = "-", "lsl"


def places_in(given: Sequence[str], read: Iterable[str | None]) -> list[Place]:
    """Return what opens the places that a user names; nothing is written yet.

    Parameters
    ----------
    given
        Each ``-`` or a file for JSON lines, or ``lsl``.
    read
        Names of the sources, which must not be written.

    Raises
    ------
    InputError
        If a place is none of these or stands there twice, a file is not free, or the packages that
        it needs are missing.
    """
    sources = [Path(one.removeprefix("replay:")) for one in read if one is not None]
    places: list[Place] = []
    files: list[Path] = []
    for place in given:
        kind, colon, _ = place.partition(":")
        if place == STDOUT:
            places.append(partial(JsonLines, None))
        elif place == LSL:
            import_extra("lsl", "--to lsl", "pylsl")
            places.append(LslStreams)
        elif (colon and kind.isalnum()) or not Path(place).suffix:
            raise InputError(
                f"--to: expected {STDOUT}, {LSL}, or a file of JSON lines such as "
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
        self._append(status | {name: rounded(getattr(touch, name)) for name in self._names})

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
        pylsl = import_extra("lsl", "--to lsl", "pylsl")
        is_live = header["unix_ahead_s"] is not None
        self._ahead_s = pylsl.local_clock() - time.monotonic() if is_live else None
        rest = header[dims.REST_POSITION]
        labels: dict[str, Sequence[Any]] = {
            dims.POSITION: [f"{n} {axis}" for n in range(len(rest)) for axis in "xy"],
            dims.SHEAR: PARTS,
            dims.RA2: range(first.ra2.shape[1]),
        }
        self._outlets: dict[str, Any] = {}
        for name in header["units"]:
            of_name = labels.get(name, range(len(rest)))
            rate_hz = header["sample_rate_hz" if name == dims.RA2 else "fps_hz"]
            info = pylsl.StreamInfo(
                f"afferents {name}", "Touch", len(of_name), rate_hz, "float32",
                f"afferents-{header['sensor']}-{name}",
            )  # fmt: skip
            channels = info.desc().append_child("channels")
            for n, label in enumerate(of_name):
                channel = channels.append_child("channel")
                channel.append_child_value("label", str(label))
                channel.append_child_value("unit", UNITS[name])
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
