"""A camera of Linux through V4L2: its device file, its controls, and its buffers as they come.

FFmpeg's reader of V4L2 hides the driver's sequence numbers and error flags, and takes raw pixels
where a camera offers them: 640 x 480 at 90 frames/s is then more than USB 2 carries.
"""

import ctypes
import errno
import mmap
import os
import select
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Annotated, Any, Literal, NamedTuple, TypeVar

from pydantic import Field

from afferents.errors import InputError
from afferents.lab.devices import v4l2_abi as abi
from afferents.lab.devices.base import Camera, CameraOptions, CameraSettings, Frame, not_free

if sys.platform == "linux":
    import fcntl

Content = TypeVar("Content", bound=ctypes.Structure | ctypes.c_int)
Listed = TypeVar("Listed", bound=ctypes.Structure)

PREFERRED = ("MJPG", "GREY", "YUYV")
"""Formats that ``auto`` takes, the first that the camera offers."""
BUFFERS = 32
"""Frames that the driver may hold before it loses one, as many as V4L2 allows: a third of a second
at 90 frames/s."""
SILENT_S = 3.0
"""A camera that gives no frame for this time, s, has stopped; a first one may take a second."""
LOOK_S = 0.1
"""How often a camera that gives nothing looks whether it is to end."""

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

_OFF = SLOWER_IN_THE_DARK, AUTO_GAIN, AUTO_WHITE_BALANCE, FOCUS_AUTO
FIXED = {EXPOSURE_AUTO: EXPOSURE_MANUAL, **dict.fromkeys(_OFF, 0)}
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
        self.fd = -1
        try:
            self.fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
            found = self.ask(abi.QUERYCAP, abi.Capability())
            self.name = str(found.card.decode("utf-8", "replace"))
            own = found.capabilities & abi.HAS_OWN_CAPS
            caps = found.device_caps if own else found.capabilities
            if not (caps & abi.CAN_CAPTURE and caps & abi.CAN_STREAM):
                raise InputError(
                    f"camera {path}: expected a device that streams pictures, found one that does "
                    "not (cameras have a second file for metadata); 'afferents devices' lists "
                    "what there is"
                )
        except BaseException as error:
            self.close()
            if isinstance(error, OSError):
                raise self.refuse(error) from error
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

    def list_all(self, request: int, kind: type[Listed], **given: Any) -> Iterator[Listed]:
        """Yield what a driver lists, until it reports that there is no more."""
        for index in range(1000):
            try:
                yield self.ask(request, kind(index=index, **given))
            except OSError:
                return

    def formats(self) -> list[str]:
        """Return the pixel formats that the camera offers, in its own order."""
        listed = self.list_all(abi.ENUM_FMT, abi.FormatDescription, type=abi.VIDEO_CAPTURE)
        return [abi.format_name(one.pixelformat) for one in listed]

    def modes(self) -> Iterator[Mode]:
        """Yield formats with their sizes and rates; of a range of sizes, both ends."""
        for name in self.formats():
            code = abi.format_code(name)
            for found in self.list_all(abi.ENUM_FRAMESIZES, abi.FrameSize, pixel_format=code):
                sizes = [(found.size[0], found.size[1])]
                if found.type != abi.DISCRETE:
                    sizes = [(found.size[0], found.size[3]), (found.size[1], found.size[4])]
                for width, height in sizes:
                    yield Mode(name, width, height, self._rates(code, width, height))

    def _rates(self, code: int, width: int, height: int) -> tuple[float, ...]:
        mode = {"pixel_format": code, "width": width, "height": height}
        rates: set[float] = set()
        for found in self.list_all(abi.ENUM_FRAMEINTERVALS, abi.FrameInterval, **mode):
            ends = found.interval[: 1 if found.type == abi.DISCRETE else 2]
            rates |= {round(one.denominator / one.numerator, 3) for one in ends if one.numerator}
            if found.type != abi.DISCRETE:
                break
        return tuple(sorted(rates, reverse=True))

    def span(self, control: int) -> tuple[int, int] | None:
        """Return the smallest and largest value of a control; None where there is none to set."""
        try:
            found = self.ask(abi.QUERYCTRL, abi.ControlQuery(id=control))
        except OSError:
            return None
        is_fixed = found.flags & (abi.DISABLED_CONTROL | abi.READ_ONLY_CONTROL)
        return None if is_fixed else (found.minimum, found.maximum)

    def refuse(self, error: OSError) -> InputError:
        """Return what to raise when the camera can't be opened or set."""
        doing = {
            errno.EBUSY: "close what else uses it",
            errno.EACCES: "add yourself to the group 'video' and log in again",
        }
        do = doing.get(error.errno or 0, "'afferents devices' lists what there is")
        return not_free(f"camera {self.path}", "a camera", error, do)


