"""Compare what cells of a plain gel say with how far its skin truly moved, for docs/tracking.md.

    python scripts/cells_truth.py [CLIP ...]

The first gel is made: smooth shading on a skin that is pressed and sheared by a known field, and no
dots. Each CLIP shows a gel with dots, and begins at rest: they are tracked, which is the truth, and
painted over. Then the picture has as many cells as dots, and each dot is compared with the cell in
which it stands at rest: by rank over all dots and frames, within single frames in which the gel is
pressed (at least half as much as it ever is), and by the means of frames.
"""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import xarray as xr
from scipy.stats import pearsonr, spearmanr

from afferents import dims
from afferents.extraction.extract import marker_responses
from afferents.markers.calibrate import calibrate_from_clips
from afferents.markers.sensor import DiscDetector, Sensor
from afferents.markers.track import track_markers
from afferents.recordings.video import open_clip
from afferents.store.recording import Frame

HEIGHT, WIDTH, ROWS, COLUMNS = 240, 320, 7, 10
N_FRAMES, AT_REST = 120, 20
REACH_PX, DEEP_PX, SHEARED_PX = 45.0, 6.0, 4.0
"""Of the press, and how far it moves the skin: outwards, and together."""
LIGHT = np.array([0.8, 0.35])
"""How much a slope of the skin along x and y brightens it: the lamps stand on two sides."""
BRIGHTER, NOISE, QUALITY = 40.0, 1.5, 90
"""Grey levels of the steepest slope and of noise; and of JPEG."""


@dataclass
class Film:
    """Pictures as a video."""

    images: Sequence[np.ndarray]
    path: Path = Path("made")
    fps_hz: float = 25.0

    def __post_init__(self) -> None:
        self.height, self.width = self.images[0].shape

    def frames(self) -> Iterator[Frame]:
        """Yield them."""
        for index, image in enumerate(self.images):
            yield Frame(index / self.fps_hz, image)


def at(index: int) -> tuple[float, np.ndarray, np.ndarray]:
    """Return how deep a frame is pressed, 0 to 1; where, px; and how far it is sheared, px."""
    time = max(0, index - AT_REST) / (N_FRAMES - AT_REST)
    deep = np.sin(np.pi * time) ** 2
    middle = np.array([WIDTH, HEIGHT]) * (0.35 + 0.3 * time, 0.5 + 0.15 * np.sin(6 * time))
    return deep, middle, SHEARED_PX * deep * np.array([np.sin(9 * time), 0.5 * np.cos(7 * time)])


