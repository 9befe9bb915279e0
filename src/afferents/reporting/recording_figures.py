"""Pictures of one recording: its markers, what the skin did, what was heard."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from afferents import dims
from afferents.files import write_aside
from afferents.outputs import MARK
from afferents.reporting.labels import About, speed_key, texture_axis, texture_letter, texture_names
from afferents.reporting.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LINE,
    ORANGE,
    SEQUENTIAL,
    VERMILION,
    frame_all,
    name_textures,
    new_figure,
    styled,
)
from afferents.store.recording import Frame, GreyImage, natural_order

QUANTILES = ((0.05, 0.95), (0.25, 0.75))
MOST_CHANNELS = 16


@styled
def markers_figure(
    image: GreyImage,
    position: NDArray[np.float64],
    detected: NDArray[np.bool_],
    source: str,
    trails: NDArray[np.float64] | None = None,
    title: str | None = None,
    suspects: NDArray[np.float64] | None = None,
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
    """
    height, width = image.shape
    seen = np.asarray(detected, dtype=bool)
    title = title or f"Markers: {int(seen.sum())} of {len(seen)} detected"
    figure = new_figure(7.6, 7.0 * height / width + 1.0, title, source)
    axes = figure.subplots()
    axes.imshow(image, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
    if trails is not None:
        axes.plot(trails[..., 0], trails[..., 1], color=ORANGE, lw=0.5, alpha=0.45)
        axes.plot([], [], color=ORANGE, lw=1.2, label="track")
    draw_markers(axes, position, seen)
    if suspects is not None and len(suspects):
        x, y = suspects.T
        axes.scatter(x, y, s=34, marker="D", facecolors="none", edgecolors=VERMILION, lw=1.2,
                     label="suspect, left out")  # fmt: skip
    axes.legend(loc="upper left", bbox_to_anchor=(0, -0.07), ncols=3, borderaxespad=0)
    axes.set(xlabel="x (px) →", ylabel="← y (px)", xlim=(-0.5, width - 0.5))
    axes.set_ylim(height - 0.5, -0.5)
    frame_all(axes)
    return figure


@styled
def responses_figure(sa1: xr.DataArray, ra1: xr.DataArray, source: str) -> Figure:
    """Draw SA-I and RA-I over time: mean with quantile bands, and every marker as a row.

    Parameters
    ----------
    sa1, ra1
        Dims (time, marker), px and px a frame; NaN where a marker was lost.
    source
        The line that says what the picture was made from.
    """
    figure = new_figure(8.6, 7.4, "SA-I and RA-I over time (white: marker lost)", source)
    grid = figure.subplots(4, 1, sharex=True, height_ratios=(1, 1.5, 1, 1.5))
    for response, name, unit, colour, band, rows in (
        (sa1, "SA-I", dims.PIXELS, BLUE, grid[0], grid[1]),
        (ra1, "RA-I", dims.PIXELS_PER_FRAME, GREEN, grid[2], grid[3]),
    ):
        draw_bands(band, response, f"{name} ({unit})", colour)
        _draw_heatmap(figure, rows, response, f"{name} ({unit})")
    grid[0].legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=3, borderaxespad=0)
    grid[3].set_xlabel("time (s)")
    return figure


@styled
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
    title = f"Vibration: {len(values) / rate:.2f} s at {rate:g} Hz, {_channels(segment)}"
    figure = new_figure(8.6, 5.2, title, source)
    above, below = figure.subplots(2, 1)
    unit = f" ({segment.attrs[dims.UNITS]})" if segment.attrs.get(dims.UNITS) else ""
    draw_traces(above, values, rate, unit)
    _draw_spectra(below, values, rate)
    below.set(xlabel="frequency (Hz)", ylabel=f"amplitude{unit}")
    return figure


def draw_markers(
    axes: Axes, position: NDArray[np.float64], seen: NDArray[np.bool_], scale: float = 1.0
) -> None:
    """Draw circles around the markers that were seen, and crosses where one is known but was not.

    Parameters
    ----------
    position, seen
        Shapes (n, 2), px, NaN where lost, and (n,).
    scale
        Of the circles and crosses; 1 is for axes of 7 inches.
    """
    axes.scatter(
        position[seen, 0],
        position[seen, 1],
        s=26 * scale**2,
        facecolors="none",
        edgecolors=BLUE,
        lw=1.2 * scale,
        label="detected",
    )
    lost = ~seen & np.isfinite(position).all(axis=1)
    if lost.any():
        axes.scatter(
            position[lost, 0],
            position[lost, 1],
            s=28 * scale**2,
            color=VERMILION,
            marker="x",
            label="not detected",
        )