def fix_controls(node: Node, wanted: list[tuple[int, int, str]]) -> dict[str, float]:
    """Switch off what the camera would do by itself, set what is wanted, read all back.

    Parameters
    ----------
    wanted
        Of each control its number, its value, and the option of a plan that sets it.

    Returns
    -------
    dict
        Name of each control that the camera has to its value, in the driver's units.

    Raises
    ------
    InputError
        If the camera lacks a control that is wanted, or took another value.
    """
    for control, value, option in [*((*one, "") for one in FIXED.items()), *wanted]:
        span = node.span(control)
        if span is None:
            if not option:
                continue
            raise InputError(
                f"camera {node.path}: expected a camera whose {NAMES[control]} can be set, "
                f"found one that has no such control; leave out {option}"
            )
        try:
            node.ask(abi.S_CTRL, abi.Control(id=control, value=value))
            found = node.ask(abi.G_CTRL, abi.Control(id=control)).value
            took = "" if found == value else f"{found}, which it took instead"
        except OSError as error:
            took = f"a refusal: {error.strerror}"
        if took:
            may_be = f" (it takes {span[0]} to {span[1]}); change or leave out {option}"
            do = may_be if option else "; switch it off otherwise, or take another"
            expected = f"expected {NAMES[control]} = {value}"
            raise InputError(f"camera {node.path}: {expected}, found {took}{do}")
    values: dict[str, float] = {}
    for control, name in NAMES.items():
        with suppress(OSError):  # it has none of these
            values[name] = node.ask(abi.G_CTRL, abi.Control(id=control)).value
    return values


class V4l2Options(CameraOptions):
    """A camera of Linux: the options that V4L2 adds.

    Attributes
    ----------
    device
        Its number or path.
    format
        ``MJPG``, ``GREY``, ``YUYV``, or ``auto`` for the first of these that it offers.
    exposure_ms, gain, white_balance_k, focus
        Set to this; None leaves the value that it has. All are fixed in any case.
    """

    kind: Literal["v4l2"] = "v4l2"
    device: str = "/dev/video0"
    format: Literal["MJPG", "GREY", "YUYV", "auto"] = "MJPG"
    exposure_ms: Annotated[float, Field(gt=0, le=10_000)] | None = None
    gain: int | None = None
    white_balance_k: int | None = None
    focus: int | None = None

    def wanted(self) -> list[tuple[int, int, str]]:
        """Return the controls that are to be set; see `fix_controls`."""
        given = (
            (EXPOSURE, self.exposure_ms and self.exposure_ms * UNITS_A_MS, "exposure_ms"),
            (GAIN, self.gain, "gain"),
            (WHITE_BALANCE, self.white_balance_k, "white_balance_k"),
            (FOCUS, self.focus, "focus"),
        )
        return [(number, round(value), name) for number, value, name in given if value is not None]


