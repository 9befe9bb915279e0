"""Following markers by centroids in windows round where they are expected.

A marker is looked for where it was plus its last step. If the discs are not there, the common
shift of all markers is searched, over more than the distance of two markers; if most are still
not found, the whole picture is searched for blobs. So a frame costs a fraction of a millisecond
(the blob detector takes ten), and a jump costs no identity. The grey levels of skin and disc are
kept for each marker and follow the light.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.core.errors import InputError
from afferents.core.recording import GreyImage
from afferents.markers import kernel
from afferents.markers.detect import Positions, find_blobs
from afferents.markers.link import NO_BLOB, link_one_to_one
from afferents.markers.sensor import Sensor

N_NEIGHBOURS = 8
"""Markers around a marker that say where it must be when it is lost."""
EDGE_PX = 3.0
"""The blurred edge of a disc reaches this far beyond its radius, px."""
WINDOW = 0.45
"""Half a window is at most this share of the distance to the nearest marker, so that no two
windows hold both discs; nor may a marker lie farther from its neighbours' motion."""
SAME_BLOB = 0.4
"""Two markers nearer than this share of their distance at rest are on one blob."""
SEARCH = 1.2
"""The common shift is searched up to this multiple of the distance of markers."""
SEARCH_STEP_PX = 2.5
FOLLOW_LIGHT = 0.1
"""Share of a new grey level in the running mean."""
_EVERY = 16
"""The picture's brightness is the mean of every 16th pixel of every 16th row."""
_ENOUGH = 0.5
"""Below this share of markers found the whole picture is searched."""


@dataclass
class Audit:
    """How often identities were in danger.

    Attributes
    ----------
    shared
        Two markers held one blob; the one farther from its expected place was lost.
    strangers
        A marker did not move with its neighbours and was lost.
    jumps
        Frames whose common shift had to be searched.
    searches
        Frames in which the whole picture was searched for blobs.
    """

    shared: int = 0
    strangers: int = 0
    jumps: int = 0
    searches: int = 0


