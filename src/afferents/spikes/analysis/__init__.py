"""What the field asks of spikes; every function takes `Spikes` from anywhere and gives a table."""

from afferents.spikes.analysis.decoding import (
    accuracy_by_resolution,
    accuracy_by_units,
    decode,
)
from afferents.spikes.analysis.distances import DISTANCES, distance_matrix, found_by_nearest
from afferents.spikes.analysis.exponent import exponents, spectral_exponent, told_by_exponent
from afferents.spikes.analysis.matched import matched
from afferents.spikes.analysis.speed import rate_slopes, stretch_match
from afferents.spikes.analysis.windows import cut_windows, some_units

__all__ = [
    "DISTANCES",
    "accuracy_by_resolution",
    "accuracy_by_units",
    "cut_windows",
    "decode",
    "distance_matrix",
    "exponents",
    "found_by_nearest",
    "matched",
    "rate_slopes",
    "some_units",
    "spectral_exponent",
    "stretch_match",
    "told_by_exponent",
]
