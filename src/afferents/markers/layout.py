"""The layout that markers form, and which marker of a known layout each one is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from afferents.choices import Layout
from afferents.errors import InputError, then
from afferents.markers.detect import NO_BLOB, Positions, link_one_to_one, spacing_px
from afferents.markers.grid import MOST_MISSING, Grid, find_grid, turn

ORDERED = 0.6
"""How well directions or radii must agree for a lattice or rings to be seen, from 0 to 1."""
_ANGLE_STEP_DEG = 2.0
_ICP_ROUNDS = 8
_TRIED = 10
"""Turns that fit best at first, each of which is then fitted closely."""
_GOOD, _ASIDE = 0.8, 2.0
"""With a fit below this the layout is also looked for this many spacings from the middle."""
GATE_SHARE = 0.4
"""A marker is one of the layout's if it lies within this share of the spacing of its place."""
_ANOTHER = 0.12
"""Of another layout, markers lie off their places by more than this share of their spacing, in the
median: at least 0.14 measured, at most 0.05 of a layout's own (fish-eye lens, other clips)."""
_ANOTHER_FOLLOWED = 0.1
"""The same once each marker is looked for where those around it went: 0.12 and 0.08 measured."""
IN_LINE = 0.05
"""Markers whose spread across is below this share of that along stand in one line: no lattice."""
ON_RAYS = 0.3
"""How well nearest markers must lie along, or all across, the rays from the middle."""
_AROUND = 13
"""In skin that shear has drawn out of shape a marker is expected where the mean of this many,
itself among them, went."""
_SHEAR_ROUNDS = 10
_ADJOINING = 6
"""The layout is also tried on the places of this many neighbours of its middle marker."""


