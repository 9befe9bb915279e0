"""Colours of the classes of afferents, the same in every figure, and of what is held out."""

from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from afferents.reporting.style import BLUE, ORANGE, VERMILION, percent_axes

CLASS_COLOURS = {"SA": BLUE, "RA": ORANGE, "PC": VERMILION}
ACROSS = {"speeds": "a speed not learnt from", "windows": "a speed learnt from"}
"""What is held out, in words, in the order of the panels."""


def accuracy_axes(axes: Axes, title: str, x: str) -> None:
    """Make a panel of accuracy in percent over a logarithmic axis."""
    percent_axes(axes, title)
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel(x)
    axes.set_ylabel("windows named rightly (%)")
