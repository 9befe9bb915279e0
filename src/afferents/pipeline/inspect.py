"""What is in a file or session, whether it is sound, and a picture of it."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.core import dims
from afferents.core.cut import AUDIO_S, LAST_FRAME
from afferents.core.doubt import KINDS
from afferents.core.errors import AfferentsError, InputError
from afferents.core.outputs import require_free, require_pictures_free
from afferents.core.progress import Progress
from afferents.core.recording import GreyImage, Recording, Session
from afferents.core.store import open_responses, store_config
from afferents.execution.local import side_by_side
from afferents.markers import (
    Sensor,
    describe,
    doubt_markers,
    measure_quality,
    recognise_sensor,
    track,
)
from afferents.pipeline.copies import notes_in
from afferents.pipeline.doubts import doubts_without_tracking
from afferents.pipeline.extract import marker_responses
from afferents.recordings import (
    Footage,
    SessionFile,
    VideoWithProgress,
    WavFile,
    check_recording,
    clipped_share,
    doubt_loudness,
    facts,
    open_video,
    read_fabricslide,
    read_session,
    require_finite,
    session_file,
    video_facts,
)
from afferents.reporting import (
    is_overlay,
    markers_figure,
    responses_figure,
    save_figure,
    vibration_figure,
    write_overlay,
)

MARKERS, RESPONSES, VIBRATION = "markers.png", "responses.png", "vibration.png"
PICTURED_S = 10.0
"""Length of the vibration that is drawn, s."""
UNEVEN, OFTEN_UNEVEN = 0.1, 0.05
"""An interval between frames is uneven beyond this share of the median; and said to be so beyond
this share of intervals (single gaps are counted as missing frames)."""
MOST_LOST = 0.01
"""Share of marker positions lost beyond which a recording is named."""


@dataclass
class Inspection:
    """Sentences about a source, problems found, pictures drawn, and facts for scripts."""

    source: str
    sentences: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)


def inspect(
    source: str,
    out: Path,
    sensor: Sensor | None,
    progress: Progress,
    overlay: Path | None = None,
    force: bool = False,
) -> Inspection:
    """Look at a video, a wav file, a session, a store or ``fabricslide:PATH``.

    Parameters
    ----------
    out
        Folder for the pictures.
    sensor
        For a video; None to recognise or estimate it.
    overlay
        For a video; where to write it with its markers drawn in.
    force
        Whether an overlay that was written there before may be replaced.

    Raises
    ------
    InputError
        If there is nothing there, or nothing that can be read.
    """
    if overlay is not None and not (Path(source).is_file() and not source.endswith(".wav")):
        raise InputError("--overlay", "a video to draw markers into", f"'{source}'")
    require_pictures_free(out, MARKERS, RESPONSES, VIBRATION)
    if overlay is not None:
        reads = [Path(source)]
        require_free(overlay, "a video with its markers", is_overlay, force=force, reads=reads)
    if source.startswith("fabricslide:"):
        session = read_fabricslide(Path(source.partition(":")[2]))
        return inspect_session(source, session, out, None, progress)
    path = Path(source)
    if not path.exists():
        raise InputError(path, "a video, a wav file, a session or a store", "nothing there")
    if path.is_file():
        if path.suffix.lower() == ".wav":
            return inspect_wav(path, out)
        return inspect_video(path, out, sensor, progress, overlay)
    if (path / "zarr.json").is_file():
        return inspect_store(path)
    return inspect_session(source, read_session(path), out, session_file(path), progress)


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


def inspect_wav(path: Path, out: Path) -> Inspection:
    """Say what a wav file holds and draw its start; the last channel is the sensor's."""
    header = WavFile(path, 0)
    audio = WavFile(path, header.n_channels - 1)
    seconds = audio.n_samples / audio.sample_rate_hz
    found = Inspection(str(path))
    found.sentences.append(
        f"{audio.n_channels} channel(s) at {audio.sample_rate_hz:g} Hz, {seconds:.2f} s; "
        f"channel {audio.n_channels} is taken for the sensor."
    )
    samples = audio.samples()
    found.sentences += level_sentences(samples)
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
    found.problems += [str(doubt) for doubt in doubt_loudness(samples, path, audio.sample_rate_hz)]
    found.pictures = [draw_vibration(audio.read(), path.name, out)]
    return found


def level_sentences(samples: NDArray[np.float32]) -> list[str]:
    """Say how loud a signal (n,) is, and whether it is clipped or silent; by what is a number."""
    numbers = samples[np.isfinite(samples)].astype(float)
    if len(numbers) == 0:
        return ["No sample is a number."]
    peak, rms = float(np.abs(numbers).max()), float(np.sqrt((numbers**2).mean()))
    sentences = [f"Peak {peak:.3g}, RMS {rms:.3g} of full scale."]
    if peak == 0:
        sentences.append("It is silent: look at the sensor's channel and cable.")
    clipped = clipped_share(numbers)
    if clipped > 0:
        sentences.append(
            f"{100 * clipped:.3g}% of samples are clipped, at {numbers.min():.3g} or "
            f"{numbers.max():.3g}: lower the gain."
        )
    return sentences


