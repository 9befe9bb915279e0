"""What Figures 7 and 12 share: one mean spectrum a condition, on its true frequency axis.

The paper's Figure 12 draws 400 bins of 1 Hz against 0 to 200 Hz and labels four of its five
speeds wrongly. Here frequency and speed are the coordinates that the spectra carry.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.samples import Samples
from afferents.reporting.choice import in_condition

HIGHEST_HZ = 400.0
"""Figures show at most 0 to 400 Hz: what the paper's Figure 12 truly shows."""


def condition_spectrum(spectra: Samples, texture: str, speed_mm_s: float) -> xr.DataArray | None:
    """Return the mean spectrum of a condition over its windows and channels.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.

    Returns
    -------
    Spectrum with the dim `frequency` and the attribute `n_windows`; None where the condition
    has no sample.
    """
    windows = in_condition(spectra, texture, speed_mm_s)
    n = windows.sizes[dims.SAMPLE]
    if n == 0:
        return None
    mean = windows.mean([dim for dim in windows.dims if dim != dims.FREQUENCY])
    return mean.assign_attrs({**spectra.attrs, "n_windows": n})


def amplitude_label(attrs: Mapping[object, object]) -> str:
    """Return the name of the amplitude axis, with its unit where the spectra carry one."""
    return f"amplitude ({attrs[dims.UNITS]})" if attrs.get(dims.UNITS) else "amplitude"


def amplitude_top(spectra: Sequence[xr.DataArray | None]) -> float:
    """Return the top of an amplitude axis for these spectra; None is passed over.

    Offset and drift, the lowest hundredth of what is shown, do not set it.
    """
    tops = [float(_shown(spectrum).max()) for spectrum in spectra if spectrum is not None]
    highest = max(tops, default=1.0)
    return 1.08 * highest if highest > 0 else 1.0


def _shown(spectrum: xr.DataArray) -> xr.DataArray:
    axis = spectrum[dims.FREQUENCY]
    highest = min(HIGHEST_HZ, float(axis.max()))
    return spectrum.where((axis >= 0.01 * highest) & (axis <= highest))


def frequencies(spectrum: NDArray[np.float32], like: xr.DataArray) -> NDArray[np.float64]:
    """Return the frequencies of bins spaced as those of `like`, for a spectrum of any length."""
    axis = np.asarray(like[dims.FREQUENCY].values, dtype=np.float64)
    spacing = float(axis[1] - axis[0])
    return float(axis[0]) + spacing * np.arange(len(spectrum), dtype=np.float64)
