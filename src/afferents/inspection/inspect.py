"""How steady tactile images are: how like an image is to the one some frames later.

The paper says of its tactile images that those of SA-I stay nearly the same while a texture slides
past, and those of RA-I change. Put as a number: the correlation, over markers, of an image with
that of the same recording 20 frames (0.22 s) later, as far apart as its Figures 8 and 10 show
them.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import share_lost, summarise_lost
from afferents.extraction.copies import notes_in
from afferents.extraction.extract import find_issues, of_still, responses_of, watched
from afferents.files import Place, is_our_picture, require_free
from afferents.inspection.files import (
    MARKERS,
    PICTURED_S,
    RESPONSES,
    VIBRATION,
    Inspection,
    draw_vibration,
    draw_video,
    inspect_video,
    inspect_wav,
)
from afferents.inspection.init import grid_sentence, some_of
from afferents.markers.detect import Positions
from afferents.markers.sensor import Sensor, default_sentences, sensor_in, sensors_of
from afferents.markers.track import ordered_rest, rest_positions, track_markers
from afferents.parallel import side_by_side_numbered
from afferents.plugins import in_a_sentence
from afferents.progress import Progress
from afferents.quality.issues import describe_issues
from afferents.quality.lasting import EDGE_S
from afferents.recordings.check import ClipFile, facts
from afferents.recordings.data_set import Data, DataSet
from afferents.recordings.data_sets import data_set_of
from afferents.recordings.described import Described
from afferents.recordings.media import is_image_folder, is_sound
from afferents.recordings.series import JoinedFiles, SeriesFile
from afferents.recordings.session import Session as FolderSession
from afferents.recordings.session import require_rates_that_agree
from afferents.recordings.video import VideoWithProgress
from afferents.reporting.overlay import is_overlay
from afferents.reporting.recording_figures import (
    responses_figure,
    steadiness_figure,
    steadiness_sentence,
)
from afferents.reporting.style import save_figure
from afferents.reporting.summary_text import what_was_lost
from afferents.store.motion import series_sentences
from afferents.store.recording import Recording, RecordingSet, natural_order
from afferents.store.responses import Responses, named_by_spacing, speed_of
from afferents.store.trimming import AUDIO_S, LAST_FRAME, cut_audio

APART = 20
"""Frames between the two images, as in the paper's Figures 8 and 10."""
LOOKED_AT = 900
"""Most frames of a recording that are looked at, from its middle: 10 s at 90 frames/s."""
_FEWEST = 3
"""Markers that both images must show."""


def steadiness(response: NDArray[np.floating], apart: int = APART) -> float:
    """Return the mean correlation of images with those some frames later.

    Parameters
    ----------
    response
        Of a channel, (time, marker); NaN where a marker was lost.
    apart
        Frames between the two images.

    Returns
    -------
    Mean over frames of Pearson's correlation over the markers that both images show, -1 to 1: near
    1 where images stay the same, near 0 where they change entirely. NaN where there are fewer than
    `apart` + 1 frames, or images that are the same everywhere.
    """
    values = response.astype(np.float64)
    earlier, later = values[:-apart], values[apart:]
    used = np.isfinite(earlier + later).sum(axis=1) >= _FEWEST
    one, other = pd.DataFrame(earlier[used]), pd.DataFrame(later[used])
    with np.errstate(invalid="ignore"):  # of images that are the same everywhere
        return float(one.corrwith(other, axis=1).mean())


def steadiness_of(recordings: Sequence[Responses]) -> list[dict[str, str | float | None]]:
    """Return how steady SA-I and RA-I images of each recording are, in the middle of it.

    Returns
    -------
    list of dict
        ``recording``, ``texture``, ``speed_mm_s`` (None where not known), ``named_by_spacing``
        (where textures are), ``sa1`` and ``ra1``, the correlations; recordings without markers, or
        too short for a number, are left out.
    """
    found: list[dict[str, str | float | None]] = []
    for responses in recordings:
        if dims.SA1 not in responses or dims.RA1 not in responses:
            continue
        values = {name: steadiness(_middle(responses, name)) for name in (dims.SA1, dims.RA1)}
        if np.isfinite(list(values.values())).all():
            attributes = responses.attrs
            found.append(
                {
                    "recording": str(attributes["name"]),
                    "texture": str(attributes[dims.TEXTURE]),
                    "speed_mm_s": speed_of(responses),
                    **named_by_spacing([responses]),
                    **values,
                }
            )
    return found


