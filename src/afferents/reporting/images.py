"""Grids of tactile images: Figures 8 (SA-I) and 10 (RA-I).

Every image has row (rank of the marker in y) downwards and column (rank in x) to the right, as
the camera sees the skin; the paper's pictures are the transpose. A colour scale spans exactly the
images that it stands beside. In the report's figures every texture's row has its own, as have the
consecutive frames: on one scale the texture that drags the skin farthest would leave the others
dark. In those as the paper prints them all images have one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from afferents import dims
from afferents.dims import NAMED_BY_SPACING, PIXELS, PIXELS_PER_FRAME
from afferents.encodings.samples import Samples, textures_of
from afferents.reporting.choice import Shown, example_textures, in_condition, speeds_of, spread
from afferents.reporting.labels import speed_key, texture_names
from afferents.reporting.style import (
    INK,
    MISSING,
    SEQUENTIAL,
    VERMILION,
    add_bar,
    frame_all,
    new_figure,
    styled,
)

SPEED = 50.0
"""Of the consecutive frames; the paper shows texture g at 10, 50 and 100 mm/s."""
MOST_SPEEDS = 10
N_FRAMES = 10
SPACINGS = (20, 1)
"""Frames from one image to the next, as printed: as the paper's code draws, and as its text says.
"""
FEW_SPEEDS = 3
"""Up to so many, panel B stands beside panel A; beneath it would leave the figure half empty."""
TITLES = {
    dims.SA1: "Figure 8. SA-I tactile images: displacement from rest",
    dims.RA1: "Figure 10. RA-I tactile images: change of SA-I from frame to frame",
}
UNITS = {dims.SA1: f"SA-I ({PIXELS})", dims.RA1: f"RA-I ({PIXELS_PER_FRAME})"}
_BAR = 0.11
"""Width of a colour bar, and what lies before it, as a share of an image's width."""
_ARROWS = {"+x": (0.7, 0.0), "-x": (-0.7, 0.0), "+y": (0.0, 0.7), "-y": (0.0, -0.7)}
"""Sliding directions in the image: x to the right, y downwards."""


@dataclass(frozen=True)
class TactileImage:
    """An image (row, column) with the texts over it and, in a first column, beside it."""

    values: NDArray[np.float32]
    title: str
    beside: str = ""


@dataclass(frozen=True)
class FrameRow:
    """A row of Figure 8 or 10 as printed.

    Attributes
    ----------
    panel
        `A` (textures) or `B` (speeds).
    shown
        Which recording it is of.
    images
        Shape (frame, row, column).
    time_s
        Of each frame since the first, s, (frame,).
    """

    panel: str
    shown: Shown
    images: NDArray[np.float32]
    time_s: NDArray[np.float64]


@styled
def images_figure(images: Samples, channel: str, source: str, sliding: str = "") -> Figure:
    """Draw panel A, four textures at every speed, and panel B, consecutive frames.

    Parameters
    ----------
    images
        Samples with the dims (sample, row, column).
    channel
        `sa1` or `ra1`.
    source
        The line that says what the images were made from.
    sliding
        Direction in which the surface slides under the skin, such as `+x`; x is to the right, y
        downwards. Empty where nothing declares it: no arrow is drawn.
    """
    by_texture, consecutive = textures_by_speed(images), consecutive_frames(images)
    shape_a = len(by_texture), len(by_texture[0])
    beside, shape_b = _place_of_b(shape_a, len(consecutive))
    n_rows = shape_a[0] if beside else shape_a[0] + shape_b[0]
    n_columns = shape_a[1] + shape_b[1] if beside else shape_a[1]
    size = max(0.9 * n_columns + 1.9, 6.0), 1.05 * n_rows + 0.9
    figure = new_figure(*size, TITLES[channel], source)
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    panel_b = grid[:, shape_a[1] :] if beside else grid[shape_a[0] :]
    rows = [*zip(grid[: shape_a[0], None, : shape_a[1]], by_texture, strict=True),
            (panel_b, consecutive[: panel_b.size])]  # fmt: skip
    for cells, shown in rows:
        drawn = _draw_on_one_scale(cells.flat, shown)
        _name_row(cells[0, 0], shown[0].beside)
        n = cells.shape[1]
        bar = add_bar(
            figure, drawn, list(cells.flat), "", fraction=_BAR / n, pad=_BAR / n,
            aspect=min(len(cells), 2) / _BAR,
        )  # fmt: skip
        bar.set_label(UNITS[channel], fontsize=7)
        bar.locator = MaxNLocator(3)
    name_axes(panel_b.flat[len(rows[-1][1]) - 1], sliding)
    return figure