def draw_vibration(signal: xr.DataArray, name: str, out: Path) -> Path:
    """Draw the first seconds of vibration and their spectrum."""
    n = round(PICTURED_S * signal.attrs[dims.SAMPLE_RATE])
    figure = vibration_figure(signal.isel({dims.AUDIO_TIME: slice(0, n)}), name)
    return save_figure(figure, out / VIBRATION)


@dataclass(frozen=True)
class Look:
    """What there is of one recording, None if it can't be read; and what is wrong with it."""

    row: dict[str, Any] | None
    problems: list[str]


def look_at(number: int, recording: Recording, declared: SessionFile | None) -> tuple[int, Look]:
    """Check a recording's headers and content; its markers are not looked for.

    Parameters
    ----------
    number
        Comes back, to put recordings that were looked at side by side into their order.
    declared
        None where there is no session file, and headers declare nothing.
    """
    row = None
    try:
        doubts = [] if declared is None else check_recording(recording, declared, KINDS)
        row = asdict(facts(recording))
        doubts = doubts + doubts_without_tracking(recording)
    except AfferentsError as error:
        return number, Look(row, [str(error)])
    return number, Look(row, [str(doubt) for doubt in doubts])


def inspect_session(
    source: str,
    session: Session,
    out: Path,
    declared: SessionFile | None,
    progress: Progress,
) -> Inspection:
    """Check every recording of a session, all pictures and samples; draw the first vibration."""
    found = Inspection(source)
    speeds = ", ".join(f"{speed:g}" for speed in session.speeds_mm_s)
    found.sentences += [
        f"{len(session.recordings)} recordings of {len(session.textures)} textures "
        f"({', '.join(session.textures)}) at {len(session.speeds_mm_s)} speeds ({speeds} mm/s).",
        "The order of markers comes from throw_away.mp4."
        if session.reference
        else "There is no throw_away.mp4; it is needed only by the published tracker.",
    ]
    jobs = [(n, recording, declared) for n, recording in enumerate(session.recordings)]
    # Sound alone is read sooner than processes begin.
    workers = None if any(r.video for r in session.recordings) else 1
    looks = side_by_side(look_at, jobs, workers, progress.note)
    looked = dict(progress.track(looks, "checking", len(jobs)))
    in_order = [looked[number] for number in sorted(looked)]
    rows = [look.row for look in in_order if look.row is not None]
    found.problems += [problem for look in in_order for problem in look.problems]
    found.sentences += [*length_sentences(rows), *too_short_sentences(rows)]
    found.facts = {"recordings": rows}
    with_audio = [r for r in session.recordings if r.audio is not None]
    if with_audio and not found.problems:
        first = with_audio[0]
        assert first.audio is not None
        found.pictures = [draw_vibration(first.audio.read(), f"{source}, {first.name}", out)]
    return found


def length_sentences(rows: list[dict[str, Any]]) -> list[str]:
    """Say between which lengths the videos and vibrations of a session lie."""
    sentences = []
    for kind, title in (("video", "Videos"), ("vibration", "Vibrations")):
        lengths = [row[kind]["duration_s"] for row in rows if row[kind]]
        if lengths:
            sentences.append(
                f"{title} in {len(lengths)} of {len(rows)} recordings, "
                f"{min(lengths):.2f} to {max(lengths):.2f} s long."
            )
    return sentences


def too_short_sentences(rows: list[dict[str, Any]]) -> list[str]:
    """Say which videos and audio are too short for the cut 'published', if any."""
    frames = [row["video"]["n_frames"] for row in rows if row["video"]]
    seconds = [row["vibration"]["duration_s"] for row in rows if row["vibration"]]
    short = (
        ("videos", f"{LAST_FRAME} frames", sum(n < LAST_FRAME for n in frames), len(frames)),
        ("vibrations", f"{AUDIO_S:g} s", sum(s < AUDIO_S for s in seconds), len(seconds)),
    )
    return [
        f"{n_short} of {n} {things} are shorter than {least}: too short for the cut 'published'."
        for things, least, n_short, n in short
        if n_short
    ]


def inspect_store(path: Path) -> Inspection:
    """Say what a store of extracted responses holds."""
    found = Inspection(str(path), facts={"config": store_config(path)})
    recordings = open_responses(path)
    names = sorted({str(name) for r in recordings for name in r.data_vars})
    found.sentences.append(f"A store of {len(recordings)} recordings with {', '.join(names)}.")
    found.sentences += notes_in({str(r.attrs["name"]): r.attrs for r in recordings}).sentences
    for responses in recordings:
        if dims.DETECTED in responses:
            lost = 1 - float(responses[dims.DETECTED].mean())
            if lost > MOST_LOST:
                name = responses.attrs["name"]
                found.problems.append(f"{name}: {100 * lost:.1f}% of marker positions are lost.")
    return found
