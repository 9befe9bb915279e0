"""Where markers are when a video ends, and what moved them for good."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.markers.detect import spacing_px

END_FRAMES = 5
"""The end of a video is its last five frames, everywhere; a marker is where they show it, in the
median, and lost if none of them does."""
BACK = 0.5
"""A marker is back within this share of the spacing of its rest position."""
STAYS = 0.9
"""A jump lasts if the markers stay away for so much of the time after it."""


class AtEnd(NamedTuple):
    """Where the markers are in the last frames.

    Attributes
    ----------
    n_back, n_elsewhere, n_lost
        Within half a spacing of rest, farther from it, and not seen; together all markers.
    away_px
        Median distance from rest of those seen; NaN if none is.
    """

    n_back: int
    n_elsewhere: int
    n_lost: int
    away_px: float


def at_end(tracks: xr.Dataset) -> AtEnd:
    """Say where the markers are at the end.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    seen = tracks[dims.DETECTED].values[-END_FRAMES:]
    rest = tracks[dims.REST_POSITION].values
    step = tracks[dims.POSITION].values[-END_FRAMES:] - rest
    away = np.where(seen, np.hypot(step[..., 0], step[..., 1]), np.nan)[:, seen.any(axis=0)]
    if away.shape[1] == 0:
        return AtEnd(0, 0, len(rest), float("nan"))
    each = np.nanmedian(away, axis=0)
    limit = BACK * spacing_px(rest) if len(rest) > 1 else np.inf
    n_back = int((each <= limit).sum())
    return AtEnd(n_back, len(each) - n_back, len(rest) - len(each), float(np.median(each)))


def lasting_jumps(tracks: xr.Dataset) -> list[float]:
    """Return when all markers jumped together and did not come back, s.

    A skin that is shaken jumps to and fro; one that was knocked, or let go, stays where it is.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    time_s = tracks[dims.TIME].values
    jumps = [float(t) for t in np.atleast_1d(tracks.attrs["jumps_s"])]
    if not jumps:
        return []
    start = int(tracks.attrs["rest_frame"])
    common = _common_motion(tracks)
    lasting = []
    before_s = time_s[start]
    for jump_s in jumps:
        before = common[(time_s >= before_s) & (time_s < jump_s)]
        after = common[time_s >= jump_s]
        if len(before) and _stays_away(before, after):
            lasting.append(jump_s)
            before_s = jump_s
    return lasting


def _common_motion(tracks: xr.Dataset) -> NDArray[np.float64]:
    """Return the median displacement of all markers, shape (time, 2), px; NaN where none is."""
    moved = tracks[dims.POSITION].values - tracks[dims.REST_POSITION].values
    common = np.full((len(moved), 2), np.nan)
    some = ~np.isnan(moved[..., 0]).all(axis=1)
    common[some] = np.nanmedian(moved[some], axis=1)
    return common


def _stays_away(before: NDArray[np.float64], after: NDArray[np.float64]) -> bool:
    """Say whether the markers stay farther from where they were than they had strayed before."""
    middle = np.nanmedian(before, axis=0)
    strayed = np.nanmax(np.hypot(*(before - middle).T))
    away = np.hypot(*(after - middle).T)
    away = away[~np.isnan(away)]
    landed = np.nanmedian(after, axis=0) - middle
    return bool(len(away) and np.mean(away > strayed) > STAYS and np.hypot(*landed) > strayed)
