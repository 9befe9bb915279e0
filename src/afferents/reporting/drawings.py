"""Figures 3, 5 and 6 as drawn in the paper: the drums, and the networks layer by layer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import FancyBboxPatch
from numpy.typing import NDArray

from afferents.reporting.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LINE,
    ORANGE,
    PURPLE,
    SEQUENTIAL,
    SKY,
    VERMILION,
    frame_all,
    new_figure,
    styled,
)

# Figure 3: the textured drums, drawn from the surfaces that the simulated rig slides.
#
# The paper shows photographs. Here each drum is drawn as a camera far away would see it, lit from
# the upper left, and beneath it a piece of its surface as heights.

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
def drums_figure(drums: Sequence[DrumView], source: str) -> Figure:
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


# Figures 5 and 6: the networks, layer by layer, as they were built for the data.
#
# What a layer is, the shape that leaves it and how many parameters it has come from the network
# itself; nothing of them is written here.

_COLOURS = {
    "Conv": BLUE,
    "MaxPool": SKY,
    "BatchNorm": GREEN,
    "Dense": VERMILION,
    "LSTM": PURPLE,
    "Dropout": LINE,
    "ReLU": LINE,
    "Flatten": LINE,
}
_OTHER = ORANGE
_ROW_INCH = 0.235
_NARROWEST, _WIDEST = 0.22, 0.57
"""Of boxes, as shares of the width."""


class DrawnLayer(NamedTuple):
    """A layer: what it is, the shape that leaves it, and its parameters as Keras counts them."""

    title: str
    shape: str
    n_values: int
    n_parameters: int


class DrawnNetwork(NamedTuple):
    """A network: its title, what enters it, its layers, and its parameters in all."""

    title: str
    input_shape: str
    layers: tuple[DrawnLayer, ...]
    n_parameters: int
    n_trainable: int


@styled
def networks_figure(networks: Sequence[DrawnNetwork], title: str, source: str) -> Figure:
    """Draw networks side by side, each a column of layers from the input down.

    A box is the wider the more values leave the layer, on a logarithmic scale.
    """
    longest = max(len(network.layers) for network in networks)
    width = 5.0 * len(networks)
    figure = new_figure(max(width, 5.6), _ROW_INCH * (longest + 3) + 1.0, title, source)
    for axes, network in zip(figure.subplots(1, len(networks), squeeze=False)[0], networks,
                             strict=True):  # fmt: skip
        _draw(axes, network, longest)
    return figure


def _draw(axes: Axes, network: DrawnNetwork, longest: int) -> None:
    axes.set_axis_off()
    axes.set(xlim=(0, 1.07), ylim=(longest + 2.4, -1.4))
    axes.set_title(network.title, loc="left", fontweight="bold", fontsize=9.5)
    for x, text, side in ((0.0, "layer", "left"), (0.82, "output", "right"),
                          (1.0, "parameters", "right")):  # fmt: skip
        axes.text(x, -1.0, text, ha=side, va="center", fontsize=7.5, color=GREY)
    axes.text(0.0, 0, "input", va="center", fontsize=8)
    axes.text(0.82, 0, network.input_shape, ha="right", va="center", fontsize=8)
    most = max(np.log(1 + layer.n_values) for layer in network.layers)
    for number, layer in enumerate(network.layers, 1):
        _draw_layer(axes, layer, number, _width(layer.n_values, most))
    last = len(network.layers) + 1
    axes.plot([0, 1], [last - 0.4] * 2, color=GREY, lw=0.7)
    axes.text(0.0, last + 0.15, f"{network.n_parameters:,} parameters, of which "
              f"{network.n_trainable:,} are trainable", va="center", fontsize=8,
              fontweight="bold")  # fmt: skip


def _width(n_values: int, most: float) -> float:
    """Return how wide a box is: wide enough for what stands in it, then by the logarithm."""
    return _NARROWEST + (_WIDEST - _NARROWEST) * float(np.log(1 + n_values) / most)


def _draw_layer(axes: Axes, layer: DrawnLayer, y: int, width: float) -> None:
    colour = _COLOURS.get(layer.title.split()[0], _OTHER)
    axes.add_patch(
        FancyBboxPatch(
            (0.004, y - 0.37), width, 0.74, boxstyle="round,pad=0,rounding_size=0.006",
            facecolor=colour, alpha=0.9 if colour == LINE else 0.3, edgecolor=colour, lw=0.6,
            mutation_aspect=25,
        )
    )  # fmt: skip
    axes.text(0.015, y, layer.title, va="center", fontsize=8, color=INK)
    axes.text(0.82, y, layer.shape, ha="right", va="center", fontsize=8, color=INK)
    if layer.n_parameters:
        axes.text(1.0, y, f"{layer.n_parameters:,}", ha="right", va="center", fontsize=8)
