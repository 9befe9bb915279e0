"""From clips at rest to a sensor file, with a picture to check it by."""

import math
import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from afferents import files, progress
from afferents.errors import InputError
from afferents.markers import detect, estimate, rest, suspects
from afferents.markers.calibrate import MADE_BY, Calibration, calibrate_from_clips, sensor_toml
from afferents.markers.sensor import WHOLE, DiscDetector, Picture, Sensor, load_sensor
from afferents.recordings.video import open_clip
from afferents.reporting import recording_figures, style

_ANY_HZ = 1.0
"""Rate of clips of which only places are wanted: of images nothing else says one."""


def calibrate_sensor(
    videos: Sequence[Path],
    out: Path,
    pitch_mm: float | None = None,
    keep: str | None = None,
    hide: Sequence[str] = (),
    turn: int = 0,
    force: bool = False,
) -> tuple[list[str], Path]:
    """Measure a new sensor: how its markers look and how they are laid out.

    Writes the sensor file that the other commands take, and a picture next to it to check.

    Parameters
    ----------
    videos
        Videos of one sensor, each beginning with the skin at rest.
    out
        Sensor file (TOML) to write; a picture is put next to it.
    pitch_mm
        Distance between neighbouring markers on the skin, mm, if known.
    keep
        Circle x,y,radius, px, outside which there are no markers.
    hide
        Circle x,y,radius, px, in which there are none, such as a lamp; may be given again.
    turn
        Degrees clockwise, 0, 90, 180 or 270, by which the picture must be turned to stand upright.
    force
        Overwrite what this command wrote there before (nothing else).

    Raises
    ------
    InputError
        If a clip shows no markers or another sensor, one is given twice, `out` is no .toml, or
        it or the picture is not free; if a circle is malformed, or lies outside the picture.
    """
    if out.suffix != ".toml":
        raise InputError(f"--out: expected a name that ends in .toml, found '{out}'")
    if not videos:
        raise InputError("calibrate: expected a clip of the skin at rest, or several, found none")
    for n, video in enumerate(videos):
        if os.path.realpath(video) in map(os.path.realpath, videos[:n]):
            raise InputError(f"{video}: expected each clip once, found it twice")
    if turn not in (0, 90, 180, 270):
        raise InputError(f"--turn: expected 0, 90, 180 or 270 degrees, found {turn}")
    masks = {
        "keep": None if keep is None else _circle("--keep", keep),
        "hide": [_circle("--hide", one) for one in hide],
    }
    # A name that ends in a digit would be read as an image of a numbered series.
    end = "-markers.png" if out.stem[-1].isdigit() else ".png"
    picture = out.with_name(out.stem + end)
    files.require_free(out, lambda p: files.has_mark(p, MADE_BY), force=force, reads=videos)
    files.require_free(picture, files.is_our_picture, force=force, reads=videos)
    found = calibrate_from_clips(
        [open_clip(video, _ANY_HZ) for video in videos],
        progress.printable(out.stem),
        pitch_mm,
        Picture.model_validate(masks | {"turn": turn}),
    )
    n = len(found.suspects)
    figure = recording_figures.markers_figure(
        found.image,
        found.position,
        np.ones(len(found.position), dtype=bool),
        ", ".join(video.name for video in videos),
        title=f"{len(found.position)} markers" + (f"; {n} suspects are left out" if n else ""),
        suspects=found.suspects,
        masks=found.sensor.picture.masks,
    )
    with files.write_aside(out) as partial:  # both, or neither
        partial.write_text(sensor_toml(found.sensor), encoding="utf-8")
        style.save_figure(figure, picture)
    return describe(found), picture


def _circle(flag: str, text: str) -> tuple[float, ...]:
    """Return a circle's middle in x and y, and its radius, px, from its text."""
    with suppress(ValueError):
        x, y, radius = map(float, text.split(","))
        if radius > 0 and math.isfinite(x + y + radius):
            return x, y, radius
    raise InputError(f"{flag}: expected x,y,radius, px, such as 320,240,200, found '{text}'")


