"""A camera of Linux, read without anything between its driver and us.

FFmpeg's reader of V4L2 hides the driver's sequence numbers and error flags, and takes raw pixels
where a camera offers them: 640 x 480 at 90 frames/s is then more than USB 2 carries.
"""

import ctypes
import errno
import mmap
import select
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Annotated, Literal

from pydantic import Field

from afferents.errors import InputError
from afferents.lab.devices.base import Camera, CameraOptions, CameraSettings, Frame
from afferents.lab.devices.v4l2 import abi, controls
from afferents.lab.devices.v4l2.node import Node

PREFERRED = ("MJPG", "GREY", "YUYV")
"""Formats that ``auto`` takes, the first that the camera offers."""
BUFFERS = 32
"""Frames that the driver may hold before it loses one, as many as V4L2 allows: a third of a second
at 90 frames/s."""
SILENT_S = 3.0
"""A camera that gives no frame for this time, s, has stopped; a first one may take a second."""
LOOK_S = 0.1
"""How often a camera that gives nothing looks whether it is to end."""


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

    def wanted(self) -> list[controls.Wanted]:
        """Return the controls that are to be set."""
        exposure = self.exposure_ms
        units = None if exposure is None else round(exposure * controls.UNITS_A_MS)
        given = (
            (controls.EXPOSURE, units, "exposure_ms"),
            (controls.GAIN, self.gain, "gain"),
            (controls.WHITE_BALANCE, self.white_balance_k, "white_balance_k"),
            (controls.FOCUS, self.focus, "focus"),
        )
        return [controls.Wanted(n, v, name) for n, v, name in given if v is not None]


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
        fixed = controls.fix_controls(node, self.options.wanted())
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
