"""The rest frame: which markers a recording has, in which order, and what was amiss in it."""

from collections.abc import Mapping, Sequence
from itertools import islice, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree, distance

from afferents import dims
from afferents.choices import Method
from afferents.errors import InputError
from afferents.markers.detect import NO_BLOB, Positions, detect, find_markers, link_nearest, turned
from afferents.markers.grid import MOST_MISSING, Grid, assign_grid, fill_grid, published_grid
from afferents.markers.layout import match_layout
from afferents.markers.places import image_places
from afferents.markers.sensor import FEWEST, Sensor
from afferents.markers.suspects import MOST_FALSE, beyond_layout, without_false_markers
from afferents.quality.frames import mean_change, sample_pixels
from afferents.quality.image import describe_no_light
from afferents.store.recording import GreyImage, Video

BLOBS, MARKERS, REPLACED = "rest_blobs", "rest_markers", "rest_replaced"
STALE, BITS = "rest_stale", "bits"
"""Attributes of a recording's tracks that say what its rest frame showed."""
NAMED = 3
"""This many recordings are named in a sentence."""
N_FRAMES = 9
"""The picture at rest is the median of this many frames: without noise, without what flickers."""
_NONE = np.zeros((0, 2))
MOST_MOVED_PX = 0.5
"""A skin whose markers moved farther since the first frame, in the median, is not at rest."""
MOST_STALE, STILL = 8, 3
"""A camera's buffer may give this many frames of an earlier run first; and in this many after them
the picture must stand still."""
N_FIRST = N_FRAMES + MOST_STALE + STILL
"""Frames from the declared rest frame on that say where the skin is at rest."""
JUMPED = 2.0
"""Without markers, the picture must jump by this many grey levels: on three real gels 6 to 13."""
CHANGED, SUDDEN, STALE_SHARE = 1.2, 4.0, 0.75
"""From a stale frame to the next the picture changes more than this many times as much as in the
frames around, and its markers, too: a quarter of them, since a touch moves those under it."""


def rest_images(video: Video, rest_frame: int) -> list[GreyImage]:
    """Decode a video up to its rest frame; return that frame and up to `N_FIRST` - 1 after it.

    Raises
    ------
    InputError
        If the video ends before it.
    """
    n_read, images = 0, []
    for n_read, frame in enumerate(islice(video.frames(), rest_frame + N_FIRST), start=1):
        if n_read > rest_frame:
            images.append(frame.image)
    if not images:
        raise too_short(video, rest_frame, n_read)
    return images


def too_short(video: Video, rest_frame: int, n_frames: int) -> InputError:
    """Return the refusal of a video that ends before its rest frame."""
    expected = f"at least {rest_frame + 1} frames (frame {rest_frame} is the rest frame)"
    return InputError(f"{video.path}: expected {expected}, found {n_frames}")


def stands_still_again(images: Sequence[GreyImage], sensor: Sensor) -> bool:
    """Return whether the skin stands still in the last `STILL` frames after it jumped.

    A camera's buffer may first give frames of an earlier run: the picture stands still, is another
    one from one frame to the next, and stands still again. A skin that moves takes several frames.

    Parameters
    ----------
    images
        The last frames, each (height, width), uint8: `STILL` + 3, or fewer from the first on.
    """
    if len(images) < STILL + 2:
        return False
    samples = [sample_pixels(image) for image in images]
    changes = [mean_change(now, before) for before, now in pairwise(samples)]
    jump = changes.pop(-STILL - 1)
    if sensor.layout == dims.CELLS:  # there is nothing but the picture
        return jump > max(JUMPED, SUDDEN * max(changes))
    if jump <= CHANGED * max(changes):  # spares most recordings the search for markers
        return False
    moved_px = [
        _moved_px(detect(before, sensor), now, sensor, STALE_SHARE)
        for before, now in pairwise(images)
    ]
    jump_px = moved_px.pop(-STILL - 1)
    return max(MOST_MOVED_PX, SUDDEN * max(moved_px)) < jump_px < np.inf


def count_stale(images: Sequence[GreyImage], sensor: Sensor) -> int:
    """Return how many frames come before the skin is at rest: 0 where it is from the first on.

    Parameters
    ----------
    images
        The frame declared as the rest frame and those after it, each (height, width), uint8.
    """
    for n in range(min(len(images) - 1, MOST_STALE + STILL), STILL, -1):
        if stands_still_again(images[max(0, n - STILL - 2) : n + 1], sensor):
            return n
    return 0


