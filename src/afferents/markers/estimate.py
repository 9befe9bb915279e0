"""A detector for a sensor that nobody has described: guessed from one of its images."""

import cv2
import numpy as np
from numpy.typing import NDArray

from afferents.errors import InputError
from afferents.markers.detect import (
    Positions,
    detect,
    find_blobs,
    find_discs,
    find_markers,
    spacing_px,
)
from afferents.markers.grid import find_grid
from afferents.markers.rest import rest_images
from afferents.markers.sensor import BlobDetector, Detector, DiscDetector, Sensor, load_sensor
from afferents.markers.suspects import MOST_FALSE, without_false_markers
from afferents.quality.image import describe_no_light
from afferents.store.recording import GreyImage, Video

FEWEST = 6
"""Fewer blobs of like size than this are no marker layout."""
SMALLEST_PX2, LARGEST_SHARE = 8.0, 1 / 150
"""Areas that a marker may have: least in px^2, most as a share of the image."""
LIKE_SIZE = (0.25, 3.0)
"""Areas, as multiples of the median area, that count as markers: fish-eye lenses shrink them
towards the rim, reflections are larger."""
MOST_DISCS = 0.8
"""Markers are described as discs where so many discs are found for the blobs."""
FEWEST_BY_GREY, MORE = 400, 1.3
"""Where fewer blobs are found by grey level, they are looked for in an evened picture too, which is
taken if it shows so many times more and they are markers in the image itself."""
EVEN_SHARE, EVEN_GREY, LEAST_SPREAD = 30.0, 50.0, 3.0
"""Evened are parts of this share of the picture's height, to a spread of so many grey levels; less
spread than the last is noise."""
LEAST_OVER_NOISE = 7.0
"""A blob differs from the skin by so many standard deviations of what noise alone leaves: in
pictures of white noise at most 4.3 were measured, of drawn markers in noise 36 or more."""
NOISE_MASK = np.outer([1, -2, 1], [1, -2, 1]).astype(np.float32)
GATE_SHARE = 0.65
"""Gate as a share of the spacing. More than half of it, because one-to-one assignment keeps
neighbours apart."""


def estimate_detector(image: GreyImage, where: object = "the image") -> Sensor:
    """Guess from an image how its markers are to be found.

    Blobs of any size and brightness are looked for, bright ones and dark ones. The colour with
    more blobs of like size is taken for the markers', and their median size for the discs'.

    Parameters
    ----------
    image
        Grey image of the skin at rest, shape (height, width), uint8.
    where
        The video or image, for the error.

    Returns
    -------
    Sensor
        Named ``estimated``, of the layout ``free``, its markers not counted.

    Raises
    ------
    InputError
        If there are fewer than `FEWEST` blobs of like size.
    """
    n_blobs, detector, centre = _describe_markers(image, image)
    if n_blobs < FEWEST_BY_GREY:
        evened = _describe_markers(_evened(image), image)
        if evened[0] > MORE * n_blobs and len(evened[2]) > len(centre):
            _, detector, centre = evened
    if detector is None or len(centre) < FEWEST:
        raise InputError(
            f"{where}: expected at least {FEWEST} bright or dark blobs of like size, found "
            f"{len(centre)}{describe_no_light(image)}; give a sensor file that says what its "
            "markers look like"
        )
    return Sensor(
        name="estimated",
        layout="free",
        height=image.shape[0],
        width=image.shape[1],
        radius_px=None,
        gate_px=round(GATE_SHARE * spacing_px(centre), 1),
        detector=detector,
    )


def _discs(
    image: GreyImage, colour: int, centre: Positions, area: NDArray[np.float64]
) -> DiscDetector | BlobDetector:
    """Describe blobs as discs; as blobs where many of them are none (cut, long, or ragged)."""
    typical = float(np.median(area))
    discs = DiscDetector(
        blob_colour=255 if colour else 0, radius_px=round(max(1.0, (typical / np.pi) ** 0.5), 2)
    )
    if len(find_discs(image, discs)[0]) >= MOST_DISCS * len(centre):
        return discs
    limits = {
        "min_area_px2": round(LIKE_SIZE[0] * typical, 1),
        "max_area_px2": round(LIKE_SIZE[1] * typical, 1),
    }
    return _any_blob(image, colour).model_copy(update=limits)


