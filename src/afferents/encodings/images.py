"""Encodings of what markers do, frame by frame: runs of frames become samples, also live.

Tactile images, one or runs of ten (paper, section 2.2.1); or, of markers without rows and columns,
what each shows, or its moments over a run of frames.
"""

from collections import deque
from typing import Annotated, Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import PositiveInt

from afferents import dims
from afferents.choices import Cut
from afferents.encodings.augment import RANGES, Stretch, faster_images, faster_runs
from afferents.encodings.base import Encoding, Floats, Indices, Option
from afferents.encodings.samples import Samples, make_samples
from afferents.errors import InputError
from afferents.markers.places import make_images
from afferents.store.responses import Responses, steady_s
from afferents.store.trimming import cut_frames

FRAMES = 10
"""Frames a sample, 0.111 s at 90 fps."""
FRAMES_OPTION = Option(
    "--frames",
    "Length of a run of tactile images, video frames; 'evaluate' also takes several: 1,2,5,10.",
    str,
)
_LEAST_SPREAD = 1e-3
"""In px: what is still to better than that is no stiller for a model."""


class ImageEncoding(Encoding):
    """An encoding of what markers do, frame by frame: SA-I, RA-I and what is made of them.

    A recording is cut into runs of `length` frames that follow each other, and each becomes a
    sample by `of_runs`; a last incomplete run is dropped. An encoding that cuts recordings in
    another way writes `samples` anew.

    >>> class Mean(ImageEncoding):
    ...     '''Every marker's mean over runs of frames.'''
    ...
    ...     name, sample_dims, of_pixels = "mean", (dims.COMPONENT, dims.MARKER), False
    ...     frames: int = 45
    ...
    ...     @property
    ...     def length(self):
    ...         return self.frames
    ...
    ...     def of_runs(self, runs, lookback):
    ...         return runs.mean(axis=1)
    >>> labels = {"name": "3/50", "texture": "3", "speed_mm_s": 50.0, "units": "px"}
    >>> time = {"time": np.arange(4) / 90}
    >>> response = xr.DataArray(
    ...     [[0.0, 1.0], [2.0, 1.0], [4.0, 4.0], [6.0, 8.0]], time, ("time", "marker"), attrs=labels
    ... )
    >>> Mean(frames=2).samples(response, slice(0, 4), lookback=0).values
    array([[[1., 1.]],
    <BLANKLINE>
           [[5., 6.]]], dtype=float32)
    """

    of_vibration: ClassVar[bool] = False
    of_pixels: ClassVar[bool] = True
    """Whether it encodes tactile images; else what single markers show, (component, marker)."""
    keeps_unit: ClassVar[bool] = True
    """Whether samples are in the unit of the response."""

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return 1

    def suits(self, responses: Responses) -> bool:
        """Return whether the markers have places in an image, where it needs them."""
        return dims.ROW in responses.coords if self.of_pixels else dims.REST_POSITION in responses

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the samples that runs of frames become, `(n, *sample_shape)`.

        Parameters
        ----------
        runs
            As `runs` gives them.
        lookback
            How many earlier frames the response depends on: 0 for SA-I, 1 for RA-I.

        Raises
        ------
        InputError
            If the encoding does not write it.
        """
        raise InputError(
            f"the encoding: expected one that writes of_runs or samples, found {self.name}"
        )

    def coordinates(self, runs: Floats) -> dict[str, Any]:
        """Return the coordinates of a sample's dims, where it has any."""
        return {}

    def runs(self, response: xr.DataArray, kept: slice) -> Floats:
        """Return runs of frames, (run, frame, component, row, column) or (..., component, marker).

        Raises
        ------
        InputError
            If the markers have no places in an image, or if lost markers (NaN) were not filled.
        """
        series = response.isel({dims.TIME: kept})
        frames = component_images(series) if self.of_pixels else component_series(series)
        length = self.length
        n = len(frames) // length
        return frames[: n * length].reshape(n, length, *frames.shape[1:])

    def samples(self, response: xr.DataArray, kept: slice, lookback: int) -> Samples:
        """Return samples `(sample, *sample_dims)` of the runs of one recording.

        Parameters
        ----------
        response
            `(time, marker)` or `(time, marker, space)` without NaN (see `filling.fill`), with the
            recording's `name`, `texture` and `speed_mm_s` in the attributes.

        Raises
        ------
        InputError
            If there are fewer frames than a run has, or as `runs`.
        """
        attrs, length = response.attrs, self.length
        start_s, stop_s = frame_extents(response[dims.TIME].values, kept, lookback)
        self.require_run(len(start_s), attrs.get("name", "a recording"))
        runs = self.runs(response, kept)
        n = len(runs) * length
        return make_samples(
            self.of_runs(runs, lookback),
            self.sample_dims,
            start_s[:n:length],
            stop_s[length - 1 : n : length],
            attrs if self.keeps_unit else {k: v for k, v in attrs.items() if k != dims.UNITS},
            self.coordinates(runs),
        )

    def kept(self, responses: Responses, variable: str, lookback: int, cut: Cut) -> slice:
        """Return the frames that a cut keeps, of every `step`-th.

        They begin with the rest frame: before it there are no markers, and nothing to hold.
        """
        name = responses.attrs["name"]
        time_s = responses[variable][dims.TIME].values
        frames = cut_frames(time_s, cut, steady_s(responses), name)
        rest = int(responses.attrs.get("rest_frame", 0))
        start, rest, stop = (-(-n // self.step) for n in (frames.start, rest, frames.stop))
        kept = slice(max(start, rest + lookback), stop)
        self.require_run(kept.stop - kept.start, name)
        return kept

    def require_run(self, n_frames: int, where: str) -> None:
        """Refuse a recording with fewer frames after the cut than a run has."""
        if n_frames < self.length:
            raise InputError(
                f"{where}: expected at least {self.length} frames after the cut, found {n_frames}"
            )


class RunsLive(ImageEncoding):
    """An encoding that live gives a sample at every image, of the run that it ends."""

    def stream(self, lookback: int) -> "LastRun":
        """Return what gives, at every image, the sample of the run that it ends."""
        return LastRun(self, lookback)


class LastRun:
    """At every image the sample of the run that it ends, where offline one run follows the other.

    Parameters
    ----------
    encoding
        What makes a sample of a run.
    lookback
        Of the response.
    """

    def __init__(self, encoding: ImageEncoding, lookback: int) -> None:
        """Wait for the first run to fill."""
        self._encoding, self._lookback = encoding, lookback
        self._frames: deque[NDArray[Any]] = deque(maxlen=encoding.length)

    def skip(self) -> None:
        """Begin anew: no run may hold both sides of a gap."""
        self._frames.clear()

    def feed(self, image: Floats) -> Floats | None:
        """Return the sample of the run that an image ends; None before one is full.

        Parameters
        ----------
        image
            (row, column), (component, row, column) of a vector, or (component, marker).
        """
        if self._encoding.of_pixels and image.ndim == 2:
            image = image[np.newaxis]
        self._frames.append(image)
        if len(self._frames) != self._frames.maxlen:
            return None
        run = np.stack(self._frames)[np.newaxis]
        sample: Floats = self._encoding.of_runs(run, self._lookback)[0]
        return sample


def frame_extents(
    time_s: NDArray[np.float64], frames: slice, memory: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return when what a frame shows began and ended, s, for the frames of the slice.

    Parameters
    ----------
    time_s
        Presentation times of all frames of the recording, shape (n_frames,).
    memory
        How many earlier frames the response looks back at: 0 for SA-I, 1 for RA-I.
    """
    period = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    ends = np.append(time_s[1:], time_s[-1:] + period)
    indices = np.arange(len(time_s))[frames]
    return time_s[np.maximum(indices - memory, 0)], ends[indices]


def component_images(response: xr.DataArray) -> Floats:
    """Lay the markers of every frame out as an image, or as one for each component of a vector.

    Parameters
    ----------
    response
        `(time, marker)` or `(time, marker, space)` with the coordinates `row` and `column` on
        `marker`.

    Returns
    -------
    Array of shape (time, component, row, column), float32, in the response's unit. On a square
    grid row is the rank of a marker in y, column its rank in x; the published arrays are the
    transpose. Of other layouts pixels are interpolated between markers; see `markers.places`.

    Raises
    ------
    InputError
        If the markers have no places in an image, or if lost markers (NaN) were not filled before.
    """
    if dims.ROW not in response.coords or dims.COLUMN not in response.coords:
        raise InputError(
            f"{_name(response)}: expected markers whose places are known (coordinates row and "
            "column), found a layout that no sensor file describes; calibrate the sensor and "
            "extract again, or use the vibrotactile models"
        )
    series = component_series(response)
    shown = series.reshape(-1, series.shape[2])
    images = make_images(shown, response[dims.ROW].values, response[dims.COLUMN].values)
    return images.reshape(*series.shape[:2], *images.shape[1:])


def component_series(response: xr.DataArray) -> Floats:
    """Return what markers show, or all together, (time, component, marker or part), float32.

    Raises
    ------
    InputError
        If lost markers (NaN) were not filled before.
    """
    if bool(response.isnull().any()):
        raise InputError(
            f"{_name(response)}: expected lost markers filled, found NaN; fill them with "
            "filling.fill"
        )
    if dims.SPACE not in response.dims:
        response = response.expand_dims(dims.SPACE)
    return np.asarray(response.transpose(dims.TIME, dims.SPACE, ...).values, np.float32)


def _name(response: xr.DataArray) -> str:
    return f"{response.name} of {response.attrs.get('name', 'a recording')}"


def _take_lengths(runs: Floats) -> Floats:
    """Return runs (n, frame, row, column) of a response that is one number a marker."""
    if runs.shape[2] != 1:
        raise InputError(
            "the encoding: expected a response of one number a marker, such as sa1 or ra1, found "
            f"{runs.shape[2]} components; take the encoding markers or wavenumbers"
        )
    return runs[:, :, 0]


class SpatialEncoding(RunsLive):
    """Every frame is a sample, a tactile image (row, column); it has no options."""

    name, sample_dims = "spatial", (dims.ROW, dims.COLUMN)
    n_copies = len(RANGES)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs of one."""
        return _take_lengths(runs)[:, 0]

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return two copies of every sample as at other speeds; see `faster_images`."""
        return faster_images(samples, index, rng)


class RunsOfFrames(RunsLive):
    """An encoding of runs whose length is an option."""

    frames: Annotated[PositiveInt, FRAMES_OPTION] = FRAMES

    @property
    def length(self) -> int:
        """Frames that a sample is made of."""
        return self.frames


class SpatiotemporalEncoding(RunsOfFrames):
    """A run of tactile images is a sample (frame, row, column).

    Attributes
    ----------
    frames
        Images a sample; the paper has ten.
    """

    name, sample_dims = "spatiotemporal", (dims.FRAME, dims.ROW, dims.COLUMN)
    n_copies = len(RANGES)

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the images of runs."""
        return _take_lengths(runs)

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return two copies of every sample as at other speeds; see `faster_runs`."""
        return faster_runs(samples, index, rng)


class MarkersEncoding(RunsLive):
    """Every frame is a sample (component, marker); it has no options.

    For your own estimators, which need no rows and columns, and for any layout. Markers stand
    in the order of the layout: of a square one by row, then column, else as the sensor file lists
    them. A length has one component, a vector two (x, y).
    """

    name, sample_dims = "markers", (dims.COMPONENT, dims.MARKER)
    of_pixels = False

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the frames of runs of one."""
        return runs[:, 0]


class MomentEncoding(RunsOfFrames):
    """The mean and the logarithm of the spread over a run of frames are a sample (moment, feature).

    Of each marker and component, or of each part of the global shear, one after the other: means
    in px, then ln of spreads in px. The mean over a run is the level that friction holds the skin
    at; it is a force, and does not depend on how fast the texture went by. The spread is what the
    texture and stick-slip add; at another speed it grows or shrinks by a factor, so its logarithm
    is taken.

    Attributes
    ----------
    frames
        Of a run.
    """

    name, sample_dims = "moments", (dims.MOMENT, dims.FEATURE)
    of_pixels, keeps_unit = False, False

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the moments of runs, (run, moment, feature)."""
        spread = np.log(np.maximum(runs.std(axis=1), _LEAST_SPREAD))
        moments = np.stack([runs.mean(axis=1), spread], axis=1)
        return moments.reshape(len(runs), 2, -1).astype(np.float32)

    def coordinates(self, runs: Floats) -> dict[str, Any]:
        """Return the names of both moments."""
        return {dims.MOMENT: ["mean", "log_spread"]}


def spatial_samples(response: xr.DataArray, frames: slice, memory: int) -> Samples:
    """Encode each frame as one sample, a tactile image `(sample, row, column)`.

    Parameters
    ----------
    response
        `(time, marker)` without NaN (see `filling.fill`), with the markers' `row` and `column`,
        and the recording's `name`, `texture` and `speed_mm_s` in the attributes.
    frames
        Those to encode.
    memory
        How many earlier frames the response looks back at: 0 for SA-I, 1 for RA-I.

    Returns
    -------
    xarray.DataArray
        In the response's unit; on `sample` stand `texture`, `speed_mm_s` (mm/s), `recording`,
        `start_s` and `stop_s` (s).

    Raises
    ------
    InputError
        If markers were lost, or form no grid.
    """
    return SpatialEncoding().samples(response, frames, memory)


def spatiotemporal_samples(
    response: xr.DataArray, frames: slice, memory: int, length: int = FRAMES
) -> Samples:
    """Encode non-overlapping runs of `length` frames as `(sample, frame, row, column)`.

    A last incomplete run is dropped; runs never cross recordings, since each call sees one.

    Raises
    ------
    InputError
        If the recording has fewer than `length` frames in the slice.
    """
    return SpatiotemporalEncoding(frames=length).samples(response, frames, memory)
