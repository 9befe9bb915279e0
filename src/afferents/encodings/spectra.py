"""Amplitude spectra of windows of vibration (paper, 2.3.3), and a machine's lines in them."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Self, TypeVar

import numpy as np
import scipy.fft
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PositiveFloat, PositiveInt, model_validator

from afferents import dims
from afferents.encodings.augment import COPIES, Stretch, stretched_copies
from afferents.encodings.base import Floats, Indices, Option, Ready, SignalInfo, VibrationEncoding
from afferents.encodings.samples import Samples, make_samples
from afferents.errors import InputError

HARMONICS = 8
_WIDTH = 0.01
"""A line that follows the speed is as wide as the speed is uneven: this share of its frequency."""


class Lines(BaseModel):
    """Lines to be masked, with their harmonics.

    Attributes
    ----------
    hertz
        Fundamentals that stand still, such as 50.
    per_mm
        Fundamentals that follow the sliding speed, cycles per mm, such as a motor that turns 14.4
        times for 251 mm: 0.0573.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hertz: tuple[PositiveFloat, ...] = ()
    per_mm: tuple[PositiveFloat, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _of_text(cls, given: Any) -> Any:
        """Take text as well, so that an encoding's `mask` may be given as it is typed."""
        return cls.parse(given).model_dump() if isinstance(given, str) else given

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read an option such as ``50Hz,0.0573/mm``.

        Raises
        ------
        InputError
            If a part is neither.
        """
        found: dict[str, list[float]] = {"Hz": [], "/mm": []}
        for part in text.split(","):
            line = re.fullmatch(r"\s*(\d*\.?\d+)\s*(Hz|/mm)\s*", part)
            if line is None or float(line[1]) == 0:
                raise InputError(f"--mask: expected lines as in 50Hz,0.0573/mm, found '{part}'")
            found[line[2]].append(float(line[1]))
        return cls(hertz=tuple(found["Hz"]), per_mm=tuple(found["/mm"]))

    def masks(
        self, frequency: NDArray[np.float64], speed_mm_s: float, resolution_hz: float
    ) -> NDArray[np.bool_]:
        """Return which frequencies, Hz, lie on a line or a harmonic of it."""
        fundamentals = [(f, 0.0) for f in self.hertz]
        fundamentals += [(k * speed_mm_s, _WIDTH) for k in self.per_mm]
        masked = np.zeros(len(frequency), dtype=bool)
        for fundamental, width in fundamentals:
            for line in fundamental * np.arange(1, HARMONICS + 1):
                masked |= np.abs(frequency - line) <= max(resolution_hz, width * line)
        return masked


def bridge(
    power: NDArray[np.float64], frequency: NDArray[np.float64], masked: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return spectra (..., frequency), above 0, with masked stretches replaced by straight lines.

    Straight in the logarithm, from edge to edge: nothing of the masked values is left, and nothing
    at all where all are masked.
    """
    if not masked.any():
        return power
    if masked.all():
        return np.ones_like(power)
    kept = ~masked
    logs = np.log(power)
    flat = logs.reshape(-1, logs.shape[-1])
    for row in flat:
        row[masked] = np.interp(frequency[masked], frequency[kept], row[kept])
    return np.exp(logs)


# Temporal encoding: amplitude spectra of windows of vibration (paper, section 2.3.3).

WINDOW_OPTION = Option("--window-s", "Length of a window of vibration, s.")
_DENSEST = 1000
_LEAST_SAMPLES = 128
"""Of a window, where a second has fewer than the spectrum needs."""
FEW_WINDOWS = 3
"""Of recordings that are not twice as long as a window."""
STRIDE_OPTION = Option("--stride-s", "Time from the start of a window to that of the next, s.")


Windowed = TypeVar("Windowed", bound=VibrationEncoding)


class SpectralEncoding(VibrationEncoding):
    """The amplitude spectrum of a window is a sample; the defaults are the published ones.

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

    name, sample_dims = "spectral", (dims.CHANNEL, dims.FREQUENCY)
    scaled = True

    window_s: Annotated[PositiveFloat, WINDOW_OPTION] = 1.0
    stride_s: Annotated[PositiveFloat, STRIDE_OPTION] = 0.5
    windows: PositiveInt | None = None
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
                window_s = signal.samples_within(max(window_s, least_s))
        length = round(window_s * signal.rate_hz)
        chosen |= {"window_s": window_s, "stride_s": window_s / 2}
        if signal.shortest_s < 2 * window_s and "stride_s" not in given:
            chosen["windows"] = FEW_WINDOWS
        if length // 2 + 1 < bins:
            chosen |= {"fft_points": 2 * bins, "kept_bins": bins}
        return {name: v for name, v in chosen.items() if v != getattr(default, name)}

    def changed(self, **wanted: Any) -> Self:
        """Return it with the values wanted; twice the bins wanted are kept, for slowed copies."""
        new = by_stride(super().changed(**wanted), **wanted)
        least = new.model_bins * (2 if wanted.get("model_bins") else 1)
        return new.model_copy(update={"kept_bins": max(new.kept_bins, least)})

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse what is too short; see `spectral_samples`."""
        length = round(self.window_s * rate_hz)
        points = self.fft_points or length
        if n < length:
            raise InputError(shorter_than_window(self.window_s, n / rate_hz, where))
        if length < 2:
            raise InputError(
                f"--window-s: expected at least two samples at {rate_hz:g} Hz, found {length}"
            )
        require_stride(self.stride_s, self.window_s)
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

    @property
    def n_copies(self) -> int:
        """How many copies of a spectrum are made."""
        return len(COPIES)

    def stretched(
        self, samples: Samples, index: Indices, rng: np.random.Generator, stretch: Stretch
    ) -> tuple[Floats, Indices]:
        """Return six stretched copies of every spectrum (section 2.4.3)."""
        values = samples.values[index]
        return stretched_copies(values, rng, stretch, self.seen(values).shape[-1])

    def stream(self, rate_hz: float, n_channels: int) -> "SpectrumStream":
        """Return what gives a spectrum at every stride."""
        return SpectrumStream(self, rate_hz, n_channels)


def by_stride(encoding: Windowed, stride_s: float | None = None, **_: Any) -> Windowed:
    """Return an encoding whose stride, if one is wanted, replaces a number of windows."""
    return encoding if stride_s is None else encoding.model_copy(update={"windows": None})


def require_stride(stride_s: float, window_s: float) -> None:
    """Refuse windows that lie so densely that they would fill the memory with the same sound."""
    if stride_s < window_s / _DENSEST:
        expected = f"at least {window_s / _DENSEST:g} s, a thousandth of the window"
        raise InputError(f"--stride-s: expected {expected}, found {stride_s:g}")


def shorter_than_window(window_s: float, found_s: float, where: str) -> str:
    """Say that what is used of a recording is shorter than a window, and what sets its length."""
    return (
        f"{where}: expected at least one window of {window_s:g} s, found {found_s:.2f} s; "
        "--window-s sets a shorter one, steady_s a longer part"
    )


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
    encoding.require(len(signal), rate, where)
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
        ready: list[Ready] = []
        while (stop := self._start + self._length) <= self._held.shape[1]:
            taken = len(samples) + stop - self._held.shape[1]
            spectrum = self._spectrum(self._held[:, self._start : stop])
            ready.append(Ready(spectrum, time_s + taken / self._rate_hz))
            self._start += self._stride
        gone = min(self._start, self._held.shape[1])  # a stride may be longer than a window
        self._held, self._start = self._held[:, gone:], self._start - gone
        return ready

    def _spectrum(self, window: NDArray[np.float32]) -> NDArray[np.float32]:
        encoding = self._encoding
        window = without_mean(window) if encoding.remove_mean else window
        return amplitude_spectrum(window, encoding.fft_points, encoding.model_bins)
