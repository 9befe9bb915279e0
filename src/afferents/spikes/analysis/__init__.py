"""What the field asks of spikes; every function takes `Spikes` from anywhere and gives a table."""

from afferents.spikes.analysis.decoding import (
    accuracy_by_resolution,
    accuracy_by_units,
    decode,
)
from afferents.spikes.analysis.matched import matched
from afferents.spikes.analysis.speed import rate_slopes, stretch_match
from afferents.spikes.analysis.windows import cut_windows, some_units

__all__ = [
    "accuracy_by_resolution",
    "accuracy_by_units",
    "cut_windows",
    "decode",
    "matched",
    "rate_slopes",
    "some_units",
    "stretch_match",
]
