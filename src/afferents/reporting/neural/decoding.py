"""How well texture is read from spikes, by temporal resolution and by the number of units."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.reporting.neural.style import ACROSS, CLASS_COLOURS, accuracy_axes
from afferents.reporting.style import draw_chance, new_figure, styled


@styled
def resolution_figure(found: pd.DataFrame, source: str) -> Figure:
    """Draw accuracy against the width of bins; see `spikes.analysis.accuracy_by_resolution`."""
    parts = [part for part in ACROSS if (found["across"] == part).any()]
    n_units = int(found["n_units"].max())
    title = f"Texture read from spikes, by temporal resolution (at most {n_units} units a class)"
    figure = new_figure(4.2 * len(parts) + 0.6, 3.2, title, source)
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for part, axes in zip(parts, panels, strict=True):
        for name, some in found[found["across"] == part].groupby("class", sort=False):
            x = 1e3 * some["resolution_s"]
            _line(axes, x.to_numpy(), some, str(name), CLASS_COLOURS[str(name)], "-")
        draw_chance(axes, float(found["chance"].iloc[0]))
        accuracy_axes(axes, f"At {ACROSS[part]}", "width of a bin (ms); the widest is the rate")
    panels[0].legend(loc="upper left", ncols=4, columnspacing=1.0, handlelength=1.4)
    return figure


@styled
def units_figure(found: pd.DataFrame, source: str) -> Figure:
    """Draw accuracy against the number of units; see `spikes.analysis.accuracy_by_units`."""
    parts = [part for part in ACROSS if (found["across"] == part).any()]
    title = "Texture read from spikes, by number of units"
    figure = new_figure(4.2 * len(parts) + 0.6, 3.2, title, source)
    panels = figure.subplots(1, len(parts), sharey=True, squeeze=False)[0]
    for part, axes in zip(parts, panels, strict=True):
        here = found[found["across"] == part]
        for (name, code), some in here.groupby(["class", "code"], sort=False):
            style = "-" if code == "timing" else ":"
            label = f"{name}, {'with timing' if code == 'timing' else 'rates'}"
            x = some["n_units"].to_numpy()
            _line(axes, x, some, label, CLASS_COLOURS[str(name)], style)
        draw_chance(axes, float(found["chance"].iloc[0]))
        accuracy_axes(axes, f"At {ACROSS[part]}", "units")
    panels[0].legend(loc="upper left", ncols=2, columnspacing=1.0, handlelength=1.8)
    return figure


def _line(axes: Axes, x: object, some: pd.DataFrame, label: str, colour: str, style: str) -> None:
    """Draw a line of percent, with its interval as a band."""
    mean, low, high = (100 * some[name].to_numpy() for name in ("accuracy", "low", "high"))
    axes.plot(x, mean, style, color=colour, marker="o", ms=3, label=label)  # type: ignore[arg-type]
    axes.fill_between(x, low, high, color=colour, alpha=0.12, lw=0)  # type: ignore[arg-type]
