"""Figure 7: a spectrum stretched to half and twice its speed, beside the real ones.

Sliding twice as fast doubles the frequency of what a texture does to the skin, so a spectrum
stretched by two should look like one recorded at twice the speed. The paper shows texture i at
40 mm/s, stretched by 0.5 and 2, beside its real spectra at 20 and 80 mm/s.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.samples import Samples, textures_of
from afferents.reporting.choice import speeds_of
from afferents.reporting.labels import speed_key, texture_label
from afferents.reporting.spectra import (
    HIGHEST_HZ,
    amplitude_label,
    amplitude_top,
    condition_spectrum,
    frequencies,
)
from afferents.reporting.style import BLUE, INK, VERMILION, new_figure, styled

FACTORS = (0.5, 2.0)
TEXTURE, SPEED = "4", 40.0
"""The example of the paper: texture i (4 mm) at 40 mm/s."""


@dataclass(frozen=True)
class StretchExample:
    """A texture at a speed, at half of it and at twice, each a mean spectrum (frequency).

    `middle` is what is to be stretched by `FACTORS`; `half` and `double` are what the results
    should look like.
    """

    texture: str
    speed_mm_s: float
    half: xr.DataArray
    middle: xr.DataArray
    double: xr.DataArray


def stretch_example(spectra: Samples) -> StretchExample | None:
    """Choose the example: the paper's where it is there, else another texture or speed.

    Of other speeds the one nearest 40 mm/s is taken whose half and double were recorded.

    Returns
    -------
    None where no texture has a speed together with its half and its double.
    """
    textures = sorted(textures_of(spectra), key=lambda name: name != TEXTURE)
    # Of many recordings, looking for each in all samples would take longer than all the rest.
    recorded = set(zip(spectra[dims.TEXTURE].values, spectra[dims.SPEED].values, strict=True))
    for speed in sorted(speeds_of(spectra), key=lambda v: abs(v - SPEED)):
        for texture in textures:
            if not {(texture, k * speed) for k in (0.5, 1.0, 2.0)} <= recorded:
                continue
            found = [condition_spectrum(spectra, texture, k * speed) for k in (0.5, 1.0, 2.0)]
            half, middle, double = found
            if half is not None and middle is not None and double is not None:
                return StretchExample(texture, speed, half, middle, double)
    return None


@styled
def figure07(
    example: StretchExample, stretched: Mapping[float, NDArray[np.float32]], source: str
) -> Figure:
    """Draw the spectrum, and its stretched copies over the real spectra.

    Parameters
    ----------
    example
        From `stretch_example`.
    stretched
        `example.middle` stretched by each of `FACTORS` by rebinning, as under the nested
        protocol; 1-D, any length, bins spaced as before.
    source
        The line that says what the spectra were made from.
    """
    texture = texture_label(example.texture)
    title = f"Figure 7. Stretched (nested protocol: rebinned) and real spectra, texture {texture}"
    figure = new_figure(7.6, 5.6, title, source)
    upper, middle, lower = figure.subplots(3, 1, sharex=True, sharey=True)
    _draw_real(upper, example.half, example.speed_mm_s / 2)
    _draw_stretched(upper, stretched[0.5], 0.5, example)
    _draw_real(middle, example.middle, example.speed_mm_s)
    _draw_real(lower, example.double, example.speed_mm_s * 2)
    _draw_stretched(lower, stretched[2.0], 2.0, example)
    lower.set_xlabel("frequency (Hz)")
    middle.set_ylabel(amplitude_label(example.middle.attrs))
    lower.set_xlim(0, min(HIGHEST_HZ, float(example.middle[dims.FREQUENCY].max())))
    lower.set_ylim(0, amplitude_top((example.half, example.middle, example.double)))
    for axes in (upper, middle, lower):
        axes.legend(loc="upper right")
    return figure


def _draw_real(axes: Axes, spectrum: xr.DataArray, speed_mm_s: float) -> None:
    label = f"recorded at {speed_key(speed_mm_s)} mm/s ({spectrum.attrs['n_windows']} windows)"
    axes.plot(spectrum[dims.FREQUENCY], spectrum, color=INK, lw=0.9, label=label)


def _draw_stretched(
    axes: Axes, spectrum: NDArray[np.float32], factor: float, example: StretchExample
) -> None:
    axes.plot(
        frequencies(spectrum, example.middle),
        spectrum,
        color=BLUE if factor < 1 else VERMILION,
        label=f"{speed_key(example.speed_mm_s)} mm/s stretched by {factor:g}",
    )
