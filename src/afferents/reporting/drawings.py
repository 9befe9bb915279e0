"""Figures 5 and 6: the networks layer by layer, as they were built for the data.

What a layer is, the shape that leaves it and how many parameters it has come from the network
itself; nothing of them is written here.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from afferents.models.shapes import LayerShape
from afferents.reporting.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LINE,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    new_figure,
    styled,
)

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


class DrawnNetwork(NamedTuple):
    """A network: its title, what enters it, its layers, and its parameters in all."""

    title: str
    input_shape: str
    layers: Sequence[LayerShape]
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


def _draw_layer(axes: Axes, layer: LayerShape, y: int, width: float) -> None:
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
