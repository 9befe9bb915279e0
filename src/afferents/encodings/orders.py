"""Orders: vibration spectra over a logarithm of frequency, where a change of speed is a shift.

What repeats every 1 / k mm vibrates at k v Hz at the speed v. Over log frequency a texture's
spectrum is therefore one curve that speed moves as a whole; divided by the speed it stands still
(order tracking, as for rotating machines: Fyfe & Munck, Mech. Syst. Signal Process. 1997, 11:187).

With several channels their cross-spectra show more. A pattern that slides past two taxels d mm
apart shifts their phases by 2 pi k d, whatever the speed: so phases give k, and with the frequency
the speed itself. Which of two phases is ahead shows the way of the slide instead: the other way
the slide is, as far as the skin allows, played backwards. So signs of phases are left out.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.fft
from numpy.typing import NDArray
from pydantic import PositiveFloat, PositiveInt

from afferents import dims
from afferents.encodings.base import SignalInfo
from afferents.encodings.windows import LINE_WIDTH, WindowEncoding, Windows, audible_hz, bridge
from afferents.errors import InputError

_PADDING = 4
"""Points of the transform for each sample: bands are cut out of it without steps."""
_LEAST_POWER = 1e-20
_OCTAVES = 9
"""Octaves below the highest frequency that whole recordings of a low rate are looked at."""
PERIODS = 2
"""Of a wave that a recording must hold for it to count as heard."""
_COARSE = 8
"""Frequencies in a factor of 2, where several channels bring cross-spectra as well."""


class OrderEncoding(WindowEncoding):
    """The power of a window over the logarithm of frequency is a sample (feature, frequency).

    For every channel the natural logarithm of its power, then, with several channels, twice the
    real part, and twice the size of the imaginary part, of every channel's coherency with the mean
    of all, each averaged over a band round the frequency. A recording played backwards has the same
    features. The frequencies are geometric, Hz.

    Attributes
    ----------
    lowest_hz
        Of the frequencies.
    bins_per_octave
        Frequencies in a factor of 2.
    lowest_per_mm, highest_per_mm
        Of the textures' own axis, cycles per mm.
    """

    name, sample_dims = "orders", (dims.FEATURE, dims.FREQUENCY)

    lowest_hz: PositiveFloat = 2.0
    bins_per_octave: PositiveInt = 24
    lowest_per_mm: PositiveFloat = 0.06
    highest_per_mm: PositiveFloat = 6.0

    @classmethod
    def suiting(cls, signal: SignalInfo, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return a band that is heard, and the textures' axis that is heard at all speeds.

        Or at some speeds, if what is heard at all is less than an octave. Windows are whole
        recordings where these are too short for as many samples as usual.
        """
        default = cls()
        highest = given.get("highest_hz", audible_hz(signal.rate_hz, default.highest_hz))
        usual = default.lowest_hz / default.highest_hz * highest
        window_s = given.get("window_s", 4.0 * default.highest_hz / highest)
        is_whole = window_s is None or window_s > signal.shortest_s
        chosen: dict[str, Any] = {"highest_hz": highest, "window_s": window_s}
        if is_whole and "window_s" not in given:
            chosen["window_s"] = None
        elif not is_whole:
            chosen["stride_s"] = window_s / 2
        lowest = given.get("lowest_hz", usual)
        if is_whole and highest < default.highest_hz and "lowest_hz" not in given:
            lowest = max(highest / 2**_OCTAVES, PERIODS / signal.longest_s)
        chosen["lowest_hz"] = lowest
        low, high = lowest / signal.slowest_mm_s, highest / signal.fastest_mm_s
        if is_whole:
            low = max(low, PERIODS / signal.least_mm)
        if high < 2 * low:
            low, high = lowest / signal.fastest_mm_s, highest / signal.slowest_mm_s
        is_usual = (lowest, highest) == (default.lowest_hz, default.highest_hz)
        is_heard = default.lowest_per_mm <= low and high <= default.highest_per_mm
        if not (is_usual and is_heard):
            chosen |= {"lowest_per_mm": low, "highest_per_mm": high}
        if signal.n_channels > 1:
            chosen["bins_per_octave"] = _COARSE
        return {name: v for name, v in chosen.items() if v != getattr(default, name)}

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse what is too short, or of too low a rate."""
        super().require(n, rate_hz, where)
        if rate_hz / 2 * 0.95 < 2 * self.lowest_hz:
            expected = f"a sample rate for an octave above {self.lowest_hz:g} Hz"
            raise InputError(f"{where}: expected {expected}, found {rate_hz:g} Hz")

    def features(
        self, windows: Windows, speed_mm_s: float, rate_hz: float
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Return powers and coherencies of windows, (window, feature, frequency)."""
        frequencies = self.frequencies(rate_hz)
        resolution_hz = windows.rate_hz / windows.values.shape[1]
        values = []
        for window in windows.values:
            spectrum, axis = _spectra(window, windows.rate_hz)
            bands = _bands(axis, frequencies, self.bins_per_octave, resolution_hz)
            masked = self.mask.masks(axis, speed_mm_s, LINE_WIDTH * resolution_hz)
            power = _means(bridge(np.abs(spectrum) ** 2 + _LEAST_POWER, axis, masked), bands)
            parts = [np.log(power)]
            if len(spectrum) > 1:
                spectrum[:, masked] = 0
                mean = spectrum.mean(axis=0, keepdims=True)
                cross = _means(spectrum * np.conj(mean), bands)
                of_mean = _means(np.abs(mean) ** 2 + _LEAST_POWER, bands)
                coherency = cross / np.sqrt(power * of_mean)
                parts += [2 * coherency.real, 2 * np.abs(coherency.imag)]
            values.append(np.concatenate(parts))
        coordinate = (dims.FREQUENCY, frequencies, {dims.UNITS: dims.HERTZ})
        return np.stack(values).astype(np.float32), {dims.FREQUENCY: coordinate}

    def frequencies(self, rate: float) -> NDArray[np.float64]:
        """Return the frequencies of a signal of that sample rate, Hz."""
        highest = audible_hz(rate, self.highest_hz)
        return geometric(self.lowest_hz, highest, self.bins_per_octave)

    @property
    def per_mm(self) -> NDArray[np.float64]:
        """The textures' own axis, cycles per mm."""
        return geometric(self.lowest_per_mm, self.highest_per_mm, self.bins_per_octave)


