"""How well a video was tracked: figures, what is wrong, and sentences for `inspect`."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.markers.detect import spacing_px
from afferents.markers.rest import start_sentences
from afferents.quality import repeats
from afferents.quality.image import ImageQuality, find_light_issues
from afferents.quality.issues import QualityIssue
from afferents.quality.lasting import lasting, sliding_part, span_text

Lengths = NDArray[np.float64]

END_FRAMES = 5
"""The end of a video is its last five frames, everywhere; a marker is where they show it, in the
median, and lost if none of them does."""
BACK = 0.5
"""A marker is back within this share of the spacing of its rest position."""
STAYS = 0.9
"""A jump lasts if the markers stay away for this much of the time after it."""
STILL_PX = 0.5
"""A marker that never strays farther than this from its rest position has not moved."""
REST_PX = 0.3
"""The skin is at rest while half of its markers are no farther than this from their places."""
FEWEST_AT_REST, MOST_AT_REST = 10, 90
"""Frames at rest for the jitter."""
FEW_SEEN, LOST_S = 0.5, 0.5
"""The skin is covered where less than this share of the markers of the rest frame are seen for
longer than this, s. Simulated recordings show 0.92 of them in any frame, encoded as it may be;
real clips, pushed far, 0.71 in 95% of the frames and 0.55 in the worst."""


class AtEnd(NamedTuple):
    """Where the markers are in the last frames.

    Attributes
    ----------
    n_back, n_elsewhere, n_lost
        Within half a spacing of rest, farther from it, and not seen; together all markers.
    away_px
        Median distance from rest of those seen; NaN if none is.
    """

    n_back: int
    n_elsewhere: int
    n_lost: int
    away_px: float


def measure_end(tracks: xr.Dataset) -> AtEnd:
    """Measure where the markers are at the end.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    seen = tracks[dims.DETECTED].values[-END_FRAMES:]
    rest = tracks[dims.REST_POSITION].values
    step = tracks[dims.POSITION].values[-END_FRAMES:] - rest
    away = np.where(seen, np.hypot(step[..., 0], step[..., 1]), np.nan)[:, seen.any(axis=0)]
    if away.shape[1] == 0:
        return AtEnd(0, 0, len(rest), float("nan"))
    each = np.nanmedian(away, axis=0)
    limit = BACK * spacing_px(rest) if len(rest) > 1 else np.inf
    n_back = int((each <= limit).sum())
    return AtEnd(n_back, len(each) - n_back, len(rest) - len(each), float(np.median(each)))


def find_lasting_jumps(tracks: xr.Dataset) -> list[float]:
    """Return when all markers jumped together and did not come back, s.

    A skin that is shaken jumps to and fro; one that was knocked, or let go, stays where it is.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    time_s = tracks[dims.TIME].values
    jumps = [float(t) for t in np.atleast_1d(tracks.attrs["jumps_s"])]
    if not jumps:
        return []
    start = int(tracks.attrs["rest_frame"])
    moved = tracks[dims.POSITION].values - tracks[dims.REST_POSITION].values
    common = np.full((len(moved), 2), np.nan)
    some = ~np.isnan(moved[..., 0]).all(axis=1)
    common[some] = np.nanmedian(moved[some], axis=1)
    lasting = []
    before_s = time_s[start]
    for jump_s in jumps:
        before = common[(time_s >= before_s) & (time_s < jump_s)]
        after = common[time_s >= jump_s]
        if len(before) == 0:
            continue
        # They must stay farther from where they were than they had strayed before.
        middle = np.nanmedian(before, axis=0)
        strayed = np.nanmax(np.hypot(*(before - middle).T))
        away = np.hypot(*(after - middle).T)
        away = away[~np.isnan(away)]
        landed = np.nanmedian(after, axis=0) - middle
        if len(away) and np.mean(away > strayed) > STAYS and np.hypot(*landed) > strayed:
            lasting.append(jump_s)
            before_s = jump_s
    return lasting


@dataclass(frozen=True)
class TrackingQuality:
    """Figures that say how well a video was tracked. Lengths in px.

    Attributes
    ----------
    n_markers, n_frames
        Markers followed; frames from the rest frame on.
    share_lost
        Share of marker positions, rest frame on, where the marker was not detected.
    n_missing
        Markers not seen in the rest frame.
    n_often_lost
        Markers not detected in more than half of these frames.
    at_end
        Where the markers are in the last frames.
    n_shared
        Positions that two or more markers claim in the same frame, over all frames.
    n_repeated
        Frames that repeat the one before though the skin moved, see `find_repeated`.
    n_dropped
        Frames missing by the others' times.
    n_still
        Markers that moved no farther than `STILL_PX` while others did: reflections, perhaps.
    jitter_px
        How far a marker at rest seems to move: standard deviation (both axes), median over
        markers, until the skin first moves; NaN where that is too short.
    largest_step_px
        Longest way of a marker from one frame to the next.
    largest_displacement_px
        Farthest a marker was from its rest position.
    """

    n_markers: int
    n_frames: int
    share_lost: float
    n_missing: int
    n_often_lost: int
    at_end: AtEnd
    n_shared: int
    n_repeated: int
    n_dropped: int
    n_still: int
    jitter_px: float
    largest_step_px: float
    largest_displacement_px: float


def measure_quality(tracks: xr.Dataset) -> TrackingQuality:
    """Measure how well a video was tracked.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    start = int(tracks.attrs["rest_frame"])
    position = tracks[dims.POSITION].values[start:]
    detected = tracks[dims.DETECTED].values[start:]
    away = np.hypot(*np.moveaxis(position - tracks[dims.REST_POSITION].values, -1, 0))
    step = np.hypot(*np.moveaxis(np.diff(position, axis=0), -1, 0))
    farthest = np.fmax.reduce(away, axis=0)
    return TrackingQuality(
        n_markers=detected.shape[1],
        n_frames=len(detected),
        share_lost=float(1 - detected.mean()),
        n_missing=int((~detected[0]).sum()),
        n_often_lost=int((detected.mean(axis=0) < 0.5).sum()),
        at_end=measure_end(tracks),
        n_shared=sum(
            len(seen) - len(np.unique(seen, axis=0))
            for seen in (frame[~np.isnan(frame[:, 0])] for frame in position)
        ),
        n_repeated=int(repeats.find_repeated(tracks[dims.FRAME_CHANGE].values).sum()),
        n_dropped=repeats.count_dropped(tracks[dims.TIME].values),
        jitter_px=_measure_jitter(position, away),
        n_still=int((farthest < STILL_PX).sum()) if np.any(farthest >= STILL_PX) else 0,
        largest_step_px=_largest(step),
        largest_displacement_px=_largest(away),
    )


