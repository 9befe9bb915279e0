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
from typing import Annotated, Literal

from pydantic import Field

from afferents.errors import InputError
from afferents.lab.devices.base import Camera, CameraOptions, CameraSettings, Frame
from afferents.lab.devices.v4l2 import abi
from afferents.lab.devices.v4l2.node import (
    EXPOSURE,
    FOCUS,
    GAIN,
    UNITS_A_MS,
    WHITE_BALANCE,
    Node,
    Wanted,
    fix_controls,
    formats,
)

PREFERRED = ("MJPG", "GREY", "YUYV")
"""Formats that ``auto`` takes, the first that the camera offers."""
BUFFERS = 32
"""Frames that the driver may hold before it loses one, as many as V4L2 allows: a third of a second
at 90 frames/s."""
SILENT_S = 3.0
"""A camera that gives no frame for so long has stopped; a first one may take a second."""
LOOK_S = 0.1
"""How often a camera that gives nothing is asked whether to end."""


class V4l2Options(CameraOptions):
    """A camera of Linux, beside what may be asked of any.

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

    @property
    def path(self) -> str:
        """Path of the device file."""
        return f"/dev/video{self.device}" if self.device.isdigit() else self.device

    def wanted(self) -> list[Wanted]:
        """Return the controls that are asked for."""
        exposure = self.exposure_ms
        units = None if exposure is None else round(exposure * UNITS_A_MS)
        asked = (
            (EXPOSURE, units, "exposure_ms"),
            (GAIN, self.gain, "gain"),
            (WHITE_BALANCE, self.white_balance_k, "white_balance_k"),
            (FOCUS, self.focus, "focus"),
        )
        return [Wanted(number, value, name) for number, value, name in asked if value is not None]


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
        self._handle = node = Node(self.options.path)
        try:
            self.settings = self._set(node)
        except OSError as error:
            self.close()
            raise node.refused(error) from error
        except BaseException:
            self.close()
            raise

    def frames(self) -> Iterator[Frame]:
        """Yield every buffer that the driver gives."""
        node: Node = self._begin()
        try:
            buffers = _mapped(node)
            try:
                yield from self._streamed(node, buffers)
            finally:
                _release(node, buffers)
        except OSError as error:
            raise self._lost((error.strerror or str(error)).lower()) from error

    def _streamed(self, node: Node, buffers: list[mmap.mmap]) -> Iterator[Frame]:
        poll = select.poll()
        poll.register(node.fd, select.POLLIN)
        _stream(node, abi.STREAMON)
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
            last_s = time.monotonic()
            frame = self._frame(buffer, buffers, last_s)
            node.ask(abi.QBUF, buffer)
            yield frame

    def _frame(self, buffer: abi.Buffer, buffers: list[mmap.mmap], arrived_s: float) -> Frame:
        monotonic = buffer.flags & abi.CLOCK_MASK == abi.CLOCK_MONOTONIC
        stamp = buffer.timestamp
        return Frame(
            buffer.sequence,
            stamp.tv_sec + stamp.tv_usec * 1e-6 if monotonic else arrived_s,
            bool(buffer.flags & abi.BUFFER_ERROR),
            buffers[buffer.index][: buffer.bytesused],
        )

    def _set(self, node: Node) -> CameraSettings:
        options = self.options
        form = self._wanted_format(node)
        asked = _described(form)
        found = _described(node.ask(abi.S_FMT, form))
        if found != asked:
            raise InputError(
                f"camera {node.path}: expected {'{} of {} x {} px'.format(*asked)}, found "
                f"{'{} of {} x {} px, which it took instead'.format(*found)}; 'afferents devices' "
                "lists what it offers"
            )
        fixed = fix_controls(node, options.wanted())
        # After the controls: a camera may give another rate for another exposure.
        return CameraSettings(
            node.name, *found, _set_rate(node, options.fps_hz), fixed,
            () if _clock_is_monotonic(node) else
            ("when a frame was captured (the time is that of its arrival)",),
        )  # fmt: skip

    def _wanted_format(self, node: Node) -> abi.Format:
        offered = formats(node)
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
        form.fmt.pix.pixelformat = abi.code_of(chosen)
        form.fmt.pix.bytesperline = form.fmt.pix.sizeimage = 0  # of the format that it had
        form.fmt.pix.field = 1  # V4L2_FIELD_NONE: whole frames
        return form


def _described(form: abi.Format) -> tuple[str, int, int]:
    """Return the name of a pixel format, and the size."""
    pixels = form.fmt.pix
    return abi.name_of(pixels.pixelformat), pixels.width, pixels.height


def _set_rate(node: Node, fps_hz: float | None) -> float:
    """Ask for a rate; return the one that the camera says it gives.

    If it says none, it is the one that was asked for, and NaN where none was.
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


def _clock_is_monotonic(node: Node) -> bool:
    """Tell by which clock buffers are stamped; drivers say so of any buffer."""
    node.ask(abi.REQBUFS, _asked_buffers(1))
    buffer = node.ask(abi.QUERYBUF, abi.Buffer(type=abi.VIDEO_CAPTURE, memory=abi.MMAP))
    node.ask(abi.REQBUFS, _asked_buffers(0))
    return bool(buffer.flags & abi.CLOCK_MASK == abi.CLOCK_MONOTONIC)


def _asked_buffers(count: int) -> abi.BufferRequest:
    return abi.BufferRequest(count=count, type=abi.VIDEO_CAPTURE, memory=abi.MMAP)


def _mapped(node: Node) -> list[mmap.mmap]:
    """Return the driver's buffers, mapped and queued."""
    given = node.ask(abi.REQBUFS, _asked_buffers(BUFFERS)).count
    buffers = []
    for index in range(given):
        buffer = abi.Buffer(index=index, type=abi.VIDEO_CAPTURE, memory=abi.MMAP)
        node.ask(abi.QUERYBUF, buffer)
        buffers.append(mmap.mmap(node.fd, buffer.length, offset=buffer.m.offset))
        node.ask(abi.QBUF, buffer)
    return buffers


def _release(node: Node, buffers: list[mmap.mmap]) -> None:
    """Stop the stream and give the buffers back; a camera that is gone has done so itself."""
    for buffer in buffers:
        buffer.close()
    if node.fd < 0:
        return
    try:
        _stream(node, abi.STREAMOFF)
        node.ask(abi.REQBUFS, _asked_buffers(0))
    except OSError:
        return


def _stream(node: Node, request: int) -> None:
    node.ask(request, ctypes.c_int(abi.VIDEO_CAPTURE))
