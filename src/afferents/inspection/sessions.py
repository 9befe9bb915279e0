"""What is in a session or another data set: each recording read, checked, and the first drawn."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from afferents import dims, parallel, plugins
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import share_lost, summarise_lost
from afferents.extraction.extract import adapt_to_still, responses_of
from afferents.extraction.issues import find_issues, watched
from afferents.inspection.files import PICTURED_S, Inspection, draw_vibration, draw_video
from afferents.inspection.init import grid_sentence, list_first
from afferents.markers import session_sensors, track
from afferents.markers.sensor import Sensor
from afferents.progress import Progress
from afferents.quality.issues import describe_issues
from afferents.quality.lasting import EDGE_S
from afferents.recordings import check, grid, session as sessions
from afferents.recordings.data_set import DataSet
from afferents.recordings.series import JoinedFiles, SeriesFile
from afferents.recordings.video import VideoWithProgress
from afferents.reporting.text import describe_lost
from afferents.store.recording import Recording, RecordingSet, natural_order
from afferents.store.trimming import AUDIO_S, LAST_FRAME, cut_audio


@dataclass(frozen=True)
class Look:
    """What is in one recording, None if it can't be read; and what is wrong with it.

    `problems` are what it is refused for, `issues` what is only named. `lost` is the share of
    marker positions that were lost; None where none were followed.
    """

    row: dict[str, Any] | None
    problems: list[str]
    lost: float | None = None
    issues: list[str] = field(default_factory=list)


def check_recording(recording: Recording, data_set: DataSet, sensor: Sensor | None) -> Look:
    """Check a recording's headers and content, and its markers as `extract` would follow them.

    Parameters
    ----------
    data_set
        That it is of.
    sensor
        Whose markers a video shows; None for data sets without sensors.
    """
    row, lost = None, None
    try:
        with plugins.in_a_sentence(recording.name):
            issues = data_set.check(recording)
            row = check.facts(recording)
            seen = watched(recording)
            if sensor is None or seen.video is None:
                for _ in seen.video.frames() if seen.video else ():
                    pass
                issues += find_issues(seen, None)
            else:
                responses = responses_of(seen, sensor)
                issues += find_issues(seen, responses)
                lost = share_lost(responses[dims.DETECTED], responses.attrs)
            if isinstance(
                table := recording.audio, SeriesFile | JoinedFiles
            ):  # refused if nothing is left of it
                rate_hz, steady_s = table.sample_rate_hz, recording.steady_s
                cut_audio(table.n_samples, rate_hz, "all", steady_s, recording.name)
    except AfferentsError as error:
        return Look(row, [str(error)])
    refused = [str(issue.error) for issue in issues if issue.is_refused]
    return Look(row, refused, lost, [str(issue) for issue in issues if not issue.is_refused])


def inspect_recordings(
    source: str, data_set: DataSet, out: Path, progress: Progress, sensor: Sensor | None = None
) -> Inspection:
    """Check every recording of a data set, all pictures and samples; draw the first one's start."""
    with plugins.in_a_sentence(source):
        session = data_set.scan()
    found = Inspection(source)
    found.add("Recordings", [grid_sentence(session), *data_set.describe(session)])
    found.add("Reference", reference_sentences(session, sensor))
    sensors = None
    if isinstance(session, sessions.Session):
        sensors = session_sensors.find_sensors(session, sensor)
        found.add("Sensor", session_sensors.default_sentences(session, sensor))
    jobs = [
        (recording, data_set, sensors.of(recording) if sensors else None)
        for recording in session.recordings
    ]
    # Sound alone is read sooner than processes begin.
    workers = None if any(r.video for r in session.recordings) else 1
    looks = parallel.side_by_side_numbered(check_recording, jobs, workers, progress.note)
    looked = dict(progress.track(looks, "checking", len(jobs)))
    in_order = [looked[number] for number in sorted(looked)]
    rows = [look.row for look in in_order if look.row is not None]
    found.problems += [problem for look in in_order for problem in look.problems]
    names = [recording.name for recording in session.recordings]
    lost = {name: x.lost for name, x in zip(names, in_order, strict=True) if x.lost is not None}
    found.add("Lengths", length_sentences(rows, len(jobs)))
    found.add("Markers", [describe_lost(summarise_lost(lost))])
    of_paper = [
        look.row
        for look, recording in zip(in_order, session.recordings, strict=True)
        if look.row is not None and recording.named_by_spacing
    ]
    found.add("Tables", table_sentences(session))
    if "Tables" not in found.topics:
        found.add("Lengths", too_short_sentences(of_paper))
    issues = {name: look.issues for name, look in zip(names, in_order, strict=True)}
    found.add("Doubts", describe_issues(issues))
    try:
        found.add("Logs", log_sentences(session))
        if not found.problems and isinstance(session, sessions.Session):
            grid.require_rates_that_agree(session, session.declared)
    except InputError as error:
        found.problems.append(str(error))
    found.facts = {"recordings": rows, "issues": {k: v for k, v in issues.items() if v}}
    if not found.problems:
        found.pictures = draw_first(session, jobs, source, out, progress)
    return found


