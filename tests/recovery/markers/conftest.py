"""A drawn fingertip of 19 x 19 markers whose every position is known."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from afferents.store.recording import Frame, GreyImage

WIDTH, HEIGHT = 640, 480
RADIUS = 6.3
"""Area 125 px^2, in the middle of what the published detector takes."""


def draw_markers(position: np.ndarray) -> GreyImage:
    """Draw anti-aliased discs at sub-pixel positions, shape (n, 2); NaN is not drawn.

    A pixel's cover is taken from its distance to the disc's edge.
    """
    image = np.full((HEIGHT, WIDTH), 25.0)
    offset = np.arange(-9, 10)
    for x, y in position[~np.isnan(position[:, 0])]:
        column, row = offset + round(x), offset + round(y)
        distance = np.hypot(column[None, :] - x, row[:, None] - y)
        cover = np.clip(RADIUS + 0.5 - distance, 0, 1)
        image[np.ix_(row, column)] += cover * (220 - image[np.ix_(row, column)])
    return np.rint(image).astype(np.uint8)


@dataclass
class DrawnVideo:
    """A `core.recording.Video` of given positions, shape (time, marker, space), px."""

    truth: np.ndarray
    path: Path = Path("drawn.mp4")
    fps_hz: float = 90.0
    width: int = WIDTH
    height: int = HEIGHT

    def frames(self) -> Iterator[Frame]:
        for index, position in enumerate(self.truth):
            yield Frame(index / self.fps_hz, draw_markers(position))


@pytest.fixture
def draw() -> Callable[[np.ndarray], GreyImage]:
    return draw_markers


@pytest.fixture
def video() -> Callable[[np.ndarray], DrawnVideo]:
    return DrawnVideo


@pytest.fixture
def rest() -> np.ndarray:
    """Return rest positions in row-major order, rolled by 6.2 degrees, each a fraction off."""
    x, y = np.meshgrid(22.0 * np.arange(-9, 10), 22.0 * np.arange(-9, 10))
    angle = np.radians(6.2)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    fraction = np.random.default_rng(3).uniform(-0.5, 0.5, (361, 2))
    return np.stack([x.ravel(), y.ravel()], axis=1) @ turn + [320, 238] + fraction
