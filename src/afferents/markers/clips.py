"""What the clips of one sensor show of it: each at rest, all together, and followed on."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.recording import GreyImage, Video
from afferents.markers.detect import Positions, spacing_px
from afferents.markers.estimate import estimate_detector
from afferents.markers.layout import GATE_SHARE, match_layout, put_back
from afferents.markers.rest import N_FRAMES, SeenAtRest, seen_at_rest, still_picture
from afferents.markers.sensor import Sensor
from afferents.markers.suspects import MovedFrames, stay_still
from afferents.markers.track import Tracker

LEAST_ALIKE, IN_PLACE = 0.6, 0.2
"""Clips of one sensor show this share of each other's markers, for all their light, each within so
much of a spacing of its place."""
MOST_FOLLOWED = 300
"""Frames after those at rest in which the markers are looked for again."""


@dataclass(frozen=True)
class Clip:
    """A clip and what its frames at rest show.

    Attributes
    ----------
    video
        Where it comes from.
    image
        The median of its frames at rest, (height, width).
    sensor
        Says how markers look in it.
    seen
        What is found in it.
    n_still, n_looked
        Frames from the first in which the skin did not move, of those looked at.
    """

    video: Video
    image: GreyImage
    sensor: Sensor
    seen: SeenAtRest
    n_still: int
    n_looked: int


@dataclass(frozen=True)
class Followed:
    """What became of the markers in frames that were not used to find them.

    Attributes
    ----------
    n_frames
        How many frames these are.
    n_found
        In how many of them each marker was found, (n,).
    still
        Which markers stood still while all round them moved, (n,).
    """

    n_frames: int
    n_found: NDArray[np.intp]
    still: NDArray[np.bool_]


def look_at_rest(video: Video) -> Clip:
    """Find out how the markers of a clip look, and where they are at rest.

    Raises
    ------
    InputError
        If it has no frames, or shows no markers.
    """
    images = [frame.image for frame in islice(video.frames(), N_FRAMES)]
    if not images:
        raise InputError(video.path, "a clip of the skin at rest", "no frames")
    image, n_still = still_picture(images, estimate_detector(images[0], video.path))
    sensor = estimate_detector(image, video.path)
    return Clip(video, image, sensor, seen_at_rest(image, sensor), n_still, len(images))


def seen_in_most(clips: Sequence[Clip]) -> Positions:
    """Return the markers that at least half of the clips show, in the first one's picture, px.

    Raises
    ------
    InputError
        If a clip shows another layout than the first.
    """
    union = clips[0].seen.position
    n_seen = np.ones(len(union), dtype=int)
    for clip in clips[1:]:
        found, template = clip.seen.position, union
        where = clip.video.path
        placed, present = match_layout(found, template, where, clip.seen.faint, needed=0.0)
        if _alike(placed[present], template[present]) * present.mean() < LEAST_ALIKE:
            first = f"the {len(template)} markers of {clips[0].video.path.name}"
            hint = "give the clips of one sensor, in one picture size, at a time"
            raise InputError(where, first, f"{int(present.sum())} of them", hint)
        gate = GATE_SHARE * spacing_px(template)
        new = put_back(found, placed[present], template[present])
        far = np.hypot(*(new[:, None] - template[None]).transpose(2, 0, 1)).min(axis=1) > gate
        n_seen += present
        union = np.concatenate([template, new[far]])
        n_seen = np.concatenate([n_seen, np.ones(int(far.sum()), dtype=int)])
    return union[2 * n_seen >= len(clips)]


def _alike(seen: Positions, filed: Positions) -> float:
    """Return which share of markers keep their places among the others in both pictures."""
    off = np.hypot(*(put_back(seen, seen, filed) - filed).T)
    return float(np.mean(off < IN_PLACE * spacing_px(filed)))


def follow_on(clip: Clip, position: Positions) -> Followed:
    """Look for the markers in the frames of a clip that were not used.

    Parameters
    ----------
    position
        The sensor's markers, shape (n, 2), px, maybe in another clip's picture.
    """
    rest, present = match_layout(
        clip.seen.position, position, clip.video.path, clip.seen.faint, needed=0.0
    )
    tracker = Tracker(clip.sensor, rest, "windowed", clip.image, None, present)
    n_found, n_frames, moved = np.zeros(len(rest), dtype=np.intp), 0, MovedFrames()
    for index, frame in enumerate(islice(clip.video.frames(), clip.n_still + MOST_FOLLOWED)):
        seen = tracker.step(frame.image)
        if index >= clip.n_still:
            n_frames += 1
            n_found += seen.detected
            moved.add(frame.image, seen.position, tracker.rest_position)
    still = stay_still(moved, tracker.rest_position, clip.sensor) & present
    return Followed(n_frames, n_found, still)
