"""Figures 5 and 6: the networks layer by layer, as they were built for the data.

What a layer is, the shape that leaves it and how many parameters it has come from the network
itself; nothing of them is written here.
"""

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from afferents.models.shapes import LayerShape
from afferents.reporting.style import LINE, new_figure, styled


class DrawnNetwork(NamedTuple):
    """A network: its title, what enters it, its layers, and its parameters in all."""

    title: str
    input_shape: str
    layers: Sequence[LayerShape]
    n_parameters: int
    n_trainable: int


@styled
def networks_figure(networks: Sequence[DrawnNetwork], title: str, source: str) -> Figure:
    """Draw networks side by side, each a column of layers from the input down."""
    longest = max(len(network.layers) for network in networks)
    size = max(4.2 * len(networks), 5.6), 0.225 * (longest + 3) + 1.0
    figure = new_figure(*size, title, source)
    panels = figure.subplots(1, len(networks), squeeze=False)[0]
    for axes, network in zip(panels, networks, strict=True):
        axes.set_axis_off()
        axes.set_title(network.title, loc="left", fontweight="bold", fontsize=9.5)
        layers = [(one.title, one.shape, f"{one.n_parameters:,}") for one in network.layers]
        n, trainable = f"{network.n_parameters:,}", f"in all; {network.n_trainable:,} are trainable"
        table = axes.table(
            [("input", network.input_shape, ""), *layers, ("", trainable, n)],
            colLabels=("layer", "output", "parameters"), colWidths=(0.42, 0.38, 0.2),
            cellLoc="right", colLoc="right", edges="horizontal", bbox=(0, 0, 1, 1),
        )  # fmt: skip
        table.auto_set_font_size(False)
        for (_, column), cell in table.get_celld().items():
            cell.set(edgecolor=LINE, linewidth=0.5)
            cell.set_text_props(fontsize=8, ha="right" if column else "left")
    return figure
