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
from afferents.core.recording import spacing_mm
from afferents.core.samples import Samples, textures_of
from afferents.reporting.labels import speed_key
from afferents.reporting.spectra import (
    amplitude_label,
    condition_spectrum,
    frequencies,
)
from afferents.reporting.style import BLUE, INK, VERMILION, new_figure, styled
from afferents.reporting.texture_names import texture_names

FACTORS = (0.5, 2.0)
SPACING_MM, SPEED = 4.0, 40.0
"""The example of the paper: texture i (4 mm) at 40 mm/s."""
HIGHEST_HZ = 200.0
"""The networks see 0 to 200 Hz; above that there is little to compare."""


@dataclass(frozen=True)
class StretchExample:
    """A texture at a speed, at half of it and at twice, each a mean spectrum (frequency).

    `name` is what the report calls the texture.
    `middle` is what is to be stretched by `FACTORS`; `half` and `double` are what the results
    should look like.
    """

    texture: str
    name: str
    speed_mm_s: float
    half: xr.DataArray
    middle: xr.DataArray
    double: xr.DataArray


def stretch_example(spectra: Samples) -> StretchExample | None:
    """Choose the example: the paper's where it is there, else another texture or speed.

    Bumpy textures come first, since a smooth one has no lines that stretching could move; then the
    speed nearest 40 mm/s whose half and double were recorded; then the spacing nearest 4 mm.

    Returns
    -------
    None where no texture has a speed together with its half and its double.
    """
    names = texture_names(textures_of(spectra), spectra.attrs)
    # Of many recordings, looking for each in all samples would take longer than all the rest.
    recorded = set(zip(spectra[dims.TEXTURE].values, spectra[dims.SPEED].values, strict=True))
    candidates = [
        (texture, float(speed))
        for texture, speed in recorded
        if {(texture, k * speed) for k in (0.5, 2.0)} <= recorded
    ]
    for texture, speed in sorted(candidates, key=_unlike_the_paper):
        found = [condition_spectrum(spectra, texture, k * speed) for k in (0.5, 1.0, 2.0)]
        half, middle, double = found
        if half is not None and middle is not None and double is not None:
            return StretchExample(texture, names[texture], speed, half, middle, double)
    return None


def _unlike_the_paper(condition: tuple[str, float]) -> tuple[int, float, float, str, float]:
    """Sort key: bumps, then words, then smooth; of each the nearest speed and spacing first."""
    texture, speed = condition
    spacing = spacing_mm(texture)
    kind = 1 if spacing is None else 0 if spacing > 0 else 2
    off = abs((spacing or 0.0) - SPACING_MM)
    return (kind, abs(speed - SPEED), off, texture, speed)


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
    title = (
        f"Figure 7. Stretched (nested protocol: rebinned) and real spectra, texture {example.name}"
    )
    figure = new_figure(7.6, 5.6, title, source)
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    _draw_real(upper, example.half, example.speed_mm_s / 2)
    _draw_stretched(upper, stretched[0.5], 0.5, example)
    _draw_real(middle, example.middle, example.speed_mm_s)
    _draw_real(lower, example.double, example.speed_mm_s * 2)
    _draw_stretched(lower, stretched[2.0], 2.0, example)
    lower.set_xlabel("frequency (Hz)")
    middle.set_ylabel(amplitude_label(example.middle.attrs))
    lower.set_xlim(0, min(HIGHEST_HZ, float(example.middle[dims.FREQUENCY].max())))
    for axes in (upper, middle, lower):
        axes.set_ylim(0, _top(axes))
        axes.legend(loc="upper right")
    return figure


def _top(axes: Axes) -> float:
    """Return the top of an amplitude axis; offset and drift, the lowest hundredth, don't set it."""
    shown = [
        y[(x >= 0.01 * HIGHEST_HZ) & (x <= HIGHEST_HZ)]
        for x, y in (np.transpose(line.get_xydata()) for line in axes.lines)
    ]
    highest = max(float(y.max()) for y in shown if len(y))
    return 1.15 * highest if highest > 0 else 1.0


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