def find_track_issues(
    tracks: xr.Dataset, where: object, steady_s: tuple[float, float] | None = None
) -> list[QualityIssue]:
    """Find what is wrong with the markers, their light, and the times of the frames.

    Parameters
    ----------
    tracks
        What `track` returns.
    where
        The video.
    steady_s
        Start and end of constant speed, s; None where nothing says so.
    """
    attributes = tracks.attrs
    found = find_hidden_markers(tracks, where, steady_s)
    if times := find_lasting_jumps(tracks):
        when = f"all markers moved together at {', '.join(f'{t:.2f}' for t in times[:3])} s"
        expected = "a camera and a fingertip that stay where they are mounted"
        cause = "SA-I after it counts from the old rest position"
        jumped = f"that {when} and did not come back"
        found.append(QualityIssue("knocked", where, expected, jumped, cause))
    if n_torn := int(attributes.get("audit_torn", 0)):
        shifted = f"{n_torn} with a part shifted as no skin can be"
        cause = "look at the camera's cable; the markers there are lost"
        found.append(QualityIssue("damaged", where, "whole pictures", shifted, cause))
    if not dims.of_cells(tracks):
        names = [field.name for field in fields(ImageQuality)]
        light = find_light_issues(ImageQuality(**{name: attributes[name] for name in names}))
        found += [
            QualityIssue(kind, where, "sharp markers that stand out", how)
            for kind, how in light.items()
        ]
    found += repeats.find_doubled_frames(tracks[dims.FRAME_CHANGE].values, where)
    return found + repeats.find_time_issues(tracks[dims.TIME].values, where)


def find_hidden_markers(
    tracks: xr.Dataset, where: object, steady_s: tuple[float, float] | None
) -> list[QualityIssue]:
    """Find whether the markers are out of sight while the drum slides.

    Parameters
    ----------
    tracks
        What `track` returns.
    steady_s
        Start and end of constant speed, s; None where nothing says so.
    """
    time_s, detected = tracks[dims.TIME].values, tracks[dims.DETECTED].values
    rest = int(tracks.attrs["rest_frame"])
    there = detected[rest]
    few = detected[:, there].mean(axis=1) < FEW_SEEN
    few[:rest] = False
    part = sliding_part(float(time_s[0]), float(time_s[-1]), steady_s)
    span = lasting(few, time_s, part, LOST_S)
    if span is None:
        return []
    seen = f"the {there.sum()} markers of the rest frame, or most of them"
    return [QualityIssue("dark", where, seen, f"less than half of them {span_text(span, time_s)}")]