class V4l2Camera(Camera):
    """A camera of Linux: every buffer with its number, time and error flag."""

    Options = V4l2Options
    options: V4l2Options

    def open(self) -> None:
        """Open it, set format, rate and controls, and read all back.

        Raises
        ------
        InputError
            If there is none, it is busy, or does not take the format, size or a control.
        """
        self._ended.clear()
        device = self.options.device
        self._handle = node = Node(f"/dev/video{device}" if device.isdigit() else device)
        try:
            self.settings = self._set(node)
        except OSError as error:
            self.close()
            raise node.refuse(error) from error
        except BaseException:
            self.close()
            raise

    def frames(self) -> Iterator[Frame]:
        """Yield every buffer that the driver gives."""
        node: Node = self._begin()
        try:
            with _stream(node) as buffers:
                poll = select.poll()
                poll.register(node.fd, select.POLLIN)
                last_s = time.monotonic()
                while not self._ended.is_set():
                    poll.poll(LOOK_S * 1000)
                    buffer = abi.Buffer(type=abi.VIDEO_CAPTURE, memory=abi.MMAP)
                    try:
                        node.ask(abi.DQBUF, buffer)
                    except BlockingIOError:  # there is none yet
                        if time.monotonic() - last_s > SILENT_S:
                            raise self._lost(f"no frame for {SILENT_S:g} s") from None
                        continue
                    last_s, stamp = time.monotonic(), buffer.timestamp
                    frame = Frame(
                        buffer.sequence,
                        stamp.tv_sec + stamp.tv_usec * 1e-6 if _is_monotonic(buffer) else last_s,
                        bool(buffer.flags & abi.BUFFER_ERROR),
                        buffers[buffer.index][: buffer.bytesused],
                    )
                    node.ask(abi.QBUF, buffer)
                    yield frame
        except OSError as error:
            raise self._lost((error.strerror or str(error)).lower()) from error

    def _set(self, node: Node) -> CameraSettings:
        """Set what the options ask for; return what the camera reports afterwards."""
        form = self._choose_format(node)
        wanted = _describe_format(form)
        found = _describe_format(node.ask(abi.S_FMT, form))
        if found != wanted:
            raise InputError(
                f"camera {node.path}: expected {'{} of {} x {} px'.format(*wanted)}, found "
                f"{'{} of {} x {} px, which it took instead'.format(*found)}; 'afferents devices' "
                "lists what it offers"
            )
        fixed = fix_controls(node, self.options.wanted())
        # After the controls: a camera may give another rate for another exposure.
        rate_hz = _set_rate(node, self.options.fps_hz)
        node.ask(abi.REQBUFS, _request_buffers(1))  # any buffer tells which clock stamps them
        buffer = node.ask(abi.QUERYBUF, abi.Buffer(type=abi.VIDEO_CAPTURE, memory=abi.MMAP))
        node.ask(abi.REQBUFS, _request_buffers(0))
        unknown = "when a frame was captured (the time is that of its arrival)"
        return CameraSettings(
            node.name, *found, rate_hz, fixed, () if _is_monotonic(buffer) else (unknown,)
        )

    def _choose_format(self, node: Node) -> abi.Format:
        offered = node.formats()
        wanted = PREFERRED if self.options.format == "auto" else (self.options.format,)
        chosen = next((name for name in wanted if name in offered), None)
        if chosen is None:
            raise InputError(
                f"camera {node.path}: expected one that gives {' or '.join(wanted)}, found only "
                f"{', '.join(offered) or 'no format'}; name a format that it offers"
            )
        form = node.ask(abi.G_FMT, abi.Format(type=abi.VIDEO_CAPTURE))
        form.fmt.pix.width = self.options.width or form.fmt.pix.width
        form.fmt.pix.height = self.options.height or form.fmt.pix.height
        form.fmt.pix.pixelformat = abi.format_code(chosen)
        form.fmt.pix.bytesperline = form.fmt.pix.sizeimage = 0  # of the format that it had
        form.fmt.pix.field = 1  # V4L2_FIELD_NONE: whole frames
        return form


def _describe_format(form: abi.Format) -> tuple[str, int, int]:
    """Return the name of a pixel format, and the size."""
    pixels = form.fmt.pix
    return abi.format_name(pixels.pixelformat), pixels.width, pixels.height


def _set_rate(node: Node, fps_hz: float | None) -> float:
    """Request a rate; return the one that the camera reports.

    If it reports none, it is the one that was requested, and NaN where none was.
    """
    unknown = fps_hz or float("nan")
    rate = abi.StreamParameters(type=abi.VIDEO_CAPTURE)
    try:
        if fps_hz is not None:
            rate.parm.capture.timeperframe.numerator = 1000
            rate.parm.capture.timeperframe.denominator = round(fps_hz * 1000)
            node.ask(abi.S_PARM, rate)
        found = node.ask(abi.G_PARM, abi.StreamParameters(type=abi.VIDEO_CAPTURE))
    except OSError as error:
        if error.errno == errno.ENOTTY:  # a driver without rates
            return unknown
        raise
    interval = found.parm.capture.timeperframe
    return interval.denominator / interval.numerator if interval.numerator else unknown


def _is_monotonic(buffer: abi.Buffer) -> bool:
    return bool(buffer.flags & abi.CLOCK_MASK == abi.CLOCK_MONOTONIC)


def _request_buffers(count: int) -> abi.BufferRequest:
    return abi.BufferRequest(count=count, type=abi.VIDEO_CAPTURE, memory=abi.MMAP)


@contextmanager
def _stream(node: Node) -> Iterator[list[mmap.mmap]]:
    """Let the driver fill buffers, mapped into our memory, while the block lasts."""
    buffers = []
    for index in range(node.ask(abi.REQBUFS, _request_buffers(BUFFERS)).count):
        buffer = abi.Buffer(index=index, type=abi.VIDEO_CAPTURE, memory=abi.MMAP)
        node.ask(abi.QUERYBUF, buffer)
        buffers.append(mmap.mmap(node.fd, buffer.length, offset=buffer.m.offset))
        node.ask(abi.QBUF, buffer)
    try:
        node.ask(abi.STREAMON, ctypes.c_int(abi.VIDEO_CAPTURE))
        yield buffers
    finally:
        for mapped in buffers:
            mapped.close()
        if node.fd >= 0:
            with suppress(OSError):  # a camera that is gone has given them back itself
                node.ask(abi.STREAMOFF, ctypes.c_int(abi.VIDEO_CAPTURE))
                node.ask(abi.REQBUFS, _request_buffers(0))
