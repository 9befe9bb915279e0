"""Temporal encoding: amplitude spectra of windows of vibration (paper, section 2.3.3)."""

import math
from typing import Any

import numpy as np
import scipy.fft
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveFloat, PositiveInt

from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.samples import Samples, make_samples


class SpectralEncoding(BaseModel):
    """Parameters of the spectra; the defaults are the published ones.

    Attributes
    ----------
    window_s, stride_s
        Length of a window and distance between the starts of neighbours, s.
    windows
        Exactly so many windows a recording, evenly spread from end to end, instead of the
        stride; for recordings whose length depends on the speed. None for the stride.
    fft_points
        Points of the transform, more than the window has for zero padding; None for the
        window's own length.
    kept_bins
        Bins stored (fewer if Nyquist comes first); stretching needs more than the model sees.
    model_bins
        Bins the network sees, cut off only after augmentation.
    remove_mean
        Subtract each window's mean, channel by channel. Not done to the published microphone;
        needed by taxels, whose offset would otherwise drown everything.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    window_s: PositiveFloat = 1.0
    stride_s: PositiveFloat = 0.5
    windows: PositiveInt | None = None
    fft_points: PositiveInt | None = None
    kept_bins: PositiveInt = 4000
    model_bins: PositiveInt = 200
    remove_mean: bool = False

    def changed(
        self,
        window_s: float | None = None,
        stride_s: float | None = None,
        fft_points: int | None = None,
        model_bins: int | None = None,
    ) -> "SpectralEncoding":
        """Return the encoding with the parameters given; a stride replaces a window count.

        Raises
        ------
        InputError
            If a value is not a positive, finite number.
        """
        wanted = {
            "window_s": window_s,
            "stride_s": stride_s,
            "fft_points": fft_points,
            "model_bins": model_bins,
        }
        new: dict[str, Any] = {name: v for name, v in wanted.items() if v is not None}
        for name, value in new.items():
            if not (math.isfinite(value) and value > 0):
                raise InputError(f"the spectra's {name}", "a positive number", f"{value}")
        if stride_s is not None:
            new["windows"] = None
        new["kept_bins"] = max(self.kept_bins, model_bins or 0)
        return SpectralEncoding(**{**self.model_dump(), **new})


def require_window(n: int, rate: float, encoding: SpectralEncoding, where: str) -> None:
    """Refuse what can't be encoded, by numbers alone; see `spectral_samples`.

    Parameters
    ----------
    n, rate
        Samples that the cut leaves, and their rate in Hz.
    """
    length = round(encoding.window_s * rate)
    points = encoding.fft_points or length
    if n < length:
        expected = f"at least one window of {encoding.window_s:g} s"
        raise InputError(where, expected, f"{n / rate:.2f} s")
    if length < 2:
        raise InputError("--window-s", f"at least two samples at {rate:g} Hz", f"{length}")
    if points < length:
        raise InputError("--fft-points", f"at least the window's {length} samples", f"{points}")
    bins = min(points // 2 + 1, encoding.kept_bins)
    if encoding.model_bins > bins:
        nyquist = f"the {bins} bins that the encoding has (of {rate / points:g} Hz)"
        raise InputError("--bins", f"at most {nyquist}", f"{encoding.model_bins}")


def window_starts(n: int, length: int, stride: int, count: int | None) -> NDArray[np.int64]:
    """Return where the windows of a signal of n samples start: a stride apart, or `count`."""
    if count is None:
        return np.arange(0, n - length + 1, stride)
    return np.linspace(0, n - length, count).astype(np.int64)


def amplitude_spectrum(
    signal: NDArray[np.float32], fft_points: int | None = None, bins: int | None = None
) -> NDArray[np.float32]:
    """Return 2|FFT|/N over the last axis, N its length; no window function.

    A sine of amplitude A on a bin gives A there. Bin k lies at k * rate / fft_points; bin 0 is
    twice the mean, as published.
    """
    length = signal.shape[-1]
    spectrum = scipy.fft.rfft(signal, n=fft_points or length, axis=-1)[..., :bins]
    return np.asarray(2.0 / length * np.abs(spectrum), dtype=np.float32)


def without_mean(windows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return windows (..., time) with their means taken off, the same however they lay."""
    windows = np.ascontiguousarray(windows)  # the order of the sum depends on the layout
    return np.asarray(windows - windows.mean(axis=-1, keepdims=True))


def spectral_samples(vibration: xr.DataArray, kept: slice, encoding: SpectralEncoding) -> Samples:
    """Encode vibration `(audio_time, channel)` as spectra `(sample, channel, frequency)`.

    Parameters
    ----------
    vibration
        RA-II with `sample_rate_hz` and the recording's labels in its attrs.
    kept
        Audio samples that the cut keeps.

    Returns
    -------
    Amplitudes in the vibration's unit, with the coordinate `frequency` in Hz.

    Raises
    ------
    InputError
        If a window is longer than what the cut leaves of the recording, or if the padded
        transform is shorter than the window.
    """
    rate = float(vibration.attrs[dims.SAMPLE_RATE])
    where = vibration.attrs.get("name", "a recording")
    signal = vibration.transpose(dims.AUDIO_TIME, dims.CHANNEL).values[kept]
    require_window(len(signal), rate, encoding, where)
    length = round(encoding.window_s * rate)
    points = encoding.fft_points or length
    stride = max(1, round(encoding.stride_s * rate))
    starts = window_starts(len(signal), length, stride, encoding.windows)
    cut = np.lib.stride_tricks.sliding_window_view(signal, length, axis=0)[starts]
    if encoding.remove_mean:
        cut = without_mean(cut)
    spectra = amplitude_spectrum(cut, points, encoding.kept_bins)
    frequency = np.arange(spectra.shape[-1]) * rate / points
    begin = (starts + kept.start) / rate
    return make_samples(
        spectra,
        (dims.CHANNEL, dims.FREQUENCY),
        begin,
        begin + length / rate,
        vibration.attrs,
        {dims.FREQUENCY: (dims.FREQUENCY, frequency, {dims.UNITS: dims.HERTZ})},
    )
