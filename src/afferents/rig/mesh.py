"""Any layout of pins as a mesh: which are neighbours, and how strongly each acts on the other.

The square lattice's equations (see `skin`) are those of a sheet, with the constants of a node that
has 1.2 x 1.2 mm of it. Here the same sheet is cut into the pins' Voronoi cells (finite volumes;
Eymard, Gallouet & Herbin, Handbook of Numerical Analysis VII, 2000): an edge of length l between
nodes at the distance d couples them by k_c l / d, and the mean pressure of both pushes through it.
On a square lattice l = d, and these are the lattice's equations again. What a node has by itself
(mass, springs, contact) grows with its cell, so its motion does not depend on that.
"""

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


def mesh_of(pins_mm: NDArray[np.float64], pitch_mm: float) -> Mesh:
    """Return the mesh of pins; nothing pulls at the outermost from outside.

    Parameters
    ----------
    pins_mm
        Shape (n, 2), mm.
    pitch_mm
        Of the square lattice whose nodes the constants are for, mm.
    """
    n = len(pins_mm)
    # Imagined pins all round, so that the outermost have cells like those of the others.
    cells = Voronoi(np.concatenate([pins_mm, _rim(pins_mm)]))
    corners = (cells.vertices[cells.regions[region]] for region in cells.point_region[:n])
    area = np.array([ConvexHull(corner).volume for corner in corners])
    pairs, length = _edges(cells, n)
    pin, other = np.concatenate([pairs, pairs[:, ::-1]]).T
    order = np.argsort(pin, kind="stable")
    pin, other = pin[order], other[order]
    place = np.arange(len(pin)) - np.searchsorted(pin, pin)
    way = pins_mm[pin] - pins_mm[other]
    weight = np.tile(length, 2)[order] / np.hypot(*way.T) / area[pin]
    shape = (n, int(place.max()) + 1)
    neighbour = np.repeat(np.arange(n, dtype=np.int32)[:, None], shape[1], axis=1)
    coupling, push = np.zeros(shape, np.float32), np.zeros((*shape, 2), np.float32)
    neighbour[pin, place] = other
    coupling[pin, place] = weight * pitch_mm**2
    push[pin, place] = weight[:, None] * way * pitch_mm
    return Mesh(neighbour, coupling, push, area / pitch_mm**2)


def _rim(pins_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return imagined pins round a layout, (n, 2), mm, about as far apart as its own."""
    tree = cKDTree(pins_mm)
    pitch = float(np.median(tree.query(pins_mm, k=2)[0][:, 1]))
    reach = _RIM_REACH * pitch
    low, high = pins_mm.min(axis=0) - reach, pins_mm.max(axis=0) + reach
    x, y = (np.arange(a, b, pitch) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return np.asarray(places[tree.query(places)[0] > _RIM * pitch])


def _edges(cells: Voronoi, n: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return which of the first n points are neighbours, (edge, 2), and the edges' lengths, mm."""
    pairs = np.asarray(cells.ridge_points)
    inner = np.asarray((pairs < n).all(axis=1))
    ends = np.array(
        [ends for ends, its in zip(cells.ridge_vertices, inner.tolist(), strict=True) if its]
    )
    length = np.hypot(*(cells.vertices[ends[:, 0]] - cells.vertices[ends[:, 1]]).T)
    there = length > _NO_EDGE_MM
    return pairs[inner][there], length[there]