def draw_bands(axes: Axes, response: xr.DataArray, label: str, colour: str) -> None:
    """Draw the mean over markers and the bands of `QUANTILES`, of a response (time, marker)."""
    time = response[dims.TIME].values
    alive = response.dropna(dims.TIME, how="all")
    if len(alive) == 0:  # a still, or nothing seen
        return
    for (low, high), alpha in zip(QUANTILES, (0.18, 0.32), strict=True):
        band = alive.quantile([low, high], dim=dims.MARKER)
        axes.fill_between(
            alive[dims.TIME].values,
            *band.values,
            color=colour,
            alpha=alpha,
            lw=0,
            label=f"{100 * low:.0f} to {100 * high:.0f} % of markers",
        )
    axes.plot(alive[dims.TIME], alive.mean(dims.MARKER), color=colour, label="mean")
    axes.set(ylabel=label, xlim=(time[0], time[-1]))
    if not (alive < 0).any():
        axes.set_ylim(bottom=0)


def _draw_heatmap(figure: Figure, axes: Axes, response: xr.DataArray, label: str) -> None:
    values = response.transpose(dims.MARKER, dims.TIME).values
    time = response[dims.TIME].values
    finite = values[np.isfinite(values)]
    axes.set_facecolor("white")
    image = axes.imshow(
        values,
        aspect="auto",
        cmap=SEQUENTIAL,
        interpolation="nearest",
        vmin=0,
        vmax=float(np.quantile(finite, 0.995)) if finite.size else 1.0,
        extent=(time[0], time[-1], len(values) - 0.5, -0.5),
    )
    axes.set_ylabel("marker")
    frame_all(axes)
    figure.colorbar(image, ax=axes, label=label, fraction=0.03, pad=0.01, extend="max")


def draw_traces(axes: Axes, values: NDArray[np.float32], rate: float, unit: str) -> None:
    """Draw every channel around its own mean, one above the other where there are several."""
    time = np.arange(len(values)) / rate
    centred = values - values.mean(axis=0)
    step = 0.7 * float(np.ptp(centred, axis=0).max()) if values.shape[1] > 1 else 0.0
    for index, trace in enumerate(centred.T):
        axes.plot(time, trace - index * step, color=BLUE, lw=0.6)
    axes.set(xlabel="time (s)", ylabel=f"signal{unit}", xlim=(time[0], time[-1]))
    if step:
        axes.set_ylabel(f"channel (apart by {step:.3g}{unit})")
        axes.set_yticks([-index * step for index in range(values.shape[1])], _numbers(values))


def _draw_spectra(axes: Axes, values: NDArray[np.float32], rate: float) -> None:
    frequency = np.fft.rfftfreq(len(values), 1 / rate)[1:]
    amplitude = 2 * np.abs(np.fft.rfft(values - values.mean(axis=0), axis=0))[1:] / len(values)
    if values.shape[1] > 1:
        axes.loglog(frequency, amplitude, color=GREY, lw=0.4, alpha=0.6)
    axes.loglog(frequency, amplitude.mean(axis=1), color=INK, lw=0.7)
    axes.set_xlim(frequency[0], frequency[-1])
    for axis in (axes.xaxis, axes.yaxis):  # the usual labels are formulas, which the style has not
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())


def _numbers(values: NDArray[np.float32]) -> list[str]:
    return [str(index + 1) for index in range(values.shape[1])]


def _channels(segment: xr.DataArray) -> str:
    n = segment.sizes[dims.CHANNEL]
    return "1 channel" if n == 1 else f"{n} channels"


# A video with its markers drawn in: names, trails, and the lost in red.

ENLARGED = 2
"""So that names can be read between markers 20 px apart."""
TRAIL_FRAMES = 20
_QUICK = {"crf": "20", "preset": "ultrafast"}
"""Of x264: encoding is most of the work, and the file is only to be looked at."""
_RED, _ORANGE, _WHITE, _BLACK = (40, 40, 255), (0, 159, 230), (255, 255, 255), (0, 0, 0)
"""Blue, green, red."""
_TICKS_HZ = 90_000
_COMMENT = f"{MARK}: a video with its markers drawn in"
_SUBPIXEL_BITS = 4

Colour = tuple[int, int, int]
Picture = NDArray[np.uint8]
"""Shape (height, width, 3), blue, green, red."""


