"""Whether markers slid together to their neighbours' blobs, and which blobs are theirs.

Markers of a dense skin that jump by half their spacing may all get the names of their neighbours.
Such a slip looks right from within: neighbours agree. It shows where it ends, by markers torn
from their neighbours or left without a blob, in the skin or at its rim. Names then start anew:
from the part that hangs together, from rest, from rest moved as the blobs of the whole picture
did, or from where the markers are, one spacing back in any direction. From there each marker is
looked for where its neighbours' motion puts it. What gives most markers a blob of their own is
right.
"""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csgraph
from scipy.spatial import cKDTree

from afferents.markers import kernel
from afferents.markers.detect import Positions

TORN = 0.5
"""Neighbours are torn apart if their step from rest to each other differs by this share of it."""
MOST_LOST = 0.01
"""More lost than this share and some may be slipped."""
ON_ONE_BLOB = 0.4
"""Two markers nearer than this share of the spacing are on one blob."""
BETTER = 0.01
"""So much of all markers more must find blobs of their own under other names; two at least."""
_N_EDGES, _N_PARTS, _ROUNDS = 6, 2, 40
TEAR = 0.1
"""Neighbours whose steps since the last frame differ by this share of their distance may lie on
either side of a line across which a damaged picture is torn,"""
RIGID = 0.03
"""where those beyond the line all make the same step, and the others the one that they made before,
within this share;"""
LEVEL = 0.95
"""the line is level in so far as this share of pairs, one from either side, lies in one order."""
_FEWEST = 3

Look = Callable[[Positions], Positions]
"""Looks for markers near where they are expected, (n, 2), px, NaN for not at all; returns where
they are, NaN for not found."""


