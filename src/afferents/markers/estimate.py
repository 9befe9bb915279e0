"""A detector for a sensor without a sensor file: guessed from one of its images."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.errors import InputError
from afferents.markers import detect, kernel, rest, sensor as sensors, suspects
from afferents.markers.detect import Positions
from afferents.markers.grid import find_grid
from afferents.markers.sensor import FEWEST, BlobDetector, DiscDetector, Picture, Sensor
from afferents.quality.image import describe_no_light
from afferents.store.recording import GreyImage, Video

SMALLEST_PX2, LARGEST_SHARE = 8.0, 1 / 30
"""Areas that a marker may have: least in px^2, most as a share of the image."""
SMALL_PICTURE_PX = 200
"""Less high or wide pictures are enlarged to look for blobs: small ones have no shape."""
LIKE_SIZE = (0.25, 3.0)
"""Areas, as multiples of the median area, that count as markers: fish-eye lenses shrink them
towards the rim, reflections are larger."""
MOST_DISCS = 0.8
"""Markers are described as discs where this share of discs are found for the blobs."""
LIKE_SPACING, AS_GOOD, AS_LARGE = 0.25, 0.85, 0.5
"""In a regular layout the next marker is as far as in the median, but for this share. Guesses with
this share of the best one's score are as good; of these, blobs with this share of the area of the
largest are no mere highlights in them."""
SHINE_SHARE, SPACING_SHARE = 0.25, 1 / 15
"""Highlights in markers are looked for up to this share of the spacing, and where no guess says
that, it is assumed to be this share of the picture's height."""
SHINES = 0.2
"""Markers have highlights where the middle of most differs from the rest of it by this share of
their contrast: at least 0.27 measured, at most 0.09 where they have none."""
LEAST_OVER_NOISE = 7.0
"""A blob differs from the skin by this many standard deviations of what noise alone leaves: in
pictures of white noise at most 4.3 were measured, of drawn markers in noise 36 or more."""
NOISE_MASK = np.outer([1, -2, 1], [1, -2, 1]).astype(np.float32)
GATE_SHARE = 0.65
"""Gate as a share of the spacing. More than half of it, because one-to-one assignment keeps
neighbours apart."""


class _Guess(NamedTuple):
    """A sensor that markers may be those of, and what that finds, (n, 2).

    The better the guess, the higher its score; `shines` says whether most have highlights.
    """

    sensor: Sensor
    found: Positions
    area_px2: float = 0.0
    score: float = 0.0
    shines: bool = False


def estimate_detector(
    image: GreyImage, where: object = "the image", within: Picture = sensors.WHOLE
) -> Sensor:
    """Guess from an image how its markers are to be found.

    Blobs of any size are looked for: bright and dark ones, with and without highlights in them.
    Those are taken that are many and equally far from one another, not those that are most: specks,
    scratches and noise may be more.

    Parameters
    ----------
    image
        Grey image of the skin at rest, shape (height, width), uint8.
    where
        The video or image, for the error.
    within
        Which part of it shows the skin.

    Returns
    -------
    Sensor
        Named ``estimated``, of the layout ``free``, its markers not counted.

    Raises
    ------
    InputError
        If there are fewer than `FEWEST` blobs of like size.
    """
    guesses = [_guess(image, colour, within) for colour in (255, 0)]
    spacing = detect.spacing_px(max(guesses, key=lambda guess: guess.score).found)
    spacing = spacing if spacing > 0 else SPACING_SHARE * image.shape[0]
    shine_px = max(3, 2 * round(SHINE_SHARE * spacing / 2) + 1)
    guesses += [_guess(image, colour, within, shine_px) for colour in (255, 0)]
    best = max(guess.score for guess in guesses)
    as_good = [guess for guess in guesses if guess.score >= AS_GOOD * best]
    as_good = [one for one in as_good if isinstance(one.sensor.detector, DiscDetector)] or as_good
    largest = max(guess.area_px2 for guess in as_good)
    as_good = [one for one in as_good if one.area_px2 >= AS_LARGE * largest]
    # What shines in the middle harms tracking; what does not is left as it is.
    chosen = next((one for one in as_good if one.shines), as_good[0])
    if not best or len(chosen.found) < FEWEST:
        part, do = "", "give a sensor file that says what its markers look like, or, of a gel "
        do += "without any, one of layout = 'cells' (docs/tracking.md)"
        if within.masks:
            part, do = " where keep and hide leave the picture", "let these leave more of it"
        raise InputError(
            f"{where}: expected at least {FEWEST} bright or dark blobs of like size{part}, found "
            f"{len(chosen.found)}{describe_no_light(image)}; {do}"
        )
    gate_px = round(GATE_SHARE * detect.spacing_px(chosen.found), 1)
    return chosen.sensor.model_copy(update={"gate_px": gate_px})


