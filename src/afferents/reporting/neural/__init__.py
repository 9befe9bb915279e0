"""Figures of spikes: what fires, what texture is read from, what speed does."""

from afferents.reporting.neural.beside import beside_figure
from afferents.reporting.neural.decoding import resolution_figure, units_figure
from afferents.reporting.neural.raster import raster_figure
from afferents.reporting.neural.speed import slope_figure, stretch_figure
from afferents.reporting.neural.style import CLASS_COLOURS

__all__ = [
    "CLASS_COLOURS",
    "beside_figure",
    "raster_figure",
    "resolution_figure",
    "slope_figure",
    "stretch_figure",
    "units_figure",
]
