"""The rest frame: which markers a recording has, and in which order they are kept."""

from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from afferents.core.choices import Method
from afferents.core.errors import InputError
from afferents.core.recording import GreyImage, Video
from afferents.markers.detect import Positions, detect, without_loners
from afferents.markers.grid import MOST_MISSING, Grid, assign_grid, fill_grid, published_grid
from afferents.markers.image_quality import fault_of_light
from afferents.markers.layout import match_layout
from afferents.markers.places import image_places
from afferents.markers.sensor import Sensor

"""How markers are followed; see `Tracker`."""


def rest_image(video: Video, rest_frame: int) -> GreyImage:
    """Decode a video up to its rest frame and return that frame.

    Raises
    ------
    InputError
        If the video ends before it.
    """
    frames = list(islice(video.frames(), rest_frame + 1))
    if len(frames) <= rest_frame:
        raise too_short(video, rest_frame, len(frames))
    return frames[rest_frame].image


def too_short(video: Video, rest_frame: int, n_frames: int) -> InputError:
    """Return the refusal of a video that ends before its rest frame."""
    expected = f"at least {rest_frame + 1} frames (frame {rest_frame} is the rest frame)"
    return InputError(video.path, expected, f"{n_frames}")


def find_rest_markers(
    image: GreyImage, sensor: Sensor, where: object, method: Method = "published"
) -> Positions:
    """Find the markers of the rest frame, sorted by x (the published order).

    Parameters
    ----------
    method
        ``published`` wants all that the sensor file declares; to the others some may be
        missing where it says where they are.
    where
        The video, for the error.

    Returns
    -------
    Positions
        Shape (n, 2), px; markers beyond `sensor.radius_px` of the centroid are left out
        (preprocess/afferent_response.py).

    Raises
    ------
    InputError
        If there are none, or fewer or more than the sensor file declares.
    """
    found = detect(image, sensor)
    if sensor.radius_px is not None and len(found):
        offset = found - found.mean(axis=0)
        found = found[np.hypot(offset[:, 0], offset[:, 1]) <= sensor.radius_px]
    if sensor.layout != "square" and (sensor.n_markers is None or sensor.markers is not None):
        found = without_loners(found)
    if len(found) == 0 or not _plausible(len(found), sensor, method):
        raise InputError(
            where,
            f"{sensor.n_markers or 'some'} markers of sensor '{sensor.name}' in frame "
            f"{sensor.rest_frame}",
            f"{len(found)}{fault_of_light(image)}",
            "check the picture, or give a sensor file that fits it",
        )
    return found[np.argsort(found[:, 0], kind="stable")]


def _plausible(n_found: int, sensor: Sensor, method: Method) -> bool:
    """Say whether so many markers can be this sensor's."""
    if sensor.n_markers is None or sensor.markers is not None:
        return True  # `match_layout` finds the missing and leaves out the false ones
    if sensor.layout == "square" and method != "published":
        return (1 - MOST_MISSING) * sensor.n_markers <= n_found <= sensor.n_markers
    return n_found == sensor.n_markers


class RestMarkers(NamedTuple):
    """The markers of the rest frame in the order that they keep.

    Attributes
    ----------
    position
        Shape (n, 2), px; a missing marker stands where it should be.
    present
        Which were found, shape (n,).
    grid
        Their places; None for layouts that the sensor file does not describe.
    """

    position: Positions
    present: NDArray[np.bool_]
    grid: Grid | None = None


def order_markers(
    found: Positions,
    sensor: Sensor,
    method: Method,
    reference: Positions | None,
    where: object,
) -> RestMarkers:
    """Bring the rest frame's markers into the order that they keep, and place them in the grid.

    ``windowed`` and ``one-to-one`` order a square layout by row, then column, so that marker n
    is the same in every recording without a reference. Other layouts follow the sensor file's
    `markers`, wherever the picture is turned, and some may be missing; without them `reference`,
    each reference marker getting a marker of its own; and without that the order by y, then x.

    ``published`` keeps the order by x, or gives each marker of `reference` the nearest one of
    this video, be it taken already or not; its grid assumes the published roll.

    Parameters
    ----------
    found
        Shape (n, 2), px.
    reference
        The reference video's rest markers in their order, shape (n, 2), px, or None.

    Raises
    ------
    InputError
        If the markers do not form the grid, or do not match the reference in number.
    """
    if method == "published":
        kept = found if reference is None else found[cKDTree(found).query(reference)[1]]
        return RestMarkers(kept, np.ones(len(kept), bool), _published_places(kept, sensor))
    if sensor.layout == "square" and sensor.rows and sensor.columns:
        grid = assign_grid(found, sensor.rows, sensor.columns, where)
        position, present = fill_grid(found, grid, sensor.rows, sensor.columns)
        row, column = np.divmod(np.arange(len(position)), sensor.columns)
        return RestMarkers(position, present, Grid(row, column, grid.roll_deg))
    if sensor.markers is not None:
        layout = np.array(sensor.markers)
        places = Grid(*image_places(layout, sensor.image), float("nan"))
        return RestMarkers(*match_layout(found, layout, where), places)
    order = np.lexsort((found[:, 0], found[:, 1]))
    if reference is not None:
        order = _match_reference(found, reference, where)
    return RestMarkers(found[order], np.ones(len(found), bool))


def _published_places(position: Positions, sensor: Sensor) -> Grid | None:
    if sensor.rows and sensor.columns:
        return published_grid(position, sensor.rows, sensor.columns)
    return None


def _match_reference(found: Positions, reference: Positions, where: object) -> NDArray[np.intp]:
    """Return for each reference marker the index of its own marker, the nearest on the whole."""
    if len(found) != len(reference):
        expected = f"the {len(reference)} markers of the reference video"
        raise InputError(where, expected, f"{len(found)}")
    _, own = linear_sum_assignment(cdist(reference, found, "sqeuclidean"))
    return np.asarray(own, dtype=np.intp)
