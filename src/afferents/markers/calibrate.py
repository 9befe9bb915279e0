"""A sensor file from clips at rest: what each shows, all together, and followed on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from afferents.documents import quoted
from afferents.errors import InputError, then
from afferents.markers import detect, estimate, layout, rest, suspects, track
from afferents.markers.sensor import WHOLE, Picture, Sensor
from afferents.quality.image import ImageQuality, measure_image_quality
from afferents.store.recording import GreyImage, Video

LEAST_ALIKE, IN_PLACE = 0.6, 0.2
"""Clips of one sensor show this share of each other's markers, for all their light, each within
this share of a spacing of its place."""
MOST_FOLLOWED, LEAST_AGAIN = 300, 0.25
"""Frames after those at rest in which the markers are looked for again, and the share of them that
is found in most of these: of noise 0.03 at most, of real clips 0.98, or 0.6 with lamps in the dots.
"""
MADE_BY = "# Made by afferents calibrate; see the picture beside it."
"""First line of a sensor file that `calibrate` writes."""


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
        Frames from the rest frame on in which the skin did not move, of those looked at.
    rest_frame
        Index of the first frame at rest: those before it are old (`count_stale`).
    bits
        Of each pixel, as the camera gave it.
    """

    video: Video
    image: GreyImage
    sensor: Sensor
    seen: rest.AtRest
    n_still: int
    n_looked: int
    rest_frame: int
    bits: int


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


def look_at_rest(video: Video, within: Picture = WHOLE) -> Clip:
    """Find out how the markers of a clip look, and where they are at rest.

    Parameters
    ----------
    within
        Which part of the picture shows the skin.

    Raises
    ------
    InputError
        If it has no frames, or shows no markers, or a mask lies outside its picture.
    """
    if fault := within.misplaced(video.width, video.height):
        raise InputError(f"--{fault}; give x,y,radius, px, in the picture of {video.path}")
    frames = list(islice(video.frames(), rest.N_FIRST))
    if not frames:
        raise InputError(f"{video.path}: expected a clip of the skin at rest, found no frames")
    images = [frame.image for frame in frames]
    at_first = estimate.estimate_detector(images[0], video.path, within)
    rest_frame = rest.count_stale(images, at_first)
    images = images[rest_frame : rest_frame + rest.N_FRAMES]
    image, n_still = rest.still_picture(images, at_first)
    sensor = estimate.estimate_detector(image, video.path, within)
    seen, bits = rest.seen_at_rest(image, sensor), frames[0].bits
    return Clip(video, image, sensor, seen, n_still, len(images), rest_frame, bits)


def seen_in_most(clips: Sequence[Clip]) -> detect.Positions:
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
        placed, present = layout.match_layout(found, template, where, clip.seen.faint, needed=0.0)
        seen, filed = placed[present], template[present]
        # The share of markers that keep their places among the others in both pictures.
        off = np.hypot(*(layout.carry_over(seen, seen, filed) - filed).T)
        alike = float(np.mean(off < IN_PLACE * detect.spacing_px(filed)))
        if alike * present.mean() < LEAST_ALIKE:
            first = f"the {len(template)} markers of {clips[0].video.path.name}"
            hint = "give the clips of one sensor, in one picture size, at a time"
            raise InputError(
                f"{where}: expected {first}, found {int(present.sum())} of them{then(hint)}"
            )
        gate = layout.GATE_SHARE * detect.spacing_px(template)
        new = layout.carry_over(found, seen, filed)
        far = np.hypot(*(new[:, None] - template[None]).transpose(2, 0, 1)).min(axis=1) > gate
        n_seen += present
        union = np.concatenate([template, new[far]])
        n_seen = np.concatenate([n_seen, np.ones(int(far.sum()), dtype=int)])
    return union[2 * n_seen >= len(clips)]


def follow_on(clip: Clip, position: detect.Positions) -> Followed:
    """Look for the markers in the frames of a clip that were not used.

    Parameters
    ----------
    position
        The sensor's markers, shape (n, 2), px, maybe in another clip's picture.
    """
    placed, present = layout.match_layout(
        clip.seen.position, position, clip.video.path, clip.seen.faint, needed=0.0
    )
    tracker = track.Tracker(clip.sensor, placed, "windowed", clip.image, None, present)
    n_found, n_frames, moved = np.zeros(len(placed), dtype=np.intp), 0, suspects.MovedFrames()
    stop = clip.rest_frame + clip.n_still + MOST_FOLLOWED
    for index, frame in enumerate(islice(clip.video.frames(), clip.rest_frame, stop)):
        seen = tracker.step(frame.image)
        if index >= clip.n_still:
            n_frames += 1
            n_found += seen.detected
            moved.add(frame.image, seen.position, tracker.rest_position)
    still = suspects.stay_still(moved, tracker.rest_position, clip.sensor) & present
    return Followed(n_frames, n_found, still)


