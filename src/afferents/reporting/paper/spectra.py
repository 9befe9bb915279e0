"""Figure 12 as drawn: the spectrum of a single window, with the mean over windows behind it.

Rows are the textures a, g and m, columns the speeds that the paper's figure truly shows. As in the
paper, all panels have one scale of amplitude; where one texture is much louder than another that
hides the others, so a second figure gives each texture its own. The frequency axis is in true Hz:
the paper's is off by a factor of two, and four of its five speeds are labelled wrongly.
"""

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from afferents.core import dims
from afferents.core.samples import Samples
from afferents.reporting.choice import in_condition
from afferents.reporting.figure12 import SPEEDS
from afferents.reporting.labels import speed_key
from afferents.reporting.paper.stand_ins import Shown, shown_for
from afferents.reporting.spectra import (
    HIGHEST_HZ,
    amplitude_label,
    amplitude_top,
    condition_spectrum,
)
from afferents.reporting.style import INK, ORANGE, new_figure, styled

LETTERS_SHOWN = ("a", "g", "m")


def shown_spectra(spectra: Samples) -> list[list[Shown]]:
    """Choose the panels: a row for each texture, a column for each speed."""
    pairs = zip(spectra[dims.TEXTURE].values.tolist(), spectra[dims.SPEED].values, strict=True)
    recorded = sorted({(texture, float(speed)) for texture, speed in pairs})
    return [
        shown_for([(letter, speed) for speed in SPEEDS], recorded, spectra.attrs)
        for letter in LETTERS_SHOWN
    ]


@styled
def spectra_figure(spectra: Samples, source: str, one_scale: bool = True) -> Figure:
    """Draw the grid of spectra.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    one_scale
        Whether all panels have one scale of amplitude, or each texture its own.
    """
    rows = shown_spectra(spectra)
    title = "Figure 12. Vibration spectra, one window and the mean over windows"
    figure = new_figure(9.4, 5.4, title, source)
    grid = figure.subplots(
        len(rows), len(rows[0]), squeeze=False, sharex=True, sharey=True if one_scale else "row"
    )
    for cells, row in zip(grid, rows, strict=True):
        for axes, shown in zip(cells, row, strict=True):
            _draw(axes, spectra, shown)
        cells[0].set_ylabel(row[0].name, fontweight="bold", rotation=0, labelpad=10)
    grid[0, 0].set_xlim(0, min(HIGHEST_HZ, float(spectra[dims.FREQUENCY].max())))
    for cells, row in zip(grid, rows, strict=True):
        drawn = [one for each in rows for one in each] if one_scale else row
        cells[0].set_ylim(0, amplitude_top([x for one in drawn for x in _both(spectra, one)]))
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
        axes.xaxis.set_major_locator(MaxNLocator(4, prune="upper"))
    scale = "one scale for all" if one_scale else "each texture its own scale"
    figure.supylabel(f"{amplitude_label(spectra.attrs)}, {scale}", fontsize=8.5)
    grid[0, 0].legend(loc="upper right", fontsize=7.5)
    return figure


def single_window(spectra: Samples, shown: Shown) -> Samples:
    """Return the window in the middle of a condition, of its first channel: (frequency,)."""
    windows = in_condition(spectra, shown.texture, shown.speed_mm_s)
    middle = windows.isel({dims.SAMPLE: windows.sizes[dims.SAMPLE] // 2})
    return middle.isel({name: 0 for name in middle.dims if name != dims.FREQUENCY})


def _both(spectra: Samples, shown: Shown) -> tuple[Samples, xr.DataArray | None]:
    mean = condition_spectrum(spectra, shown.texture, shown.speed_mm_s)
    return single_window(spectra, shown), mean


def _draw(axes: Axes, spectra: Samples, shown: Shown) -> None:
    window, mean = _both(spectra, shown)
    assert mean is not None  # `shown_for` takes only what was recorded
    frequency = window[dims.FREQUENCY]
    axes.plot(frequency, window, color=INK, lw=0.5, label="one window", zorder=3)
    axes.plot(frequency, mean, color=ORANGE, lw=1.6, label="mean over windows")
    wanted = f" (for {shown.wanted})" if shown.wanted else ""
    axes.set_title(f"{speed_key(shown.speed_mm_s)} mm/s{wanted}")
