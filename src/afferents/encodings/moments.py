"""What each marker shows, and where a response stands during a run and how far it swings."""

from typing import Annotated

import numpy as np
import xarray as xr
from pydantic import PositiveInt

from afferents import dims
from afferents.encodings.base import Floats, ImageEncoding, require_run
from afferents.encodings.images import FRAMES, FRAMES_OPTION, LastRun, OneByOne, frame_extents
from afferents.encodings.samples import Samples, make_samples
from afferents.encodings.tactile_image import require_filled
from afferents.store.responses import Responses


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


# Moments: where a response stands during a run of frames, and how far it swings.
#
# The mean over a run is the level that friction holds the skin at; it is a force, and says nothing
# of how fast the texture went by. The spread is what the texture and stick-slip add; at another
# speed it grows or shrinks by a factor, so its logarithm is taken.

_LEAST_SPREAD = 1e-3
"""In px: what is still to better than that is no stiller for a model."""


class MomentEncoding(ImageEncoding):
    """The mean and the logarithm of the spread over a run of frames are a sample (moment, feature).

    Of each marker and component, or of each part of the global shear, one after the other.

    Attributes
    ----------
    frames
        Of a run.
    """

    name, sample_dims = "moments", (dims.MOMENT, dims.FEATURE)
    of_pixels = False

    frames: Annotated[PositiveInt, FRAMES_OPTION] = FRAMES

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return self.frames

    def suits(self, responses: Responses) -> bool:
        """Tell that markers are there."""
        return dims.REST_POSITION in responses

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, moment, feature)`: means in px, then ln of spreads in px.

        Raises
        ------
        InputError
            If lost markers (NaN) were not filled before, or there are fewer frames than a run has.
        """
        start_s, stop_s = frame_extents(response[dims.TIME].values, kept, lookback)
        require_run(len(start_s), response.attrs.get("name", "a recording"), self.frames)
        runs = self.runs(response, kept)
        n = len(runs) * self.frames
        return make_samples(
            self.of_runs(runs, lookback),
            self.sample_dims,
            start_s[: n : self.frames],
            stop_s[self.frames - 1 : n : self.frames],
            {name: value for name, value in response.attrs.items() if name != dims.UNITS},
            {dims.MOMENT: ["mean", "log_spread"]},
        )

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return runs of frames, (run, frame, component, marker or part); no incomplete one."""
        series = component_series(response.isel({dims.TIME: kept}))
        n = len(series) // self.frames
        return series[: n * self.frames].reshape(n, self.frames, *series.shape[1:])

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the moments of runs, (run, moment, feature)."""
        spread = np.log(np.maximum(runs.std(axis=1), _LEAST_SPREAD))
        moments = np.stack([runs.mean(axis=1), spread], axis=1)
        return moments.reshape(len(runs), 2, -1).astype(np.float32)

    def stream(self, lookback: int) -> "MomentStream":
        """Return what gives, at every frame, the moments of the run that it ends."""
        return MomentStream(self, lookback)


class MomentStream(LastRun):
    """The moments of the last run of frames, where offline one run follows the other.

    Parameters
    ----------
    encoding
        How long a run is.
    lookback
        Of the response.
    """

    def __init__(self, encoding: MomentEncoding, lookback: int) -> None:
        """Wait for the first run to fill."""
        super().__init__(encoding.frames)
        self._encoding, self._lookback = encoding, lookback

    def feed(self, image: Floats) -> Floats | None:
        """Return the moments of the run that a frame, (component, marker or part), ends."""
        run = super().feed(image)
        return None if run is None else self._encoding.of_runs(run[np.newaxis], self._lookback)[0]
