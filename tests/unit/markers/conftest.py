"""Drawn pictures of markers, and a video of them that lives in memory."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest

from afferents.markers.sensor import BlobDetector, Sensor
from afferents.store.recording import Frame, GreyImage

SHAPE = (240, 320)


@dataclass
class MemoryVideo:
    """A `store.recording.Video` of given images, 90 frames a second from 0.5 s on."""

    images: Sequence[GreyImage]
    path: Path = Path("drawn.mp4")
    fps_hz: float = 90.0

    @property
    def height(self) -> int:
        return self.images[0].shape[0] if len(self.images) else SHAPE[0]

    @property
    def width(self) -> int:
        return self.images[0].shape[1] if len(self.images) else SHAPE[1]

    def frames(self) -> Iterator[Frame]:
        for index, image in enumerate(self.images):
            yield Frame(0.5 + index / self.fps_hz, image)


def lay_grid(rows, columns, pitch_px, first_px):
    """Return markers by row, (rows * columns, 2), px, the first at `first_px`."""
    y, x = np.divmod(np.arange(rows * columns), columns)
    return np.stack([x, y], axis=1) * float(pitch_px) + first_px


def draw_discs(position: np.ndarray, shape=SHAPE, radius=6.5, skin=20, marker=230) -> GreyImage:
    image = np.full(shape, skin, dtype=np.uint8)
    for x, y in np.asarray(position).reshape(-1, 2):
        if np.isfinite(x):
            centre = (round(x * 256), round(y * 256))
            cv2.circle(image, centre, round(radius * 256), marker, -1, cv2.LINE_AA, shift=8)
    return image


@pytest.fixture
def draw() -> Callable[..., GreyImage]:
    return draw_discs


@pytest.fixture
def video() -> Callable[..., MemoryVideo]:
    return MemoryVideo


@pytest.fixture
def detector() -> BlobDetector:
    """Return the published detector with a wider range of areas."""
    return BlobDetector(
        min_threshold=50,
        max_threshold=150,
        min_area_px2=60,
        max_area_px2=250,
        min_circularity=0.25,
        min_convexity=0.58,
        min_inertia_ratio=0.16,
    )


@pytest.fixture
def free(detector: BlobDetector) -> Sensor:
    """Return a sensor of any layout; the rest frame is the first one."""
    return Sensor(name="drawn", layout="free", rest_frame=0, detector=detector)


@pytest.fixture
def square(detector: BlobDetector) -> Sensor:
    """Return a sensor of 3 rows of 4 columns; the rest frame is frame 2."""
    return Sensor(
        name="drawn",
        layout="square",
        rows=3,
        columns=4,
        n_markers=12,
        rest_frame=2,
        detector=detector,
    )
