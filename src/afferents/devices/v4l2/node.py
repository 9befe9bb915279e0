"""A device file of V4L2: opened, asked, and closed."""

import ctypes
import errno
import os
import sys
from collections.abc import Iterator
from typing import Any, TypeVar

from afferents.core.errors import InputError
from afferents.devices.v4l2 import abi

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
                f"camera {path}", "Linux, for V4L2", sys.platform, "use kind = 'portable'"
            )
        try:
            self.fd = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
        except ValueError as error:  # no name that a file can have
            raise InputError("device", "a camera's path, or its number", repr(path)) from error
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
        return InputError(
            f"camera {self.path}",
            "a camera that is plugged in and free",
            (error.strerror or str(error)).lower(),
            doing.get(error.errno or 0, "'afferents devices' lists what there is"),
        )

    def _require_capture(self) -> str:
        try:
            found = self.ask(abi.QUERYCAP, abi.Capability())
        except OSError as error:
            raise self.refused(error) from error
        own = found.capabilities & abi.HAS_OWN_CAPS
        caps = found.device_caps if own else found.capabilities
        if not (caps & abi.CAN_CAPTURE and caps & abi.CAN_STREAM):
            raise InputError(
                f"camera {self.path}", "a device that streams pictures",
                "one that does not (cameras have a second file for metadata)",
                "'afferents devices' lists what there is",
            )  # fmt: skip
        return str(found.card.decode("utf-8", "replace"))
