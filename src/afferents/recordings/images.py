"""A folder of numbered images, taken for a video."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from afferents.core.errors import InputError
from afferents.core.recording import Frame, GreyImage

IMAGES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".pgm"})
"""Endings of what is taken for an image."""

_NUMBER = re.compile(r"\d+$")


@dataclass(frozen=True)
class ImageFolder:
    """Images whose names end in numbers, such as ``frame_0001.png``: the frames of a video.

    Implements `afferents.core.recording.Video`.

    Parameters
    ----------
    path
        The folder.
    fps_hz
        Images a second, which nothing in the files says. A number that is missing is a frame that
        was lost: the others keep their times.
    """

    path: Path
    fps_hz: float

    @cached_property
    def numbered(self) -> dict[int, Path]:
        """The images by their numbers, ascending.

        Raises
        ------
        InputError
            If there is none, or two have one number.
        """
        what = "a folder of numbered images"
        if not self.path.is_dir():
            raise InputError(self.path, what, "no such folder")
        found: dict[int, Path] = {}
        for path in sorted(self.path.iterdir()):
            number = _NUMBER.search(path.stem) if path.suffix.lower() in IMAGES else None
            if number is None or path.name.startswith("."):
                continue
            other = found.setdefault(int(number[0]), path)
            if other != path:
                raise InputError(
                    self.path,
                    "images with a number each",
                    f"{other.name} and {path.name}",
                    "move those that are not of this recording elsewhere",
                )
        if not found:
            raise InputError(self.path, what, "none in it")
        return dict(sorted(found.items()))

    @cached_property
    def _size(self) -> tuple[int, int]:
        first = _read(next(iter(self.numbered.values())))
        return first.shape[1], first.shape[0]

    @property
    def width(self) -> int:
        """Width of the first image, px."""
        return self._size[0]

    @property
    def height(self) -> int:
        """Height of the first image, px."""
        return self._size[1]

    @property
    def n_frames(self) -> int:
        """How many images there are."""
        return len(self.numbered)

    @cached_property
    def _step(self) -> int:
        """From one number to the next, where none is missing."""
        steps = np.diff(list(self.numbered))
        return int(steps.min()) if len(steps) else 1

    @property
    def duration_s(self) -> float:
        """From the first image to the end of the last, s."""
        numbers = list(self.numbered)
        return ((numbers[-1] - numbers[0]) / self._step + 1) / self.fps_hz

    def frames(self) -> Iterator[Frame]:
        """Read one image after the other.

        Raises
        ------
        InputError
            If one can't be read, or is of another size than the first.
        """
        first = next(iter(self.numbered))
        for number, path in self.numbered.items():
            image = _read(path)
            if image.shape != (self.height, self.width):
                found = f"{image.shape[1]}x{image.shape[0]}"
                raise InputError(path, f"an image of {self.width}x{self.height} px", found)
            yield Frame((number - first) / self._step / self.fps_hz, image)


def _read(path: Path) -> GreyImage:
    """Return an image in grey, (height, width) uint8."""
    image = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError(path, "a readable image", "none in it")
    return np.asarray(image, np.uint8)
