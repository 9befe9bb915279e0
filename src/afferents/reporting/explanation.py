"""What a model's answers rest on: what is lost without each marker, wave, or frequency."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from afferents.core import dims
from afferents.reporting.style import BLUE, GREY, frame_all, new_figure, styled
from afferents.reporting.texture_names import texture_labels

_TITLES = {
    "markers": "What is lost where 3 x 3 markers stand still",
    "parts": "What is lost without each part of the global shear",
    "waves": "What is lost without each wave",
    "frequencies": "What is lost without each band of the spectrum",
    "harmonics": "What is lost without each multiple of a drum's bumps a second",
}
_AXES = {
    dims.ROW: "row (y, down)",
    dims.COLUMN: "column (x)",
    dims.ROW_WAVENUMBER: "down (cycles a marker)",
    dims.COLUMN_WAVENUMBER: "across (cycles a marker)",
    dims.FREQUENCY: "frequency (Hz)",
    "harmonic": "frequency over bumps a second",
    "part": "part of the global shear",
}
_LOSS = "lost log-odds of the true texture (nats)"
_COLOURS = "PuOr_r"
"""Orange where a part speaks for the true texture, purple where against it, white for neither."""
_A_ROW = 7


@styled
def explanation_figure(name: str, lost: xr.DataArray, source: str) -> Figure:
    """Draw losses by texture: images over a grid, a table over frequency, or one curve.

    Parameters
    ----------
    name
        `markers`, `parts`, `waves`, `frequencies` or `harmonics`.
    lost
        (texture, y, x), (texture, x) or (x,), nats.
    source
        The line that says what was asked.
    """
    if lost.ndim == 3:
        return _images(_TITLES[name], lost, source)
    figure = new_figure(7.2, 3.6, _TITLES[name], source)
    axes = figure.subplots()
    (dim,) = (str(d) for d in lost.dims if d != dims.TEXTURE)
    axes.set_xlabel(_AXES[dim])
    if lost.ndim == 1:
        axes.axhline(0, color=GREY, linewidth=0.7)
        axes.plot(lost[dim], lost, color=BLUE, marker="o", markersize=3)
        axes.set_ylabel(_LOSS.replace(" of", "\nof"))
        return figure
    names = lost[dim].values
    named = names.dtype.kind == "U"
    at = np.arange(len(names)) if named else names
    half = (at[1] - at[0]) / 2
    extent = (at[0] - half, at[-1] + half, len(lost) - 0.5, -0.5)
    drawn = _draw(axes, lost.values, _most(lost), extent=extent, aspect="auto")
    if named:
        axes.set_xticks(at, names)
    labels = _labels(lost)
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylabel("texture")
    figure.colorbar(drawn, ax=axes, label=_LOSS)
    return figure


def _images(title: str, lost: xr.DataArray, source: str) -> Figure:
    """Draw the mean of all textures, and each; a wave's row runs through 0 in the middle."""
    y, x = (str(dim) for dim in lost.dims[1:])
    lost = lost.sortby(y)
    panels = [("all", lost.mean(dims.TEXTURE))]
    panels += list(zip(_labels(lost), lost, strict=True))
    n_rows = -(-len(panels) // _A_ROW)
    wide = lost.sizes[y] < 1.5 * lost.sizes[x]
    figure = new_figure(10, n_rows * (1.7 if wide else 2.5) + 0.8, title, source)
    grid = figure.subplots(n_rows, _A_ROW, squeeze=False, sharex=True, sharey=True)
    half_y, half_x = (float(lost[dim][1] - lost[dim][0]) / 2 for dim in (y, x))
    extent = (
        float(lost[x][0]) - half_x, float(lost[x][-1]) + half_x,
        float(lost[y][-1]) + half_y, float(lost[y][0]) - half_y,
    )  # fmt: skip
    for axes, (label, one) in zip(grid.flat, panels, strict=False):
        drawn = _draw(axes, one.values, _most(one), extent=extent, aspect="equal")
        axes.set_title(f"{label}\nup to {_most(one):.2f}", fontsize=7.5)
    for axes in list(grid.flat)[len(panels) :]:
        axes.set_visible(False)
    grid[0, 0].set_ylabel(_AXES[y])
    grid[-1, 0].set_xlabel(_AXES[x])
    bar = figure.colorbar(drawn, ax=grid, shrink=0.7, label="lost nats, of each panel's most")
    bar.set_ticks([-_most(one), 0, _most(one)], labels=["-most", "0", "most"])
    return figure


def _labels(lost: xr.DataArray) -> list[str]:
    textures = [str(texture) for texture in lost[dims.TEXTURE].values]
    return list(texture_labels(textures, lost.attrs).values())


def _most(lost: xr.DataArray) -> float:
    return float(np.abs(lost.values).max()) or 1.0


def _draw(axes: Axes, values: Any, most: float, **options: Any) -> AxesImage:
    frame_all(axes)
    return axes.imshow(
        values, cmap=_COLOURS, vmin=-most, vmax=most, interpolation="nearest", **options
    )
