"""Log spectra of windows of any sensor as a scikit-learn transformer."""

import math
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, TransformerMixin

from afferents.encodings.orders import PERIODS, geometric, log_power
from afferents.encodings.windows import audible_hz
from afferents.errors import InputError

_AT_ONCE = 512
"""Windows: memory stays small."""


class LogSpectra(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Log power in bands of frequency: windows (n, time, channel) to features (n, feature).

    The mean of each channel is taken away first, so the features hold nothing of offsets. Bands lie
    evenly on a logarithm of frequency, channel after channel. Nothing is learnt from data.

    Parameters
    ----------
    rate_hz
        Rows a second. Left at 1, frequencies are in cycles per row.
    lowest_hz, highest_hz
        Of the bands; None for two periods a window, and for just below half the rate.
    bins_per_octave
        Bands in a factor of 2.

    Examples
    --------
    >>> import numpy as np
    >>> windows = np.random.default_rng(0).normal(size=(10, 64, 3))
    >>> LogSpectra().fit_transform(windows).shape
    (10, 96)
    """

    def __init__(
        self,
        rate_hz: float = 1.0,
        lowest_hz: float | None = None,
        highest_hz: float | None = None,
        bins_per_octave: int = 8,
    ) -> None:
        """Keep the options, as scikit-learn wants them."""
        self.rate_hz = rate_hz
        self.lowest_hz = lowest_hz
        self.highest_hz = highest_hz
        self.bins_per_octave = bins_per_octave

    def fit(self, X: ArrayLike, y: Any = None) -> Self:  # noqa: N803
        """Return itself: there is nothing to learn."""
        return self

    def __sklearn_is_fitted__(self) -> bool:
        """Whether it may transform, which it always may."""
        return True

    def transform(self, X: ArrayLike) -> NDArray[np.float32]:  # noqa: N803
        """Return the features (n, feature) of windows (n, time, channel).

        Raises
        ------
        InputError
            If they have other axes, or a window is too short for the lowest frequency.
        """
        windows = np.asarray(X)
        if windows.ndim != 3:
            raise InputError(
                "LogSpectra: expected windows of shape (n, time, channels), found an array of "
                f"shape {windows.shape}; a single channel is X[:, :, np.newaxis]"
            )
        n_rows = windows.shape[1]
        low = self.lowest_hz or PERIODS * self.rate_hz / max(n_rows, 1)
        high = audible_hz(self.rate_hz, self.highest_hz or math.inf)
        if low >= high or n_rows * low < self.rate_hz:
            raise InputError(
                f"LogSpectra: expected windows that hold a period of the lowest frequency, which "
                f"is below the highest, found {n_rows} rows at {self.rate_hz:g} Hz for {low:g} to "
                f"{high:g} Hz; take longer windows"
            )
        frequencies = geometric(low, high, self.bins_per_octave)
        parts = (windows[i : i + _AT_ONCE].astype(float) for i in range(0, len(windows), _AT_ONCE))
        found = [log_power(its, self.rate_hz, frequencies, self.bins_per_octave) for its in parts]
        return np.concatenate(found).reshape(len(windows), -1).astype(np.float32)
