"""Parts of figures, each drawn on one Axes: what plots, the report and `inspect` share."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.image import AxesImage
from numpy.typing import NDArray

from afferents import dims
from afferents.reporting import labels, style
from afferents.reporting.style import BLUE, GREY, INK, VERMILION

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
    return style.draw_cells(axes, image, style.SEQUENTIAL, *scale)


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
    origin: Literal["lower", "upper"] = "lower",
) -> AxesImage:
    """Draw percent[true, predicted]: true textures to the right as in the paper, predicted ones up.

    From the upper origin predicted ones go down, as in print.
    """
    axes.set_title(title)
    return style.draw_cells(axes, percent.T, style.PERCENT, 0, 100, origin=origin)


def write_numbers(axes: Axes, percent: NDArray[np.float64], width_inch: float) -> None:
    """Write percentages into the cells of a matrix of that width, where they can be read."""
    size = min(_MOST_POINTS, _OF_CELL * 72 * width_inch / len(percent))
    if size < _LEAST_POINTS:
        return
    for true, predicted in np.argwhere(percent >= LEAST_WRITTEN):
        value = percent[true, predicted]
        colour = "white" if value > _DARK else INK
        axes.text(
            true, predicted, f"{value:.0f}", ha="center", va="center", fontsize=size, color=colour
        )


def name_textures(grid: NDArray[Any], textures: Sequence[str], by_spacing: bool) -> None:
    """Name the textures on every axis of the left column, and on the lowest of each column."""
    names = list(labels.texture_names(textures, by_spacing).values())
    axis, step = labels.texture_axis(textures, by_spacing), -(-len(names) // MOST_TICKS)
    for axes in grid.flat:
        axes.set(xticks=[], yticks=[])
        axes.tick_params(length=2, color=GREY)
    for axes in (column[[one.get_visible() for one in column]][-1] for column in grid.T):
        style.name_places(axes, names, MOST_TICKS, fontsize=6)
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
