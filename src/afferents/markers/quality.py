"""What can be said of a tracked video in plain words, for `inspect`."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.markers.detect import Positions

Lengths = NDArray[np.float64]
STILL_PX = 0.5
"""A marker that never strays farther than this from its rest position has not moved."""
REPEAT_PX = 0.02
"""Half of all markers stepping less than this is no skin but a repeated frame: two images of a
skin at rest differ by more (0.03 px and up in the videos looked at)."""


@dataclass(frozen=True)
class TrackingQuality:
    """Figures that say how well a video was tracked. Lengths in px.

    Attributes
    ----------
    n_markers, n_frames
        Markers followed; frames from the rest frame on.
    share_lost
        Share of marker positions, rest frame on, where the marker was not detected.
    n_often_lost
        Markers not detected in more than half of these frames.
    n_found_at_end
        Markers detected at least once in the last five frames.
    n_shared
        Positions that two or more markers claim in the same frame, over all frames.
    n_repeated
        Frames in which half of the markers or more moved less than `REPEAT_PX` though others
        moved at other times: the camera or a script wrote a frame twice.
    n_still
        Markers that moved no farther than `STILL_PX` while others did: reflections, perhaps.
    largest_step_px
        Longest way of a marker from one frame to the next.
    largest_displacement_px
        Farthest a marker was from its rest position.
    return_px
        Median distance from rest in the last five frames, NaN if all were lost.
    """

    n_markers: int
    n_frames: int
    share_lost: float
    n_often_lost: int
    n_found_at_end: int
    n_shared: int
    n_repeated: int
    n_still: int
    largest_step_px: float
    largest_displacement_px: float
    return_px: float


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
        n_often_lost=int((detected.mean(axis=0) < 0.5).sum()),
        n_found_at_end=int(detected[-5:].any(axis=0).sum()),
        n_shared=sum(_n_shared(frame) for frame in position),
        n_repeated=_n_repeated(step),
        n_still=int((farthest < STILL_PX).sum()) if np.any(farthest >= STILL_PX) else 0,
        largest_step_px=_largest(step),
        largest_displacement_px=_largest(away),
        return_px=_median(away[-5:]),
    )


def describe(tracks: xr.Dataset) -> list[str]:
    """Say in plain sentences what was found and what could not be followed.

    Parameters
    ----------
    tracks
        What `track` returns.
    """
    quality = measure_quality(tracks)
    return [
        f"{quality.n_markers} markers in the rest frame (frame {tracks.attrs['rest_frame']}), "
        f"followed through {quality.n_frames} frames by {tracks.attrs['method']} linking.",
        f"Lost for {quality.share_lost:.1%} of the time; {_at_the_end(quality)}.",
        f"Largest displacement {quality.largest_displacement_px:.1f} px, largest step "
        f"{quality.largest_step_px:.1f} px from one frame to the next.",
        _layout(tracks),
        *_doubts(quality),
    ]


def _at_the_end(quality: TrackingQuality) -> str:
    """Say how many markers are left and how far they are from rest."""
    if quality.n_found_at_end == 0:
        return f"none of the {quality.n_markers} is found at the end"
    return (
        f"{quality.n_found_at_end} of {quality.n_markers} are found at the end, at a median of "
        f"{quality.return_px:.2f} px from their rest positions"
    )


def _layout(tracks: xr.Dataset) -> str:
    """Say whether the markers form a grid."""
    if dims.ROW not in tracks.coords:
        return "No grid is known for this layout, so it gives no tactile images."
    rows, columns = (int(tracks[name].max()) + 1 for name in (dims.ROW, dims.COLUMN))
    return f"They form a grid of {rows} x {columns}, rolled by {tracks.attrs['roll_deg']:.1f} deg."


def _doubts(quality: TrackingQuality) -> list[str]:
    """Name what a user should look at, each only if it occurs."""
    doubts = [
        (
            quality.n_often_lost,
            "Markers lost for more than half of the time: {} (cut by the rim, hidden by a "
            "reflection, or no markers).",
        ),
        (
            quality.n_still,
            f"Markers that did not move by {STILL_PX} px while others did: {{}} (reflections or "
            "dust, perhaps).",
        ),
        (
            quality.n_shared,
            "Positions claimed by more than one marker: {}, so identities are not safe.",
        ),
        (
            quality.n_repeated,
            "Frames that seem to repeat the one before: {}. RA-I is near 0 there and too large "
            "in the next, and the true frame rate is lower than the file's.",
        ),
    ]
    return [sentence.format(count) for count, sentence in doubts if count]


def _n_shared(position: Positions) -> int:
    """Count the markers of a frame that stand exactly where another one stands."""
    seen = position[~np.isnan(position[:, 0])]
    return len(seen) - len(np.unique(seen, axis=0))


def _n_repeated(step: Lengths) -> int:
    """Count the frames that repeat the one before; none if nothing ever moved."""
    seen = step[~np.isnan(step).all(axis=1)]
    typical = np.nanmedian(seen, axis=1) if seen.size else np.zeros(0)
    return int((typical < REPEAT_PX).sum()) if np.any(typical >= REPEAT_PX) else 0


def _largest(values: Lengths) -> float:
    """Return the largest value, NaN left out; 0 for none."""
    return float(np.fmax.reduce(values, axis=None, initial=0.0))


def _median(values: Lengths) -> float:
    """Return the median, NaN left out; NaN for none."""
    seen = values[~np.isnan(values)]
    return float(np.median(seen)) if len(seen) else float("nan")
