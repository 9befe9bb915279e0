"""Rates of spikes: how often each unit fires in a window."""

import numpy as np
import xarray as xr
from pydantic import PositiveInt

from afferents.core import dims
from afferents.core.responses import Responses
from afferents.core.samples import Samples, make_samples
from afferents.encodings.base import Floats, ImageEncoding, require_run
from afferents.encodings.markers import component_series
from afferents.encodings.spatial import frame_extents

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

    def suits(self, responses: Responses) -> bool:
        """Tell that markers are there."""
        return dims.REST_POSITION in responses

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, component, marker)`, in the response's unit a frame.

        Raises
        ------
        InputError
            If there are fewer frames than a run has.
        """
        start_s, stop_s = frame_extents(response[dims.TIME].values, kept, lookback)
        require_run(len(start_s), response.attrs.get("name", "a recording"), self.length)
        runs = self.runs(response, kept)
        n = len(runs) * self.length
        return make_samples(
            self.of_runs(runs, lookback),
            self.sample_dims,
            start_s[: n : self.length],
            stop_s[self.length - 1 : n : self.length],
            response.attrs,
        )

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return runs of frames, (run, frame, component, marker); no incomplete one."""
        series = component_series(response.isel({dims.TIME: kept}))
        n = len(series) // self.length
        return series[: n * self.length].reshape(n, self.length, *series.shape[1:])

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the means of runs, (run, component, marker)."""
        return np.asarray(runs.mean(axis=1), np.float32)
