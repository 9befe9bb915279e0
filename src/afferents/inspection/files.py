"""What is in a video or a wav file, and whether it is sound."""

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from afferents import dims
from afferents.errors import InputError
from afferents.extraction.extract import marker_responses
from afferents.extraction.issues import find_video_issues
from afferents.markers import estimate, track
from afferents.markers.quality import describe, measure_quality
from afferents.markers.sensor import Sensor
from afferents.progress import Progress
from afferents.quality.sound import find_sound_issues, measure_level, require_finite
from afferents.recordings import check, session_file
from afferents.recordings.audio import WavFile, sound_within
from afferents.recordings.video import Footage, VideoWithProgress, open_clip
from afferents.reporting import recording_figures, style
from afferents.reporting.overlay import write_overlay
from afferents.store.recording import GreyImage

MARKERS, RESPONSES, VIBRATION = "markers.png", "responses.png", "vibration.png"
PICTURED_S = 10.0
"""Length of the vibration that is drawn, s."""


@dataclass
class Inspection:
    """What was found in a source.

    Attributes
    ----------
    problems
        What it can't be used with.
    pictures
        Files that were drawn.
    facts
        For scripts.
    topics
        Sentences by what they are about.
    """

    source: str
    problems: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    topics: dict[str, list[str]] = field(default_factory=dict)

    def add(self, topic: str, sentences: Iterable[str]) -> None:
        """Add sentences on a topic; empty ones are left out."""
        if some := list(filter(None, sentences)):
            self.topics.setdefault(topic, []).extend(some)

    @property
    def sentences(self) -> list[str]:
        """All sentences."""
        return [sentence for its in self.topics.values() for sentence in its]


def inspect_video(
    path: Path,
    out: Path,
    sensor: Sensor | None,
    progress: Progress,
    overlay: Path | None = None,
    fps_hz: float | None = None,
) -> Inspection:
    """Track a video's markers and report how well that went; draw markers, SA-I and RA-I."""
    video = open_clip(path, None if fps_hz is None else session_file.parse_rate(fps_hz))
    found = Inspection(str(path), facts={"video": check.video_facts(video)})
    declared = f"{video.width} x {video.height} px, {video.fps_hz:g} frames a second"
    every = f"{declared}, {video.n_frames} frames in {video.duration_s:.2f} s as declared."
    found.add("Video", [f"Video of {every}"])
    why = f"The sensor file given is '{sensor.name}'." if sensor else ""
    if sensor is None:
        sensor, why = estimate.recognise_sensor(video)
    found.add("Sensor", [why])
    found.add("Sound", sound_within([path]))
    watched = VideoWithProgress(video, progress)
    footage = Footage(watched)
    tracks = track.track_markers(footage, sensor)
    steps_ms = 1000 * np.diff(tracks[dims.TIME].values)
    if len(steps_ms):
        every = f"Frames come every {np.median(steps_ms):.2f} ms (median, container's times)."
        found.add("Video", [every])
    found.add("Markers", describe(tracks))
    issues = find_video_issues(footage, tracks)
    slides = " This is so only if the drum slides here."
    found.add("Doubts", [issue.sentence + slides * issue.is_refused for issue in issues])
    quality = {} if dims.of_cells(tracks) else asdict(measure_quality(tracks))
    found.facts |= {name: None if value != value else value for name, value in quality.items()}
    found.facts |= {"issues": {issue.kind: issue.found for issue in issues}}
    found.facts["stalls_s"] = footage.figures.stalls.spans
    assert watched.last is not None
    found.pictures = draw_video(watched.last.image, tracks, sensor, path.name, out)
    if overlay is not None:
        frames = progress.track(video.frames(), "drawing", video.n_frames)
        places, seen = tracks[dims.POSITION].values, tracks[dims.DETECTED].values
        found.pictures.append(
            write_overlay(overlay, frames, places, seen, video.fps_hz, sensor.picture.masks)
        )
    return found


def draw_video(
    image: GreyImage, tracks: xr.Dataset, sensor: Sensor, name: str, out: Path
) -> list[Path]:
    """Draw the markers on the last frame with their trails, and the responses over time.

    Markers are where the lens shows them, responses as without its distortion.
    """
    responses = marker_responses(tracks, sensor)
    positions = tracks[dims.POSITION].values
    markers = recording_figures.markers_figure(
        image,
        positions[-1],
        tracks[dims.DETECTED].values[-1],
        name,
        positions,
        masks=sensor.picture.masks,
    )
    over_time = recording_figures.responses_figure(responses[dims.SA1], responses[dims.RA1], name)
    return [
        style.save_figure(markers, out / MARKERS),
        style.save_figure(over_time, out / RESPONSES),
    ]


def inspect_wav(path: Path, out: Path) -> Inspection:
    """Report what a wav file holds and draw its start; the last channel is the sensor's."""
    header = WavFile(path, 0)
    audio = WavFile(path, header.n_channels - 1)
    seconds = audio.n_samples / audio.sample_rate_hz
    found = Inspection(str(path))
    held = f"{audio.n_channels} channel(s) at {audio.sample_rate_hz:g} Hz, {seconds:.2f} s"
    found.add("Sound", [f"{held}; channel {audio.n_channels} is used as the sensor's."])
    samples = audio.samples()
    numbers = samples[np.isfinite(samples)]
    if len(numbers):
        level = measure_level(numbers[:, np.newaxis])
        found.add("Sound", [f"Peak {level.peak:.3g}, RMS {level.rms:.3g} of full scale."])
    found.facts = {
        "channels": audio.n_channels,
        "sample_rate_hz": audio.sample_rate_hz,
        "duration_s": seconds,
    }
    try:
        require_finite(samples, path, audio.sample_rate_hz)
    except InputError as error:
        found.problems.append(str(error))
        return found
    for issue in find_sound_issues(samples, path, audio.sample_rate_hz):
        if issue.is_refused:
            found.problems.append(str(issue.error))
        else:
            found.add("Doubts", [issue.sentence])
    found.pictures = [draw_vibration(audio.read(), path.name, out)]
    return found


def draw_vibration(signal: xr.DataArray, name: str, out: Path) -> Path:
    """Draw the first seconds of vibration and their spectrum."""
    n = max(4, round(PICTURED_S * signal.attrs[dims.SAMPLE_RATE]))
    figure = recording_figures.vibration_figure(signal.isel({dims.AUDIO_TIME: slice(0, n)}), name)
    return style.save_figure(figure, out / VIBRATION)
