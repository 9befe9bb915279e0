"""Taking a lens's distortion out of marker positions."""

import cv2
import numpy as np
import xarray as xr

from afferents.core import dims
from afferents.markers.detect import Positions
from afferents.markers.sensor import Lens


def undistorted(tracks: xr.Dataset, lens: Lens | None) -> xr.Dataset:
    """Return tracks as a lens without distortion would have shown them, in the same px.

    Only the positions change, after tracking: the pictures stay as they are, which costs nothing
    and blurs nothing.

    Parameters
    ----------
    tracks
        What `track` returns.
    lens
        None leaves them as they are.
    """
    if lens is None:
        return tracks
    return tracks.assign(
        {
            name: tracks[name].copy(data=undistort(tracks[name].values, lens))
            for name in (dims.POSITION, dims.REST_POSITION)
        }
    )


def undistort(position: Positions, lens: Lens) -> Positions:
    """Return where points would be without distortion, shape (..., 2), px; NaN stays NaN.

    The models are OpenCV's: Brown's radial and tangential one, or the fish-eye one of Kannala
    and Brandt (2006).
    """
    camera = np.array(
        [
            [lens.focal_px[0], 0, lens.centre_px[0]],
            [0, lens.focal_px[1], lens.centre_px[1]],
            [0, 0, 1],
        ]
    )
    straight = np.full(position.shape, np.nan)
    seen = ~np.isnan(position).any(axis=-1)
    if seen.any():
        points = np.asarray(position[seen], np.float64)[:, None]
        undo = cv2.fisheye.undistortPoints if lens.fish_eye else cv2.undistortPoints
        distortion = np.array(lens.distortion)
        straight[seen] = undo(points, camera, distortion, R=np.eye(3), P=camera)[:, 0]
    return straight
