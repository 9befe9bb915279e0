"""The look of every figure, and writing it: colours, type, the line that names the source.

Figures are made with matplotlib's objects, never through pyplot, so nothing is left behind and
several can be drawn at once. The last ticks of an axis are made when it is written, so
writing keeps the same look. Colours are those of Okabe and Ito and maps of even lightness,
which colour-blind readers can tell apart.
"""

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text

from afferents.files import MARK, write_aside
from afferents.progress import printable

BLUE, ORANGE, GREEN, VERMILION, PURPLE, SKY = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#CC79A7",
    "#56B4E9",
)
INK, GREY, LINE, MISSING = "#1c2330", "#667085", "#c9ced6", "#e6e8ec"
SEQUENTIAL = "cividis"
"""For responses: even in lightness, the same to colour-blind readers."""
PERCENT = "Blues"
"""For percentages: white is none, as in the paper's matrices."""
DPI = 160
_FOOTER_INCH = 0.22

styled = style.context(
    [
        "default",  # whatever a user's matplotlibrc says, such as text.usetex
        {
            "font.family": "DejaVu Sans",
            "font.size": 8.5,
            "text.color": INK,
            "text.parse_math": False,  # a $ is part of a name
            "axes.edgecolor": GREY,
            "axes.labelcolor": INK,
            "axes.linewidth": 0.7,
            "axes.titlesize": 8.5,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "xtick.color": GREY,
            "ytick.color": GREY,
            "xtick.labelcolor": INK,
            "ytick.labelcolor": INK,
            "xtick.labelsize": 7.5,
            "ytick.labelsize": 7.5,
            "xtick.major.width": 0.7,
            "ytick.major.width": 0.7,
            "lines.linewidth": 1.1,
            "legend.frameon": False,
            "legend.fontsize": 8,
            "figure.facecolor": "white",
        },
    ]
)
"""Decorator of the functions that draw: the look holds while they run and nowhere else."""


def new_figure(width: float, height: float, title: str, footer: str) -> Figure:
    """Return an empty figure of that size in inches, with its title and its source line."""
    below = _FOOTER_INCH / height
    inside = ConstrainedLayoutEngine(h_pad=0.06, w_pad=0.05, rect=(0.005, below, 0.99, 1 - below))
    figure = Figure(figsize=(width, height), layout=inside)
    figure.suptitle(title, x=0.012, ha="left", fontsize=11, fontweight="bold")
    figure.text(0.012, 0.06 / height, footer, fontsize=6.5, color=GREY, ha="left", va="bottom")
    return figure


def hide(cells: Iterable[Axes]) -> None:
    """Hide the cells of a grid that nothing is drawn in."""
    for axes in cells:
        axes.set_visible(False)


def add_bar(figure: FigureBase, drawn: AxesImage, ax: Any, label: str, **where: Any) -> Colorbar:
    """Add a colour bar without an outline."""
    bar = figure.colorbar(drawn, ax=ax, label=label, **where)
    bar.outline.set_visible(False)
    return bar


def draw_cells(
    axes: Axes, values: Any, colours: str, low: float, high: float, **options: Any
) -> AxesImage:
    """Draw numbers (row, column) as colours from `low` to `high`, framed; what is NaN is grey."""
    axes.set_facecolor(MISSING)
    axes.spines[:].set_visible(True)
    return axes.imshow(
        values, cmap=colours, vmin=low, vmax=high, interpolation="nearest", **options
    )


def percent_axes(axes: Axes, title: str, least: float = 0) -> None:
    """Make a panel of accuracy in percent, with its title."""
    axes.set_title(title, loc="left", fontweight="bold")
    axes.set(ylim=(least, 103), yticks=range(0, 101, 20))
    axes.grid(axis="y", color=LINE, lw=0.4)


def draw_chance(axes: Axes, chance: float) -> None:
    """Draw the line of chance, a share, into a panel of percent."""
    axes.axhline(100 * chance, color=GREY, lw=0.8, ls=(0, (4, 3)), label="chance")


def name_places(axes: Axes, names: Sequence[str], most: int, longest: int = 3, **text: Any) -> None:
    """Write names at 0, 1, 2, ...: all, or where there are more than `most`, some.

    They are turned where one has more letters than `longest`.
    """
    every = -(-len(names) // most)
    turned = 90 if max(map(len, names)) > longest else 0
    axes.set_xticks(range(0, len(names), every), names[::every], rotation=turned, **text)


def save_figure(figure: Figure, path: Path) -> Path:
    """Write the figure as PNG, whole or not at all, and return the path."""
    with write_aside(path) as partial:
        partial.write_bytes(png_bytes(figure))
    return path


@styled
def png_bytes(figure: Figure) -> bytes:
    """Return the figure as the content of a PNG file."""
    for text in figure.findobj(Text):
        if text.get_text() != (printed := printable(text.get_text())):
            text.set_text(printed)  # the name of a file
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": MARK})
    return buffer.getvalue()


@dataclass(frozen=True)
class ReportFigure:
    """A figure with its file name, title, caption, and what it shows.

    `description` is read out to those who cannot see the figure.
    """

    name: str
    title: str
    caption: str
    description: str
    figure: Figure

    @cached_property
    def png(self) -> bytes:
        """The figure as the content of a PNG file, drawn once."""
        return png_bytes(self.figure)