class SlipCheck:
    """Looks after the order of the markers, as the layout has it.

    Parameters
    ----------
    rest
        The markers at rest, shape (n, 2), px.
    neighbours
        The nearest others of each, shape (n, k).
    present
        Which the rest frame shows, shape (n,).
    """

    def __init__(
        self, rest: Positions, neighbours: NDArray[np.int64], present: NDArray[np.bool_]
    ) -> None:
        self._rest, self._n_present = rest, int(present.sum())
        self._to = np.ascontiguousarray(neighbours[:, :_N_EDGES])
        edge = rest[self._to] - rest[:, None]
        length = np.hypot(edge[..., 0], edge[..., 1])
        self._spacing = float(np.median(length[:, 0])) if length.size else np.inf
        self._limit, self._tear = (TORN * length) ** 2, (TEAR * length) ** 2
        middle = np.hypot(*(rest - rest.mean(axis=0)).T).argmin()
        self._pitches = edge[middle]
        self._margin = max(2.0, BETTER * len(rest))

    def suspicious(self, position: Positions) -> bool:
        """Return whether markers enough are lost, or any torn apart, that some may be slipped."""
        if self._to.shape[1] < 2:
            return False
        n_lost = self._n_present - int((~np.isnan(position[:, 0])).sum())
        if n_lost > MOST_LOST * self._n_present:
            return True
        return bool(kernel.any_torn(position, self._rest, self._to, self._limit))

    def torn_off(self, position: Positions) -> NDArray[np.bool_]:
        """Return which markers are torn from half or more of their neighbours, (n,): not theirs."""
        if self._to.shape[1] < 2:
            return np.zeros(len(position), dtype=bool)
        n_seen = (~np.isnan(position[self._to, 0])).sum(axis=1)
        n_torn = self._torn(position).sum(axis=1)
        off: NDArray[np.bool_] = (n_torn > 0) & (2 * n_torn >= n_seen)
        return off

    def torn_across(
        self, position: Positions, before: Positions, step: Positions
    ) -> NDArray[np.bool_] | None:
        """Return which markers lie where a damaged picture is shifted, (n,); None if it is whole.

        A wrong bit in a JPEG shifts all that follows by whole blocks, row after row, until the end
        or until another error undoes it. No skin moves like that: as one piece below a level line,
        and not at all above it. The part that goes on as it moved before is believed.

        Parameters
        ----------
        position, before
            Now and in the last frame, shape (n, 2), px, NaN where lost.
        step
            By which the markers had moved there, shape (n, 2), px.
        """
        if self._to.shape[1] < 2 or not kernel.any_torn(position, before, self._to, self._tear):
            return None
        near = RIGID * self._spacing
        moved, y = position - before, before[:, 1]
        goes_on = np.hypot(*(moved - step).T) < near
        others = ~goes_on & ~np.isnan(moved[:, 0])
        if min(goes_on.sum(), others.sum()) < _FEWEST:
            return None
        shift = np.median(moved[others], axis=0)
        shifted = others & (np.hypot(*(moved - shift).T) < near)
        if 2 * shifted.sum() < others.sum() or np.hypot(*shift) < TEAR * self._spacing:
            return None
        below = (y[shifted] > y[goes_on][:, None]).mean()
        return ~goes_on if max(below, 1 - below) > LEVEL else None

    def settle(self, position: Positions, blobs: Positions, look: Look) -> Positions | None:
        """Return the markers' positions under better names; None if there are none.

        Parameters
        ----------
        position
            As they are followed now, shape (n, 2), px, NaN where lost.
        blobs
            All blobs of the picture, shape (m, 2), px.
        """
        best, most = None, self._score(position) + self._margin
        for start in self._starts(position, blobs, look):
            for part in self._parts(start):
                grown = self._grow(np.where(part[:, None], start, np.nan), look)
                score = self._score(grown)
                if score > most:
                    best, most = grown, score
        return best

    def _starts(self, position: Positions, blobs: Positions, look: Look) -> Iterator[Positions]:
        """Yield what the names may start anew from, each (n, 2), px, NaN where nothing was seen."""
        yield position
        yield look(self._rest)
        if len(blobs):
            yield look(self._rest + blobs.mean(axis=0) - self._rest.mean(axis=0))
        for pitch in self._pitches:
            yield look(position + pitch)

    def _score(self, position: Positions) -> float:
        """Return how many markers have a blob of their own and hang together."""
        return float((~np.isnan(position[:, 0])).sum() - self._torn(position).any(axis=1).sum())

    def _torn(self, position: Positions) -> NDArray[np.bool_]:
        """Return which neighbours are torn apart, shape (n, k); lost ones are not."""
        moved = position - self._rest
        apart = moved[self._to] - moved[:, None]
        torn: NDArray[np.bool_] = (apart**2).sum(axis=2) > self._limit
        return torn

    def _parts(self, position: Positions) -> list[NDArray[np.bool_]]:
        """Return the largest parts of the skin that hang together, each a mask (n,)."""
        seen = ~np.isnan(position[:, 0])
        if not seen.any():
            return []
        whole = seen[:, None] & seen[self._to] & ~self._torn(position)
        i, k = np.nonzero(whole)
        links = coo_array((np.ones(len(i)), (i, self._to[i, k])), shape=(len(seen), len(seen)))
        _, part = csgraph.connected_components(links, directed=False)
        size = np.bincount(part[seen])
        largest = np.argsort(size)[::-1][:_N_PARTS]
        return [seen & (part == p) for p in largest if size[p] > _N_EDGES]

    def _grow(self, position: Positions, look: Look) -> Positions:
        """Return the markers, each looked for where the motion of those next to it puts it."""
        position = position.copy()
        tried = np.zeros(len(position), dtype=np.intp)
        for _ in range(_ROUNDS):
            moved = (position - self._rest)[self._to]
            n_seen = (~np.isnan(moved[..., 0])).sum(axis=1)
            due = np.isnan(position[:, 0]) & (n_seen > tried) & (n_seen > 1)
            if not due.any():
                break
            tried[due] = n_seen[due]
            carried = np.nansum(moved, axis=1) / np.maximum(n_seen, 1)[:, None]
            new = look(np.where(due[:, None], self._rest + carried, np.nan))
            position = self._added(position, new)
        return position

    def _added(self, position: Positions, new: Positions) -> Positions:
        """Return the markers with new ones that hold no other's blob and are not torn off."""
        both = np.where(np.isnan(position), new, position)
        added = np.isnan(position[:, 0]) & ~np.isnan(new[:, 0])
        seen = np.flatnonzero(~np.isnan(both[:, 0]))
        pairs = cKDTree(both[seen]).query_pairs(ON_ONE_BLOB * self._spacing, output_type="ndarray")
        shared = np.zeros(len(position), dtype=bool)
        shared[seen[pairs.ravel()]] = True
        refused = added & (shared | self._torn(both).any(axis=1))
        both[refused] = np.nan
        return both