class Windowed:
    """Follows markers from frame to frame.

    Parameters
    ----------
    sensor
        Gives the blob detector, for when the picture is lost, and whether discs are bright.
    rest_position
        Shape (n, 2), px; replaced by the centroids in `rest_image`, so that all positions are
        measured alike.
    rest_image
        The frame in which the markers are there.
    """

    def __init__(self, sensor: Sensor, rest_position: Positions, rest_image: GreyImage) -> None:
        """Measure every marker in the rest frame."""
        self.audit = Audit()
        self._sensor = sensor
        self._sign = 1.0 if sensor.detector.blob_colour == 255 else -1.0
        distance, self._neighbours = _neighbours(rest_position)
        radius = _radius(rest_image, rest_position, sensor)
        self._half = np.maximum(np.minimum(radius + EDGE_PX, WINDOW * distance), 2).astype(np.int64)
        self._farthest, self._nearest = WINDOW * distance, SAME_BLOB * distance
        self._reach = SEARCH * float(np.median(distance))
        cells = [side // kernel.CELL + 1 for side in rest_image.shape]
        self._owner = np.empty(cells, np.int32)
        n = len(rest_position)
        self._dark, self._bright, self._mass = np.empty(n), np.empty(n), np.empty(n)
        kernel.levels(rest_image, rest_position, self._half, self._dark, self._bright)
        self._light = float(rest_image[::_EVERY, ::_EVERY].mean())
        self.rest_position = self._refine(rest_position, rest_image)
        self._expected = self.rest_position.copy()
        self._last = self.rest_position.copy()
        self._step = np.zeros((n, 2))

    def _refine(self, position: Positions, image: GreyImage) -> Positions:
        """Return the centroids in the rest frame; a blob's centre stands where there is none."""
        refined = np.empty_like(position)
        kernel.weigh(image, position, self._dark, self._bright, self._half, self._mass, refined)
        off = np.abs(refined - position).max(axis=1) > EDGE_PX
        refined[off] = position[off]
        return refined

    def step(self, image: GreyImage) -> tuple[Positions, NDArray[np.bool_]]:
        """Return the markers' positions (n, 2), px, NaN where lost, and which were found (n,)."""
        self._follow_light(image)
        predicted = self._predict(image)
        position, found = np.empty_like(predicted), np.empty(len(predicted), np.bool_)
        self._look(image, predicted, position, found)
        if not found.all():
            self._look_where_neighbours_are(image, position, found)
            if found.mean() < _ENOUGH:
                self._search(image, predicted, position, found)
        self._remember(image, position)
        return position, found

    def _follow_light(self, image: GreyImage) -> None:
        """Scale the grey levels as the whole picture's brightness changes."""
        light = float(image[::_EVERY, ::_EVERY].mean())
        if light > 0 and self._light > 0:
            self._dark *= light / self._light
            self._bright *= light / self._light
        self._light = light

    def _predict(self, image: GreyImage) -> Positions:
        """Say where the markers are: one step on, or still there, or shifted all together."""
        middle = float((self._dark + self._bright).mean()) / 2 * self._sign
        for guess in (self._expected + self._step, self._expected):
            if self._sign * kernel.brightness(image, guess, 0.0, 0.0) > middle:
                return guess
        self.audit.jumps += 1
        shift = kernel.best_shift(image, self._expected, self._reach, SEARCH_STEP_PX, self._sign)
        shifted: Positions = self._expected + np.array(shift)
        return shifted

    def _look(
        self,
        image: GreyImage,
        predicted: Positions,
        position: Positions,
        found: NDArray[np.bool_],
    ) -> None:
        """Find markers in their windows, each blob for one of them only."""
        kernel.centroids(
            image,
            predicted,
            self._dark,
            self._bright,
            self._half,
            self._mass,
            3,
            position,
            found,
        )
        self._settle(position, found, predicted)

    def _settle(self, position: Positions, found: NDArray[np.bool_], predicted: Positions) -> None:
        """Lose the markers whose blob is another's, or that do not move with their neighbours."""
        self.audit.shared += kernel.share_blobs(
            position, found, predicted, self._nearest, self._owner
        )
        self.audit.strangers += kernel.drop_strangers(
            position, found, self.rest_position, self._neighbours, self._farthest
        )

    def _look_where_neighbours_are(
        self, image: GreyImage, position: Positions, found: NDArray[np.bool_]
    ) -> None:
        """Look for the lost once more, where their neighbours' motion puts them."""
        expected = np.empty_like(position)
        self._expect(position, expected)
        lost = np.where(found[:, None], np.nan, expected)
        again, too = np.empty_like(position), np.empty_like(found)
        kernel.centroids(
            image, lost, self._dark, self._bright, self._half, self._mass, 3, again, too
        )
        position[too], found[too] = again[too], True
        self._settle(position, found, expected)

    def _search(
        self,
        image: GreyImage,
        predicted: Positions,
        position: Positions,
        found: NDArray[np.bool_],
    ) -> None:
        """Give markers to the blobs of the whole picture, nearest to where they are expected."""
        self.audit.searches += 1
        blobs, _ = find_blobs(image, self._sensor.detector)
        blob = link_one_to_one(predicted, blobs, self._reach / 2)
        found[:] = blob != NO_BLOB
        position[:] = np.nan
        position[found] = blobs[blob[found]]
        self._settle(position, found, predicted)

    def _expect(self, position: Positions, expected: Positions) -> None:
        kernel.from_neighbours(position, self.rest_position, self._last, self._neighbours, expected)

    def _remember(self, image: GreyImage, position: Positions) -> None:
        """Keep places, steps and grey levels for the next frame."""
        step = position - self._last
        self._step = np.where(np.isnan(step), 0.0, step)
        self._expect(position, self._expected)
        self._last = self._expected.copy()
        dark, bright = np.empty_like(self._dark), np.empty_like(self._bright)
        kernel.levels(image, self._expected, self._half, dark, bright)
        seen = ~np.isnan(position[:, 0])
        self._dark[seen] += FOLLOW_LIGHT * (dark - self._dark)[seen]
        self._bright[seen] += FOLLOW_LIGHT * (bright - self._bright)[seen]


def _neighbours(position: Positions) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return each marker's distance to the nearest other, and its nearest others, (n, k)."""
    if len(position) < 2:
        return np.full(len(position), np.inf), np.zeros((len(position), 0), np.int64)
    k = min(N_NEIGHBOURS + 1, len(position))
    distance, index = cKDTree(position).query(position, k=k)
    return distance[:, 1], np.ascontiguousarray(index[:, 1:], dtype=np.int64)


def _radius(image: GreyImage, position: Positions, sensor: Sensor) -> float:
    """Return the median radius of the blobs, px.

    Raises
    ------
    InputError
        If there are none.
    """
    _, area = find_blobs(image, sensor.detector)
    if len(area) == 0:
        raise InputError("the rest frame", f"{len(position)} markers", "none")
    return float(np.sqrt(np.median(area) / np.pi))