def write_overlay(
    path: Path,
    frames: Iterable[Frame],
    position: NDArray[np.float64],
    detected: NDArray[np.bool_],
    fps_hz: float,
) -> Path:
    """Write an mp4 of the frames, twice as large, with their markers.

    Parameters
    ----------
    frames
        Of the video, from its first.
    position, detected
        As `markers.track` gives them, shapes (n_frames, n, 2), px, and (n_frames, n).

    Raises
    ------
    OSError
        If the file can't be written.
    """
    last = _last_seen(position)
    with (
        write_aside(path) as partial,
        av.open(f"file:{partial}", "w", format="mp4") as container,
    ):
        container.metadata["comment"] = _COMMENT
        stream = container.add_stream("libx264", rate=max(1, round(fps_hz)), options=_QUICK)
        stream.pix_fmt = "yuv420p"
        stream.time_base = stream.codec_context.time_base = Fraction(1, _TICKS_HZ)
        for index, frame in enumerate(frames):
            image = frame.in_colour() if frame.in_colour else frame.image
            picture = draw_overlay(image, last, detected, index)
            if index == 0:
                stream.height, stream.width = picture.shape[:2]
            drawn = av.VideoFrame.from_ndarray(picture, format="bgr24")
            drawn.pts = round(frame.time_s * _TICKS_HZ)
            drawn.time_base = Fraction(1, _TICKS_HZ)
            container.mux(stream.encode(drawn))
        container.mux(stream.encode(None))
    return path


def is_overlay(path: Path) -> bool:
    """Tell whether a file is a video that `write_overlay` wrote."""
    try:
        with av.open(f"file:{path}") as container:
            return container.metadata.get("comment") == _COMMENT
    except (av.FFmpegError, OSError):
        return False


def draw_overlay(
    image: GreyImage, position: NDArray[np.float64], detected: NDArray[np.bool_], index: int
) -> Picture:
    """Draw the markers of frame `index`, with the way that they came.

    Parameters
    ----------
    image
        Grey, shape (height, width), or in colour, (height, width, 3), blue, green, red.
    position
        Where each marker was last seen, shape (n_frames, n, 2), px.
    """
    large = cv2.resize(image, None, fx=ENLARGED, fy=ENLARGED, interpolation=cv2.INTER_LINEAR)
    large = large[: large.shape[0] // 2 * 2]
    if large.ndim == 2:  # grey
        large = cv2.cvtColor(large, cv2.COLOR_GRAY2BGR)
    picture: Picture = np.ascontiguousarray(large, np.uint8)
    shown = np.flatnonzero(~np.isnan(position[index, :, 0]))
    way = position[max(0, index - TRAIL_FRAMES) : index + 1]
    points = _points(way)
    trails = [points[~np.isnan(way[:, n, 0]), n] for n in shown]
    cv2.polylines(picture, trails, False, _ORANGE, 1, cv2.LINE_8, _SUBPIXEL_BITS)
    for n in shown:
        seen = bool(detected[index, n])
        where = (int(points[-1, n, 0]), int(points[-1, n, 1]))
        radius = 5 << _SUBPIXEL_BITS
        colour = _colour(n) if seen else _RED
        cv2.circle(picture, where, radius, colour, 1 if seen else 2, cv2.LINE_8, _SUBPIXEL_BITS)
        place = ((where[0] >> _SUBPIXEL_BITS) + 6, (where[1] >> _SUBPIXEL_BITS) - 5)
        _write(picture, f"{n}", place, 0.3, colour)
    said = f"{int(detected[index].sum())} of {detected.shape[1]}, frame {index}"
    _write(picture, said, (8, 20), 0.55, _WHITE)
    return picture


def _write(
    picture: Picture, text: str, place: tuple[int, int], size: float, colour: Colour
) -> None:
    """Write on a dark rim, which makes it legible on whatever lies behind."""
    for ink, width in ((_BLACK, 3), (colour, 1)):
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SIMPLEX, size, ink, width, cv2.LINE_8)