@dataclass(frozen=True)
class FoundLayout:
    """What markers form.

    Attributes
    ----------
    layout
        What it is called.
    grid
        Rows and columns of a square grid; None for the others.
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
    """Recognise a square grid, a hexagonal lattice, rings or rays; anything else is free.

    Parameters
    ----------
    position
        Shape (n, 2), px, in any order.
    """
    spacing = spacing_px(position)
    grid = find_grid(position)
    if grid is not None:
        return FoundLayout("square", grid, grid.roll_deg, spacing)
    length, width = np.linalg.svd(position - position.mean(axis=0), compute_uv=False)
    if width < IN_LINE * length:
        return FoundLayout("free", None, float("nan"), spacing)
    # How well the directions to the nearest six agree modulo 60 degrees, 0 to 1: those of a
    # hexagonal lattice lie 60 degrees apart, those of rings anywhere.
    distance, index = cKDTree(position).query(position, k=min(7, len(position)))
    near = distance[:, 1:] < 1.4 * distance[:, 1:2]
    step = (position[index[:, 1:]] - position[:, None])[near]
    total = np.exp(6j * np.arctan2(step[:, 1], step[:, 0])).mean()
    if abs(total) > ORDERED:
        return FoundLayout("hexagonal", None, float(np.degrees(np.angle(total)) / 6), spacing)
    # How well the distances from the middle are multiples of one distance, 0 to 1.
    ray = position - np.median(position, axis=0)
    steps = np.linspace(0.6, 1.6, 101) * spacing
    turns = 2j * np.pi * np.hypot(*ray.T)[:, None] / steps
    rings = float(np.abs(np.exp(turns).mean(axis=0)).max())
    # How alike the nearest two lie to the ray from the middle, 0 to 1: along all rays, or across
    # them all as in rings. Where a lens draws rings in, this remains.
    _, index = cKDTree(position).query(position, k=min(3, len(position)))
    step = position[index[:, 1:]] - position[:, None]
    angle = np.arctan2(step[..., 1], step[..., 0]) - np.arctan2(ray[:, 1], ray[:, 0])[:, None]
    rays = float(abs(np.exp(2j * angle).mean()))
    if rings > ORDERED or rays > ON_RAYS:
        return FoundLayout("radial", None, float("nan"), spacing)
    return FoundLayout("free", None, float("nan"), spacing)


def match_layout(
    found: Positions,
    template: Positions,
    where: object,
    faint: Positions | None = None,
    needed: float = 1 - MOST_MISSING,
) -> tuple[Positions, NDArray[np.bool_]]:
    """Give each marker of a known layout its own blob, wherever the picture is shifted or rolled.

    The template is turned, shifted and scaled until it fits best; of turns that fit alike the
    smallest is taken, since a symmetric layout fits at several. Where that fits badly, skin may be
    out of shape, and each marker is looked for where those around it went (`follow_shear`).

    Parameters
    ----------
    found
        Blobs, shape (m, 2), px, in any order.
    template
        The layout's markers, shape (n, 2), px.
    faint
        Fainter blobs, shape (k, 2), px, which are taken where the layout expects a marker and
        nothing better is near; None for none.
    needed
        Share of the markers that must be there.

    Returns
    -------
    tuple
        Positions in the template's order, (n, 2), with the place where it should be for a
        marker that is missing; and which are there, (n,).

    Raises
    ------
    InputError
        If more are missing, by default more than a fifth; or if the layout is another one.
    """
    gate = GATE_SHARE * spacing_px(template)
    tree, most_off = cKDTree(found), _ANOTHER
    placed = _place(template, found, tree, gate, [(0.0, 0.0)])
    if _fit(placed, tree, gate) < _GOOD:  # false blobs on one side shift the middle
        aside = np.arange(-_ASIDE, _ASIDE + 0.1, 0.5) * spacing_px(template)
        wider = _place(template, found, tree, gate, [(x, y) for x in aside for y in aside])
        placed = max(placed, wider, key=lambda place: _fit(place, tree, gate))
        if _fit(placed, tree, gate) < _GOOD:
            placed, most_off = follow_shear(placed, found, gate), _ANOTHER_FOLLOWED
    own, blob = _assign(placed, found, gate)
    off = np.hypot(*(placed[own] - found[blob]).T) / spacing_px(template)
    if needed and len(own) >= needed * len(template) and np.median(off) > most_off:
        do = (
            "a run must begin with the skin at rest; if it does, give the sensor file of this "
            "sensor, or calibrate it"
        )
        expected = "markers where the sensor's layout has them"
        raise InputError(
            f"{where}: expected {expected}, found {len(found)} in another layout{then(do)}"
        )
    present = np.zeros(len(template), dtype=bool)
    present[own] = True
    placed[own] = found[blob]
    if faint is not None and len(faint):
        lost = np.flatnonzero(~present)
        free = faint[cKDTree(placed[present]).query(faint)[0] > gate] if present.any() else faint
        at, its = _assign(placed[lost], free, gate / 2)
        placed[lost[at]], present[lost[at]] = free[its], True
    if present.mean() < needed:
        raise InputError(
            f"{where}: expected the {len(template)} markers of the sensor's layout, found "
            f"{int(present.sum())} of them; a run must begin with the skin at rest: check its "
            "first picture, name a later frame at rest as rest_frame in session.toml, or "
            "calibrate this sensor"
        )
    return placed, present


def _assign(
    placed: Positions, found: Positions, gate: float
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return which places have a blob of their own within the gate, and which blob."""
    cost = cdist(placed, found)
    own, blob = linear_sum_assignment(np.minimum(cost, gate))
    good = cost[own, blob] < gate
    return own[good], blob[good]


def _fit_closely(
    template: Positions, placed: Positions, found: Positions, tree: cKDTree, gate: float
) -> Positions:
    """Return the template where it fits best near where it is placed (iterative closest point)."""
    for _ in range(_ICP_ROUNDS):
        distance, nearest = tree.query(placed)
        close = distance < gate
        if close.sum() < 3:
            break
        placed = carry_over(template, template[close], found[nearest[close]])
    return placed


