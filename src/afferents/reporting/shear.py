"""Global shear against the images without it: shares of variance, and texture told from each."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core import dims
from afferents.reporting.style import BLUE, GREY, ORANGE, SKY, new_figure, styled
from afferents.reporting.table import Cell, Table
from afferents.reporting.texture_names import texture_labels

_PARTS = (("mean displacement", BLUE), ("its gradients", SKY), ("the rest", ORANGE))


@dataclass(frozen=True)
class ShearFigure:
    """What is shown.

    Attributes
    ----------
    shares
        Of the variance between textures, between speeds, over time, percent: mean displacement,
        gradients (together the global shear), and the rest.
    rms_px
        Root of each variance.
    accuracies
        Mean, and the ends of its 95% interval, 0 to 1, by what texture was asked of.
    chance
        0 to 1.
    drag_px
        Mean displacement by (texture, speed).
    source
        The line that says of what.
    """

    shares: Mapping[str, tuple[float, ...]]
    rms_px: Mapping[str, float]
    accuracies: Mapping[str, tuple[float, float, float]]
    chance: float
    drag_px: xr.DataArray
    source: str


@styled
def shear_figure(shown: ShearFigure) -> Figure:
    """Draw shares of variance, accuracies, and how far each texture drags the skin."""
    title = "Global shear, and the images without it"
    figure = new_figure(10.5, 3.2, title, shown.source)
    shares, accuracies, drag = figure.subplots(1, 3, width_ratios=(1, 1, 1.15))
    _draw_shares(shares, shown)
    _draw_accuracies(accuracies, shown)
    _draw_drag(drag, figure, shown.drag_px)
    return figure


def shear_tables(shown: ShearFigure) -> Iterator[Table]:
    """Return the shares of variance, and the accuracies, as tables."""
    yield Table(
        "Global shear in the variance of the markers' displacement",
        "Root of the mean variance of a marker, and percent of the variance.",
        ("Variance", "rms (px)", "Mean displacement", "Its gradients", "The rest"),
        tuple(
            _row(name, f"{shown.rms_px[name]:.2f}", *(f"{share:.1f}" for share in shares))
            for name, shares in shown.shares.items()
        ),
    )
    rows = [
        _row(title, f"{100 * mean:.1f} [{100 * low:.1f}, {100 * high:.1f}]")
        for title, (mean, low, high) in shown.accuracies.items()
    ]
    yield Table(
        "Texture at held-out speeds",
        "Percent of samples of ten frames, mean over held-out speeds, with 95% interval over "
        f"recordings in brackets. A linear discriminant, nested. {shown.source}.",
        ("Told from", "Accuracy"),
        (*rows, _row("chance", f"{100 * shown.chance:.1f}")),
    )


def _row(*texts: str) -> tuple[Cell, ...]:
    return tuple(Cell(text) for text in texts)


def _draw_shares(axes: Axes, shown: ShearFigure) -> None:
    names = list(shown.shares)
    left = np.zeros(len(names))
    for number, (title, colour) in enumerate(_PARTS):
        width = np.array([shown.shares[name][number] for name in names])
        axes.barh(names, width, left=left, color=colour, height=0.6, label=title)
        left += width
    axes.set_yticks(range(len(names)), [f"{name}\n({shown.rms_px[name]:.2f} px)" for name in names])
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of the variance (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, fontsize=7,
                columnspacing=0.8, handlelength=1)  # fmt: skip


def _draw_accuracies(axes: Axes, shown: ShearFigure) -> None:
    titles = list(shown.accuracies)
    mean, low, high = 100 * np.array(list(shown.accuracies.values())).T
    error = np.maximum([mean - low, high - mean], 0)
    colours = [SKY if title.startswith("...") else BLUE for title in titles]
    axes.barh(titles, mean, xerr=error, color=colours, height=0.6, error_kw={"lw": 0.8})
    axes.axvline(100 * shown.chance, color=GREY, lw=0.8, ls=(0, (4, 3)))
    axes.set_title("texture told from (dashed: chance)", loc="left")
    axes.invert_yaxis()
    axes.set_xlim(0, 103)
    axes.set_xlabel("accuracy at held-out speeds (%)")


def _draw_drag(axes: Axes, figure: Figure, drag_px: xr.DataArray) -> None:
    textures = [str(texture) for texture in drag_px[dims.TEXTURE].values]
    speeds = drag_px[dims.SPEED].values
    drawn = axes.imshow(drag_px.values, cmap="cividis", aspect="auto", interpolation="nearest")
    axes.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
    axes.set_yticks(range(len(textures)), texture_labels(textures, drag_px.attrs).values())
    axes.set_ylabel("texture")
    axes.set_xlabel("speed (mm/s)")
    axes.set_title("how far the skin is dragged", loc="left")
    figure.colorbar(drawn, ax=axes, label="mean displacement (px)")
