"""How steady SA-I and RA-I images are, by texture and speed; the paper's own beside them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.core.recording import natural_order
from afferents.reporting.labels import speed_key
from afferents.reporting.style import (
    BLUE,
    GREY,
    INK,
    LINE,
    VERMILION,
    name_textures,
    new_figure,
    styled,
)
from afferents.reporting.texture_names import About, texture_axis, texture_letter, texture_names

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
        From `evaluation.steadiness_of`.
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