def _last_seen(position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return where every marker was last seen at every frame, NaN before the first time."""
    seen = ~np.isnan(position[..., 0])
    latest = np.maximum.accumulate(np.where(seen, np.arange(len(position))[:, None], 0), axis=0)
    return np.asarray(np.take_along_axis(position, latest[..., None], axis=0))


def _points(position: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return positions in the enlarged picture, in sixteenths of its pixels."""
    enlarged = (position + 0.5) * ENLARGED - 0.5
    return np.asarray(np.nan_to_num(np.rint(enlarged * (1 << _SUBPIXEL_BITS))), np.int32)


@lru_cache(maxsize=4096)
def _colour(n: int) -> Colour:
    """Return a colour for a marker, far from its neighbours' and from red."""
    hue = 25 + (n * 47) % 130
    pixel = cv2.cvtColor(np.array([[[hue, 160, 255]]], np.uint8), cv2.COLOR_HSV2BGR)[0, 0]
    return int(pixel[0]), int(pixel[1]), int(pixel[2])


# How steady SA-I and RA-I images are, by texture and speed; the paper's own beside them.

PUBLISHED = {
    "sa1": {("a", 50.0): 0.98, ("g", 10.0): 0.86, ("g", 50.0): 0.60, ("g", 100.0): 0.67},
    "ra1": {("a", 50.0): 0.10, ("g", 10.0): 0.14, ("g", 50.0): 0.12, ("g", 100.0): 0.10},
}
"""The same of the ten images of each row of the paper's Figures 8 and 10, 20 frames apart, as
digitised from the printed pictures: by channel, texture and speed (mm/s)."""
_COLOURS = {"sa1": BLUE, "ra1": VERMILION}
_TITLES = {"sa1": "SA-I", "ra1": "RA-I"}
MOST_NAMES = 26
_WIDTH = 0.6
"""Of the distance between textures, what their speeds are spread over."""


def steadiness_sentence(rows: Sequence[Mapping[str, Any]], apart: int) -> str:
    """Return what the recordings say of it, in a sentence with the numbers."""
    said = {name: [float(row[name]) for row in rows] for name in _TITLES}
    both = " and ".join(
        f"{_TITLES[name]} {np.mean(values):.2f} ({min(values):.2f} to {max(values):.2f})"
        for name, values in said.items()
    )
    n = len(rows)
    whose = "of the only recording" if n == 1 else f"mean (least to most) of {n} recordings"
    return (
        f"Likeness of a tactile image and the one {apart} frames later, as a correlation: {both}, "
        f"{whose}. 1 stays the same, 0 changes entirely."
    )


@styled
def steadiness_figure(rows: Sequence[Mapping[str, Any]], apart: int, source: str) -> Figure:
    """Draw the correlation of images some frames apart against texture, a mark a recording.

    Parameters
    ----------
    rows
        From `inspection.inspect.steadiness_of`.
    apart
        Frames between the two images.
    source
        The line that says what was looked at.
    """
    textures = sorted({str(row["texture"]) for row in rows}, key=natural_order)
    title = f"How like is a tactile image to the one {apart} frames later?"
    figure = new_figure(max(5.6, min(0.42 * len(textures) + 2.6, 11)), 3.9, title, source)
    axes = figure.subplots()
    speeds = sorted({float(row["speed_mm_s"]) for row in rows if row["speed_mm_s"] is not None})
    place, about = _Places(textures, speeds), rows[0]
    for name in _TITLES:
        _draw(axes, rows, place, name)
    _draw_published(axes, place, about)
    name_textures(axes, texture_names(textures, about).values(), MOST_NAMES)
    axes.set_xlim(-0.6, len(textures) - 0.4)
    axes.set_ylim(min(-0.05, *(float(row[name]) - 0.05 for row in rows for name in _TITLES)), 1.03)
    axes.axhline(0, color=GREY, lw=0.7)
    axes.grid(axis="y", color=LINE, lw=0.4)
    within = "; of each, slow to the left, fast to the right" if len(speeds) > 1 else ""
    axes.set(xlabel=f"{texture_axis(textures, about)}{within}", ylabel="correlation over markers")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    return figure


def _draw(axes: Axes, rows: Sequence[Mapping[str, Any]], place: "_Places", name: str) -> None:
    speeds = place.speeds
    ends = f", {speed_key(speeds[0])} to {speed_key(speeds[-1])} mm/s" if len(speeds) > 1 else ""
    at = [place.of(place.textures.index(str(row["texture"])), row["speed_mm_s"]) for row in rows]
    axes.plot(
        at, [row[name] for row in rows], ls="", marker="o", markersize=3, alpha=0.75,
        color=_COLOURS[name], label=f"{_TITLES[name]}{ends}",
    )  # fmt: skip


def _draw_published(axes: Axes, place: "_Places", about: About) -> None:
    letters = [texture_letter(texture, about) for texture in place.textures]
    shown = [
        (place.of(letters.index(letter), speed), value)
        for of_channel in PUBLISHED.values()
        for (letter, speed), value in of_channel.items()
        if letter in letters and speed in place
    ]
    if shown and None not in letters:
        axes.plot(
            *zip(*shown, strict=True), ls="", marker="x", markersize=5, mew=1.3, color=INK,
            label="the paper's\nprinted images",
        )  # fmt: skip


@dataclass(frozen=True)
class _Places:
    """Where marks stand: by texture, and of a texture the slowest left, the fastest right."""

    textures: list[str]
    speeds: list[float]

    def __contains__(self, speed: object) -> bool:
        """Tell whether a speed (mm/s) lies among those shown."""
        return (
            isinstance(speed, float)
            and bool(self.speeds)
            and (self.speeds[0] <= speed <= self.speeds[-1])
        )

    def of(self, texture: int, speed: float | None) -> float:
        """Return the place of a speed (mm/s) of a texture; the middle where it is not known."""
        low, high = (self.speeds[0], self.speeds[-1]) if self.speeds else (0.0, 0.0)
        if speed is None or low == high:
            return float(texture)
        return texture + _WIDTH * ((speed - low) / (high - low) - 0.5)
