"""A device file of V4L2: opened, asked what it offers, its controls set, and closed."""

import ctypes
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import Any, NamedTuple, TypeVar

from afferents.errors import InputError
from afferents.lab.devices.base import not_free
from afferents.lab.devices.v4l2 import abi

if sys.platform == "linux":
    import fcntl


Content = TypeVar("Content", bound=ctypes.Structure | ctypes.c_int)
Listed = TypeVar("Listed", bound=ctypes.Structure)


class Node:
    """An open device file.

    Parameters
    ----------
    path
        Such as ``/dev/video0``.

    Raises
    ------
    InputError
        If it is not there, can't be opened, or is no camera.
    """

    def __init__(self, path: str) -> None:
        """Open it."""
        self.path = path
        if sys.platform != "linux":
            raise InputError(
                f"camera {path}: expected Linux, for V4L2, found {sys.platform}; use kind = "
                "'portable'"
            )
        try:
            self.fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            raise self.refused(error) from error
        try:
            self.name = self._require_capture()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close it; twice is no error."""
        if self.fd >= 0:
            os.close(self.fd)
            self.fd = -1

    def ask(self, request: int, content: Content) -> Content:
        """Let the driver read and fill a structure; OSError if it refuses."""
        fcntl.ioctl(self.fd, request, content, True)
        return content

    def each(self, request: int, kind: type[Listed], **asked: Any) -> Iterator[Listed]:
        """Yield what a driver lists, until it says that there is no more."""
        for index in range(1000):
            try:
                yield self.ask(request, kind(index=index, **asked))
            except OSError:
                return

    def refused(self, error: OSError) -> InputError:
        """Return what to raise when the camera can't be opened or set."""
        doing = {
            errno.EBUSY: "close what else uses it",
            errno.EACCES: "add yourself to the group 'video' and log in again",
        }
        do = doing.get(error.errno or 0, "'afferents devices' lists what there is")
        return not_free(f"camera {self.path}", "a camera", error, do)

    def _require_capture(self) -> str:
        try:
            found = self.ask(abi.QUERYCAP, abi.Capability())
        except OSError as error:
            raise self.refused(error) from error
        own = found.capabilities & abi.HAS_OWN_CAPS
        caps = found.device_caps if own else found.capabilities
        if not (caps & abi.CAN_CAPTURE and caps & abi.CAN_STREAM):
            raise InputError(
                f"camera {self.path}: expected a device that streams pictures, found one that "
                "does not (cameras have a second file for metadata); 'afferents devices' lists "
                "what there is"
            )
        return str(found.card.decode("utf-8", "replace"))


# What a camera offers: formats, sizes and rates.


class Mode(NamedTuple):
    """One format and size of a camera, and its rates there.

    Attributes
    ----------
    format
        Four characters, such as ``MJPG``.
    width, height
        px.
    fps_hz
        Frames a second, the fastest first.
    """

    format: str
    width: int
    height: int
    fps_hz: tuple[float, ...]


def formats(node: Node) -> list[str]:
    """Return the pixel formats that a camera offers, in its own order."""
    asked = {"type": abi.VIDEO_CAPTURE}
    found = node.each(abi.ENUM_FMT, abi.FormatDescription, **asked)
    return [abi.name_of(one.pixelformat) for one in found]


def modes(node: Node) -> Iterator[Mode]:
    """Yield formats with their sizes and rates; of a range of sizes, both ends."""
    for name in formats(node):
        code = abi.code_of(name)
        for found in node.each(abi.ENUM_FRAMESIZES, abi.FrameSize, pixel_format=code):
            for width, height in _sizes(found):
                yield Mode(name, width, height, _rates(node, code, width, height))


def _sizes(found: abi.FrameSize) -> list[tuple[int, int]]:
    if found.type == abi.DISCRETE:
        return [(found.size[0], found.size[1])]
    return [(found.size[0], found.size[3]), (found.size[1], found.size[4])]


def _rates(node: Node, code: int, width: int, height: int) -> tuple[float, ...]:
    asked = {"pixel_format": code, "width": width, "height": height}
    rates: set[float] = set()
    for found in node.each(abi.ENUM_FRAMEINTERVALS, abi.FrameInterval, **asked):
        ends = found.interval[: 1 if found.type == abi.DISCRETE else 2]
        rates |= {round(one.denominator / one.numerator, 3) for one in ends if one.numerator}
        if found.type != abi.DISCRETE:
            break
    return tuple(sorted(rates, reverse=True))


