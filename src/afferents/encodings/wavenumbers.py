"""Wavenumbers: which waves stand in tactile images, in their lengths and not in their places.

A texture presses its own pattern into the skin, and the length of the pattern's waves does not
depend on how fast it slides by. So the power of a tactile image over wavenumbers (its
two-dimensional Fourier transform, without the phases) is the same at any speed, up to a factor.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveInt

from afferents.core import dims
from afferents.core.samples import Samples, make_samples
from afferents.encodings.spatial import frame_extents, tactile_images
from afferents.encodings.spatiotemporal import FRAMES, require_run

_LEAST_POWER = 1e-6
"""In px squared: an error of 0.001 px a marker has less."""


class WavenumberEncoding(BaseModel):
    """Parameters of the wavenumbers.

    Attributes
    ----------
    frames
        Frames a sample; what stands still through all of them is taken out of SA-I.
    every
        Only every so manyth frame is used, as if the camera were slower.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    frames: PositiveInt = FRAMES
    every: PositiveInt = 1


def wavenumber_samples(
    response: xr.DataArray, frames: slice, memory: int, encoding: WavenumberEncoding
) -> Samples:
    """Encode runs of frames as `(sample, component, row_wavenumber, column_wavenumber)`.

    Parameters
    ----------
    response
        SA-I or RA-I `(time, marker)`, or their vectors `(time, marker, space)`, with the
        coordinates `row` and `column` on `marker`.
    frames
        Frames that the cut keeps.
    memory
        How many earlier frames the response looks back at: 0 for SA-I, which is taken relative
        to its mean over the run, or 1 for RA-I.

    Returns
    -------
    Natural logarithm of the mean power over a run's frames, less its mean over all wavenumbers:
    how much does not matter, only where. Wavenumbers in cycles from marker to marker.

    Raises
    ------
    InputError
        If the markers form no grid, or the slice has fewer frames than a run.
    """
    start_s, stop_s = frame_extents(response[dims.TIME].values, frames, memory)
    require_run(len(start_s), response.attrs.get("name", "a recording"), encoding.frames)
    runs = image_runs(response, frames, encoding)
    n, length = runs.shape[:2]
    values = np.stack([log_waves(wave_spectra(run), memory) for run in runs])
    return make_samples(
        values,
        (dims.COMPONENT, dims.ROW_WAVENUMBER, dims.COLUMN_WAVENUMBER),
        start_s[: n * length : length],
        stop_s[length - 1 : n * length : length],
        response.attrs,
        {
            dims.ROW_WAVENUMBER: np.fft.fftfreq(runs.shape[3]),
            dims.COLUMN_WAVENUMBER: np.fft.rfftfreq(runs.shape[4]),
        },
    )


def image_runs(
    response: xr.DataArray, frames: slice, encoding: WavenumberEncoding
) -> NDArray[np.float32]:
    """Return the runs that `wavenumber_samples` makes samples of.

    Parameters and errors as there.

    Returns
    -------
    Shape (run, frame, component, row, column), in the response's unit.
    """
    images = component_images(response.isel({dims.TIME: frames}))
    n = len(images) // encoding.frames
    return images[: n * encoding.frames].reshape(n, encoding.frames, *images.shape[1:])


def component_images(response: xr.DataArray) -> NDArray[np.float32]:
    """Return tactile images (time, component, row, column) of a length or of a vector."""
    if dims.SPACE not in response.dims:
        return tactile_images(response)[:, None]
    parts = (response.isel({dims.SPACE: i}, drop=True) for i in range(response.sizes[dims.SPACE]))
    return np.stack([tactile_images(part) for part in parts], axis=1)


def wave_spectra(images: NDArray[np.float32]) -> NDArray[np.complex64]:
    """Return the waves in tactile images (..., row, column), with their phases."""
    n_rows, n_columns = images.shape[-2:]
    taper = np.outer(_taper(n_rows), _taper(n_columns)).astype(np.float32)
    level = images - images.mean(axis=(-2, -1), keepdims=True)
    return np.asarray(np.fft.rfft2(level * taper))


def log_waves(spectra: NDArray[np.complex64], memory: int) -> NDArray[np.float32]:
    """Return what `wavenumber_samples` does of one run, from the spectra of its images.

    Parameters
    ----------
    spectra
        (frame, component, row_wavenumber, column_wavenumber), as `wave_spectra` gives them.
    memory
        See there: 0 takes out what stands still through the run.
    """
    if memory == 0:
        spectra = spectra - spectra.mean(axis=0, keepdims=True)
    power = (np.abs(spectra) ** 2).mean(axis=0)
    logs = np.log(power + _LEAST_POWER)
    return np.asarray(logs - logs.mean(), dtype=np.float32)


def _taper(n: int) -> NDArray[np.float64]:
    """Return a Hann window without the zeros at its ends."""
    return np.hanning(n + 2)[1:-1]
