"""Plots for a notebook or a script: each draws on one Axes, and returns it.

::

    from matplotlib import pyplot
    from afferents import example, plot

    responses = example()
    plot.tactile_image(responses.sa1, time_s=3)     # a figure of its own
    figure, axes = pyplot.subplots(2)
    plot.responses(responses.sa1, ax=axes[0])       # or a place in yours
    plot.responses(responses.ra2, ax=axes[1])
    figure.savefig("responses.png")

They take what `afferents.example`, `extract`, `open_responses` and `samples` return (xarray), or
`Results`, as `evaluate` and `load_results` do. What lacks a dimension is refused with an
`InputError` that names it. A whole report with all figures is made by `afferents.report`.
"""

from afferents.reporting.plot import (
    accuracy_by_speed,
    confusion,
    markers,
    responses,
    spectrum,
    tactile_image,
)

__all__ = ["accuracy_by_speed", "confusion", "markers", "responses", "spectrum", "tactile_image"]
