"""Tracks as they leave the tracker: with names, units, and a place for every frame."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from afferents.core import dims
from afferents.markers.audit import Found
from afferents.markers.detect import Positions
from afferents.markers.grid import Grid


def labelled(
    time_s: list[float], tracked: Sequence[Found], rest: Positions, grid: Grid | None
) -> xr.Dataset:
    """Put names, units and the untracked frames at the start to the arrays.

    Parameters
    ----------
    time_s
        Of every frame of the video, s.
    tracked
        The markers in its last frames, from the rest frame on.
    rest
        Where displacement counts from, shape (n, 2), px.
    grid
        Places of the markers; None for layouts without.
    """
    shape = (len(time_s), len(rest))
    position, detected = np.full((*shape, 2), np.nan), np.zeros(shape, dtype=bool)
    for index, frame in enumerate(tracked, start=len(time_s) - len(tracked)):
        position[index], detected[index] = frame.position, frame.detected
    px = {dims.UNITS: dims.PIXELS}
    tracks = xr.Dataset(
        {
            dims.POSITION: ((dims.TIME, dims.MARKER, dims.SPACE), position, px),
            dims.DETECTED: ((dims.TIME, dims.MARKER), detected),
            dims.REST_POSITION: ((dims.MARKER, dims.SPACE), rest, px),
        },
        coords={
            dims.TIME: (dims.TIME, np.asarray(time_s), {dims.UNITS: dims.SECONDS}),
            dims.SPACE: (dims.SPACE, ["x", "y"]),
        },
    )
    if grid is None:
        return tracks
    places = {dims.ROW: (dims.MARKER, grid.row), dims.COLUMN: (dims.MARKER, grid.column)}
    roll = {"roll_deg": grid.roll_deg} if np.isfinite(grid.roll_deg) else {}
    return tracks.assign_coords(places).assign_attrs(roll)