@dataclass(frozen=True)
class Calibration:
    """What clips show of their sensor.

    Attributes
    ----------
    sensor
        Ready to be written.
    image
        The median picture of the first clip, (height, width).
    position
        Its markers, (n, 2), px.
    suspects
        What looks like markers there and is left out, (k, 2), px.
    found, picture
        Layout, light and focus.
    n_again, n_checked
        Markers found again in most of the frames that were not used, and how many frames.
    clips
        What was looked at.
    """

    sensor: Sensor
    image: GreyImage
    position: detect.Positions
    suspects: detect.Positions
    found: layout.FoundLayout
    picture: ImageQuality
    n_again: int
    n_checked: int
    clips: tuple[Clip, ...]


def calibrate_from_clips(
    video: Video | Sequence[Video],
    name: str,
    pitch_mm: float | None = None,
    picture: Picture = WHOLE,
) -> Calibration:
    """Find out how a sensor's markers look and what layout they form, from clips at rest.

    Parameters
    ----------
    video
        A clip, or several of the same sensor; markers are those that at least half of them show.
    name
        What the sensor is to be called.
    pitch_mm
        Distance of its markers on the skin, mm, where it is known.
    picture
        Which part of the picture shows the skin, and which way up.

    Raises
    ------
    InputError
        If a clip shows no markers, or another sensor than the first.
    """
    if pitch_mm is not None and not 0 < pitch_mm < math.inf:
        raise InputError(f"--pitch-mm: expected a distance above 0, mm, found {pitch_mm:g}")
    clips = tuple(
        look_at_rest(each, picture) for each in (video if isinstance(video, Sequence) else [video])
    )
    first = clips[0]
    height, width = first.image.shape
    for clip in clips[1:]:  # lengths in px would not hold for another size
        if clip.image.shape != (height, width):
            size = f"{clip.image.shape[1]} x {clip.image.shape[0]} px"
            raise InputError(
                f"{clip.video.path}: expected {width} x {height} px, as in "
                f"{first.video.path.name}, found {size}; calibrate each size by itself"
            )
    position = seen_in_most(clips)
    followed = [follow_on(clip, position) for clip in clips]
    still = np.any([each.still for each in followed], axis=0)
    n_checked = sum(each.n_frames for each in followed)
    again = 2 * np.sum([each.n_found for each in followed], axis=0) > n_checked
    if again.sum() < LEAST_AGAIN * len(again) and n_checked:
        raise InputError(
            f"{first.video.path}: expected markers that are there in other frames, too, found "
            f"{again.sum()} of {len(again)} blobs again, as of noise; check light and focus"
        )
    suspects = np.concatenate([first.seen.suspects, position[still]])
    position, again = position[~still], again[~still]
    found = layout.find_layout(detect.turned(position, first.sensor))
    places: dict[str, object] = {"layout": found.layout, "n_markers": len(position)}
    if found.grid is not None:
        rows, columns = int(found.grid.row.max()) + 1, int(found.grid.column.max()) + 1
        places |= {"rows": rows, "columns": columns, "n_markers": rows * columns}
    else:
        order = np.lexsort((position[:, 0], position[:, 1]))
        position = position[order]
        places["markers"] = tuple((round(float(x), 1), round(float(y), 1)) for x, y in position)
    described = first.sensor.model_dump() | places | {"name": name, "rest_frame": 0}
    sensor = Sensor.model_validate(described | {"pitch_mm": pitch_mm})
    quality = measure_image_quality(
        detect.without_shine(first.image, sensor.looks), position, detect.spacing_px(position)
    )
    return Calibration(
        sensor, first.image, position, suspects, found, quality, int(again.sum()), n_checked, clips
    )


def sensor_toml(sensor: Sensor) -> str:
    """Return a sensor file that `load_sensor` reads."""
    lines = [
        MADE_BY,
        "# Lengths are in px of the camera image, so they hold for this image size alone.",
        "",
    ]
    values = sensor.model_dump(exclude={"detector", "markers", "picture"}, exclude_none=True)
    lines += [f"{key} = {_toml(value)}" for key, value in values.items()]
    if sensor.radius_px is None:
        lines.append("radius_px = inf")
    if sensor.markers is not None:
        lines.append("# Where the markers are at rest, in the order that they keep.")
        lines.append("markers = [")
        lines += [f"  [{x:.1f}, {y:.1f}]," for x, y in sensor.markers]
        lines.append("]")
    for table, part in (("picture", sensor.picture), ("detector", sensor.detector)):
        if part is not None and (
            values := part.model_dump(mode="json", exclude_defaults=table == "picture")
        ):
            lines += ["", f"[{table}]", *(f"{key} = {_toml(one)}" for key, one in values.items())]
    return "\n".join(lines) + "\n"


def _toml(value: object) -> str:
    return quoted(value) if isinstance(value, str) else f"{value}"
