"""Amplitude spectra of windows of vibration: the paper's temporal encoding (section 2.3.3)."""

from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
import scipy.fft
import xarray as xr
from numpy.typing import NDArray
from pydantic import PositiveFloat, PositiveInt

from afferents import dims
from afferents.encodings.augment import COPIES, Stretch, stretched_copies
from afferents.encodings.base import Floats, Indices, Option, Ready, SignalInfo
from afferents.encodings.samples import Samples, make_samples
from afferents.encodings.windows import STRIDE_OPTION, WINDOW_OPTION, StridedEncoding
from afferents.errors import InputError

_LEAST_SAMPLES = 128
"""Of a window, where a second has fewer than the spectrum needs."""
FEW_WINDOWS = 3
"""Of recordings that are not twice as long as a window."""


class SpectralEncoding(StridedEncoding):
    """The amplitude spectrum of a window is a sample; the defaults are the published ones.

    Attributes
    ----------
    window_s, stride_s
        Length of a window and distance between the starts of neighbours, s.
    windows
        Number of windows a recording, evenly spread from end to end, instead of the
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

    name, sample_dims = "spectral", (dims.CHANNEL, dims.FREQUENCY)
    scaled, n_copies = True, len(COPIES)

    window_s: Annotated[PositiveFloat, WINDOW_OPTION] = 1.0
    stride_s: Annotated[PositiveFloat, STRIDE_OPTION] = 0.5
    fft_points: Annotated[
        PositiveInt | None,
        Option("--fft-points", "Points of the FFT; windows are zero-padded to them.", int),
    ] = None
    kept_bins: PositiveInt = 4000
    model_bins: Annotated[
        PositiveInt, Option("--bins", "Frequency bins that the network sees, from 0 Hz up.", int)
    ] = 200
    remove_mean: bool = False

    @classmethod
    def suiting(cls, signal: SignalInfo, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return windows that fit into all recordings, padded to as many bins as a network sees.

        As published where a second has enough samples; else of 128, or all of the shortest
        recording. Means are taken off what is no sound.
        """
        default = cls()
        chosen: dict[str, Any] = {"remove_mean": not signal.is_sound}
        bins = given.get("model_bins", default.model_bins)
        window_s = given.get("window_s")
        if window_s is None:
            window_s, least_s = default.window_s, _LEAST_SAMPLES / signal.rate_hz
            if window_s > signal.shortest_s or round(window_s * signal.rate_hz) // 2 + 1 < bins:
                longest_s = min(max(window_s, least_s), signal.shortest_s)
                window_s = int(longest_s * signal.rate_hz + 1e-6) / signal.rate_hz  # whole samples
        length = round(window_s * signal.rate_hz)
        chosen |= {"window_s": window_s, "stride_s": window_s / 2}
        if signal.shortest_s < 2 * window_s and "stride_s" not in given:
            chosen["windows"] = FEW_WINDOWS
        if length // 2 + 1 < bins:
            chosen |= {"fft_points": 2 * bins, "kept_bins": bins}
        return {name: v for name, v in chosen.items() if v != getattr(default, name)}

    def changed(self, **wanted: Any) -> Self:
        """Return it with the values wanted; twice the bins wanted are kept, for slowed copies."""
        new = super().changed(**wanted)
        least = new.model_bins * (2 if wanted.get("model_bins") else 1)
        return new.model_copy(update={"kept_bins": max(new.kept_bins, least)})

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse what is too short; see `spectral_samples`."""
        length = round(self.window_s * rate_hz)
        points = self.fft_points or length
        if n < length:
            self.refuse_short(self.window_s, n / rate_hz, where)
        self.require_window(length, rate_hz)
        if points < length:
            raise InputError(
                f"--fft-points: expected at least the window's {length} samples, found {points}"
            )
        bins = min(points // 2 + 1, self.kept_bins)
        if self.model_bins > bins:
            nyquist = f"the {bins} bins that the encoding has (of {rate_hz / points:g} Hz)"
            raise InputError(f"--bins: expected at most {nyquist}, found {self.model_bins}")

    def samples(self, response: xr.DataArray, kept: slice, lookback: int = 0) -> Samples:
        """Return samples `(sample, channel, frequency)`; see `spectral_samples`."""
        return spectral_samples(response, kept, self)

    def seen(self, values: Floats) -> Floats:
        """Return the bins that a network sees."""
        return values[..., : self.model_bins]

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return six stretched copies of every spectrum (section 2.4.3)."""
        values = samples.values[index]
        return stretched_copies(values, rng, stretch, self.seen(values).shape[-1])

    def stream(self, rate_hz: float, n_channels: int) -> "SpectrumStream":
        """Return what gives a spectrum at every stride."""
        return SpectrumStream(self, rate_hz, n_channels)


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
    """Return windows (..., time) with their means taken off, whatever their layout in memory."""
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
    encoding.require(len(signal), rate, where)
    length = round(encoding.window_s * rate)
    points = encoding.fft_points or length
    starts = encoding.starts(len(signal), length, rate)
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


class SpectrumStream:
    """Keeps what the next window holds of vibration and makes a spectrum at every stride.

    Parameters
    ----------
    encoding
        Window, stride and transform; all bins that the model sees are returned.
    rate_hz
        Sample rate.
    n_channels
        Vibration channels.

    Raises
    ------
    InputError
        If the encoding does not fit the rate.
    """

    def __init__(self, encoding: SpectralEncoding, rate_hz: float, n_channels: int) -> None:
        """Wait for the first window to fill."""
        self._encoding, self._rate_hz, self._n_channels = encoding, rate_hz, n_channels
        self._length = round(encoding.window_s * rate_hz)
        encoding.require(self._length, rate_hz, "the stream")
        self._stride = max(1, round(encoding.stride_s * rate_hz))
        self.skip()

    def skip(self) -> None:
        """Begin anew: samples are missing before the next, and no window may hold both sides."""
        self._held, self._start = np.empty((self._n_channels, 0), np.float32), 0

    def feed(self, time_s: float, samples: NDArray[np.float32]) -> list[Ready]:
        """Take in samples, (n, channel), the first taken at `time_s`; return what is ready.

        Raises
        ------
        InputError
            If there are more or fewer channels than the model learnt from.
        """
        if samples.ndim != 2 or samples.shape[1] != self._n_channels:
            found = f"samples of shape {samples.shape}"
            raise InputError(f"the vibration: expected {self._n_channels} channels, found {found}")
        self._held = np.concatenate([self._held, samples.T], axis=1, dtype=np.float32)
        encoding, ready = self._encoding, []
        while (stop := self._start + self._length) <= self._held.shape[1]:
            taken = len(samples) + stop - self._held.shape[1]
            window = self._held[:, self._start : stop]
            if encoding.remove_mean:
                window = without_mean(window)
            spectrum = amplitude_spectrum(window, encoding.fft_points, encoding.model_bins)
            ready.append(Ready(spectrum, time_s + taken / self._rate_hz))
            self._start += self._stride
        gone = min(self._start, self._held.shape[1])  # a stride may be longer than a window
        self._held, self._start = self._held[:, gone:], self._start - gone
        return ready
