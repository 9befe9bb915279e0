"""Kernels: the wave as short random filters see it; a baseline that knows no physics.

ROCKET (Dempster, Petitjean & Webb, Data Min. Knowl. Discov. 2020, 34:1454) convolves a window with
random kernels of random dilations and keeps two numbers of each: the highest value, and the share
of the values above 0. As usual there, windows are brought to mean 0 and variance 1 first, so that
loudness is lost. The kernels depend on the length of the windows and on the seed, and on nothing
that was recorded: encoding all recordings with the same ones leaks nothing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import NonNegativeInt, PositiveInt

from afferents import dims
from afferents.encodings.spectra import Lines
from afferents.encodings.windows import LINE_WIDTH, WindowEncoding, Windows, decimation
from afferents.errors import InputError
from afferents.plugins import import_extra

_LONGEST = 11
"""Values that the longest kernels span, undilated."""
_DENSITY = 3
"""Frequencies of those waves to one of the transform."""
_LEAST_POWER = 1e-8
"""Share of the strongest mixture of waves below which a mixture is of no use: rounding, nearly."""
_LEAST_LEFT = 1e-6
"""Share of a window's standard deviation below which what the cut leaves of it is rounding."""


class KernelEncoding(WindowEncoding):
    """What random kernels make of a window is a sample (feature).

    Of every kernel the highest value, in standard deviations of the window, and the share of
    values above 0, percent. The coordinate `length` is the number of values in a window: only
    samples of equal length have been seen by the same kernels. Needs the extra 'baselines'.

    Attributes
    ----------
    n_kernels
        Of all channels together, shared out evenly; each gives two features.
    seed
        That they are drawn with.
    """

    name, sample_dims = "kernels", (dims.FEATURE,)

    keeps_unit = False

    n_kernels: PositiveInt = 1000
    seed: NonNegativeInt = 0

    def require(self, n: int, rate_hz: float, where: str) -> None:
        """Refuse what is too short; see `WindowEncoding.require`."""
        super().require(n, rate_hz, where)
        kept = rate_hz / decimation(rate_hz, self.highest_hz)
        length = round((self.window_s or n / rate_hz) * kept)
        if length < _LONGEST:
            raise InputError(
                f"{where}: expected windows of at least {_LONGEST} values, found {length}"
            )

    def require_packages(self) -> None:
        """Refuse if the package that has the kernels is missing."""
        import_extra("baselines", "--models rocket-te", "pyts")

    def features(
        self, windows: Windows, speed_mm_s: float, rate_hz: float
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Return what random kernels make of windows, (window, feature), and their length."""
        waves = _standardised(windows.values, windows.rate_hz, speed_mm_s, self.mask)
        return _features(waves, self), {dims.LENGTH: waves.shape[1]}


def _standardised(
    windows: NDArray[np.float64], rate: float, speed_mm_s: float, lines: Lines
) -> NDArray[np.float64]:
    """Return windows (window, time, channel) without lines, each of mean 0 and variance 1."""
    level = windows - windows.mean(axis=1, keepdims=True)
    basis = _line_basis(windows.shape[1], rate, speed_mm_s, lines)
    left = level - basis @ (basis.T @ level)
    sd = left.std(axis=1, keepdims=True)
    something = sd > _LEAST_LEFT * level.std(axis=1, keepdims=True)
    return np.asarray(left / np.where(something, sd, np.inf))


def _line_basis(n: int, rate: float, speed_mm_s: float, lines: Lines) -> NDArray[np.float64]:
    """Return an orthonormal basis (time, component) of all waves of n values within the lines.

    A line between two frequencies of the window's Fourier transform spreads over all of them:
    waves at denser frequencies hold it whole, wherever it lies. The constant is among
    them, for a line whose periods don't fit the window has a mean.
    """
    frequency = np.arange(0, rate / 2, rate / (_DENSITY * n))
    masked = lines.masks(frequency, speed_mm_s, LINE_WIDTH * rate / n)
    masked[0] = True
    phase = 2 * np.pi * np.outer(np.arange(n) / rate, frequency[masked])
    waves = np.hstack([np.cos(phase), np.sin(phase)])
    power, mixed = np.linalg.eigh(waves.T @ waves)
    apart = power > _LEAST_POWER * power[-1]
    return np.asarray(waves @ (mixed[:, apart] / np.sqrt(power[apart])))


def _features(waves: NDArray[np.float64], encoding: KernelEncoding) -> NDArray[np.float32]:
    """Return the features (window, feature) of waves (window, time, channel)."""
    # The first import takes half a minute: the package compiles all it has.
    pyts = import_extra("baselines", "--models rocket-te", "pyts.transformation")
    channels = np.moveaxis(waves, 2, 0)
    n_kernels = max(1, encoding.n_kernels // len(channels))
    features = []
    for number, channel in enumerate(channels):
        kernels = pyts.ROCKET(n_kernels, random_state=encoding.seed + number)
        highest_and_share = kernels.fit_transform(np.ascontiguousarray(channel))
        # In percent, as wide as the highest values: a ridge trusts nothing that varies by 0.01.
        highest_and_share[:, 1::2] *= 100
        features.append(highest_and_share)
    return np.concatenate(features, axis=1).astype(np.float32)
