"""Spikes as samples: how often units fire, and how long they wait between spikes."""

import math
from typing import Annotated

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import PositiveFloat, PositiveInt

from afferents import dims
from afferents.encodings.base import Floats, ImageEncoding, VibrationEncoding, without_unit
from afferents.encodings.samples import Samples, make_samples
from afferents.encodings.spectra import (
    STRIDE_OPTION,
    WINDOW_OPTION,
    require_stride,
    shorter_than_window,
    window_starts,
)
from afferents.errors import InputError

FRAMES = 45
"""Half a second at 90 frames/s: tens of spikes a unit."""


class SpikeRateEncoding(ImageEncoding):
    """How often each unit fires a frame, over a run of frames, is a sample (component, marker).

    For the channels `sa1_spikes` and `ra1_spikes`; of another channel it is the mean over a run.

    Attributes
    ----------
    rate_frames
        Of a run.
    """

    name, sample_dims = "spike-rate", (dims.COMPONENT, dims.MARKER)
    of_pixels = False

    rate_frames: PositiveInt = FRAMES

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return self.rate_frames

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the means of runs, (run, component, marker)."""
        return np.asarray(runs.mean(axis=1), np.float32)


# Timing of spikes: how long each unit waits from one spike to the next.

SHORTEST_S, LONGEST_S, BINS = 1e-3, 0.25, 16
"""Of the histogram: bins even in the logarithm; what lies beyond counts for the nearest."""


class SpikeTimingEncoding(VibrationEncoding):
    """A histogram of inter-spike intervals for each unit is a sample (channel, interval).

    For the channel `ra2_spikes`. Counts n are given as ln(1 + n), so that units which fire much
    don't drown the others.

    Attributes
    ----------
    window_s
        Length of a window, s.
    stride_s
        Distance between the starts of windows, s.
    """

    name, sample_dims = "spike-timing", (dims.CHANNEL, dims.INTERVAL)

    window_s: Annotated[PositiveFloat, WINDOW_OPTION] = 1.0
    stride_s: Annotated[PositiveFloat, STRIDE_OPTION] = 0.5

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse n values, of a rate in Hz, that are shorter than a window."""
        require_stride(self.stride_s, self.window_s)
        if n < round(self.window_s * rate_hz):
            raise InputError(shorter_than_window(self.window_s, n / rate_hz, where))

    def samples(self, response: xr.DataArray, kept: slice, lookback: int = 0) -> Samples:
        """Return samples `(sample, channel, interval)`, ln(1 + count)."""
        rate_hz = float(response.attrs[dims.SAMPLE_RATE])
        counts = response.transpose(dims.AUDIO_TIME, dims.CHANNEL).values[kept]
        self.require(len(counts), rate_hz, response.attrs.get("name", "a recording"))
        length, stride = round(self.window_s * rate_hz), max(1, round(self.stride_s * rate_hz))
        starts = window_starts(len(counts), length, stride, None)
        values = np.stack(
            [interval_histograms(counts[i : i + length], rate_hz) for i in starts]
        ).astype(np.float32)
        start_s = (kept.start + starts) / rate_hz
        edges = interval_edges_s()
        return make_samples(
            np.log1p(values),
            self.sample_dims,
            start_s,
            start_s + self.window_s,
            without_unit(response.attrs),
            {dims.INTERVAL: np.sqrt(edges[1:] * edges[:-1])},
        )


def interval_edges_s() -> NDArray[np.float64]:
    """Return the edges of the histogram's bins, s, (interval + 1,)."""
    return np.geomspace(SHORTEST_S, LONGEST_S, BINS + 1)


def interval_histograms(counts: NDArray[np.floating], rate_hz: float) -> NDArray[np.int64]:
    """Return how many intervals between successive spikes lie in each bin, (channel, interval).

    Parameters
    ----------
    counts
        (time, channel), spikes at each sample; several at one sample count as one.
    rate_hz
        Samples a second.
    """
    found = np.zeros((counts.shape[1], BINS), np.int64)
    per_bin = BINS / math.log(LONGEST_S / SHORTEST_S)
    for channel, train in enumerate(counts.T):
        intervals = np.diff(np.flatnonzero(train)) / rate_hz
        bins = np.floor(np.log(intervals / SHORTEST_S) * per_bin).astype(np.int64)
        np.add.at(found[channel], np.clip(bins, 0, BINS - 1), 1)
    return found