def slope(point: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return the slope of the pressed skin at points (..., 2), at most 1."""
    off = (point - middle) / REACH_PX
    return np.sqrt(np.e) * off * np.exp(-(off**2).sum(axis=-1, keepdims=True) / 2) * np.sqrt(2) / 2


def way(point: np.ndarray, index: int) -> np.ndarray:
    """Return how far the skin at points at rest (..., 2) has come in a frame, px."""
    deep, middle, sheared = at(index)
    return DEEP_PX * deep * slope(point, middle) + sheared


def made() -> tuple[Film, xr.Dataset]:
    """Return a plain gel that is pressed, and SA-I and RA-I of dots that it would have had."""
    rng = np.random.default_rng(0)
    grid = np.stack(np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT)), axis=-1).astype(float)
    shading = cv2.GaussianBlur(rng.normal(0, 1, (HEIGHT, WIDTH)), (0, 0), 12)
    shading = 120 + 15 * shading / shading.std() + 40 * (grid[..., 0] / WIDTH - 0.5)
    y, x = (np.indices((ROWS, COLUMNS)).reshape(2, -1) + 0.5) / [[ROWS], [COLUMNS]]
    rest = np.stack([WIDTH * x, HEIGHT * y], axis=1) - 0.5
    images, places = [], []
    for index in range(N_FRAMES):
        came = (grid - way(grid, index)).astype(np.float32)
        image = cv2.remap(shading, came, None, cv2.INTER_LINEAR, None, cv2.BORDER_REPLICATE)
        deep, middle, _ = at(index)
        image += BRIGHTER * deep * slope(grid, middle) @ LIGHT + rng.normal(0, NOISE, image.shape)
        levels = np.clip(image, 0, 255).astype(np.uint8)
        coded = cv2.imencode(".jpg", levels, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1]
        images.append(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))
        places.append(rest + way(rest, index))
    tracks = xr.Dataset({
        dims.POSITION: ((dims.TIME, dims.MARKER, dims.SPACE), np.array(places)),
        dims.REST_POSITION: ((dims.MARKER, dims.SPACE), rest),
    })  # fmt: skip
    return Film(images), marker_responses(tracks)


def painted(path: Path) -> tuple[Film, xr.Dataset]:
    """Return a clip whose dots are painted over, and their SA-I and RA-I."""
    clip = open_clip(path, 25.0)
    sensor = calibrate_from_clips(clip, path.stem).sensor
    tracks = track_markers(clip, sensor)
    assert isinstance(sensor.detector, DiscDetector)
    radius = round(1.6 * sensor.detector.radius_px + 1)
    images = []
    for frame, places in zip(clip.frames(), tracks[dims.POSITION].values, strict=False):
        mask = np.zeros_like(frame.image)
        for x, y in places[np.isfinite(places[:, 0])]:
            cv2.circle(mask, (round(x), round(y)), radius, 255, -1)
        images.append(cv2.inpaint(frame.image, mask, 3, cv2.INPAINT_TELEA))
    first = int(tracks.attrs["rest_frame"])  # frames of an earlier run come before
    return Film(images[first:]), marker_responses(tracks, sensor).isel(time=slice(first, None))


def compared(film: Film, true: xr.Dataset) -> tuple[list[float], float]:
    """Return the four correlations, and SA-I of cells at rest, grey levels."""
    rows, columns = ROWS, COLUMNS
    if dims.ROW in true.coords:
        rows, columns = (int(true[name].max()) + 1 for name in (dims.ROW, dims.COLUMN))
    sensor = Sensor(name="cells", layout="cells", rows=rows, columns=columns, rest_frame=0)
    felt = marker_responses(track_markers(film, sensor))
    rest = true[dims.REST_POSITION].values
    of = np.floor((rest + 0.5) / (film.width, film.height) * (columns, rows)).astype(int)
    cell = of[:, 1] * columns + of[:, 0]
    cells, dots = ([each[n].values for n in (dims.SA1, dims.RA1)] for each in (felt, true))
    slow, fast = ((one[:, cell], other) for one, other in zip(cells, dots, strict=True))
    means = [np.nanmean(one, axis=1) for one in slow]
    pressed = np.flatnonzero(means[1] >= means[1].max() / 2)
    within = [spearmanr(slow[0][n], slow[1][n], nan_policy="omit")[0] for n in pressed]
    return [
        spearmanr(*map(np.ravel, slow), nan_policy="omit")[0],
        float(np.mean(within)),
        pearsonr(*means)[0],
        spearmanr(*map(np.ravel, fast), nan_policy="omit")[0],
    ], float(np.median(cells[0][:5]))


def main(clips: Sequence[str]) -> None:
    """Print the table."""
    columns = ("gel", "dots", "all", "within a pressed frame", "means of frames", "RA-I", "at rest")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    for name, film_and_truth in [
        ("made", made()),
        *((Path(c).stem, painted(Path(c))) for c in clips),
    ]:
        found, noise = compared(*film_and_truth)
        numbers = " | ".join(f"{one:.2f}" for one in [*found, noise])
        print(f"| {name} | {film_and_truth[1].sizes[dims.MARKER]} | {numbers} |")


if __name__ == "__main__":
    main(sys.argv[1:])