def describe(found: Calibration) -> list[str]:
    """Return in sentences what was found, to be checked against the picture."""
    sensor, layout, picture = found.sensor, found.found, found.picture
    detector, bright = sensor.looks, sensor.looks.blob_colour
    size = f", {sensor.rows} x {sensor.columns}" if sensor.rows else ""
    roll = f", rolled by {layout.roll_deg:.1f} deg" if layout.roll_deg == layout.roll_deg else ""
    scale, mm = "", ""
    if sensor.pitch_mm:
        px_per_mm = layout.spacing_px / sensor.pitch_mm
        scale = f" ({px_per_mm:.1f} px a mm)"
        if isinstance(detector, DiscDetector):
            mm = f" ({detector.radius_px / px_per_mm:.2f} mm)"
    n, n_clips, n_suspects = len(found.position), len(found.clips), len(found.suspects)
    clips = f" that at least half of {n_clips} clips show" if n_clips > 1 else ""
    missing = (sensor.n_markers or 0) - n
    masked = " where keep and hide leave the picture" if sensor.picture.masks else ""
    sentences = [
        f"{n} {'bright' if bright else 'dark'} markers{masked}{clips}, "
        f"{estimate.looks(detector)}{mm}, {layout.spacing_px:.1f} px apart{scale}.",
        f"Layout: {sensor.layout}{size}{roll}{f', {missing} missing' if missing else ''}.",
        f"Grey levels: markers {picture.disc_grey:.0f}, skin {picture.skin_grey:.0f}; edges "
        f"{picture.edge_px:.1f} px wide.",
    ]
    if detector.shine_px is not None:
        sentences.append(
            f"{'Dark spots' if bright else 'Highlights'} of up to {detector.shine_px} px inside "
            "the markers are taken out before these are looked for (shine_px in the sensor file)."
        )
    sentences += _describe_cuts(found)
    fields = suspects.count_in_fields(np.concatenate([found.position, found.suspects]))
    if len(fields) > 1:  # as mirrors make them
        sentences.append(
            f"The picture shows {len(fields)} fields of dots apart from one another, of "
            f"{', '.join(map(str, fields[:-1]))} and {fields[-1]}; if they are several skins or "
            "mirrors, give each a sensor file of its own, with --keep round it."
        )
    if n_suspects:
        sentences.append(
            f"{n_suspects} more look like markers and are left out (another colour in the "
            "picture): they lie beyond the layout, or stand still while all round them moves."
        )
    sentences.append(
        f"{found.n_again} of {n} are found again in most of the {found.n_checked} frames after "
        "those used."
        if found.n_checked
        else "No frame is left to look for them again; a longer clip would show more."
    )
    return [*sentences, *_describe_motion(found)]


def _describe_cuts(found: Calibration) -> list[str]:
    """Return which circles cut through dots: such a dot is found or lost as the skin moves.

    What is centred in a circle that hides it, such as a lamp, is not named.
    """
    whole = found.sensor.model_copy(update={"picture": WHOLE})
    centre, area = detect.find_markers(found.image, whole)
    sentences = []
    for key, (x, y, radius) in found.sensor.picture.masks:
        beyond_px = np.hypot(*(centre - (x, y)).T) - radius
        cut = (np.abs(beyond_px) < np.sqrt(area / np.pi)) & ((key == "keep") | (beyond_px > 0))
        if n := int(cut.sum()):
            dots = "1 dot" if n == 1 else f"{n} dots"
            sentences.append(
                f"--{key} {x:g},{y:g},{radius:g} cuts through {dots}: move its edge, so that each "
                "dot lies within it or outside."
            )
    return sentences


def _describe_motion(found: Calibration) -> list[str]:
    """Return how the clips start, and where the skin moved: places at rest are doubtful there."""
    clips = {clip.video.path.name: clip for clip in found.clips}
    starts = {
        name: {rest.STALE: clip.rest_frame, rest.BITS: clip.bits} for name, clip in clips.items()
    }
    return rest.start_sentences(starts) + [
        f"{name}: the skin moves from frame {clip.rest_frame + clip.n_still} on, so {clip.n_still} "
        f"of {clip.n_looked} frames were used; for places at rest give a clip at rest."
        for name, clip in clips.items()
        if clip.n_still < clip.n_looked
    ]


def calibrate(
    video: files.Place | Sequence[files.Place],
    out: files.Place,
    pitch_mm: float | None = None,
    force: bool = False,
    keep: Sequence[float] | None = None,
    hide: Sequence[Sequence[float]] = (),
    turn: int = 0,
) -> Sensor:
    """Find out how a sensor's markers look and what layout they form; write its sensor file.

    Parameters
    ----------
    video
        A clip (a video, or a folder of numbered images) that begins with the skin at rest, or
        several of the same sensor.
    out
        Sensor file to write, ending in ``.toml``; a picture to check comes next to it.
    pitch_mm
        Distance of the markers on the skin, mm, if known.
    force
        Whether those of an earlier calibration may be replaced.
    keep, hide
        A circle (x, y, radius), px, outside which there are no markers; and some in which there are
        none.
    turn
        Degrees clockwise by which the picture must be turned to stand upright.

    Returns
    -------
    Sensor
        What was written, to be given as ``sensor`` to the other functions.

    Raises
    ------
    InputError
        If the clip can't be read, shows no markers, or one of the files to write is there already.

    Examples
    --------
    >>> sensor = calibrate("session/1/20/video.mp4", "mine.toml", pitch_mm=1.0)
    >>> sensor.n_markers
    361
    """
    clips = [video] if isinstance(video, str | Path) else video
    calibrate_sensor(
        [Path(clip) for clip in clips],
        Path(out),
        pitch_mm,
        None if keep is None else ",".join(map(str, keep)),
        [",".join(map(str, circle)) for circle in hide],
        turn,
        force,
    )
    return load_sensor(str(out))