def recognise_sensor(video: Video) -> tuple[Sensor, str]:
    """Choose a sensor for a video that came without a sensor file.

    Returns
    -------
    tuple
        The published sensor `tip_b` if its detector finds its markers in the rest frame, or a few
        blobs more or less that form its grid, an estimated one if not; and a sentence that says
        which and why.

    Raises
    ------
    InputError
        If the video is shorter than the rest frame, or shows no markers at all.
    """
    published = load_sensor("tip_b")
    image = rest_images(video, published.rest_frame)[0]
    blobs = detect(image, published)
    found = len(blobs)
    if found == published.n_markers:
        return published, f"The published detector ({published.name}) finds its {found} markers."
    if _forms_grid_of(blobs, published):
        return published, (
            f"The published detector ({published.name}) finds {found} blobs for its "
            f"{published.n_markers} markers; they form its grid."
        )
    sensor = estimate_detector(image, video.path)
    shade = "bright" if sensor.detector.blob_colour else "dark"
    return sensor, (
        f"The published detector ({published.name}) finds {found} of its {published.n_markers} "
        f"markers in frame {published.rest_frame}, so this is another sensor: markers were taken "
        f"to be {shade} {looks(sensor.detector)}, as the image itself suggests."
    )


def _forms_grid_of(blobs: Positions, sensor: Sensor) -> bool:
    """Say whether blobs, a few too many or too few, form a square sensor's grid."""
    n, rows, columns = sensor.n_markers or 0, sensor.rows or 0, sensor.columns or 0
    if abs(len(blobs) - n) > MOST_FALSE * n:
        return False
    grid = find_grid(without_false_markers(blobs, rows, columns))
    return grid is not None and (grid.row.max() + 1, grid.column.max() + 1) == (rows, columns)


def looks(detector: Detector) -> str:
    """Say what markers look like."""
    if isinstance(detector, DiscDetector):
        return f"discs of {detector.radius_px:g} px radius"
    return f"blobs of {detector.min_area_px2:g} to {detector.max_area_px2:g} px^2"


def _describe_markers(
    evened: GreyImage, image: GreyImage
) -> tuple[int, Detector | None, Positions]:
    """Return the number of blobs of like size in an image, their detector, and what that finds.

    The blobs, of the colour that has more, are looked for in `evened`: the image itself, or the
    same with its light evened. Where they are too few, there is no detector, and they are what is
    found.
    """
    found = {colour: _blobs_of_like_size(evened, colour, image) for colour in (255, 0)}
    colour = max(found, key=lambda key: len(found[key][0]))
    centre, area = found[colour]
    if len(centre) < FEWEST:
        return len(centre), None, centre
    detector = _discs(image, colour, centre, area)
    return len(centre), detector, find_markers(image, detector)[0]


def _evened(image: GreyImage) -> GreyImage:
    """Return a picture whose brightness and contrast are everywhere alike, without its noise.

    Small faint markers differ by fewer grey levels than the steps at which blobs are cut.
    """
    grey = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0)
    around = image.shape[0] / EVEN_SHARE
    off = grey - cv2.GaussianBlur(grey, (0, 0), around)
    spread = np.sqrt(cv2.GaussianBlur(off**2, (0, 0), around)) + LEAST_SPREAD
    return np.asarray(np.clip(128 + EVEN_GREY * off / spread, 0, 255), np.uint8)


def _blobs_of_like_size(
    evened: GreyImage, colour: int, image: GreyImage
) -> tuple[Positions, NDArray[np.float64]]:
    """Find blobs of one colour and leave out noise, and those of another size than most."""
    centre, area = find_blobs(evened, _any_blob(image, colour))
    if len(area):
        real = _stands_out(image, centre, float(np.sqrt(np.median(area) / np.pi)))
        centre, area = centre[real], area[real]
    typical = np.median(area) if len(area) else 0.0
    like = (area >= LIKE_SIZE[0] * typical) & (area <= LIKE_SIZE[1] * typical)
    return centre[like], area[like]


def _stands_out(image: GreyImage, centre: Positions, radius: float) -> NDArray[np.bool_]:
    """Return which blobs differ from the skin round them by more than noise does.

    The noise of a pixel is found by a mask that slopes and edges do not pass (Immerkaer 1996),
    here as the median; the difference is that of Gaussians of one and two radii.
    """
    grey = image.astype(np.float32)
    noise = np.median(np.abs(cv2.filter2D(grey, -1, NOISE_MASK))) / 0.6745 / 6
    off = cv2.GaussianBlur(grey, (0, 0), radius) - cv2.GaussianBlur(grey, (0, 0), 2 * radius)
    x, y = np.rint(centre).astype(int).T
    stands_out: NDArray[np.bool_] = np.abs(off[y, x]) >= LEAST_OVER_NOISE * 0.19 / radius * noise
    return stands_out


def _any_blob(image: GreyImage, colour: int) -> BlobDetector:
    """Return a detector for round blobs at all grey levels and of nearly all sizes."""
    return BlobDetector(
        blob_colour=255 if colour else 0,
        min_threshold=5,
        max_threshold=255,
        min_distance_px=5,
        min_area_px2=SMALLEST_PX2,
        max_area_px2=image.size * LARGEST_SHARE,
        min_circularity=0.6,
        min_convexity=0.7,
        min_inertia_ratio=0.3,
    )
