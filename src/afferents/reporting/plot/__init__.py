"""Plots for a notebook or a script; public as `afferents.plot`."""

from afferents.reporting.plot.of_responses import markers, responses, spectrum, tactile_image
from afferents.reporting.plot.of_results import accuracy_by_speed, confusion

__all__ = ["accuracy_by_speed", "confusion", "markers", "responses", "spectrum", "tactile_image"]
