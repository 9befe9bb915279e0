"""Spectra of a stream of vibration: the same windows and numbers as offline, bit by bit."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.encodings import (
    SpectralEncoding,
    amplitude_spectrum,
    require_window,
    without_mean,
)


class Spectrum(NamedTuple):
    """One window.

    Attributes
    ----------
    amplitude
        (channel, frequency), float32, in the vibration's unit.
    end_s
        When the window's last sample was taken, plus one sample, s.
    """

    amplitude: NDArray[np.float32]
    end_s: float


class Spectra:
    """Keeps the last window of vibration and makes a spectrum at every stride.

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
        self._encoding, self._rate_hz = encoding, rate_hz
        self._length = round(encoding.window_s * rate_hz)
        require_window(self._length, rate_hz, encoding, "the stream")
        self._stride = max(1, round(encoding.stride_s * rate_hz))
        self._ring = np.zeros((n_channels, self._length), np.float32)
        self.skip()

    def skip(self) -> None:
        """Begin anew: samples are missing before the next, and no window may hold both sides."""
        self._n = 0

    def feed(self, time_s: float, samples: NDArray[np.float32]) -> list[Spectrum]:
        """Take in samples, (n, channel), the first taken at `time_s`; return what is ready.

        Raises
        ------
        InputError
            If there are more or fewer channels than the model learnt from.
        """
        if samples.ndim != 2 or samples.shape[1] != len(self._ring):
            found = f"samples of shape {samples.shape}"
            raise InputError("the vibration", f"{len(self._ring)} channels", found)
        ready: list[Spectrum] = []
        done = 0
        while done < len(samples):
            until = self._next_end() - self._n
            taken = samples[done : done + until]
            self._keep(taken)
            done += len(taken)
            if len(taken) == until:
                ready.append(Spectrum(self._spectrum(), time_s + done / self._rate_hz))
        return ready

    def _next_end(self) -> int:
        """Return the number of samples at which the next window ends."""
        if self._n < self._length:
            return self._length
        return self._n + self._stride - (self._n - self._length) % self._stride

    def _keep(self, taken: NDArray[np.float32]) -> None:
        at = (self._n + np.arange(len(taken))) % self._length
        self._ring[:, at[-self._length :]] = taken[-self._length :].T
        self._n += len(taken)

    def _spectrum(self) -> NDArray[np.float32]:
        start = self._n % self._length
        window = np.concatenate([self._ring[:, start:], self._ring[:, :start]], axis=1)
        if self._encoding.remove_mean:
            window = without_mean(window)
        encoding = self._encoding
        return amplitude_spectrum(window, encoding.fft_points, encoding.model_bins)
