"""A raster: every spike of some units in a stretch of a few trials."""

import numpy as np
from matplotlib.figure import Figure

from afferents.reporting.neural.style import CLASS_COLOURS
from afferents.reporting.style import new_figure, styled
from afferents.spikes.population import Spikes


@styled
def raster_figure(spikes: Spikes, source: str) -> Figure:
    """Draw the spikes of a few trials, a panel a trial, a row a unit."""
    height = 0.8 + 0.055 * max(spikes.n_units, 12)
    figure = new_figure(2.9 * spikes.n_trials + 1.0, height, "Spikes", source)
    panels = figure.subplots(1, spikes.n_trials, sharey=True, squeeze=False)[0]
    classes = spikes.units["class"].to_numpy(str)
    for trial, axes in enumerate(panels):
        trains = [1e3 * spikes.train(trial, unit) for unit in range(spikes.n_units)]
        colours = [CLASS_COLOURS[name] for name in classes]
        axes.eventplot(trains, colors=colours, linewidths=0.6, linelengths=0.8)
        row = spikes.trials.iloc[trial]
        axes.set_title(
            f"{row['texture']}, {row['speed_mm_s']:g} mm/s", loc="left", fontweight="bold"
        )
        axes.set_xlim(0, 1e3 * row["duration_s"])
        axes.set_xlabel("time (ms)")
    middles = [float(np.mean(np.flatnonzero(classes == name))) for name in dict.fromkeys(classes)]
    panels[0].set_yticks(middles, list(dict.fromkeys(classes)))
    panels[0].set_ylim(spikes.n_units - 0.5, -0.5)
    return figure