def draw_first(
    session: RecordingSet,
    jobs: Sequence[tuple[Recording, DataSet, Sensor | None]],
    source: str,
    out: Path,
    progress: Progress,
) -> list[Path]:
    """Draw the first seconds of the first recording with markers, and of the first with sound."""
    pictures: list[Path] = []
    for recording, _, sensor in jobs:
        if sensor is not None and isinstance(video := recording.video, check.ClipFile):
            most = sensor.rest_frame + round(PICTURED_S * video.fps_hz)
            start, rest = VideoWithProgress(video, progress, most), None
            clip = session.reference
            if (
                isinstance(session, sessions.Session)
                and session.declared.rest == "reference"
                and clip
            ):
                rest = track.ordered_rest(
                    clip, adapt_to_still(clip, sensor)
                )  # displacement counts from it
            tracks = track.track_markers(start, sensor, count_from=rest)
            assert start.last is not None
            name = f"{source}, {recording.name}"
            pictures += draw_video(start.last.image, tracks, sensor, name, out)
            break
    heard = ((r.name, r.audio) for r, *_ in jobs if r.audio is not None)
    for name, audio in islice(heard, 1):
        pictures.append(draw_vibration(audio.read(), f"{source}, {name}", out))
    return pictures


def log_sentences(session: RecordingSet) -> list[str]:
    """Return what was logged along with the recordings, how fast, and what sets its clock.

    Raises
    ------
    InputError
        If a log can't be read.
    """
    logs = {log.name: log for r in reversed(session.recordings) for log in r.beside}
    if not logs:
        return []
    kept = []
    for name, log in sorted(logs.items()):
        n = sum(any(one.name == name for one in r.beside) for r in session.recordings)
        kept.append(
            f"{name} ({', '.join(log.columns)}; {log.units}; {log.rate_hz():.4g} rows a second; "
            f"in {n} of {len(session.recordings)} recordings)"
        )
    press = session.press if isinstance(session, sessions.Session) else None
    clock = "Times are read as of the images' clock: there is no press that sets another."
    if press is not None:
        names = " and ".join(sorted(log.name for log in press.beside)) or "nothing"
        clock = f"{press.name} is a press, not a recording: it sets the clock of {names}."
    return [f"Kept alongside: {', '.join(kept)}.", clock]


def table_sentences(session: RecordingSet) -> list[str]:
    """Return what was read from names and columns of tables, and which part of them is used."""
    files = [
        (r, r.audio) for r in session.recordings if isinstance(r.audio, SeriesFile | JoinedFiles)
    ]
    if not files:
        return []
    values: dict[str, set[str]] = {}
    for recording, _ in files:
        for name, value in recording.conditions.items():
            values.setdefault(name, set()).add(str(value))
    sentences = [
        f"{name}: {list_first(sorted(its, key=natural_order))}"
        for name, its in sorted(values.items())
    ]
    recording, file = files[0]
    with suppress(InputError):
        names = ", ".join(map(str, file.read()[dims.CHANNEL].values))
        length_s = file.n_samples / file.sample_rate_hz
        start, stop = recording.steady_s or (EDGE_S, length_s - EDGE_S)
        sentences.append(f"channels: {names}, at {file.sample_rate_hz:g} Hz")
        if start < stop:
            used = f"{start:g} to {stop:.4g} s of {length_s:.4g} s"
            sentences.append(f"used of the first: {used}; steady_s says which part")
    return [f"{text[:1].upper()}{text[1:]}." for text in sentences]


def reference_sentences(session: RecordingSet, sensor: Sensor | None) -> list[str]:
    """Return what is wrong with a marker reference, if it does not show the sensor's markers."""
    if session.reference is None or not isinstance(session, sessions.Session):
        return []
    try:
        usual = session_sensors.find_sensors(session, sensor).usual
        track.rest_positions(session.reference, adapt_to_still(session.reference, usual))
    except AfferentsError as error:
        return [f"The published tracker can't be led by it: {error}."]
    return []


def length_sentences(rows: list[dict[str, Any]], n: int) -> list[str]:
    """Return between which lengths the videos and vibrations of `n` recordings lie."""
    sentences = []
    for kind, title in (("video", "Videos"), ("vibration", "Vibrations")):
        lengths = [row[kind]["duration_s"] for row in rows if row[kind]]
        if lengths:
            sentences.append(
                f"{title} in {len(lengths)} of {n} recordings, "
                f"{min(lengths):.2f} to {max(lengths):.2f} s long."
            )
    return sentences


def too_short_sentences(rows: list[dict[str, Any]]) -> list[str]:
    """Return which videos and audio are too short for the cut 'published', if any."""
    frames = [row["video"]["n_frames"] for row in rows if row["video"]]
    seconds = [row["vibration"]["duration_s"] for row in rows if row["vibration"]]
    short = (
        ("videos", f"{LAST_FRAME} frames", sum(n < LAST_FRAME for n in frames), len(frames)),
        ("vibrations", f"{AUDIO_S:g} s", sum(s < AUDIO_S for s in seconds), len(seconds)),
    )
    return [
        f"{n_short} of {n} {things} are shorter than {least}: too short for the cut 'published', "
        "which is only for comparison with the paper."
        for things, least, n_short, n in short
        if n_short
    ]