# A camera's exposure, gain, white balance and focus: fixed, and read back.

_USER, _CAMERA = 0x00980900, 0x009A0900
"""V4L2_CID_BASE and V4L2_CID_CAMERA_CLASS_BASE (linux/v4l2-controls.h)."""
EXPOSURE_AUTO, EXPOSURE = _CAMERA + 1, _CAMERA + 2
SLOWER_IN_THE_DARK = _CAMERA + 3
"""V4L2_CID_EXPOSURE_AUTO_PRIORITY: whether the camera may lower its rate for a longer exposure."""
FOCUS, FOCUS_AUTO = _CAMERA + 10, _CAMERA + 12
AUTO_WHITE_BALANCE, WHITE_BALANCE = _USER + 12, _USER + 26
AUTO_GAIN, GAIN = _USER + 18, _USER + 19
EXPOSURE_MANUAL = 1
UNITS_A_MS = 10
"""Exposures are in 0.1 ms."""

FIXED = {
    EXPOSURE_AUTO: EXPOSURE_MANUAL,
    SLOWER_IN_THE_DARK: 0,
    AUTO_GAIN: 0,
    AUTO_WHITE_BALANCE: 0,
    FOCUS_AUTO: 0,
}
"""What cameras do by themselves and must not, while a skin is measured."""

NAMES = {
    _USER: "brightness", _USER + 1: "contrast", _USER + 2: "saturation",
    AUTO_WHITE_BALANCE: "white_balance_automatic", _USER + 16: "gamma",
    AUTO_GAIN: "gain_automatic", GAIN: "gain", _USER + 24: "power_line_frequency",
    WHITE_BALANCE: "white_balance_temperature", _USER + 27: "sharpness",
    _USER + 28: "backlight_compensation", EXPOSURE_AUTO: "auto_exposure",
    EXPOSURE: "exposure_time_absolute", SLOWER_IN_THE_DARK: "exposure_dynamic_framerate",
    FOCUS: "focus_absolute", FOCUS_AUTO: "focus_automatic_continuous",
}  # fmt: skip
"""Controls that are read back, by the names that v4l2-ctl has for them."""


class Wanted(NamedTuple):
    """A control to be set: its number, its value, and what it is called in a plan, if it is."""

    control: int
    value: int
    option: str


def fix_controls(node: Node, wanted: list[Wanted]) -> dict[str, float]:
    """Switch off what the camera would do by itself, set what is asked for, read all back.

    Returns
    -------
    dict
        Name of each control that the camera has to its value, in the driver's units.

    Raises
    ------
    InputError
        If the camera lacks a control that was asked for, or took another value.
    """
    for control, value in FIXED.items():
        if _range(node, control) is not None:
            _set(node, Wanted(control, value, ""))
    for one in wanted:
        span = _range(node, one.control)
        if span is None:
            raise InputError(
                f"camera {node.path}: expected a camera whose {NAMES[one.control]} can be set, "
                f"found one that has no such control; leave out {one.option}"
            )
        _set(node, one, f" (it takes {span[0]} to {span[1]})")
    found: dict[str, float] = {}
    for control, name in NAMES.items():
        with suppress(OSError):  # it has none of these
            found[name] = node.ask(abi.G_CTRL, abi.Control(id=control)).value
    return found


def _range(node: Node, control: int) -> tuple[int, int] | None:
    """Return the smallest and largest value of a control; None where there is none to set."""
    try:
        found = node.ask(abi.QUERYCTRL, abi.ControlQuery(id=control))
    except OSError:
        return None
    if found.flags & (abi.DISABLED_CONTROL | abi.READ_ONLY_CONTROL):
        return None
    return found.minimum, found.maximum


def _set(node: Node, wanted: Wanted, may_be: str = "") -> None:
    """Set a control and see that it was taken."""
    try:
        node.ask(abi.S_CTRL, abi.Control(id=wanted.control, value=wanted.value))
        found = node.ask(abi.G_CTRL, abi.Control(id=wanted.control)).value
        if found == wanted.value:
            return
        took = f"{found}, which it took instead"
    except OSError as error:
        took = f"a refusal: {error.strerror}"
    option = wanted.option
    do = f"change or leave out {option}" if option else "switch it off otherwise, or take another"
    raise InputError(
        f"camera {node.path}: expected {NAMES[wanted.control]} = {wanted.value}, found "
        f"{took}{may_be}; {do}"
    )
