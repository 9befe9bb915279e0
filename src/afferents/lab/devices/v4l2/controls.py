"""A camera's exposure, gain, white balance and focus: fixed, and read back."""

from contextlib import suppress
from typing import NamedTuple

from afferents.errors import InputError
from afferents.lab.devices.v4l2 import abi
from afferents.lab.devices.v4l2.node import Node

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
    """A control to be set: its number, its value, and its name in a plan, if it has one."""

    control: int
    value: int
    option: str


def fix_controls(node: Node, wanted: list[Wanted]) -> dict[str, float]:
    """Switch off what the camera would do by itself, set what is wanted, read all back.

    Returns
    -------
    dict
        Name of each control that the camera has to its value, in the driver's units.

    Raises
    ------
    InputError
        If the camera lacks a control that is wanted, or took another value.
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
