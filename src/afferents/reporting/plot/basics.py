"""What all plots share: the axes, colours, and how what is given is called."""

import xarray as xr
from matplotlib import pyplot
from matplotlib.axes import Axes

from afferents.reporting.style import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY)


def axes_of(ax: Axes | None, width: float, height: float) -> Axes:
    """Return the axes given, or those of a new figure of that size in inches.

    A notebook shows the figures that pyplot knows of, so here they are made with it.
    """
    if ax is not None:
        return ax
    new: Axes = pyplot.subplots(figsize=(width, height), layout="constrained")[1]
    return new


def kind_of(given: object) -> str:
    """Return what something is, in words: its dimensions where it has some."""
    if isinstance(given, xr.DataArray):
        return f"({', '.join(map(str, given.dims))})"
    if isinstance(given, xr.Dataset):
        return f"a data set of {', '.join(map(str, given.data_vars)) or 'nothing'}"
    return type(given).__name__