def describe(tracks: xr.Dataset) -> list[str]:
    """Say in plain sentences what was found and what could not be followed.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    attributes = tracks.attrs
    rest = int(attributes["rest_frame"])
    started = start_sentences({"this one": attributes})
    stopped = [f"The video stopped early: {it}"] if (it := attributes["stopped"]) else []
    if dims.of_cells(tracks):
        sa1 = tracks[dims.SA1].values
        n_frames, n_cells = sa1[rest:].shape
        return [
            f"{n_cells} cells, from frame {rest}, the rest frame, through {n_frames} frames.",
            f"SA-I is {np.nanmedian(sa1):.1f} grey levels in the median and at most "
            f"{np.nanmax(sa1):.1f}; it tells that something touches, not how far the skin moves.",
            *started,
            *stopped,
        ]
    quality = measure_quality(tracks)
    end = quality.at_end
    lost = f", {end.n_lost} are lost" if end.n_lost else ""
    at_end = (
        f"{end.n_back} are back within half a spacing of rest, {end.n_elsewhere} ended "
        f"elsewhere{lost} (median {end.away_px:.2f} px from rest)"
    )
    if end.n_lost == quality.n_markers:
        at_end = "none is found"
    jitter = [f"At rest a marker jitters by {quality.jitter_px:.3f} px."]
    to_look_at = {
        "Markers missing in the rest frame: {} (a broken pin, or hidden); each is NaN until it is "
        "seen.": quality.n_missing,
        "Markers lost for more than half of the time: {} (cut by the rim, hidden by a reflection, "
        "or no markers).": quality.n_often_lost,
        f"Markers that did not move by {STILL_PX} px while others did: {{}} (reflections or dust, "
        "perhaps).": quality.n_still,
        "Positions claimed by more than one marker: {}, so identities are not safe.": (
            quality.n_shared
        ),
    }
    return [
        f"{quality.n_markers} markers, lost for {quality.share_lost:.1%} of the time; at the end "
        f"{at_end}.",
        f"Followed from frame {rest}, the rest frame, through {quality.n_frames} frames by "
        f"{attributes['method']} linking.",
        f"Largest displacement {quality.largest_displacement_px:.1f} px, largest step "
        f"{quality.largest_step_px:.1f} px from one frame to the next.",
        *([] if np.isnan(quality.jitter_px) else jitter),
        *started,
        _describe_layout(tracks),
        *_describe_audit(tracks),
        *stopped,
        *(sentence.format(count) for sentence, count in to_look_at.items() if count),
    ]


def _describe_audit(tracks: xr.Dataset) -> list[str]:
    """Say how often markers may have been confused, if ever, and what was done."""
    found = {
        "two markers on one blob": tracks.attrs["audit_shared"],
        "a marker apart from its neighbours' motion": tracks.attrs["audit_strangers"],
        "a jump of all markers": tracks.attrs["audit_jumps"],
        "the whole picture searched": tracks.attrs["audit_searches"],
    }
    counted = [f"{what} ({count} times)" for what, count in found.items() if count]
    sentences = []
    if counted:
        danger = ", ".join(counted)
        sentences.append(
            f"Markers may have been confused, and count as lost where in doubt: {danger}."
        )
    checks, slips = tracks.attrs.get("audit_checks", 0), tracks.attrs.get("audit_slips", 0)
    if checks:
        how = (
            f"; {slips} times some had slipped together to their neighbours' places, and were put "
            "right (lost in the frames before)"
            if slips
            else " and stood"
        )
        sentences.append(f"All names were checked by the layout's order {checks} times{how}.")
    return sentences


def _describe_layout(tracks: xr.Dataset) -> str:
    """Say whether the markers form a grid, or at least have places in an image."""
    if dims.ROW not in tracks.coords:
        return (
            "No sensor file says where these markers belong, so they give no tactile images; "
            "'afferents calibrate' makes one from a clip."
        )
    if "roll_deg" not in tracks.attrs:
        return "They form no square grid; tactile images are interpolated between them."
    rows, columns = (int(tracks[name].max()) + 1 for name in (dims.ROW, dims.COLUMN))
    return f"They form a grid of {rows} x {columns}, rolled by {tracks.attrs['roll_deg']:.1f} deg."


def _measure_jitter(position: NDArray[np.float64], away: Lengths) -> float:
    """Return the jitter of the frames at rest with which a recording begins."""
    moved = np.nan_to_num([_median(frame) for frame in away[: MOST_AT_REST + 1]]) > REST_PX
    n_still = int(np.argmax(moved)) if moved.any() else len(moved)
    if n_still < FEWEST_AT_REST:
        return float("nan")
    still = position[:n_still]
    spread = still[:, ~np.isnan(still).any(axis=(0, 2))].std(axis=0)
    return _median(np.hypot(spread[:, 0], spread[:, 1]))


def _largest(values: Lengths) -> float:
    """Return the largest value, NaN left out; 0 for none."""
    return float(np.fmax.reduce(values, axis=None, initial=0.0))


def _median(values: Lengths) -> float:
    """Return the median, NaN left out; NaN for none."""
    seen = values[~np.isnan(values)]
    return float(np.median(seen)) if len(seen) else float("nan")
