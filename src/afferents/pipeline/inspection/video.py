"""What is in a video, and how well its markers are followed."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from afferents.core import dims
from afferents.core.progress import Progress
from afferents.core.recording import GreyImage
from afferents.markers import (
    Sensor,
    describe,
    doubt_markers,
    measure_quality,
    recognise_sensor,
    track,
)
from afferents.pipeline.extract import marker_responses
from afferents.pipeline.inspection.found import MARKERS, RESPONSES, Inspection
from afferents.recordings import Footage, VideoWithProgress, open_video, video_facts
from afferents.reporting import markers_figure, responses_figure, save_figure, write_overlay

UNEVEN, OFTEN_UNEVEN = 0.1, 0.05
"""An interval between frames is uneven beyond this share of the median; and said to be so beyond
this share of intervals (single gaps are counted as missing frames)."""


def inspect_video(
    path: Path,
    out: Path,
    sensor: Sensor | None,
    progress: Progress,
    overlay: Path | None = None,
) -> Inspection:
    """Track a video's markers and say how well that went; draw markers, SA-I and RA-I."""
    video = open_video(path)
    found = Inspection(str(path), facts={"video": asdict(video_facts(video))})
    declared = f"{video.width} x {video.height} px, {video.fps_hz:g} frames a second"
    found.sentences.append(
        f"Video of {declared}, {video.n_frames} frames in {video.duration_s:.2f} s as declared."
    )
    why = f"The sensor file given is '{sensor.name}'." if sensor else ""
    if sensor is None:
        sensor, why = recognise_sensor(video)
    found.sentences.append(why)
    watched = VideoWithProgress(video, progress)
    footage = Footage(watched)
    tracks = track(footage, sensor)
    found.sentences += [*describe(tracks), *frame_time_sentences(tracks)]
    doubts = footage.doubts() or doubt_markers(tracks, path, None)
    found.sentences += [f"{d.kind.title()}, if the drum slides here: {d.what}." for d in doubts]
    found.facts |= {**quality_facts(tracks), "doubts": {d.kind: d.found for d in doubts}}
    found.pictures = draw_video(watched.last_image, tracks, path.name, out)
    if overlay is not None:
        frames = progress.track(video.frames(), "drawing", video.n_frames)
        places, seen = tracks[dims.POSITION].values, tracks[dims.DETECTED].values
        found.pictures.append(write_overlay(overlay, frames, places, seen, video.fps_hz))
    return found


def quality_facts(tracks: xr.Dataset) -> dict[str, Any]:
    """Return the tracking's figures, None for what is not a number."""
    quality = asdict(measure_quality(tracks))
    return {name: None if value != value else value for name, value in quality.items()}


def frame_time_sentences(tracks: xr.Dataset) -> list[str]:
    """Say how regular the frames come, by the container's own times."""
    steps = np.diff(tracks[dims.TIME].values)
    if len(steps) == 0:
        return []
    period = float(np.median(steps))
    frame_times = f"Frames come every {1000 * period:.2f} ms (median, container's times)"
    uneven = float((np.abs(steps - period) > UNEVEN * period).mean())
    if uneven <= OFTEN_UNEVEN:
        return [f"{frame_times}."]
    return [
        f"{frame_times}, but {uneven:.0%} of the intervals differ from that by more than a tenth: "
        "a variable frame rate, so RA-I per frame is not a speed; use px/s."
    ]


def draw_video(image: GreyImage, tracks: xr.Dataset, name: str, out: Path) -> list[Path]:
    """Draw the markers on the last frame with their trails, and the responses over time."""
    responses = marker_responses(tracks)
    positions = tracks[dims.POSITION].values
    markers = markers_figure(
        image, positions[-1], tracks[dims.DETECTED].values[-1], name, positions
    )
    over_time = responses_figure(responses[dims.SA1], responses[dims.RA1], name)
    return [
        save_figure(markers, out / MARKERS),
        save_figure(over_time, out / RESPONSES),
    ]
