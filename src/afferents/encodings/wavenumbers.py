"""Waves in the markers' pattern: their strengths by wavelength and direction."""

from collections.abc import Iterable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import PositiveInt

from afferents import dims
from afferents.encodings.base import Floats, Option
from afferents.encodings.images import LastRun, RunsOfFrames
from afferents.store.recording import spacing_mm


def unseen_waves(pitch_mm: float | None, textures: Iterable[str] = ()) -> str:
    """Return in a sentence which waves a fingertip can't show: two pins must fall on one.

    Shannon, Communication in the presence of noise, Proc. IRE 1949: shorter ones look like longer
    ones, or like none.

    Parameters
    ----------
    pitch_mm
        Distance of its pins, mm; None where the sensor file has none.
    textures
        Named by the spacing of their bumps; those with bumps closer together are listed.
    """
    limit = ""
    if pitch_mm is not None:
        finer = [t for t in textures if 0 < (spacing_mm(t) or 0.0) < 2 * pitch_mm]
        limit = f", {2 * pitch_mm:g} mm"
        if finer:
            limit += f" (here the bumps of {', '.join(finer)})"
    return (
        f"Models of waves cannot resolve waves shorter than twice the distance of the pins{limit}."
    )


_LEAST_POWER = 1e-6
"""In px squared, that of noise of 0.0001 px a marker: below all that is tracked."""


class WavenumberEncoding(RunsOfFrames):
    """The power of a run's images over wavenumbers is a sample: the lengths of waves, not places.

    A texture presses its own pattern into the skin, and the length of the pattern's waves does not
    depend on how fast it slides by. So the power of a tactile image over wavenumbers (its
    two-dimensional Fourier transform, without the phases) is the same at any speed, up to a factor.

    The natural logarithm of the mean power over a run's frames, less its mean over all wavenumbers:
    how much does not matter, only where. SA-I is taken relative to its mean over the run.
    Wavenumbers are in cycles from marker to marker, or from pixel to pixel on layouts that are not
    square. Waves that are shorter than two pixels, about two pins, can't be seen in it.

    Attributes
    ----------
    frames
        Images a sample; what stands still through all of them is taken out of SA-I.
    every
        Of how many frames one is used, as if the camera were slower.
    """

    name = "wavenumbers"
    sample_dims = (dims.COMPONENT, dims.ROW_WAVENUMBER, dims.COLUMN_WAVENUMBER)

    every: Annotated[
        PositiveInt,
        Option("--every", "Use one video frame in N, as if the camera were N times slower.", int),
    ] = 1

    @property
    def step(self) -> int:
        """Of how many frames one is used."""
        return self.every

    def of_runs(self, runs: Floats, lookback: int) -> Floats:
        """Return the waves of runs of images."""
        return np.stack([measure_power(find_waves(run), lookback) for run in runs])

    def stream(self, lookback: int) -> LastRun:
        """Return what gives, at every image, the waves of the run that it ends."""
        return LastWaves(self, lookback)

    def coordinates(self, runs: Floats) -> dict[str, Any]:
        """Return the wavenumbers of rows and columns."""
        rows, columns = np.fft.fftfreq(runs.shape[3]), np.fft.rfftfreq(runs.shape[4])
        return {dims.ROW_WAVENUMBER: rows, dims.COLUMN_WAVENUMBER: columns}


class LastWaves(LastRun):
    """A `LastRun` that finds the waves of an image once, though it is in many runs."""

    def feed(self, image: Floats) -> Floats | None:
        """Return the waves of the run that an image ends; see `LastRun.feed`."""
        self._frames.append(find_waves(image.reshape(-1, *image.shape[-2:])))
        if len(self._frames) != self._frames.maxlen:
            return None
        return measure_power(np.stack(self._frames), self._lookback)


def find_waves(images: Floats) -> NDArray[np.complex64]:
    """Return the waves in tactile images (..., row, column), with their phases."""
    rows, columns = (np.hanning(n + 2)[1:-1] for n in images.shape[-2:])  # no zeros at the ends
    level = images - images.mean(axis=(-2, -1), keepdims=True)
    return np.asarray(np.fft.rfft2(level * np.outer(rows, columns).astype(np.float32)))


def measure_power(waves: NDArray[np.complex64], lookback: int) -> Floats:
    """Return the log power of a run's waves, (frame, component, ...), less its mean over all.

    Of a response that looks back at no frame, SA-I, what stands still through the run is taken
    out.
    """
    if lookback == 0:
        waves = waves - waves.mean(axis=0, keepdims=True)
    power = (np.abs(waves) ** 2).mean(axis=0)
    logs = np.log(power + _LEAST_POWER)
    return np.asarray(logs - logs.mean(), dtype=np.float32)