def _place(
    template: Positions,
    found: Positions,
    tree: cKDTree,
    gate: float,
    aside: Sequence[tuple[float, float]],
) -> Positions:
    """Return the template where it fits best: as filed, or turned and shifted from the middle.

    As filed first: false and missing blobs move the middle, and the camera is mostly where it was.
    """
    centred, middle = template - template.mean(axis=0), found.mean(axis=0)
    tried = []
    for angle in np.arange(-180.0, 180.0, _ANGLE_STEP_DEG):
        turned = turn(centred, angle) + middle
        tried += [(turned + np.array(shift), angle) for shift in aside]
    as_filed = (_fit_closely(template, template, found, tree, gate), 0.0)

    def how_well(turned: tuple[Positions, float]) -> float:
        return _fit(turned[0], tree, gate) - 1e-4 * abs(turned[1])

    rough = sorted(tried, key=how_well)[-_TRIED:]
    close = [(_fit_closely(template, place, found, tree, gate), angle) for place, angle in rough]
    return max([as_filed, *close], key=how_well)[0]


def _fit(placed: Positions, tree: cKDTree, gate: float) -> float:
    """Return the share of places with a blob near, the nearer the better."""
    distance = tree.query(placed)[0]
    return float(np.exp(-((distance / gate) ** 2)).mean())


def carry_over(points: Positions, source: Positions, target: Positions) -> Positions:
    """Return points under the best shift, turn and scale from source to target.

    Parameters
    ----------
    points
        Shape (m, 2), px.
    source, target
        The same markers in two pictures, or where a layout has them and where they are, shape
        (n, 2), px.
    """
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    as_complex = np.vdot(a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1]) / (a**2).sum()
    centred = points - source.mean(axis=0)
    moved = (centred[:, 0] + 1j * centred[:, 1]) * as_complex
    placed: Positions = np.stack([moved.real, moved.imag], axis=1) + target.mean(axis=0)
    return placed


def follow_shear(placed: Positions, blobs: Positions, gate_px: float) -> Positions:
    """Move a layout's places to where shear has carried them: each to where its neighbours went.

    One turn, shift and scale places a layout whose skin is at rest. Skin that a drum has held back
    is stretched here and squeezed there, by as much as the distance between markers where these are
    close; but it is so alike from one marker to the next that each is found by what those around it
    did.

    A lattice fits nearly as well one step aside, all but its edge, so it is tried there too, as
    long as more blobs get a place by it.

    Parameters
    ----------
    placed
        The layout under its best turn, shift and scale, shape (n, 2), px.
    blobs
        Shape (m, 2), px.
    gate_px
        A blob farther than this from where a marker is expected is not this marker.

    Returns
    -------
    Positions
        Where the markers are expected, shape (n, 2), px.
    """
    around = cKDTree(placed).query(placed, k=min(_AROUND, len(placed)))[1]
    middle = int(((placed - placed.mean(axis=0)) ** 2).sum(axis=1).argmin())
    adjoining = cKDTree(placed).query(placed[middle], k=min(1 + _ADJOINING, len(placed)))[1][1:]
    aside = np.zeros(2)
    worth, expected = _link_by_turns(placed, blobs, gate_px, around)
    while True:
        tried = [
            (*_link_by_turns(placed + aside + step, blobs, gate_px, around), aside + step)
            for step in placed[adjoining] - placed[middle]
        ]
        best = max(tried, key=lambda one: one[0])
        if best[0] <= worth:
            return expected
        worth, expected, aside = best


def _link_by_turns(
    placed: Positions, blobs: Positions, gate_px: float, around: NDArray[np.intp]
) -> tuple[tuple[int, float], Positions]:
    """Link blobs and move each place by the mean of what those `around` it moved, by turns.

    Returns
    -------
    How well the layout fits, to compare (blobs with a place, then how near these lie, in the
    median), and where the markers are expected, (n, 2), px.
    """
    expected = placed
    for _ in range(_SHEAR_ROUNDS):
        blob = link_one_to_one(expected, blobs, gate_px)
        linked = (blob != NO_BLOB)[:, None]
        moved = np.where(linked, blobs[blob] - placed, 0.0)
        n_linked = np.maximum(linked[around].sum(axis=1), 1)
        expected = placed + moved[around].sum(axis=1) / n_linked
    blob = link_one_to_one(expected, blobs, gate_px)
    own = blob != NO_BLOB
    off = np.hypot(*(expected[own] - blobs[blob[own]]).T)
    return (int(own.sum()), -float(np.median(off)) if own.any() else -np.inf), expected