def _guess(image: GreyImage, colour: int, within: Picture, shine_px: int | None = None) -> _Guess:
    """Describe the blobs of a colour: as discs, or as blobs where many are cut, long, or ragged."""
    times = sensors.ENLARGED if min(image.shape) < SMALL_PICTURE_PX else 1
    any_blob = BlobDetector(
        blob_colour=255 if colour else 0,
        min_threshold=5,
        max_threshold=255,
        min_distance_px=5,
        min_area_px2=SMALLEST_PX2,
        max_area_px2=times**2 * image.size * LARGEST_SHARE,
        min_circularity=0.6,
        min_convexity=0.7,
        min_inertia_ratio=0.3,
        shine_px=shine_px,
    )
    sensor = Sensor(
        name="estimated",
        layout="free",
        height=image.shape[0],
        width=image.shape[1],
        radius_px=None,
        picture=within,
        detector=any_blob,
    )
    plain = detect.enlarged(detect.without_shine(image, any_blob), times)
    centre, area = detect.find_blobs(plain, any_blob)
    centre, area = detect.scaled(centre, 1 / times), area / times**2
    shown = within.shows(centre)
    centre, area = centre[shown], area[shown]
    if len(area):
        real = _stands_out(image, centre, float(np.sqrt(np.median(area) / np.pi)))
        centre, area = centre[real], area[real]
    typical = np.median(area) if len(area) else 0.0
    like = (area >= LIKE_SIZE[0] * typical) & (area <= LIKE_SIZE[1] * typical)
    centre, area = centre[like], area[like]
    if len(centre) < FEWEST:
        return _Guess(sensor, centre)
    typical = float(np.median(area))
    radius = max(1.0, (typical / np.pi) ** 0.5)
    discs = DiscDetector(
        blob_colour=any_blob.blob_colour, radius_px=round(radius, 2), shine_px=shine_px
    )
    least, most = (round(share * typical, 1) for share in LIKE_SIZE)
    blobs = any_blob.model_copy(update={"min_area_px2": least, "max_area_px2": most})
    sensor = sensor.model_copy(update={"detector": discs})
    found = detect.detect(image, sensor)
    if len(found) < MOST_DISCS * len(centre):
        sensor = sensor.model_copy(update={"detector": blobs})
        found = detect.detect(image, sensor)
    agree = min(len(centre), len(found)) / max(len(centre), len(found))
    shines = shine_px is not None and len(found) > 0 and _shine(image, found, discs)
    score = 0.0
    if len(found) >= FEWEST:  # how many there are, and the share of those at the usual distance
        distance = cKDTree(found).query(found, k=2)[0][:, 1]
        usual = np.median(distance)
        alike = float(np.mean(np.abs(distance - usual) < LIKE_SPACING * usual))
        score = agree * (len(found) * alike**2)
    return _Guess(sensor, found, typical, score, shines)


def _shine(image: GreyImage, found: Positions, discs: DiscDetector) -> bool:
    """Return whether most markers' middles have another grey than without highlights."""
    plain = detect.without_shine(image, discs)
    skin, marker = np.empty((2, len(found)))
    kernel.levels(plain, found, np.full(len(found), round(discs.radius_px + 1)), skin, marker)
    x, y = np.rint(found).astype(int).T
    shine = cv2.absdiff(image, plain)[y, x]
    return bool(np.median(shine) > SHINES * np.median(np.abs(marker - skin)))


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
    published = sensors.load_sensor("tip_b")
    image = rest.rest_images(video, published.rest_frame)[0]
    blobs = detect.detect(image, published)
    found = len(blobs)
    if found == published.n_markers:
        return published, f"The published detector ({published.name}) finds its {found} markers."
    n, rows, columns = published.n_markers or 0, published.rows or 0, published.columns or 0
    near_number = abs(found - n) <= suspects.MOST_FALSE * n  # a few too many or too few
    grid = find_grid(suspects.without_false_markers(blobs, rows, columns)) if near_number else None
    if grid is not None and (grid.row.max() + 1, grid.column.max() + 1) == (rows, columns):
        return published, (
            f"The published detector ({published.name}) finds {found} blobs for its "
            f"{published.n_markers} markers; they form its grid."
        )
    sensor = estimate_detector(image, video.path)
    shade = "bright" if sensor.looks.blob_colour else "dark"
    return sensor, (
        f"The published detector ({published.name}) finds {found} of its {published.n_markers} "
        f"markers in frame {published.rest_frame}, so this is another sensor: markers were taken "
        f"to be {shade} {looks(sensor.looks)}, as the image itself suggests."
    )


def looks(detector: sensors.Detector) -> str:
    """Say what markers look like."""
    shine = f" with highlights of up to {detector.shine_px} px" if detector.shine_px else ""
    if isinstance(detector, DiscDetector):
        return f"discs of {detector.radius_px:g} px radius{shine}"
    return f"blobs of {detector.min_area_px2:g} to {detector.max_area_px2:g} px^2{shine}"


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