def _middle(responses: Responses, name: str) -> NDArray[np.floating]:
    response = responses[name]
    n = response.sizes[dims.TIME]
    first = max(0, (n - LOOKED_AT) // 2)
    # Time first: in a store dims have an order, but nothing forces it on other sources.
    shown = response.isel({dims.TIME: slice(first, first + LOOKED_AT)})
    values: NDArray[np.floating] = shown.transpose(dims.TIME, ...).values
    return values


# What is in a file or a data set, whether it is sound, and a picture of it.

STEADINESS = "steadiness.png"
MOST_LOST = 0.01
"""Share of marker positions lost beyond which a recording is named."""


def inspect(
    source: Data,
    out: Place | None = None,
    sensor: str | Path | Sensor | None = None,
    overlay: Place | None = None,
    force: bool = False,
    quiet: bool = False,
    fps_hz: float | None = None,
) -> Inspection:
    """Check a file or a session: what it holds, whether it is sound, and a picture of it.

    Parameters
    ----------
    source
        A video (or folder of images), sound, a session folder, a store, a dataset.toml or
        fabricslide:PATH. In Python a `DataSet`.
    out
        Folder for the pictures (default: NAME-inspected).
    sensor
        Sensor file (TOML), or the name of a packaged one.
    overlay
        Video to write with the tracked markers drawn in, such as o.mp4.
    force
        Overwrite what this command wrote there before (nothing else).
    quiet
        No progress bars; plain lines on stderr.
    fps_hz
        True frame rate of the videos, frames a second, where their files say another; times then
        count from it (default: what the session file says, else the files).

    Returns
    -------
    Inspection
        Sentences, problems, pictures and facts.

    Raises
    ------
    InputError
        If there is nothing that can be read, or the folder for the pictures holds something else.

    Examples
    --------
    >>> found = inspect("session/1/20/audio.wav", out="pictures")
    >>> [picture.name for picture in found.pictures]
    ['vibration.png']
    """
    given = None if sensor is None else sensor_in(sensor)
    drawn = None if overlay is None else Path(overlay)
    if out is None:
        out = f"{Path(str(source).rpartition(':')[2].rstrip('/')).stem or 'source'}-inspected"
    out = Path(out)
    path = source.path if isinstance(source, DataSet) else Path(source)
    is_heard = is_sound(path)
    is_clip = (path.is_file() or is_image_folder(path)) and not Described.recognises(path)
    if drawn is not None and (is_heard or not is_clip):
        raise InputError(f"--overlay: expected a video to draw markers into, found '{source}'")
    for name in (MARKERS, RESPONSES, VIBRATION, STEADINESS):
        require_free(out / name, is_our_picture)
    if drawn is not None:
        require_free(drawn, is_overlay, force=force, reads=[path])
    if is_heard and is_clip and fps_hz is not None:
        raise InputError(f"--fps: expected a video, or a session of videos, found '{source}'")
    with Progress(quiet) as progress:
        if is_clip and not isinstance(source, DataSet):
            if is_heard:
                return inspect_wav(path, out)
            return inspect_video(path, out, given, progress, drawn, fps_hz)
        data_set = data_set_of(source)
        data_set = data_set if fps_hz is None else data_set.at_rate(fps_hz)
        if data_set.path == path and not path.exists():
            raise InputError(
                f"{path}: expected a video, a wav file, a session or a store, found nothing there"
            )
        stored = data_set.responses()
        if stored is not None:
            return inspect_responses(str(source), data_set, stored, out)
        return inspect_recordings(str(source), data_set, out, progress, given)


@dataclass(frozen=True)
class Look:
    """What there is of one recording, None if it can't be read; and what is wrong with it.

    `problems` are what it is refused for, `issues` what is only named. `lost` is the share of
    marker positions that were lost; None where none were followed.
    """

    row: dict[str, Any] | None
    problems: list[str]
    lost: float | None = None
    issues: list[str] = field(default_factory=list)


def look_at(recording: Recording, data_set: DataSet, sensor: Sensor | None) -> Look:
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
        with in_a_sentence(recording.name):
            issues = data_set.check(recording)
            row = facts(recording)
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
    with in_a_sentence(source):
        session = data_set.scan()
    found = Inspection(source)
    found.sentences += [grid_sentence(session), *data_set.describe(session)]
    found.sentences += reference_sentences(session, sensor)
    sensors = None
    if isinstance(session, FolderSession):
        sensors = sensors_of(session, sensor)
        found.sentences += default_sentences(session, sensor)
    jobs = [
        (recording, data_set, sensors.of(recording) if sensors else None)
        for recording in session.recordings
    ]
    # Sound alone is read sooner than processes begin.
    workers = None if any(r.video for r in session.recordings) else 1
    looks = side_by_side_numbered(look_at, jobs, workers, progress.note)
    looked = dict(progress.track(looks, "checking", len(jobs)))
    in_order = [looked[number] for number in sorted(looked)]
    rows = [look.row for look in in_order if look.row is not None]
    found.problems += [problem for look in in_order for problem in look.problems]
    names = [recording.name for recording in session.recordings]
    lost = {name: x.lost for name, x in zip(names, in_order, strict=True) if x.lost is not None}
    found.sentences += length_sentences(rows, len(jobs))
    found.sentences += filter(None, [what_was_lost(summarise_lost(lost))])
    of_paper = [
        look.row
        for look, recording in zip(in_order, session.recordings, strict=True)
        if look.row is not None and recording.named_by_spacing
    ]
    found.sentences += table_sentences(session) or too_short_sentences(of_paper)
    issues = {name: look.issues for name, look in zip(names, in_order, strict=True)}
    found.sentences += describe_issues(issues)
    try:
        found.sentences += beside_sentences(session)
        if not found.problems and isinstance(session, FolderSession):
            require_rates_that_agree(session, session.declared)
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
        if sensor is not None and isinstance(video := recording.video, ClipFile):
            most = sensor.rest_frame + round(PICTURED_S * video.fps_hz)
            start = VideoWithProgress(video, progress, most)
            tracks = track_markers(start, sensor, count_from=_declared_rest(session, sensor))
            assert start.last is not None
            name = f"{source}, {recording.name}"
            pictures += draw_video(start.last.image, tracks, sensor, name, out)
            break
    heard = ((r.name, r.audio) for r, *_ in jobs if r.audio is not None)
    for name, audio in islice(heard, 1):
        pictures.append(draw_vibration(audio.read(), f"{source}, {name}", out))
    return pictures


def _declared_rest(session: RecordingSet, sensor: Sensor) -> Positions | None:
    """Return the rest positions that a session says displacement counts from; None for its own."""
    reference = session.reference
    if not isinstance(session, FolderSession) or session.declared.rest != "reference":
        return None
    return ordered_rest(reference, of_still(reference, sensor)) if reference else None


def beside_sentences(session: RecordingSet) -> list[str]:
    """Say what was logged beside the recordings, how fast, and what sets its clock.

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
    press = session.press if isinstance(session, FolderSession) else None
    clock = "Times are taken to be by the images' clock: there is no press that sets another."
    if press is not None:
        names = " and ".join(sorted(log.name for log in press.beside)) or "nothing"
        clock = f"{press.name} is a press, not a recording: it sets the clock of {names}."
    return [f"Kept beside: {', '.join(kept)}.", clock]


def table_sentences(session: RecordingSet) -> list[str]:
    """Say what was read from names and columns of tables, and which part of them is used."""
    files = [
        (r, r.audio) for r in session.recordings if isinstance(r.audio, SeriesFile | JoinedFiles)
    ]
    if not files:
        return []
    values: dict[str, set[str]] = {}
    for recording, _ in files:
        for name, value in recording.conditions.items():
            values.setdefault(name, set()).add(str(value))
    said = [
        f"{name}: {some_of(sorted(its, key=natural_order))}" for name, its in sorted(values.items())
    ]
    recording, file = files[0]
    with suppress(InputError):
        names = ", ".join(map(str, file.read()[dims.CHANNEL].values))
        length_s = file.n_samples / file.sample_rate_hz
        start, stop = recording.steady_s or (EDGE_S, length_s - EDGE_S)
        said.append(f"channels: {names}, at {file.sample_rate_hz:g} Hz")
        if start < stop:
            used = f"{start:g} to {stop:.4g} s of {length_s:.4g} s"
            said.append(f"used of the first: {used}; steady_s says which part")
    return [f"{text[:1].upper()}{text[1:]}." for text in said]


def reference_sentences(session: RecordingSet, sensor: Sensor | None) -> list[str]:
    """Say of a marker reference that does not show the sensor's markers what the matter is."""
    if session.reference is None or not isinstance(session, FolderSession):
        return []
    try:
        usual = sensors_of(session, sensor).usual
        rest_positions(session.reference, of_still(session.reference, usual))
    except AfferentsError as error:
        return [f"The published tracker can't be led by it: {error}."]
    return []


def length_sentences(rows: list[dict[str, Any]], n: int) -> list[str]:
    """Say between which lengths the videos and vibrations of `n` recordings lie."""
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
    """Say which videos and audio are too short for the cut 'published', if any."""
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


def inspect_responses(
    source: str, data_set: DataSet, recordings: Sequence[Responses], out: Path
) -> Inspection:
    """Say what responses a data set holds, and how steady its tactile images are."""
    found = Inspection(source, facts={"config": dict(data_set.config())})
    names = sorted({str(name) for r in recordings for name in r.data_vars})
    found.sentences.append(
        f"{data_set.title} of {len(recordings)} recordings with {', '.join(names)}."
    )
    notes = notes_in({str(r.attrs["name"]): r.attrs for r in recordings})
    found.sentences += [*notes.sentences, *series_sentences(recordings), *notes.of_force]
    lost = {
        str(responses.attrs["name"]): share_lost(responses[dims.DETECTED], responses.attrs)
        for responses in recordings
        if dims.DETECTED in responses
    }
    found.sentences += filter(None, [what_was_lost(summarise_lost(lost))])
    found.problems += [
        f"{name}: {100 * share:.1f}% of marker positions are lost."
        for name, share in lost.items()
        if share > MOST_LOST
    ]
    if rows := steadiness_of(recordings):
        found.facts["steadiness"] = rows
        found.sentences.append(steadiness_sentence(rows, APART))
        figure = steadiness_figure(rows, APART, f"{source}, middle of each recording")
        found.pictures = [save_figure(figure, out / STEADINESS)]
    if recordings:
        found.pictures += draw_responses(recordings[len(recordings) // 2], source, out)
    return found


def draw_responses(responses: Responses, source: str, out: Path) -> list[Path]:
    """Draw the first seconds of one recording, as of a clip and a sound."""
    name, pictures = f"{source}, {responses.attrs['name']}", []
    if dims.SA1 in responses and dims.RA1 in responses:
        times = responses[dims.TIME].values
        part = responses.isel({dims.TIME: times < times[0] + PICTURED_S})
        figure = responses_figure(part[dims.SA1], part[dims.RA1], name)
        pictures.append(save_figure(figure, out / RESPONSES))
    if dims.RA2 in responses:
        pictures.append(draw_vibration(responses[dims.RA2], name, out))
    return pictures
