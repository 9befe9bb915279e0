"""A model of a library for time series to compare with; needs the extra `aeon`."""

from afferents.models.model import Model
from afferents.plugins import import_extra

_intervals = import_extra("aeon", "--models quant", "aeon.classification.interval_based")

quant = Model(
    "quant", "quantiles of intervals (QUANT)",
    channel="ra2", encoding="kernels", classifier=_intervals.QUANTClassifier(random_state=0),
)  # fmt: skip
"""Quantiles of a window's intervals, and many random trees (Dempster et al. 2024, QUANT, Data
Mining and Knowledge Discovery). Channels stand in a row, one after the other."""