def _moved_px(first: Positions, image: GreyImage, sensor: Sensor, share: float = 0.5) -> float:
    """Return how far a share of markers at most is from the nearest ones in a picture, px."""
    found = detect(image, sensor)
    some = len(first) and len(found)
    return float(np.quantile(cKDTree(found).query(first)[0], share)) if some else float("inf")


def still_picture(images: Sequence[GreyImage], sensor: Sensor) -> tuple[GreyImage, int]:
    """Return the median of the frames in which the skin is where the first one shows it.

    Parameters
    ----------
    images
        The rest frame and those after it, each (height, width), uint8; `N_FRAMES` are looked at.
    sensor
        Says what markers look like.

    Returns
    -------
    tuple
        The median, and of how many frames it is.
    """
    first = detect(images[0], sensor)
    n_still = 1
    for image in images[1:N_FRAMES]:
        if _moved_px(first, image, sensor) > MOST_MOVED_PX:
            break
        n_still += 1
    return median_picture(images[:n_still]), n_still


def median_picture(images: Sequence[GreyImage]) -> GreyImage:
    """Return the median of pictures, each (height, width), uint8; of one, itself."""
    return images[0] if len(images) == 1 else np.asarray(np.median(images, axis=0), np.uint8)


class AtRest(NamedTuple):
    """Markers as a picture at rest shows them.

    Attributes
    ----------
    position
        What look like markers, (n, 2), px.
    faint
        What may be one where a layout expects it, (m, 2), px.
    suspects
        What lies beyond the layout, (k, 2), px: specks and reflections at the rim.
    n_still
        The picture is the median of this many frames.
    """

    position: Positions
    faint: Positions = _NONE
    suspects: Positions = _NONE
    n_still: int = 1


def seen_at_rest(picture: GreyImage, sensor: Sensor, n_still: int = 1) -> AtRest:
    """Find markers in a picture at rest; `calibrate` and `track` both look by this."""
    found = detect(picture, sensor)
    beyond = beyond_layout(found)
    generous = sensor.model_copy(update={"detector": sensor.looks.generous()})
    faint, _ = find_markers(picture, generous)
    return AtRest(found[~beyond], faint, found[beyond], n_still)


def find_rest_markers(
    images: Sequence[GreyImage],
    sensor: Sensor,
    where: object,
    method: Method = "published",
    led: bool = False,
) -> AtRest:
    """Find the markers of the rest frame, sorted by x (the published order).

    They are looked for in the rest frame, as the paper did; where it does not show all that the
    sensor file declares, `published` goes on with what it shows if a reference leads it, and the
    others look in the median of the frames at rest.

    Parameters
    ----------
    images
        The rest frame and those after it (`rest_images`).
    method
        ``published`` wants all that the sensor file declares, unless it is `led`; to the others
        some may be missing, and a few too many, where it says where they are.
    where
        The video, for the error.
    led
        Whether markers of a reference are given the nearest of these (`order_markers`).

    Returns
    -------
    AtRest
        Markers beyond `sensor.radius_px` of the centroid are left out
        (preprocess/afferent_response.py).

    Raises
    ------
    InputError
        If there are none, or too many fewer or more than the sensor file declares.
    """
    by_layout = sensor.n_markers is None or sensor.markers is not None
    if sensor.layout != "square" and by_layout and method != "published":
        found, image = _look_by_layout(images, sensor)
    else:
        found, image = _look_by_number(images, sensor, method, led)
    n_found = len(found.position)
    few_left = n_found < FEWEST and sensor.picture.masks
    if n_found == 0 or few_left or not _plausible(n_found, sensor, method, led):
        near = n_found and _plausible(n_found, sensor, method, led=True)
        do = (
            "the tracker 'published' needs a reference clip that shows all of them; use another "
            "tracker"
            if near
            else "a run must begin with the skin at rest: check its first picture, name a later "
            "frame at rest as rest_frame in session.toml, or give a sensor file that fits it"
        )
        if few_left:
            do = "let keep and hide in the sensor file leave more of the picture"
        raise InputError(
            f"{where}: expected {sensor.n_markers or 'some'} markers of sensor '{sensor.name}' in "
            f"frame {sensor.rest_frame}, found {n_found}{describe_no_light(image)}; {do}"
        )
    return found._replace(position=found.position[np.argsort(found.position[:, 0], kind="stable")])


