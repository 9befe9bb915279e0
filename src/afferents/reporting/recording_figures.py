"""Figures of recordings: markers on a frame, responses over time, vibration, steadiness."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from afferents import dims
from afferents.encodings.spectra import amplitude_spectrum
from afferents.folds.held_out import key_of
from afferents.markers.detect import spacing_px
from afferents.reporting import labels, style
from afferents.store.recording import GreyImage, natural_order

MOST_CHANNELS = 16
RING_SHARE = 0.7
"""Diameter of the ring round a marker, as a share of the markers' spacing."""
LEAST_APART_INCH, MOST_LARGER = 0.16, 3.0
"""Markers are drawn at least this far apart, in pictures at most this many times as wide."""
PUBLISHED = {
    "sa1": {("a", 50.0): 0.98, ("g", 10.0): 0.86, ("g", 50.0): 0.60, ("g", 100.0): 0.67},
    "ra1": {("a", 50.0): 0.10, ("g", 10.0): 0.14, ("g", 50.0): 0.12, ("g", 100.0): 0.10},
}
"""Steadiness of the ten images of each row of the paper's Figures 8 and 10, 20 frames apart, as
digitised from the printed pictures: by channel, texture and speed (mm/s)."""
_CHANNELS = {"sa1": ("SA-I", style.BLUE), "ra1": ("RA-I", style.VERMILION)}
_MOST_NAMES = 26
_WIDTH = 0.6
"""Of the distance between textures, what their speeds are spread over."""


@style.styled
def markers_figure(
    image: GreyImage,
    position: NDArray[np.float64],
    detected: NDArray[np.bool_],
    source: str,
    trails: NDArray[np.float64] | None = None,
    title: str | None = None,
    suspects: NDArray[np.float64] | None = None,
    masks: Sequence[tuple[str, tuple[float, float, float]]] = (),
) -> Figure:
    """Draw the markers over a frame.

    Parameters
    ----------
    image
        Grey frame, shape (height, width).
    position
        Marker positions, shape (n, 2), px, x right and y down; NaN where lost.
    detected
        Shape (n,). A marker with a position but not detected is drawn as a cross.
    source
        The line that says what the picture was made from.
    trails
        Positions over time, shape (time, n, 2), px, drawn as lines.
    title
        None to say how many are detected.
    suspects
        What looks like a marker and is left out, shape (k, 2), px.
    masks
        Circles (x, y, radius), px, each with its key: ``keep`` or ``hide``.
    """
    height, width = image.shape
    seen = np.asarray(detected, dtype=bool)
    title = title or f"Markers: {int(seen.sum())} of {len(seen)} detected"
    # A big picture of small markers is drawn larger: rings stand apart, and dots show inside.
    apart_px = spacing_px(position[np.isfinite(position).all(axis=1)])
    wide_inch, scale = 7.0, 1.0
    if apart_px > 0:  # not of one marker, or none
        larger = LEAST_APART_INCH * width / (wide_inch * apart_px)
        wide_inch *= float(np.clip(larger, 1, MOST_LARGER))
        scale = RING_SHARE * 72 * wide_inch * apart_px / width / style.RING_POINTS
    figure = style.new_figure(wide_inch + 0.6, wide_inch * height / width + 1.0, title, source)
    axes = figure.subplots()
    style.draw_cells(axes, image, "gray", 0, 255)
    if trails is not None:
        axes.plot(trails[..., 0], trails[..., 1], color=style.ORANGE, lw=0.5, alpha=0.45)
        axes.plot([], [], color=style.ORANGE, lw=1.2, label="track")
    style.draw_markers(axes, position, seen, scale)
    if suspects is not None and len(suspects):
        x, y = suspects.T
        axes.scatter(x, y, s=34 * scale**2, marker="D", facecolors="none",
                     edgecolors=style.VERMILION, lw=1.2, label="suspect, left out")  # fmt: skip
    for key, (x, y, radius) in masks:
        colour = style.GREEN if key == "keep" else style.VERMILION
        label = None if key in axes.get_legend_handles_labels()[1] else key
        axes.add_patch(Circle((x, y), radius, fill=False, ec=colour, lw=1.2, label=label))
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.07), ncols=3, borderaxespad=0,
                markerscale=1 / scale)  # fmt: skip
    axes.set(xlabel="x (px) →", ylabel="← y (px)")
    axes.set(xlim=(-0.5, width - 0.5), ylim=(height - 0.5, -0.5))
    return figure


@style.styled
def responses_figure(sa1: xr.DataArray, ra1: xr.DataArray, source: str) -> Figure:
    """Draw SA-I and RA-I over time: mean with quantile bands, and every marker as a row.

    Parameters
    ----------
    sa1, ra1
        Dims (time, marker), with `units`, or in px and px a frame; NaN where a marker was lost.
    source
        The line that says what the picture was made from.
    """
    figure = style.new_figure(8.6, 7.4, "SA-I and RA-I over time (white: marker lost)", source)
    grid = figure.subplots(4, 1, sharex=True, height_ratios=(1, 1.5, 1, 1.5))
    for response, name, unit, colour, band, rows in (
        (sa1, "SA-I", dims.PIXELS, style.BLUE, grid[0], grid[1]),
        (ra1, "RA-I", dims.PIXELS_PER_FRAME, style.GREEN, grid[2], grid[3]),
    ):
        unit = response.attrs.get(dims.UNITS, unit)
        label = f"{name} ({unit})"
        style.draw_bands(band, response, label, colour)
        values = response.transpose(dims.MARKER, dims.TIME).values
        time, finite = response[dims.TIME].values, values[np.isfinite(values)]
        top = float(np.quantile(finite, 0.995)) if finite.size else 1.0
        extent = (time[0], time[-1], len(values) - 0.5, -0.5)
        image = style.draw_cells(
            rows, values, style.SEQUENTIAL, 0, top, aspect="auto", extent=extent
        )
        rows.set(ylabel="marker", facecolor="white")
        figure.colorbar(image, ax=rows, label=label, fraction=0.03, pad=0.01, extend="max")
    grid[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, borderaxespad=0)
    grid[3].set_xlabel("time (s)")
    return figure


