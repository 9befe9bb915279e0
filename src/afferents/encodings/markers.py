"""Per-marker encoding: what each marker shows, in the layout's order, without any image."""

import numpy as np
import xarray as xr

from afferents.core import dims
from afferents.core.responses import Responses
from afferents.core.samples import Samples, make_samples
from afferents.encodings.base import Floats, ImageEncoding
from afferents.encodings.spatial import OneByOne, frame_extents
from afferents.encodings.tactile_image import require_filled


class MarkersEncoding(ImageEncoding):
    """Every frame is a sample (component, marker); it has no options.

    For estimators of one's own, which need no rows and columns, and for any layout. Markers stand
    in the order of the layout: of a square one by row, then column, else as the sensor file lists
    them. A length has one component, a vector two (x, y).
    """

    name, sample_dims = "markers", (dims.COMPONENT, dims.MARKER)
    of_pixels = False

    def suits(self, responses: Responses) -> bool:
        """Tell that markers are there."""
        return dims.REST_POSITION in responses

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, component, marker)`, in the response's unit.

        Raises
        ------
        InputError
            If lost markers (NaN) were not filled before.
        """
        start_s, stop_s = frame_extents(response[dims.TIME].values, kept, lookback)
        values = self.runs(response, kept)[:, 0]
        return make_samples(values, self.sample_dims, start_s, stop_s, response.attrs)

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return runs of one frame, (run, 1, component, marker)."""
        return component_series(response.isel({dims.TIME: kept}))[:, None]

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the frames of runs of one."""
        return runs[:, 0]

    def stream(self, lookback: int) -> OneByOne:
        """Return what takes the markers of a frame, (component, marker), for a sample."""
        return OneByOne()


def component_series(response: xr.DataArray) -> Floats:
    """Return what markers show, or what all feel together, (time, component, marker or part).

    Raises
    ------
    InputError
        If lost markers (NaN) were not filled before.
    """
    require_filled(response)
    if dims.SPACE not in response.dims:
        response = response.expand_dims(dims.SPACE)
    return np.asarray(response.transpose(dims.TIME, dims.SPACE, ...).values, np.float32)
