"""Following markers by centroids in windows round where they are expected.

A marker is looked for where it was plus its last step. If the discs are not there, the common
shift of all markers is searched, over more than the distance of two markers; if most are still
not found, the whole picture is searched for blobs. So a frame costs a fraction of a millisecond
(the blob detector takes ten), and a jump costs no identity. The grey levels of skin and disc are
kept for each marker and follow the light.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from afferents.errors import InputError
from afferents.markers import detect, kernel, slips
from afferents.markers.detect import Positions
from afferents.markers.sensor import Sensor
from afferents.store.recording import GreyImage, make_grey

N_NEIGHBOURS = 8
"""Markers around a marker that say where it must be when it is lost."""
EDGE_PX = 1.0
"""A window is this much larger than the disc to every side, px."""
WINDOW = 0.45
"""Half a window is at most this share of the distance to the nearest marker, so that no two
windows hold both discs; nor may a marker lie farther from its neighbours' motion."""
SAME_BLOB = 0.4
"""Two markers nearer than this share of their distance at rest are on one blob."""
SEARCH = 1.2
"""The common shift is searched up to this multiple of the distance of markers."""
FAR = 0.15
"""A common step beyond this share of the search is not believed without one."""
FAINT = 0.3
"""A lost marker is there if it stands out by this share of what markers stand out by."""
_FAR_RADII = 8.0
"""Markers farther apart than this many radii are as good as alone."""
_ENOUGH = 0.5
"""Below this share of markers found the whole picture is searched."""
_MOST = 0.9
"""Below this share of markers found the picture may be damaged."""
_CHECK, _LONGEST = 4, 64
"""Frames between two checks of names in doubt: at first, and at most while they prove right."""