def _look_by_layout(images: Sequence[GreyImage], sensor: Sensor) -> tuple[AtRest, GreyImage]:
    """Return what the rest frame shows, or the median if a marker of the layout is missing."""
    image = images[0]
    seen, layout = seen_at_rest(image, sensor), np.array(sensor.markers or ())
    shows_all = 0 < len(layout) <= len(seen.position) and bool(
        match_layout(seen.position, layout, "", needed=0.0)[1].all()
    )
    if len(images) > 1 and not shows_all:
        image, n_still = still_picture(images, sensor)
        seen = seen_at_rest(image, sensor, n_still)
    return seen._replace(position=_within(seen.position, sensor)), image


def _look_by_number(
    images: Sequence[GreyImage], sensor: Sensor, method: Method, led: bool
) -> tuple[AtRest, GreyImage]:
    """Return what the rest frame shows, or the median if that is nearer the number declared."""
    image = images[0]
    found = AtRest(_within(detect(image, sensor), sensor))
    if method != "published" and len(found.position) != sensor.n_markers and len(images) > 1:
        median, n_still = still_picture(images, sensor)
        again = _within(detect(median, sensor), sensor)
        if _plausible(len(again), sensor, method, led):
            return AtRest(again, n_still=n_still), median
    return found, image


def _within(found: Positions, sensor: Sensor) -> Positions:
    """Leave out what lies beyond the sensor's radius from the middle of all."""
    if sensor.radius_px is None or len(found) == 0:
        return found
    offset = found - found.mean(axis=0)
    near: Positions = found[np.hypot(offset[:, 0], offset[:, 1]) <= sensor.radius_px]
    return near


def _plausible(n_found: int, sensor: Sensor, method: Method, led: bool) -> bool:
    """Return whether this many markers can be this sensor's."""
    if sensor.n_markers is None or (sensor.markers is not None and method != "published"):
        return True  # `match_layout` finds the missing and leaves out the false ones
    if led if method == "published" else sensor.layout == "square":
        least, most = (1 - MOST_MISSING), (1 + MOST_FALSE)
        return least * sensor.n_markers <= n_found <= most * sensor.n_markers
    return n_found == sensor.n_markers


class RestMarkers(NamedTuple):
    """The markers of the rest frame in the order that they keep.

    Attributes
    ----------
    position
        Shape (n, 2), px; a missing marker stands where it should be.
    present
        Which were found, shape (n,). One that `published` did not find within the gate stands
        where the reference has it.
    grid
        Their places; None for layouts that the sensor file does not describe.
    """

    position: Positions
    present: NDArray[np.bool_]
    grid: Grid | None = None


def order_markers(
    at_rest: AtRest,
    sensor: Sensor,
    method: Method,
    reference: Positions | None,
    where: object,
) -> RestMarkers:
    """Bring the rest frame's markers into the order that they keep, and place them in the grid.

    ``windowed`` and ``one-to-one`` order a square layout by row, then column, of the upright
    picture, so that marker n is the same in every recording without a reference. Other layouts
    follow the sensor file's `markers`, wherever the picture is rolled, and some may be missing;
    without them `reference`, each reference marker getting a marker of its own; and without that
    the order by y, then x.

    ``published`` keeps the order by x, or gives each marker of `reference` the nearest one of
    this video, be it taken already or not, and the reference's own position where none lies within
    the sensor's gate (preprocess/afferent_response.py); its grid assumes the published roll.

    Parameters
    ----------
    at_rest
        As `find_rest_markers` gives them.
    reference
        The reference video's rest markers in their order, shape (n, 2), px, or None.

    Raises
    ------
    InputError
        If the markers do not form the grid, or do not match the reference in number.
    """
    found = at_rest.position
    if method == "published":
        kept, near = found, np.ones(len(found), dtype=bool)
        if reference is not None:
            nearest = link_nearest(reference, found, sensor.gate_px)
            near = nearest != NO_BLOB
            kept = np.where(near[:, None], found[nearest], reference)
        rows, columns = sensor.rows, sensor.columns
        return RestMarkers(
            kept,
            near,
            published_grid(turned(kept, sensor), rows, columns) if rows and columns else None,
        )
    if sensor.layout == "square" and sensor.rows and sensor.columns:
        found = without_false_markers(turned(found, sensor), sensor.rows, sensor.columns)
        grid = assign_grid(found, sensor.rows, sensor.columns, where)
        position, present = fill_grid(found, grid, sensor.rows, sensor.columns)
        row, column = np.divmod(np.arange(len(position)), sensor.columns)
        position = turned(position, sensor, back=True)
        return RestMarkers(position, present, Grid(row, column, grid.roll_deg))
    if sensor.markers is not None:
        layout = np.array(sensor.markers)
        places = Grid(*image_places(turned(layout, sensor), sensor.image), float("nan"))
        return RestMarkers(*match_layout(found, layout, where, at_rest.faint), places)
    order = np.lexsort((found[:, 0], found[:, 1]))
    if reference is not None:
        if len(found) != len(reference):
            expected = f"the {len(reference)} markers of the reference video"
            raise InputError(f"{where}: expected {expected}, found {len(found)}")
        _, order = linear_sum_assignment(distance.cdist(reference, found, "sqeuclidean"))
    return RestMarkers(found[order], np.ones(len(found), bool))


