"""What a camera offers: formats, sizes and rates."""

from collections.abc import Iterator
from typing import NamedTuple

from afferents.devices.v4l2 import abi
from afferents.devices.v4l2.node import Node


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
