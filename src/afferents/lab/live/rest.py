"""Where the skin is at rest while it is watched: whether it is, and rest that is set anew."""

import numpy as np
from numpy.typing import NDArray

from afferents.channels import Skin
from afferents.markers.detect import Positions

MOVED_PX, MOVED_SHARE = 0.2, 0.05
"""Nothing touches the skin where no more markers than this share are this far from rest: tracking
alone moves them half as far."""
MOVED_GREY = 3.0
"""The same of cells, grey levels; noise alone is 1 or 2."""
REST_FRAMES = 10
"""Frames without motion that displacement may count from anew."""


def have_moved(skin: Skin) -> bool:
    """Tell whether more markers are off rest, in one frame, than tracking (or noise) moves."""
    n_seen = np.count_nonzero(np.isfinite(skin.distance))
    least = MOVED_PX if skin.grey is None else MOVED_GREY
    return bool(np.count_nonzero(skin.distance > least) > MOVED_SHARE * n_seen)


class NewRest:
    """Takes the next `REST_FRAMES` frames for the skin at rest, unless something moves in them."""

    def __init__(self) -> None:
        """Wait for the first of them."""
        self._seen: list[Positions] = []

    def feed(
        self, position: NDArray[np.floating], rest: NDArray[np.floating]
    ) -> tuple[Positions | None, str] | None:
        """Take in a frame; None before the last of them.

        Parameters
        ----------
        position
            Of the markers, (marker, space), px; NaN where lost.
        rest
            Where displacement counts from now, (marker, space), px.

        Returns
        -------
        tuple
            Where it counts from next: the median of the frames, and `rest` of markers that none of
            them shows; None if it was not set. And that it was, or why not, in a sentence.
        """
        self._seen.append(np.asarray(position, np.float64))
        if len(self._seen) < REST_FRAMES:
            return None
        places = np.array(self._seen)
        seen = np.isfinite(places[..., 0]).any(axis=0)
        found = "no markers"
        if seen.any():
            still = np.nanmedian(places[:, seen], axis=0)
            moved = np.nanmax(np.hypot(*np.moveaxis(places[:, seen] - still, 2, 0)), axis=0)
            moved_px = float(np.quantile(moved, 1 - MOVED_SHARE))
            if moved_px <= MOVED_PX:
                anew = np.array(rest, np.float64)
                anew[seen] = still
                return anew, "rest was set: displacement counts from here"
            found = f"markers that move by {moved_px:.1f} px"
        return None, (
            f"rest was not set: expected a skin that stands still for {REST_FRAMES} frames, found "
            f"{found}; let go, and set it again"
        )