class Tracked(NamedTuple):
    """Markers in one frame: `position` (n, 2) in px, NaN where lost, and `detected` (n,).

    Of cells, which stay where they are, `grey` (n,) is how far they are from rest, grey levels.
    """

    position: Positions
    detected: NDArray[np.bool_]
    grey: NDArray[np.float64] | None = None


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
    checks
        Frames in which names were in doubt and were checked by the layout's order.
    slips
        Of these, those in which markers had slipped to their neighbours' blobs, and were put right.
    torn
        Frames of which a part was shifted as no skin can be; the markers there were lost.
    """

    shared: int = 0
    strangers: int = 0
    jumps: int = 0
    searches: int = 0
    checks: int = 0
    slips: int = 0
    torn: int = 0


class Renamed(NamedTuple):
    """Markers that had slipped: which, (n,), and since at most how many frames."""

    which: NDArray[np.bool_]
    n_frames: int

    def lose(self, tracked: Sequence[Tracked]) -> None:
        """Lose them in the frames before they were found slipped, back to the last check."""
        for frame in tracked[-self.n_frames : -1]:
            frame.position[self.which] = np.nan
            frame.detected[self.which] = False


class WindowedTracker:
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
    levels
        Grey level of each value in the images, see `store.recording.Frame`; only the blob
        detector needs to know.
    present
        Which markers the rest frame shows, shape (n,); the others are taken to look like the
        median of these. None for all.
    """

    def __init__(
        self,
        sensor: Sensor,
        rest_position: Positions,
        rest_image: GreyImage,
        levels: GreyImage | None = None,
        present: NDArray[np.bool_] | None = None,
    ) -> None:
        """Measure every marker in the rest frame."""
        self.audit = Audit()
        self.jump_px = 0.0
        self._sensor, self._levels, self._looks = sensor, levels, sensor.looks
        rest_image = detect.without_shine(rest_image, self._looks)
        self._sign = 1.0 if self._looks.blob_colour == 255 else -1.0
        distance, self._neighbours = nearest_markers(rest_position)
        _, area = detect.find_markers(make_grey(rest_image, levels), sensor)
        if len(area) == 0:
            raise InputError(f"the rest frame: expected {len(rest_position)} markers, found none")
        radius = float(np.sqrt(np.median(area) / np.pi))
        self._half = np.maximum(np.minimum(radius + EDGE_PX, WINDOW * distance), 2).astype(np.int64)
        self._farthest, self._nearest = WINDOW * distance, SAME_BLOB * distance
        self._reach = SEARCH * float(np.median(np.minimum(distance, _FAR_RADII * radius)))
        self._room = kernel.working_room(self._half)
        self._strange = np.empty(len(rest_position), np.bool_)
        n = len(rest_position)
        self._dark, self._bright, self._mass = np.empty(n), np.empty(n), np.empty(n)
        kernel.levels(rest_image, rest_position, self._half, self._dark, self._bright)
        self._light = 0.0
        refined = np.empty_like(rest_position)
        kernel.weigh(
            rest_image, rest_position, self._dark, self._bright, self._half, self._mass, self._room,
            refined,
        )  # fmt: skip
        off = np.abs(refined - rest_position).max(axis=1) > EDGE_PX
        refined[off] = rest_position[off]  # a blob's centre stands where there is no centroid
        self.rest_position: Positions = refined
        if present is not None and not present.all():
            for measure in (self._dark, self._bright, self._mass):
                measure[~present] = np.median(measure[present])
            self.rest_position[~present] = rest_position[~present]
        self._rest_dark, self._rest_bright = self._dark.copy(), self._bright.copy()
        self._expected = self.rest_position.copy()
        self._step = np.zeros((n, 2))
        there = np.ones(n, np.bool_) if present is None else present
        self._slips = slips.SlipCheck(self.rest_position, self._neighbours, there)
        self._unchecked, self._wait, self._due = 0, _CHECK, 0
        self.renamed: Renamed | None = None

    def step(self, image: GreyImage) -> Tracked:
        """Return where the markers are in the next frame."""
        image, n = detect.without_shine(image, self._looks), len(self._expected)
        predicted, position, found = np.empty((n, 2)), np.empty((n, 2)), np.empty(n, np.bool_)
        self._light, n_found, shared, strangers, self.jump_px = kernel.look(
            image, self._expected, self._step, self.rest_position, self._dark, self._bright,
            self._half, self._mass, self._neighbours, self._nearest, self._farthest, self._light,
            self._room, self._strange, predicted, position, found,
        )  # fmt: skip
        self.audit.shared += shared
        self.audit.strangers += strangers
        if n_found < 0:
            predicted = self._shifted(image, self._expected)
            self._look(image, predicted, position, found)
        elif self.jump_px > FAR * self._reach:
            # A lattice nearly fits itself when it is shifted by its pitch.
            better = self._shifted(image, predicted)
            if np.abs(better - predicted).max() > self._reach / 4:
                predicted = better
                self._look(image, predicted, position, found)
        if not found.all():
            self._look_where_neighbours_are(image, position, found)
            if found.mean() < _ENOUGH:
                self._search(image, predicted, position, found)
        there = position
        if np.count_nonzero(found) < _MOST * n or self.jump_px > FAR * self._reach:
            # Where most of a damaged picture is shifted, the others were not looked for where they
            # still are.
            stayed = np.where(found[:, None], np.nan, self._expected + self._step)
            there = np.where(found[:, None], position, self._seen(image, stayed))
        if not self._lose_shifted_part(there, position, found):
            self._check_names(image, position, found)
        kernel.remember(
            image, position, self.rest_position, self._neighbours, self._half, self._expected,
            self._step, self._dark, self._bright,
        )  # fmt: skip
        if found.any() and not found.all():
            # The grey levels of lost markers go as those of the others went since rest.
            for now, rest in ((self._dark, self._rest_dark), (self._bright, self._rest_bright)):
                gone = np.median(now[found] - rest[found])
                now[~found] += kernel.FOLLOW_LIGHT * (rest[~found] + gone - now[~found])
        return Tracked(position, found)

    def _lose_shifted_part(
        self, there: Positions, position: Positions, found: NDArray[np.bool_]
    ) -> bool:
        """Lose markers in the shifted part of a damaged picture; return whether it is damaged.

        Parameters
        ----------
        there
            Where markers are; the others are taken over into `position` and `found`.
        """
        shifted = self._slips.torn_across(there, self._expected, self._step)
        if shifted is None:
            return False
        self.audit.torn += 1
        self.renamed, self.jump_px = None, 0.0
        position[:] = np.where(shifted[:, None], np.nan, there)
        found[:] = ~np.isnan(position[:, 0])
        return True

    def _check_names(self, image: GreyImage, position: Positions, found: NDArray[np.bool_]) -> None:
        """Where names are in doubt, look whether markers slipped to their neighbours' blobs."""
        self.renamed = None
        self._unchecked += 1
        self._due -= 1
        if not self._slips.suspicious(position):
            self._unchecked = 0
            return
        if self.jump_px > FAR * self._reach:
            self._due, self._wait = 0, _CHECK
        if self._due <= 0:
            self._settle_names(image, position, found)
        off = self._slips.torn_off(position)
        position[off], found[off] = np.nan, False

    def _settle_names(
        self, image: GreyImage, position: Positions, found: NDArray[np.bool_]
    ) -> None:
        """Check names by the whole picture and the layout's order, and take better ones over."""
        self.audit.checks += 1
        blobs, _ = detect.find_markers(make_grey(image, self._levels), self._sensor)
        better = self._slips.settle(position, blobs, lambda expected: self._seen(image, expected))
        self._wait = _CHECK if better is not None else min(2 * self._wait, _LONGEST)
        self._due = self._wait
        # Where a shifted part looked like a jump, only better names show that it is none.
        if better is not None and not self._lose_shifted_part(better, position, found):
            self._rename(better, position, found)
        self._unchecked = 0

    def _rename(self, better: Positions, position: Positions, found: NDArray[np.bool_]) -> None:
        """Take better names over; the grey levels are those of rest in the others' light."""
        kept = np.hypot(*(better - position).T) < EDGE_PX
        which = found & ~kept
        self.audit.slips += int(which.any())
        self.renamed = Renamed(which, self._unchecked)
        position[:], found[:] = better, ~np.isnan(better[:, 0])
        for now, rest in ((self._dark, self._rest_dark), (self._bright, self._rest_bright)):
            now[which] = rest[which] + np.median(now - rest)
        self._step[:] = 0
        self._expected[found] = position[found]

    def _seen(self, image: GreyImage, expected: Positions) -> Positions:
        """Return the markers seen near where they are expected, by the light that is there."""
        somewhere = np.where(np.isnan(expected), self.rest_position, expected)
        dark, bright, stands_out = self._levels_at(image, somewhere)
        position, found = np.empty_like(expected), np.empty(len(expected), np.bool_)
        wanted = np.where(stands_out[:, None], expected, np.nan)
        self._take_centroids(image, wanted, dark, bright, position, found)
        return position

    def _levels_at(
        self, image: GreyImage, position: Positions
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return the grey levels of skin and marker at some places, and where one stands out."""
        dark, bright = np.empty_like(self._dark), np.empty_like(self._bright)
        kernel.levels(image, position, self._half, dark, bright)
        contrast = self._sign * (self._bright - self._dark)
        return dark, bright, self._sign * (bright - dark) > FAINT * np.median(contrast)

    def _shifted(self, image: GreyImage, position: Positions) -> Positions:
        """Say where the markers are after they moved farther than expected, all together."""
        self.audit.jumps += 1
        shift = kernel.best_shift(image, position, self._reach, self._sign)
        shifted: Positions = position + np.array(shift)
        return shifted

    def _look(
        self,
        image: GreyImage,
        predicted: Positions,
        position: Positions,
        found: NDArray[np.bool_],
    ) -> None:
        """Find markers in their windows, each blob for one of them only."""
        self._take_centroids(image, predicted, self._dark, self._bright, position, found)
        self._settle(position, found, predicted)
        self.jump_px = kernel.common_step(position, self._expected)

    def _take_centroids(
        self,
        image: GreyImage,
        expected: Positions,
        dark: NDArray[np.float64],
        bright: NDArray[np.float64],
        position: Positions,
        found: NDArray[np.bool_],
    ) -> None:
        kernel.centroids(
            image, expected, dark, bright, self._half, self._mass, self._room, position, found
        )

    def _settle(self, position: Positions, found: NDArray[np.bool_], predicted: Positions) -> None:
        """Lose the markers whose blob is another's, or that do not move with their neighbours."""
        self.audit.shared += kernel.share_blobs(
            position, found, predicted, self._neighbours, self._nearest
        )
        self.audit.strangers += kernel.drop_strangers(
            position, found, self.rest_position, self._neighbours, self._farthest, self._strange
        )

    def _look_where_neighbours_are(
        self, image: GreyImage, position: Positions, found: NDArray[np.bool_]
    ) -> None:
        """Look for the lost once more, where their neighbours' motion puts them.

        By the light that is there: a marker that slid into the pool of an LED is brighter, and
        so is the skin around it.
        """
        expected = np.empty_like(position)
        kernel.from_neighbours(
            position, self.rest_position, self._expected, self._neighbours, expected
        )
        dark, bright, stands_out = self._levels_at(image, expected)
        lost = np.where((~found & stands_out)[:, None], expected, np.nan)
        again, too = np.empty_like(position), np.empty_like(found)
        self._take_centroids(image, lost, dark, bright, again, too)
        position[too], found[too] = again[too], True
        self._settle(position, found, expected)
        back = too & found
        self._dark[back], self._bright[back] = dark[back], bright[back]

    def _search(
        self,
        image: GreyImage,
        predicted: Positions,
        position: Positions,
        found: NDArray[np.bool_],
    ) -> None:
        """Give markers to the blobs of the whole picture, nearest to where they are expected."""
        self.audit.searches += 1
        blobs, _ = detect.find_markers(make_grey(image, self._levels), self._sensor)
        blob = detect.link_one_to_one(predicted, blobs, self._reach / 2)
        found[:] = blob != detect.NO_BLOB
        position[:] = np.nan
        position[found] = blobs[blob[found]]
        self._settle(position, found, predicted)


def nearest_markers(position: Positions) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return each marker's distance to the nearest other, and its nearest others, (n, k)."""
    if len(position) < 2:
        return np.full(len(position), np.inf), np.zeros((len(position), 0), np.int64)
    k = min(N_NEIGHBOURS + 1, len(position))
    distance, index = cKDTree(position).query(position, k=k)
    return distance[:, 1], np.ascontiguousarray(index[:, 1:], dtype=np.int64)
