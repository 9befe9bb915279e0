"""Tactile images frame after frame: Figures 8 (SA-I) and 10 (RA-I).

Every image has row (rank of the marker in y) downwards and column (rank in x) to the right, as
the camera sees the skin; the paper's pictures are the transpose. A colour scale goes from the 1st
to the 99th percentile of the images that it stands beside. In the report's figures every recording
has its own: on one scale the texture that drags the skin farthest would leave the others dark. In
those as the paper prints them all images have one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from afferents import dims
from afferents.reporting.choice import Shown
from afferents.reporting.style import (
    INK,
    SEQUENTIAL,
    VERMILION,
    add_bar,
    draw_cells,
    new_figure,
    styled,
)

N_FRAMES = 10
SPACINGS = (20, 1)
"""Frames from one image to the next, as printed: as the paper's code draws, and as its text says.
"""
_NAMES = {dims.SA1: "SA-I", dims.RA1: "RA-I"}
_LEFT, _RIGHT, _TOP, _BOTTOM = (0.15, 0.5), (0.85, 0.5), (0.5, 0.85), (0.5, 0.15)
_ARROWS = {
    "+x": (_RIGHT, _LEFT), "-x": (_LEFT, _RIGHT), "+y": (_BOTTOM, _TOP), "-y": (_TOP, _BOTTOM)
}  # fmt: skip
"""Tip and tail of sliding directions in the image, in parts of it: x to the right, y downwards."""


@dataclass(frozen=True)
class FrameRow:
    """A row of Figure 8 or 10.

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
    unit
        Of the images.
    """

    panel: str
    shown: Shown
    images: NDArray[np.float32]
    time_s: NDArray[np.float64]
    unit: str


@styled
def images_figure(
    rows: Sequence[FrameRow],
    channel: str,
    title: str,
    source: str,
    sliding: str = "",
    one_scale: bool = False,
) -> Figure:
    """Draw ten frames of each recording, one after the other, as the paper does.

    The paper speaks of ten consecutive frames; its code draws frames that are 20 apart: see
    `SPACINGS`. Its scale was taken from other frames and hides some.

    Parameters
    ----------
    rows
        Those of panel A, then those of panel B; of short recordings with fewer frames.
    channel
        `sa1` or `ra1`.
    title
        Of the figure.
    source
        The line that says what the images were made from.
    sliding
        Direction in which the surface slides under the skin, such as `+x`; x is to the right, y
        downwards. Empty where nothing declares it: no arrow is drawn.
    one_scale
        Whether all rows have one scale of colours, or each its own.
    """
    n_columns = max(len(row.images) for row in rows)
    width = 0.86 * n_columns + (1.5 if one_scale else 2.1)
    figure = new_figure(width, 0.97 * len(rows) + 0.95, title, source)
    grid = figure.subplots(len(rows), n_columns, squeeze=False)
    panel = ""
    for cells, row in zip(grid, rows, strict=True):
        scale = scale_of(*(one.images for one in (rows if one_scale else [row])))
        for axes, image, time in zip(cells, row.images, row.time_s, strict=False):
            said = f"{1000 * time:+.0f} ms" if row is rows[0] else ""
            drawn = draw_image(axes, image, scale, said)
        for axes in cells[len(row.images) :]:  # the recording is too short for ten frames
            axes.set_axis_off()
        cells[0].set_ylabel(row.shown.label, rotation=0, ha="right", va="center", fontsize=8)
        if row.panel != panel:
            panel = row.panel
            cells[0].annotate(
                panel, xy=(0, 1), xytext=(-46, 4), xycoords="axes fraction",
                textcoords="offset points", fontsize=10, fontweight="bold", color=INK,
            )  # fmt: skip
        if not one_scale:
            bar = add_bar(
                figure, drawn, cells, "", extend="both", fraction=0.011, pad=0.011, aspect=9
            )
            bar.set_label(f"{_NAMES[channel]} ({row.unit})", fontsize=7)
            bar.locator = MaxNLocator(3)
    name_axes(grid[-1, len(rows[-1].images) - 1], sliding)
    if one_scale:
        label = f"{_NAMES[channel]} ({rows[0].unit}), one scale for all"
        add_bar(figure, drawn, grid, label, extend="both", fraction=0.016, pad=0.012, aspect=32)
    return figure


def scale_of(*images: NDArray[np.float32]) -> tuple[float, float]:
    """Return the 1st and the 99th percentile of all images: one outlier does not set the scale."""
    values = np.concatenate([image.ravel() for image in images])
    values = values[np.isfinite(values)]
    low, high = np.quantile(values, [0.01, 0.99]) if len(values) else (0.0, 1.0)
    return float(low), float(high)


def draw_image(
    axes: Axes, image: NDArray[np.float32], scale: tuple[float, float], title: str
) -> AxesImage:
    """Draw an image (row, column) in colours that span the scale; what is NaN is grey."""
    axes.set_title(title, fontsize=7.5)
    axes.set(xticks=[], yticks=[])
    return draw_cells(axes, image, SEQUENTIAL, *scale)


def name_axes(axes: Axes, sliding: str) -> None:
    """Say on one image what the axes are, and draw the sliding direction, if known, over it."""
    slides = f"\nsliding {sliding}" if sliding else ""
    axes.set_xlabel(f"column (x) →{slides}", fontsize=7)
    axes.yaxis.set_label_position("right")
    axes.set_ylabel("← row (y)", fontsize=7)
    if sliding in _ARROWS:
        tip, tail = _ARROWS[sliding]
        arrow = {"arrowstyle": "->", "color": VERMILION, "lw": 1.6}
        axes.annotate("", tip, tail, xycoords="axes fraction", arrowprops=arrow)