def check_size(where: object, size: tuple[int, ...], sensor: Sensor) -> None:
    """Refuse pictures (width, height) to which the lengths in the sensor file do not apply.

    Raises
    ------
    InputError
        Naming both sizes.
    """
    if fault := sensor.picture.misplaced(*size):
        raise InputError(f"sensor '{sensor.name}', {fault} for {where}; mend its file")
    declared = (sensor.width or size[0], sensor.height or size[1])
    if size != declared:
        turned = size == declared[::-1]
        do = "turn the video, or calibrate anew" if turned else "give a sensor file for this size"
        raise InputError(
            f"{where}: expected {declared[0]} x {declared[1]} px, as sensor '{sensor.name}' says, "
            f"found {size[0]} x {size[1]} px; {do}"
        )


def rest_seen(at_rest: AtRest, rest: RestMarkers) -> dict[str, int]:
    """Return, as attributes, how many blobs and markers there were, and how many are missing.

    `rest_replaced` counts markers that were not found, and stand where the others (or, under
    ``published``, the reference) say that they should.
    """
    return {
        BLOBS: len(at_rest.position),
        MARKERS: len(rest.position),
        REPLACED: int((~rest.present).sum()),
    }


def start_sentences(attributes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say of recordings, by their attributes, which start with stale frames or have more bits."""
    return [
        *_name_recordings(
            {name: f"{one[STALE]} frames" for name, one in attributes.items() if one.get(STALE)},
            "the picture jumps in the first frames and then stands still, as where a camera's "
            "buffer gives frames of an earlier run; rest is the frame after these",
        ),
        *_name_recordings(
            {
                name: f"{one[BITS]} bits"
                for name, one in attributes.items()
                if 8 < one.get(BITS, 8) < 16
            },
            "no pixel of its 16-bit images uses more, so this counts as the camera's depth",
        ),
    ]


def rest_sentences(attributes: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Say of recordings, by the attributes of their tracks, what was amiss in their rest frames.

    There is nothing on those in which every blob was one marker.
    """
    known = {name: one for name, one in attributes.items() if BLOBS in one}
    published = {name: one for name, one in known.items() if one.get("method") == "published"}
    others = {name: one for name, one in known.items() if name not in published}
    return [
        *start_sentences(known),
        *_name_recordings(
            {n: f"{o[BLOBS]} blobs" for n, o in published.items() if o[BLOBS] != o[MARKERS]},
            "the rest frame shows another number of blobs than markers; each marker took the "
            "nearest, as the published code does",
        ),
        *_name_recordings(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in published.items() if o[REPLACED]},
            "markers farther from the reference clip's than the gate were put where those are, as "
            "the published code does; their SA-I counts from where they are not (the other "
            "trackers don't do so)",
        ),
        *_name_recordings(
            {n: f"{o[BLOBS]} for {o[MARKERS]}" for n, o in others.items() if o[BLOBS] > o[MARKERS]},
            "the rest frame shows blobs that the sensor's layout has no place for; they were left "
            "out",
        ),
        *_name_recordings(
            {n: f"{o[REPLACED]} of {o[MARKERS]}" for n, o in others.items() if o[REPLACED]},
            "the rest frame lacks markers, which count as lost until they are seen",
        ),
    ]


def _name_recordings(found: Mapping[str, str], what: str) -> list[str]:
    """Say something of the recordings that it is true of, or nothing."""
    if not found:
        return []
    named = ", ".join(f"{name} ({how})" for name, how in list(found.items())[:NAMED])
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    many = f"{len(found)} recording{'s' if len(found) > 1 else ''}"
    return [f"{many}, {named}{more}: {what}."]
