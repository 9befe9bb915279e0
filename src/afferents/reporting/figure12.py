"""Figure 12: spectra of several textures at several speeds, on the true frequency axis."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core import dims
from afferents.core.samples import Samples, textures_of
from afferents.reporting.choice import example_textures, speeds_of, spread
from afferents.reporting.labels import speed_key
from afferents.reporting.spectra import (
    HIGHEST_HZ,
    amplitude_label,
    amplitude_top,
    condition_spectrum,
)
from afferents.reporting.style import BLUE, GREY, new_figure, styled
from afferents.reporting.texture_names import texture_names

SPEEDS = (20.0, 40.0, 50.0, 80.0, 100.0)
"""What the paper's figure truly shows; its labels say 10, 30, 50, 70, 90."""
MOST_SPEEDS = 5


@styled
def figure12(spectra: Samples, source: str) -> Figure:
    """Draw a grid of mean spectra: a row for each texture, a column for each speed.

    Parameters
    ----------
    spectra
        Samples with the dims (sample, channel, frequency), `frequency` in Hz.
    source
        The line that says what the spectra were made from.
    """
    textures, speeds = example_textures(spectra), _speeds(spectra)
    names = texture_names(textures_of(spectra), spectra.attrs)
    figure = new_figure(
        1.85 * len(speeds) + 1, 1.25 * len(textures) + 0.9, "Figure 12. Vibration spectra", source
    )
    grid = figure.subplots(len(textures), len(speeds), squeeze=False, sharex=True, sharey="row")
    for texture, row in zip(textures, grid, strict=True):
        for speed, axes in zip(speeds, row, strict=True):
            _draw_condition(axes, spectra, texture, speed)
        top = amplitude_top([condition_spectrum(spectra, texture, speed) for speed in speeds])
        row[0].set_ylim(0, top)
        row[0].set_ylabel(names[texture], fontweight="bold", fontsize=8)
    for speed, axes in zip(speeds, grid[0], strict=True):
        axes.set_title(f"{speed_key(speed)} mm/s", fontweight="bold")
    highest = min(HIGHEST_HZ, float(spectra[dims.FREQUENCY].max()))
    grid[0, 0].set_xlim(0, highest)
    for axes in grid[-1]:
        axes.set_xlabel("frequency (Hz)")
    figure.supylabel(f"{amplitude_label(spectra.attrs)}, mean over windows", fontsize=8.5)
    return figure


def _draw_condition(axes: Axes, spectra: Samples, texture: str, speed: float) -> None:
    spectrum = condition_spectrum(spectra, texture, speed)
    if spectrum is None:
        axes.text(
            0.5,
            0.5,
            "not recorded",
            color=GREY,
            ha="center",
            va="center",
            transform=axes.transAxes,
        )
        return
    axes.fill_between(spectrum[dims.FREQUENCY], spectrum, color=BLUE, alpha=0.15, lw=0)
    axes.plot(spectrum[dims.FREQUENCY], spectrum, color=BLUE, lw=0.8)


def _speeds(spectra: Samples) -> list[float]:
    speeds = speeds_of(spectra)
    return list(SPEEDS) if set(SPEEDS) <= set(speeds) else spread(speeds, MOST_SPEEDS)
