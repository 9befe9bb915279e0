"""The look of every figure, its parts that are drawn on one Axes, and writing it.

Figures are made with matplotlib's objects, never through pyplot, so nothing is left behind and
several can be drawn at once. The last ticks of an axis are made when it is written, so
writing keeps the same look. Colours are those of Okabe and Ito and maps of even lightness,
which colour-blind readers can tell apart.
"""

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure, FigureBase
from matplotlib.image import AxesImage
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.text import Text
from numpy.typing import NDArray

from afferents import dims, files, progress
from afferents.reporting import labels

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
PROTOCOL_COLOURS = {"nested": BLUE, "published": VERMILION}
NAMES = {dims.SA1: "SA-I", dims.RA1: "RA-I", dims.RA2: "RA-II"}
QUANTILES = ((0.05, 0.95), (0.25, 0.75))
"""Of the markers, that the bands of a response hold."""
RING_POINTS = 5.1
"""Diameter of the ring round a marker at a scale of 1."""
HIGHEST_HZ = 400.0
"""Spectra are shown up to 400 Hz at most: what the paper's Figure 12 truly shows."""
OF_TRUE = "% of the true texture's test samples"
MOST_TICKS = 14
"""Names of textures under a matrix; of more, some are left out."""
_LEAST_POINTS, _MOST_POINTS, _OF_CELL = 5.5, 8.0, 0.43
"""Size of the numbers in cells, pt: no smaller, no larger, and what share of a cell."""
LEAST_WRITTEN, _DARK = 5.0, 55.0
"""Percent that are written as a number, and from where on in white."""

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


def draw_markers(
    axes: Axes, position: NDArray[np.float64], seen: NDArray[np.bool_], scale: float = 1.0
) -> None:
    """Draw circles around the markers that were seen, and crosses where one is known but was not.

    Parameters
    ----------
    position, seen
        Shapes (n, 2), px, NaN where lost, and (n,).
    scale
        Of the circles and crosses; 1 is for axes of 7 inches.
    """
    x, y = position[seen].T
    axes.scatter(x, y, s=(RING_POINTS * scale) ** 2, facecolors="none", edgecolors=BLUE,
                 lw=1.2 * min(scale, 1), label="detected")  # fmt: skip
    lost = ~seen & np.isfinite(position).all(axis=1)
    if lost.any():
        x, y = position[lost].T
        axes.scatter(x, y, s=28 * scale**2, color=VERMILION, marker="x", label="not detected")


def draw_bands(axes: Axes, response: xr.DataArray, label: str, colour: str) -> None:
    """Draw the mean over markers and the bands of `QUANTILES`, of a response (time, marker)."""
    time = response[dims.TIME].values
    alive = response.dropna(dims.TIME, how="all")
    if len(alive) == 0:  # a still, or nothing seen
        return
    for (low, high), alpha in zip(QUANTILES, (0.18, 0.32), strict=True):
        band = alive.quantile([low, high], dim=dims.MARKER).values
        label_of_band = f"{100 * low:.0f} to {100 * high:.0f} % of markers"
        axes.fill_between(
            alive[dims.TIME], *band, color=colour, alpha=alpha, lw=0, label=label_of_band
        )
    axes.plot(alive[dims.TIME], alive.mean(dims.MARKER), color=colour, label="mean")
    axes.set(ylabel=label, xlim=(time[0], time[-1]))
    if not (alive < 0).any():
        axes.set_ylim(bottom=0)


def draw_traces(axes: Axes, values: NDArray[np.float32], rate: float, unit: str) -> None:
    """Draw every channel around its own mean, one above the other where there are several."""
    time = np.arange(len(values)) / rate
    centred = values - values.mean(axis=0)
    step = 0.7 * float(np.ptp(centred, axis=0).max()) if values.shape[1] > 1 else 0.0
    for index, trace in enumerate(centred.T):
        axes.plot(time, trace - index * step, color=BLUE, lw=0.6)
    axes.set(xlabel="time (s)", ylabel=f"signal{unit}", xlim=(time[0], time[-1]))
    if step:
        axes.set_ylabel(f"channel (apart by {step:.3g}{unit})")
        numbers = range(1, values.shape[1] + 1)
        axes.set_yticks([-step * (number - 1) for number in numbers], map(str, numbers))


def find_scale(*images: NDArray[np.float32]) -> tuple[float, float]:
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


