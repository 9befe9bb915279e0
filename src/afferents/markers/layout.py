"""The layout that markers form, and which marker of a known layout each one is."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from afferents.core.errors import InputError
from afferents.markers.detect import Positions, spacing_px
from afferents.markers.grid import Grid, find_grid, turn

Layout = Literal["square", "hexagonal", "radial", "free"]

ORDERED = 0.6
"""How well directions or radii must agree for a lattice or rings to be seen, from 0 to 1."""
_ANGLE_STEP_DEG = 2.0
_ICP_ROUNDS = 8
GATE_SHARE = 0.4
"""A marker is one of the layout's if it lies within this share of the spacing of its place."""
MOST_MISSING = 0.2
"""With more of a layout missing than this, it is another sensor or a picture gone wrong."""


@dataclass(frozen=True)
class FoundLayout:
    """What markers form.

    Attributes
    ----------
    layout
        What it is called.
    grid
        Rows and columns of a whole square grid; None for the others.
    roll_deg
        From the image's x axis to the lattice's nearest axis; NaN where there is none.
    spacing_px
        Median distance of neighbours.
    """

    layout: Layout
    grid: Grid | None
    roll_deg: float
    spacing_px: float


def find_layout(position: Positions) -> FoundLayout:
    """Recognise a square grid, a hexagonal lattice or rings; anything else is free.

    Parameters
    ----------
    position
        Shape (n, 2), px, in any order.
    """
    spacing = spacing_px(position)
    grid = find_grid(position)
    if grid is not None:
        return FoundLayout("square", grid, grid.roll_deg, spacing)
    order, roll = _hexagonal_order(position)
    if order > ORDERED:
        return FoundLayout("hexagonal", None, roll, spacing)
    if _ring_order(position, spacing) > ORDERED:
        return FoundLayout("radial", None, float("nan"), spacing)
    return FoundLayout("free", None, float("nan"), spacing)


def _hexagonal_order(position: Positions) -> tuple[float, float]:
    """Return how well the directions to the nearest six agree modulo 60 degrees, and the roll.

    The nearest six of a hexagonal lattice lie 60 degrees apart, those of rings anywhere.
    """
    distance, index = cKDTree(position).query(position, k=min(7, len(position)))
    near = distance[:, 1:] < 1.4 * distance[:, 1:2]
    step = (position[index[:, 1:]] - position[:, None])[near]
    total = np.exp(6j * np.arctan2(step[:, 1], step[:, 0])).mean()
    return float(abs(total)), float(np.degrees(np.angle(total)) / 6)


def _ring_order(position: Positions, spacing: float) -> float:
    """Return how well the distances from the middle are multiples of one distance, 0 to 1."""
    radius = np.hypot(*(position - np.median(position, axis=0)).T)
    steps = np.linspace(0.6, 1.6, 101) * spacing
    return float(np.abs(np.exp(2j * np.pi * radius[:, None] / steps).mean(axis=0)).max())


def match_layout(
    found: Positions, template: Positions, where: object
) -> tuple[Positions, NDArray[np.bool_]]:
    """Give each marker of a known layout its own blob, wherever the picture is shifted or rolled.

    The template is turned, shifted and scaled until it fits best; of turns that fit alike the
    smallest is taken, since a symmetric layout fits at several.

    Parameters
    ----------
    found
        Blobs, shape (m, 2), px, in any order.
    template
        The layout's markers, shape (n, 2), px.

    Returns
    -------
    tuple
        Positions in the template's order, (n, 2), with the place where it should be for a
        marker that is missing; and which are there, (n,).

    Raises
    ------
    InputError
        If more than a fifth of the markers are missing.
    """
    gate = GATE_SHARE * spacing_px(template)
    tree = cKDTree(found)
    placed = max(
        (_turned(template, angle, found) for angle in _angles()),
        key=lambda turned: _fit(turned[0], tree, gate) - 1e-4 * abs(turned[1]),
    )[0]
    for _ in range(_ICP_ROUNDS):
        distance, nearest = tree.query(placed)
        close = distance < gate
        if close.sum() < 3:
            break
        placed = _similar(template, template[close], found[nearest[close]])
    cost = cdist(placed, found)
    own, blob = linear_sum_assignment(np.minimum(cost, gate))
    good = cost[own, blob] < gate
    present = np.zeros(len(template), dtype=bool)
    present[own[good]] = True
    if present.mean() < 1 - MOST_MISSING:
        raise InputError(
            where,
            f"the {len(template)} markers of the sensor's layout",
            f"{int(present.sum())} of them",
            "check the picture, or calibrate this sensor",
        )
    placed[own[good]] = found[blob[good]]
    return placed, present


def _angles() -> NDArray[np.float64]:
    return np.arange(-180.0, 180.0, _ANGLE_STEP_DEG)


def _turned(template: Positions, angle_deg: float, found: Positions) -> tuple[Positions, float]:
    turned = turn(template - template.mean(axis=0), angle_deg)
    return turned + found.mean(axis=0), angle_deg


def _fit(placed: Positions, tree: cKDTree, gate: float) -> float:
    """Return the share of places with a blob near, the nearer the better."""
    distance = tree.query(placed)[0]
    return float(np.exp(-((distance / gate) ** 2)).mean())


def _similar(template: Positions, source: Positions, target: Positions) -> Positions:
    """Return the template under the best shift, turn and scale from source to target."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    as_complex = np.vdot(a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1]) / (a**2).sum()
    centred = template - source.mean(axis=0)
    moved = (centred[:, 0] + 1j * centred[:, 1]) * as_complex
    placed: Positions = np.stack([moved.real, moved.imag], axis=1) + target.mean(axis=0)
    return placed
