"""Weaves, cords and abrasive papers as maps of heights, by a rule that is stated here.

    python studies/natural_surfaces.py FOLDER [SEED]

Writes FOLDER/NAME.npy, heights in mm, 0.05 mm apart, once round the paper's drum and across it,
for ``afferents simulate --height-map NAME=FOLDER/NAME.npy,251.3,1``, and FOLDER/surfaces.png.

Plain weaves: two families of round yarns go over and under each other in half sine waves. Their
diameter follows from their linear density: a cotton yarn of N hanks of 840 yards a pound is
1 / (28 sqrt N) inch thick, 0.0374 mm times the root of its tex (Peirce 1937, Journal of the Textile
Institute 28, T45). How many yarns lie in a centimetre is that of the usual cloth of the name.
Cords: ridges across the slide, as many an inch as corduroy is sold with (5 to 16 wales), half of a
ridge's width high at most 0.5 mm (chosen: no source).
Abrasive papers: grains of the mean diameter of their grit (ISO 6344-2: P40 425 um, P80 201 um,
P120 125 um), as smoothed noise whose standard deviation is a quarter of the diameter (chosen).
A yarn's or a ridge's place and thickness vary along and between them by 8% (chosen; spinners count
a coefficient of variation of 10 to 20% of a short piece's mass, half of that of its diameter).
"""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

Heights = NDArray[np.float32]
"""Shape (along, across), mm."""

STEP_MM, AROUND_MM, ACROSS_MM = 0.05, 251.3, 36.0
SHAPE = round(AROUND_MM / STEP_MM), round(ACROSS_MM / STEP_MM)
IRREGULAR = 0.08
DRIFT_MM = 2.0
"""Along a yarn its thickness changes over about so long."""

WEAVES = {
    "poplin": (40, 20.0),
    "shirting": (28, 37.0),
    "duck": (11, 200.0),
    "hessian": (5, 330.0),
}
"""Yarns a centimetre, and their linear density, tex."""
CORDS = {"needlecord": 16, "corduroy": 11, "wide-cord": 8, "elephant-cord": 5}
"""Wales an inch."""
PAPERS = {"P40": 0.425, "P80": 0.201, "P120": 0.125}
"""Mean diameter of a grain, mm."""


def weave(yarns_a_cm: float, tex: float, rng: np.random.Generator) -> Heights:
    """Return a plain weave."""
    diameter, pitch = 0.0374 * np.sqrt(tex), 10 / yarns_a_cm
    counts = [2 * round(length / pitch / 2) for length in (AROUND_MM, ACROSS_MM)]
    (u, i), (v, j) = (_nearest(size, n, rng) for size, n in zip(SHAPE, counts, strict=True))
    thick = 1 + IRREGULAR * _drift(rng)
    height = np.zeros(SHAPE, np.float32)
    swing = diameter / 2
    for off, across, parity in (
        (u[:, None] * pitch, j[None] + v[None], i[:, None]),  # yarns across the slide
        (v[None] * pitch, i[:, None] + u[:, None] + 1, j[None]),  # yarns along it
    ):
        radius = diameter / 2 * thick
        cap = np.sqrt(np.maximum(0, radius**2 - off**2))
        middle = swing * np.cos(np.pi * (across + parity))
        height = np.maximum(height, np.where(cap > 0, middle + cap, 0))
    return height.astype(np.float32)


def cords(wales_an_inch: float, rng: np.random.Generator) -> Heights:
    """Return ridges across the slide, as of corduroy."""
    pitch = 25.4 / wales_an_inch
    along, _ = _nearest(SHAPE[0], round(AROUND_MM / pitch), rng)
    ridge = np.cos(np.pi * along)[:, None] * (1 + IRREGULAR * _drift(rng))
    return np.asarray(min(0.5, pitch / 4) * np.maximum(ridge, 0), np.float32)


def paper(grain_mm: float, rng: np.random.Generator) -> Heights:
    """Return grains, as of abrasive paper."""
    noise = rng.standard_normal(SHAPE, np.float32)
    smooth = gaussian_filter(noise, grain_mm / 3 / STEP_MM, mode="wrap")
    return np.asarray(np.maximum(0, grain_mm / 4 * smooth / smooth.std()), np.float32)


def _nearest(
    size: int, count: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return how far each sample is from the nearest of `count` yarns, in pitches, and which."""
    places = np.arange(count) + IRREGULAR * rng.standard_normal(count)
    places = np.sort(places) * size / count
    ring = np.concatenate([places[-1:] - size, places, places[:1] + size])
    middles = (ring[1:] + ring[:-1]) / 2
    which = np.searchsorted(middles, np.arange(size), side="right")
    off = (np.arange(size) - ring[which]) / (size / count)
    return off, (which - 1) % count


def _drift(rng: np.random.Generator) -> Heights:
    """Return smooth noise of standard deviation 1."""
    coarse = rng.standard_normal((SHAPE[0] // 10, SHAPE[1] // 10), np.float32)
    smooth = gaussian_filter(coarse, DRIFT_MM / (10 * STEP_MM), mode="wrap")
    fine = cv2.resize(smooth / smooth.std(), SHAPE[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(fine, np.float32)


def surfaces(seed: int) -> dict[str, Heights]:
    """Return all surfaces by name."""
    made: list[tuple[str, Callable[[np.random.Generator], Heights]]] = [
        *((name, partial(weave, *of)) for name, of in WEAVES.items()),
        *((name, partial(cords, of)) for name, of in CORDS.items()),
        *((name, partial(paper, of)) for name, of in PAPERS.items()),
    ]
    return {name: make(np.random.default_rng([seed, n])) for n, (name, make) in enumerate(made)}


def main(folder: Path, seed: int) -> None:
    """Write the maps and their picture."""
    folder.mkdir(parents=True, exist_ok=True)
    found = surfaces(seed)
    figure, axes = plt.subplots(2, 6, figsize=(11, 4.4), layout="constrained")
    for ax in axes.flat:
        ax.set_axis_off()
    for ax, (name, height) in zip(axes.flat, found.items(), strict=False):
        np.save(folder / f"{name}.npy", height)
        ax.imshow(height[:200, :200], cmap="gray", extent=(0, 10, 10, 0))
        ax.set_title(f"{name}, {height.max():.2f} mm", fontsize=8)
    figure.suptitle(
        "1 cm square of each; slid over from top to bottom; highest point, mm", fontsize=9
    )
    figure.savefig(folder / "surfaces.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0)
