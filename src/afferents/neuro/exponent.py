"""The spectral exponent of vibration: one number for a texture, as a baseline.

The power spectrum of the vibration of many surfaces falls as a power of the frequency. The exponent
is the slope of ln power over ln frequency. At another speed a spectrum is shifted along ln
frequency, which leaves its slope: a single number that speed need not change.
"""

from collections.abc import Iterable

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.signal import welch

from afferents import dims
from afferents.errors import InputError
from afferents.spikes.artificial import choose_stretch
from afferents.store.responses import Responses

LOW_HZ, HIGH_HZ = 10.0, 200.0
"""Where the slope is fitted; the upper end is lowered to what the rate allows."""
WINDOW_S = 1.0


def spectral_exponent(vibration: NDArray[np.floating], rate_hz: float) -> float:
    """Return the slope of ln power over ln frequency.

    The spectrum is Welch's, of windows of 1 s with a Hann window and half overlap; its logarithm is
    averaged in 20 bands even in ln frequency, so that high frequencies, of which there are more,
    don't decide alone.

    Parameters
    ----------
    vibration
        `(time,)`.
    rate_hz
        Samples a second.

    Returns
    -------
    Negative where power falls with frequency; NaN where there is none.

    Raises
    ------
    InputError
        If the vibration is shorter than a window, or its rate too low.
    """
    high_hz = min(HIGH_HZ, 0.9 * rate_hz / 2)
    if high_hz < 2 * LOW_HZ:
        raise InputError(
            f"vibration: expected more than {4.5 * LOW_HZ:g} samples/s, found {rate_hz:g}"
        )
    if len(vibration) < WINDOW_S * rate_hz:
        found = f"{len(vibration) / rate_hz:.2f} s"
        raise InputError(f"vibration: expected at least {WINDOW_S:g} s, found {found}")
    frequency, power = welch(vibration, rate_hz, nperseg=round(WINDOW_S * rate_hz))
    inside = (frequency >= LOW_HZ) & (frequency <= high_hz) & (power > 0)
    if inside.sum() < 3:
        return float("nan")
    x, y = np.log(frequency[inside]), np.log(power[inside])
    bands = np.digitize(x, np.linspace(x[0], x[-1], 21)[1:-1])
    means = np.array([(x[bands == band].mean(), y[bands == band].mean()) for band in set(bands)])
    return float(np.polyfit(means[:, 0], means[:, 1], 1)[0])


def exponents(recordings: Iterable[Responses]) -> pd.DataFrame:
    """Return the spectral exponent of each recording with vibration: of its first channel.

    Returns
    -------
    pandas.DataFrame
        `recording`, `texture`, `speed_mm_s`, `exponent`, NaN of recordings shorter than 1 s.

    Raises
    ------
    InputError
        If a rate is too low; see `spectral_exponent`.
    """
    rows = []
    for recording in recordings:
        if dims.RA2 not in recording:
            continue
        rate_hz = float(recording[dims.RA2].attrs[dims.SAMPLE_RATE])
        start_s, stop_s = choose_stretch(recording)
        kept = slice(round(start_s * rate_hz), round(stop_s * rate_hz))
        exponent = np.nan
        if stop_s - start_s >= WINDOW_S:
            exponent = spectral_exponent(recording[dims.RA2].values[kept, 0], rate_hz)
        labels = (recording.attrs[name] for name in ("name", "texture", "speed_mm_s"))
        rows.append((*labels, exponent))
    return pd.DataFrame(rows, columns=["recording", "texture", "speed_mm_s", "exponent"])


def accuracy_by_exponent(table: pd.DataFrame) -> dict[float, float]:
    """Return the share of recordings recognised by their exponent alone, by the speed left out.

    A recording is assigned to the texture whose mean exponent, over the other speeds, is nearest.
    """
    known = table.dropna(subset=["exponent"])
    right = {}
    for speed in np.unique(known["speed_mm_s"]):
        tested = known[known["speed_mm_s"] == speed]
        means = known[known["speed_mm_s"] != speed].groupby("texture")["exponent"].mean()
        if means.empty:
            continue
        apart = np.abs(tested["exponent"].to_numpy()[:, None] - means.to_numpy())
        named = means.index.to_numpy()[apart.argmin(axis=1)]
        right[float(speed)] = float(np.mean(named == tested["texture"].to_numpy()))
    return right
