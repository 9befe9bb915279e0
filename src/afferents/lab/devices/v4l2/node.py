"""A device file of V4L2: opened, queried for what the camera offers, and closed."""

import ctypes
import errno
import os
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeVar

from afferents.errors import InputError
from afferents.lab.devices.base import not_free
from afferents.lab.devices.v4l2 import abi

if sys.platform == "linux":
    import fcntl


Content = TypeVar("Content", bound=ctypes.Structure | ctypes.c_int)
Listed = TypeVar("Listed", bound=ctypes.Structure)


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
        try:
            self.fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            raise self.refuse(error) from error
        try:
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
        except OSError as error:
            self.close()
            raise self.refuse(error) from error
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

    def refuse(self, error: OSError) -> InputError:
        """Return what to raise when the camera can't be opened or set."""
        doing = {
            errno.EBUSY: "close what else uses it",
            errno.EACCES: "add yourself to the group 'video' and log in again",
        }
        do = doing.get(error.errno or 0, "'afferents devices' lists what there is")
        return not_free(f"camera {self.path}", "a camera", error, do)
