"""Figures 8 and 10 as drawn: ten tactile images of each recording, one after the other.

Panel A has the textures a, g and m at 50 mm/s, panel B the texture g at 10, 50 and 100 mm/s. The
paper speaks of ten consecutive frames; its code draws frames that are 20 apart. Both are drawn
here, each a figure of its own. As in the paper, all images of a figure have one colour scale; here
it spans just what is shown, where the paper's was taken from other frames and clips some. Row is
the rank of a marker in y and column that in x, as everywhere else; the paper's are the transpose.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.reporting.images import TactileImage, draw_image, name_axes, scale_of
from afferents.reporting.paper.stand_ins import Shown
from afferents.reporting.style import INK, new_figure, styled

N_FRAMES = 10
SPACINGS = (20, 1)
"""Frames from one image to the next: as the paper's code draws, and as its text says."""


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
    """

    panel: str
    shown: Shown
    images: NDArray[np.float32]
    time_s: NDArray[np.float64]


@styled
def frames_figure(
    rows: Sequence[FrameRow], title: str, unit: str, source: str, sliding: str = ""
) -> Figure:
    """Draw rows of tactile images on one colour scale.

    Parameters
    ----------
    rows
        Those of panel A, then those of panel B; of short recordings with fewer frames.
    title
        Of the figure.
    unit
        What the colours are, with the unit, such as `SA-I (px)`.
    source
        The line that says what the images were made from.
    sliding
        Direction in which the surface slides under the skin; empty where nothing declares it.
    """
    n_columns = max(len(row.images) for row in rows)
    figure = new_figure(0.86 * n_columns + 1.5, 0.97 * len(rows) + 0.95, title, source)
    grid = figure.subplots(len(rows), n_columns, squeeze=False)
    images = [
        [
            TactileImage(image, f"{1000 * time:+.0f} ms" if number == 0 else "", row.shown.label)
            for image, time in zip(row.images, row.time_s, strict=True)
        ]
        for number, row in enumerate(rows)
    ]
    low, high = scale_of([image for row in images for image in row])
    for cells, row, content in zip(grid, rows, images, strict=True):
        for axes, image in zip(cells, content, strict=False):
            drawn = draw_image(axes, image, low, high)
        for axes in cells[len(content) :]:
            axes.set_axis_off()  # the recording is too short for ten frames
        cells[0].set_ylabel(row.shown.label, rotation=0, ha="right", va="center", fontsize=8)
    previous = ""
    for cells, row in zip(grid, rows, strict=True):
        if row.panel != previous:
            cells[0].annotate(
                row.panel, xy=(0, 1), xytext=(-46, 4), xycoords="axes fraction",
                textcoords="offset points", fontsize=10, fontweight="bold", color=INK,
            )  # fmt: skip
        previous = row.panel
    name_axes(grid[-1, len(rows[-1].images) - 1], sliding)
    bar = figure.colorbar(drawn, ax=grid, fraction=0.016, pad=0.012, aspect=32)
    bar.set_label(f"{unit}, one scale for all")
    bar.outline.set_visible(False)
    return figure
