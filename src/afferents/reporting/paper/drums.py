"""Figure 3: the textured drums, drawn from the surfaces that the simulated rig slides.

The paper shows photographs. Here each drum is drawn as a camera far away would see it, lit from
the upper left, and beneath it a piece of its surface as heights.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from afferents.reporting.style import SEQUENTIAL, frame_all, new_figure, styled

COLUMNS = 7
PIECE_MM = 15.0
"""Side of the piece whose heights are shown, mm."""
_PIXEL_MM, _FINER = 0.24, 4
"""Size of a picture element, and how many times finer its light is worked out and averaged: the
finest bumps are smaller than it."""
_LIGHT = np.array([-0.35, -0.3, 0.89])
"""Where light comes from: x to the right (across the drum), y down, z towards the camera."""
_AMBIENT = 0.15


@dataclass(frozen=True)
class DrumView:
    """A drum to draw.

    Attributes
    ----------
    name
        What the report calls its texture, with the bump spacing.
    height_mm
        Unrolled, shape (along, across), mm.
    length_mm, width_mm
        What the map covers round the drum, which it closes round, and across, mm.
    """

    name: str
    height_mm: NDArray[np.float32]
    length_mm: float
    width_mm: float


@styled
def figure03(drums: Sequence[DrumView], source: str) -> Figure:
    """Draw all drums, the picture of each above a piece of its surface; one scale of heights."""
    columns = min(COLUMNS, len(drums))
    n_rows = -(-len(drums) // columns)
    figure = new_figure(
        max(1.32 * columns + 0.7, 5.0), 3.35 * n_rows + 0.8, "Figure 3. Textured drums", source
    )
    grid = figure.subplots(
        2 * n_rows, columns, squeeze=False, gridspec_kw={"height_ratios": [1.9, 1.0] * n_rows}
    )
    highest = max(0.01, *(float(drum.height_mm.max()) for drum in drums))
    for axes in grid.flat:
        axes.set_axis_off()
    for number, drum in enumerate(drums):
        row, column = 2 * (number // columns), number % columns
        _draw_drum(grid[row, column], drum)
        image = _draw_piece(grid[row + 1, column], drum, highest)
    for row in range(1, 2 * n_rows, 2):
        _name_piece(grid[row, 0])
    bar = figure.colorbar(image, ax=grid[1::2], fraction=0.014, pad=0.01, aspect=40)
    bar.set_label("height above the drum's base (mm), one scale for all")
    bar.outline.set_visible(False)
    return figure


def shaded(drum: DrumView) -> NDArray[np.float64]:
    """Return how light the drum is, 0 to 1, seen from far away: (row, column).

    The axis lies across the picture, so the surface passes from top to bottom.
    """
    radius = drum.length_mm / (2 * np.pi)
    step = _PIXEL_MM / _FINER
    n_rows, n_columns = int(2 * radius / _PIXEL_MM), int(drum.width_mm / _PIXEL_MM)
    y = step * (np.arange(n_rows * _FINER) - (n_rows * _FINER - 1) / 2)
    angle = np.arcsin(y / radius)
    n_along, n_across = drum.height_mm.shape
    x = step * (np.arange(n_columns * _FINER) + 0.5)
    rows = np.round(angle / (2 * np.pi) * n_along).astype(int) % n_along
    columns = np.minimum((x / drum.width_mm * n_across).astype(int), n_across - 1)
    slope_along = np.gradient(drum.height_mm, drum.length_mm / n_along, axis=0)
    slope_across = np.gradient(drum.height_mm, drum.width_mm / n_across, axis=1)
    along, across = slope_along[np.ix_(rows, columns)], slope_across[np.ix_(rows, columns)]
    # The cylinder's outward normal, tilted against the slope of what stands on it.
    sine, cosine = np.sin(angle)[:, None], np.cos(angle)[:, None]
    normal = np.stack([-across, sine - along * cosine, cosine + along * sine], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    light: NDArray[np.float64] = np.clip(normal @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    averaged = light.reshape(n_rows, _FINER, n_columns, _FINER).mean(axis=(1, 3))
    lightness: NDArray[np.float64] = _AMBIENT + (1 - _AMBIENT) * averaged
    return lightness


def _draw_drum(axes: Axes, drum: DrumView) -> None:
    diameter = drum.length_mm / np.pi
    axes.imshow(
        shaded(drum), cmap="gray", vmin=0, vmax=1, interpolation="antialiased",
        extent=(0, drum.width_mm, diameter, 0),
    )  # fmt: skip
    axes.set_title(drum.name, fontsize=8.5)


def _draw_piece(axes: Axes, drum: DrumView, highest: float) -> AxesImage:
    n_along, n_across = drum.height_mm.shape
    rows = round(PIECE_MM / drum.length_mm * n_along)
    columns = round(PIECE_MM / drum.width_mm * n_across)
    first = (n_across - columns) // 2
    axes.set_axis_on()
    axes.set_xticks([])
    axes.set_yticks([])
    frame_all(axes)
    return axes.imshow(
        drum.height_mm[:rows, first : first + columns], cmap=SEQUENTIAL, vmin=0, vmax=highest,
        interpolation="antialiased", extent=(0, PIECE_MM, PIECE_MM, 0),
    )  # fmt: skip


def _name_piece(axes: Axes) -> None:
    axes.set_yticks([0, PIECE_MM], ["0", f"{PIECE_MM:g}"], fontsize=6.5)
    axes.set_xticks([0, PIECE_MM], ["0", f"{PIECE_MM:g}"], fontsize=6.5)
    axes.set_ylabel("along the\nslide (mm)", fontsize=7)
    axes.set_xlabel("across (mm)", fontsize=7)
