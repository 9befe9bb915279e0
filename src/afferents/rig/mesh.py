"""Any layout of pins as a mesh: which are neighbours, and how strongly each acts on the other.

The square lattice's equations (see `skin`) are those of a sheet, with the constants of a node that
has 1.2 x 1.2 mm of it. Here the same sheet is cut into the pins' Voronoi cells (finite volumes;
Eymard, Gallouet & Herbin, Handbook of Numerical Analysis VII, 2000): an edge of length l between
nodes at the distance d couples them by k_c l / d, and the mean pressure of both pushes through it.
On a square lattice l = d, and these are the lattice's equations again. What a node has by itself
(mass, springs, contact) grows with its cell, so its motion does not depend on that.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, Voronoi, cKDTree

_RIM, _RIM_REACH = 0.8, 4.0
"""From where to where imagined pins surround a layout, in distances between neighbours."""
_NO_EDGE_MM = 1e-6


class Mesh(NamedTuple):
    """Pins and their neighbours; where a pin has fewer than others, it is its own with factors 0.

    Attributes
    ----------
    neighbour
        Index of each, (n_nodes, most_neighbours).
    coupling
        Factor on the stiffness to each, (n_nodes, most_neighbours); 1 on the square lattice.
    push
        Factor on the push by each, along x and y, (n_nodes, most_neighbours, 2); there a unit
        vector.
    share
        Area of a node's cell over that of the lattice's nodes, (n_nodes,).
    """

    neighbour: NDArray[np.int32]
    coupling: NDArray[np.float32]
    push: NDArray[np.float32]
    share: NDArray[np.float64]


@lru_cache(maxsize=8)
def build_mesh(pins_mm: tuple[tuple[float, float], ...], pitch_mm: float) -> Mesh:
    """Return the mesh of pins; nothing pulls at the outermost from outside.

    Parameters
    ----------
    pins_mm
        Where they stand, mm.
    pitch_mm
        Of the square lattice whose nodes the constants are for, mm.
    """
    pins, n = np.array(pins_mm), len(pins_mm)
    # Imagined pins all round, about as far apart, so that the outermost have cells like the others.
    tree = cKDTree(pins)
    apart = float(np.median(tree.query(pins, k=2)[0][:, 1]))
    low, high = pins.min(axis=0) - _RIM_REACH * apart, pins.max(axis=0) + _RIM_REACH * apart
    x, y = (np.arange(a, b, apart) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rim = places[tree.query(places)[0] > _RIM * apart]
    cells = Voronoi(np.concatenate([pins, rim]))
    corners = (cells.vertices[cells.regions[region]] for region in cells.point_region[:n])
    area = np.array([ConvexHull(corner).volume for corner in corners])
    # Which pins are neighbours, and how long the edge between their cells is.
    pairs = np.asarray(cells.ridge_points)
    inner = np.asarray((pairs < n).all(axis=1))
    vertices = [v for v, is_inner in zip(cells.ridge_vertices, inner, strict=True) if is_inner]
    ends = cells.vertices[np.array(vertices)]
    length = np.hypot(*(ends[:, 0] - ends[:, 1]).T)
    there = length > _NO_EDGE_MM
    pairs, length = pairs[inner][there], length[there]
    pin, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.argsort(pin, kind="stable")
    pin, other = pin[order], other[order]
    place = np.arange(len(pin)) - np.searchsorted(pin, pin)
    way = pins[pin] - pins[other]
    weight = np.tile(length, 2)[order] / np.hypot(*way.T) / area[pin]
    shape = (n, int(place.max()) + 1)
    neighbour = np.repeat(np.arange(n, dtype=np.int32)[:, None], shape[1], axis=1)
    coupling, push = np.zeros(shape, np.float32), np.zeros((*shape, 2), np.float32)
    neighbour[pin, place] = other
    coupling[pin, place] = weight * pitch_mm**2
    push[pin, place] = weight[:, None] * way * pitch_mm
    return Mesh(neighbour, coupling, push, area / pitch_mm**2)