@style.styled
def vibration_figure(segment: xr.DataArray, source: str) -> Figure:
    """Draw a segment of the vibration channels and its spectrum, 2|FFT|/N.

    Parameters
    ----------
    segment
        Dims (audio_time, channel), with `sample_rate_hz` and maybe `units` in the attributes.
        At most 16 channels are drawn.
    source
        The line that says what the picture was made from.
    """
    rate = float(segment.attrs[dims.SAMPLE_RATE])
    values = segment.transpose(dims.AUDIO_TIME, dims.CHANNEL).values[:, :MOST_CHANNELS]
    n = segment.sizes[dims.CHANNEL]
    channels = f"{n} channel{'' if n == 1 else 's'}"
    title = f"Vibration: {len(values) / rate:.2f} s at {rate:g} Hz, {channels}"
    figure = style.new_figure(8.6, 5.2, title, source)
    above, below = figure.subplots(2, 1)
    unit = f" ({segment.attrs[dims.UNITS]})" if segment.attrs.get(dims.UNITS) else ""
    style.draw_traces(above, values, rate, unit)
    if len(values) > 1:  # a single sample has no spectrum
        frequency = np.fft.rfftfreq(len(values), 1 / rate)[1:]
        amplitude = amplitude_spectrum((values - values.mean(axis=0)).T).T[1:]
        if n > 1:
            below.loglog(frequency, amplitude, color=style.GREY, lw=0.4, alpha=0.6)
        below.loglog(frequency, amplitude.mean(axis=1), color=style.INK, lw=0.7)
        below.set_xlim(frequency[0], frequency[-1])
        for axis in (below.xaxis, below.yaxis):  # the usual labels are formulas: the style has none
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
    below.set(xlabel="frequency (Hz)", ylabel=f"amplitude{unit}")
    return figure


def steadiness_sentence(rows: Sequence[Mapping[str, Any]], apart: int) -> str:
    """Return how steady the images of all recordings are, in a sentence with the numbers."""
    found = {title: [float(row[name]) for row in rows] for name, (title, _) in _CHANNELS.items()}
    both = " and ".join(
        f"{title} {np.mean(values):.2f} ({min(values):.2f} to {max(values):.2f})"
        for title, values in found.items()
    )
    n = len(rows)
    whose = "of the only recording" if n == 1 else f"mean (least to most) of {n} recordings"
    return (
        f"Likeness of a tactile image and the one {apart} frames later, as a correlation: {both}, "
        f"{whose}. 1 stays the same, 0 changes entirely."
    )


@style.styled
def steadiness_figure(rows: Sequence[Mapping[str, Any]], apart: int, source: str) -> Figure:
    """Draw the correlation of images some frames apart against texture, a mark a recording.

    Of a texture the slowest recording stands left, the fastest right.

    Parameters
    ----------
    rows
        From `inspection.stores.measure_steadiness`.
    apart
        Frames between the two images.
    source
        The line that says what was looked at.
    """
    textures = sorted({str(row["texture"]) for row in rows}, key=natural_order)
    by_spacing = bool(rows[0].get(dims.NAMED_BY_SPACING))
    known = [float(row["speed_mm_s"]) for row in rows if row["speed_mm_s"] is not None]
    slowest, fastest = min(known, default=0.0), max(known, default=0.0)

    def place(texture: int, speed: float | None) -> float:
        if speed is None or slowest == fastest:
            return float(texture)
        return texture + _WIDTH * ((speed - slowest) / (fastest - slowest) - 0.5)

    title = f"How like is a tactile image to the one {apart} frames later?"
    figure = style.new_figure(max(5.6, min(0.42 * len(textures) + 2.6, 11)), 3.9, title, source)
    axes = figure.subplots()
    ends = f", {key_of(slowest)} to {key_of(fastest)} mm/s" if slowest < fastest else ""
    at = [place(textures.index(str(row["texture"])), row["speed_mm_s"]) for row in rows]
    for name, (called, colour) in _CHANNELS.items():
        axes.plot(at, [row[name] for row in rows], ls="", marker="o", markersize=3, alpha=0.75,
                  color=colour, label=f"{called}{ends}")  # fmt: skip
    letters = [labels.texture_letter(texture, by_spacing) for texture in textures]
    printed = [
        (place(letters.index(letter), speed), value)
        for of_channel in PUBLISHED.values()
        for (letter, speed), value in of_channel.items()
        if letter in letters and known and slowest <= speed <= fastest
    ]
    if printed and None not in letters:
        axes.plot(*zip(*printed, strict=True), ls="", marker="x", markersize=5, mew=1.3,
                  color=style.INK, label="the paper's\nprinted images")  # fmt: skip
    style.name_places(axes, list(labels.texture_names(textures, by_spacing).values()), _MOST_NAMES)
    lowest = min(float(row[name]) for row in rows for name in _CHANNELS)
    axes.set(xlim=(-0.6, len(textures) - 0.4), ylim=(min(-0.05, lowest - 0.05), 1.03))
    axes.axhline(0, color=style.GREY, lw=0.7)
    axes.grid(axis="y", color=style.LINE, lw=0.4)
    within = "; of each, slow to the left, fast to the right" if ends else ""
    axes.set(xlabel=f"{labels.texture_axis(textures, by_spacing)}{within}",
             ylabel="correlation over markers")  # fmt: skip
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    return figure