def amplitude_label(attrs: Mapping[object, object]) -> str:
    """Return the name of the amplitude axis, with its unit where the spectra carry one."""
    return f"amplitude ({attrs[dims.UNITS]})" if attrs.get(dims.UNITS) else "amplitude"


def amplitude_top(spectra: Sequence[xr.DataArray], to_hz: float = HIGHEST_HZ) -> float:
    """Return the top of an amplitude axis for these spectra, shown up to a frequency.

    Offset and drift, the lowest hundredth of what is shown, do not set it.
    """
    tops = [0.0]
    for spectrum in spectra:
        axis = spectrum[dims.FREQUENCY]
        highest = min(to_hz, float(axis.max()))
        tops.append(float(spectrum.where((axis >= 0.01 * highest) & (axis <= highest)).max()))
    return 1.15 * max(tops) or 1.0


def normalise(counts: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return percent[true, predicted] of the test samples of each true texture.

    Every row sums to 100, and is NaN where a texture has no test sample. The paper divides counts
    by 25, 2.5 and 0.3: percent of its 2,500 and 250 samples in Figures 9 and 11, but twice the
    percentage of its 60 in Figure 13, which saturates.
    """
    totals = counts.sum(axis=1, keepdims=True)
    return np.where(totals > 0, 100.0 * counts / np.maximum(totals, 1), np.nan)


def draw_matrix(
    axes: Axes,
    percent: NDArray[np.float64],
    title: str,
    width_inch: float,
    origin: Literal["lower", "upper"] = "lower",
) -> AxesImage:
    """Draw percent[true, predicted]: true textures to the right as in the paper, predicted ones up.

    From the upper origin predicted ones go down, as in print. Cells carry their number where the
    matrix is wide enough for them to be read.
    """
    axes.set_title(title)
    size = min(_MOST_POINTS, _OF_CELL * 72 * width_inch / len(percent))
    for true, predicted in np.argwhere(percent >= LEAST_WRITTEN) if size >= _LEAST_POINTS else ():
        value = percent[true, predicted]
        colour = "white" if value > _DARK else INK
        axes.text(
            true, predicted, f"{value:.0f}", ha="center", va="center", fontsize=size, color=colour
        )
    return draw_cells(axes, percent.T, PERCENT, 0, 100, origin=origin)


def name_textures(grid: NDArray[Any], textures: Sequence[str], by_spacing: bool) -> None:
    """Name the textures on every axis of the left column, and on the lowest of each column."""
    names = list(labels.texture_names(textures, by_spacing).values())
    axis, step = labels.texture_axis(textures, by_spacing), -(-len(names) // MOST_TICKS)
    for axes in grid.flat:
        axes.set(xticks=[], yticks=[])
        axes.tick_params(length=2, color=GREY)
    for axes in (column[[one.get_visible() for one in column]][-1] for column in grid.T):
        name_places(axes, names, MOST_TICKS, fontsize=6)
        axes.set_xlabel(f"true {axis}", fontsize=7)
    for axes in grid[:, 0]:
        axes.set_yticks(range(0, len(names), step), names[::step], fontsize=6)
        axes.set_ylabel(f"predicted {axis}", fontsize=7)


def draw_accuracies(
    axes: Axes,
    protocol: str,
    at: Sequence[float],
    shares: Sequence[float],
    line: str,
    width: float = 1.1,
    colour: str | None = None,
    label: str | None = None,
) -> None:
    """Draw shares in percent; the marks of the published protocol are open."""
    colour, is_open = colour or PROTOCOL_COLOURS[protocol], protocol == "published"
    axes.plot(
        at, 100 * np.array(shares), color=colour, ls=line, lw=width, marker="s" if is_open else "o",
        markerfacecolor="white" if is_open else colour, markersize=4,
        label=label or labels.PROTOCOL_TITLES[protocol],
    )  # fmt: skip


def save_figure(figure: Figure, path: Path) -> Path:
    """Write the figure as PNG, whole or not at all, and return the path."""
    with files.write_aside(path) as partial:
        partial.write_bytes(png_bytes(figure))
    return path


@styled
def png_bytes(figure: Figure) -> bytes:
    """Return the figure as the content of a PNG file."""
    for text in figure.findobj(Text):
        if text.get_text() != (printed := progress.printable(text.get_text())):
            text.set_text(printed)  # the name of a file
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": files.MARK})
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