def geometric(low: float, high: float, per_octave: int) -> NDArray[np.float64]:
    """Return frequencies from the lowest on, `per_octave` in each factor of 2."""
    steps = math.floor(math.log2(high / low) * per_octave + 1e-9)
    return np.asarray(low * 2.0 ** (np.arange(steps + 1) / per_octave))


def log_power(
    windows: NDArray[np.floating],
    rate_hz: float,
    frequencies: NDArray[np.float64],
    bins_per_octave: int,
) -> NDArray[np.float64]:
    """Return log power round frequencies, (..., channel, frequency), of (..., time, channel)."""
    spectra, axis = _spectra(windows, rate_hz)
    bands = _bands(axis, frequencies, bins_per_octave, rate_hz / windows.shape[-2])
    return np.asarray(np.log(_means(np.abs(spectra) ** 2 + _LEAST_POWER, bands)))


def _spectra(
    windows: NDArray[np.floating], rate_hz: float
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return spectra (..., channel, frequency) of windows (..., time, channel), and their axis."""
    n = windows.shape[-2]
    points = scipy.fft.next_fast_len(_PADDING * n, real=True)
    tapered = (windows - windows.mean(axis=-2, keepdims=True)) * np.hanning(n)[:, None]
    spectra = scipy.fft.rfft(np.swapaxes(tapered, -1, -2), points, axis=-1) / math.sqrt(n)
    return spectra, np.arange(spectra.shape[-1]) * rate_hz / points


def _bands(
    axis: NDArray[np.float64], frequencies: NDArray[np.float64], per_octave: int, least_hz: float
) -> NDArray[np.int64]:
    """Return where bands round geometric frequencies start and stop on an axis, (frequency, 2).

    They are never narrower than a window resolves, about `least_hz`.
    """
    half = frequencies * (2 ** (0.5 / per_octave) - 2 ** (-0.5 / per_octave)) / 2
    half = np.maximum(half, 0.75 * least_hz)
    places = np.round(np.stack([frequencies - half, frequencies + half]) / axis[1])
    first, last = np.clip(places, 0, len(axis) - 1).astype(int)
    return np.stack([first, np.maximum(last, first) + 1], axis=1)


def _means(spectra: NDArray[Any], bands: NDArray[np.int64]) -> NDArray[Any]:
    """Return the means of spectra (..., channel, frequency) over bands.

    Each band is summed by itself: a difference of running sums loses what is faint.
    """
    # so that a band may stop at the end
    padded = np.pad(spectra, [(0, 0)] * (spectra.ndim - 1) + [(0, 1)])
    total = np.add.reduceat(padded, bands.ravel(), axis=-1)[..., ::2]
    return np.asarray(total / np.diff(bands).T)
