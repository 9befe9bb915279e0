"""A camera's exposure time, by Linux's V4L2 controls (linux/v4l2-controls.h)."""

import struct
import sys
from pathlib import Path

from afferents.core.errors import InputError

_SET = 0xC008561C
"""VIDIOC_S_CTRL; struct v4l2_control is an id and a value of 32 bits each."""
_GET = 0xC008561B
_EXPOSURE_AUTO, _EXPOSURE_ABSOLUTE = 0x009A0901, 0x009A0902
_MANUAL = 1
_UNITS_A_MS = 10
"""Exposures are in 0.1 ms."""


def set_exposure(device: str, exposure_ms: float) -> None:
    """Set a camera's exposure time, and see that it was taken.

    Raises
    ------
    InputError
        If the camera can't be set, or took another time.
    """
    wanted = round(exposure_ms * _UNITS_A_MS)
    if sys.platform != "linux":
        raise InputError(
            "--exposure-ms", "Linux, where it can be set", sys.platform, "leave it out"
        )
    import fcntl

    try:
        with Path(device).open("rb") as file:
            fcntl.ioctl(file, _SET, struct.pack("Ii", _EXPOSURE_AUTO, _MANUAL))
            fcntl.ioctl(file, _SET, struct.pack("Ii", _EXPOSURE_ABSOLUTE, wanted))
            answer = fcntl.ioctl(file, _GET, struct.pack("Ii", _EXPOSURE_ABSOLUTE, 0))
    except OSError as error:
        raise InputError(
            f"camera {device}", "one whose exposure can be set", str(error.strerror),
            "leave out --exposure-ms",
        ) from error  # fmt: skip
    found = struct.unpack("Ii", answer)[1]
    if found != wanted:
        raise InputError(
            "--exposure-ms", f"a time that {device} takes", f"{exposure_ms:g}",
            f"it took {found / _UNITS_A_MS:g} ms",
        )  # fmt: skip