def _place_of_b(shape_a: tuple[int, int], n_frames: int) -> tuple[bool, tuple[int, int]]:
    """Return whether panel B stands beside panel A, and its rows and columns: whole rows only."""
    n_textures, n_speeds = shape_a
    if n_speeds <= FEW_SPEEDS:
        return True, (n_textures, max(1, n_frames // n_textures))
    return False, (max(1, n_frames // n_speeds), n_speeds)


@styled
def printed_images_figure(
    rows: Sequence[FrameRow], channel: str, title: str, source: str, sliding: str = ""
) -> Figure:
    """Draw ten frames of each recording, one after the other, as the paper does.

    Panel A has the textures a, g and m at 50 mm/s, panel B the texture g at 10, 50 and 100 mm/s.
    The paper speaks of ten consecutive frames; its code draws frames that are 20 apart: see
    `SPACINGS`. One scale for all spans just what is shown, where the paper's was taken from other
    frames and hides some.

    Parameters
    ----------
    rows
        Those of panel A, then those of panel B; of short recordings with fewer frames.
    channel, source, sliding
        As of `images_figure`.
    title
        Of the figure.
    """
    n_columns = max(len(row.images) for row in rows)
    figure = new_figure(0.86 * n_columns + 1.5, 0.97 * len(rows) + 0.95, title, source)
    grid = figure.subplots(len(rows), n_columns, squeeze=False)
    images = [
        [
            TactileImage(image, f"{1000 * time:+.0f} ms" if number == 0 else "")
            for image, time in zip(row.images, row.time_s, strict=True)
        ]
        for number, row in enumerate(rows)
    ]
    scale = scale_of([image for row in images for image in row])
    panel = ""
    for cells, row, content in zip(grid, rows, images, strict=True):
        drawn = _draw_on_one_scale(cells, content, scale)
        cells[0].set_ylabel(row.shown.label, rotation=0, ha="right", va="center", fontsize=8)
        if row.panel != panel:
            panel = row.panel
            cells[0].annotate(
                panel, xy=(0, 1), xytext=(-46, 4), xycoords="axes fraction",
                textcoords="offset points", fontsize=10, fontweight="bold", color=INK,
            )  # fmt: skip
    name_axes(grid[-1, len(rows[-1].images) - 1], sliding)
    label = f"{UNITS[channel]}, one scale for all"
    add_bar(figure, drawn, grid, label, fraction=0.016, pad=0.012, aspect=32)
    return figure


def textures_by_speed(images: Samples) -> list[list[TactileImage]]:
    """Choose panel A: a row for each of four textures, the middle frame at every speed.

    A condition that was not recorded is an image of NaN.
    """
    textures, speeds = example_textures(images), spread(speeds_of(images), MOST_SPEEDS)
    names = texture_names(textures_of(images), images.attrs.get(NAMED_BY_SPACING, False))
    return [
        [
            TactileImage(
                _middle(images, texture, speed),
                f"{speed_key(speed)} mm/s" if texture == textures[0] else "",
                names[texture],
            )
            for speed in speeds
        ]
        for texture in textures
    ]


def consecutive_frames(images: Samples) -> list[TactileImage]:
    """Choose panel B: ten consecutive frames from the middle of one recording.

    The recording is of texture g (3 mm) near 50 mm/s where it is there, else of the middle
    texture.
    """
    textures = textures_of(images)
    texture = "3" if "3" in textures else textures[len(textures) // 2]
    of_texture = images.isel({dims.SAMPLE: np.flatnonzero(images[dims.TEXTURE] == texture)})
    speed = min(speeds_of(of_texture), key=lambda value: abs(value - SPEED))
    run = _middle_run(in_condition(of_texture, texture, speed))
    elapsed_ms = 1000 * (run[dims.START].values - run[dims.START].values[0])
    names = texture_names(textures, images.attrs.get(NAMED_BY_SPACING, False))
    beside = f"{names[texture]}\n{speed_key(speed)} mm/s"
    return [
        TactileImage(image, f"{time:+.0f} ms", beside)
        for image, time in zip(run.values, elapsed_ms, strict=True)
    ]


def _middle_run(condition: Samples) -> Samples:
    """Return ten consecutive samples from the middle of the condition's first recording."""
    recording = condition[dims.RECORDING].values
    ordered = condition.isel({dims.SAMPLE: np.flatnonzero(recording == recording[0])})
    ordered = ordered.sortby(dims.START)
    first = max(0, (ordered.sizes[dims.SAMPLE] - N_FRAMES) // 2)
    return ordered[first : first + N_FRAMES]


def _middle(images: Samples, texture: str, speed: float) -> NDArray[np.float32]:
    condition = in_condition(images, texture, speed)
    n = condition.sizes[dims.SAMPLE]
    if n == 0:
        return np.full(images.shape[1:], np.nan, dtype=np.float32)
    middle: NDArray[np.float32] = condition.values[n // 2]
    return middle


def scale_of(images: Sequence[TactileImage]) -> tuple[float, float]:
    """Return the 1st and the 99th percentile of all images: one outlier does not set the scale."""
    values = np.concatenate([image.values.ravel() for image in images])
    values = values[np.isfinite(values)]
    low, high = np.quantile(values, [0.01, 0.99]) if len(values) else (0.0, 1.0)
    return float(low), float(high)


def _draw_on_one_scale(
    cells: Any, images: Sequence[TactileImage], scale: tuple[float, float] | None = None
) -> AxesImage:
    """Draw images in cells, on the scale that they span if none is given."""
    low, high = scale or scale_of(images)
    cells = list(cells)
    for axes, image in zip(cells, images, strict=False):
        drawn = draw_image(axes, image, low, high)
    for axes in cells[len(images) :]:  # the recording is too short for ten frames
        axes.set_axis_off()
    return drawn


def _name_row(axes: Axes, text: str) -> None:
    axes.annotate(
        text, xy=(0, 0.5), xytext=(-5, 0), xycoords="axes fraction", textcoords="offset points",
        ha="right", va="center",
    )  # fmt: skip


def draw_image(axes: Axes, image: TactileImage, low: float, high: float) -> AxesImage:
    """Draw an image in colours from `low` to `high`; what is NaN is grey."""
    axes.set_facecolor(MISSING)
    axes.set_title(image.title, fontsize=7.5)
    axes.set_xticks([])
    axes.set_yticks([])
    frame_all(axes)
    return axes.imshow(
        image.values, cmap=SEQUENTIAL, vmin=low, vmax=high, origin="upper", interpolation="nearest"
    )


def name_axes(axes: Axes, sliding: str) -> None:
    """Say on one image what the axes are, and draw the sliding direction, if known, over it."""
    slides = f"\nsliding {sliding}" if sliding else ""
    axes.set_xlabel(f"column (x) →{slides}", fontsize=7)
    axes.yaxis.set_label_position("right")
    axes.set_ylabel("← row (y)", fontsize=7)
    if sliding in _ARROWS:
        dx, dy = _ARROWS[sliding]
        axes.annotate(
            "",
            xy=(0.5 + dx / 2, 0.5 - dy / 2),
            xytext=(0.5 - dx / 2, 0.5 + dy / 2),
            xycoords="axes fraction",
            arrowprops={"arrowstyle": "->", "color": VERMILION, "lw": 1.6},
        )
