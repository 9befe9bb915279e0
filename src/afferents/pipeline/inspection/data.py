"""What is in a data set: its recordings, or responses that were extracted."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from afferents.core import dims
from afferents.core.cut import AUDIO_S, LAST_FRAME
from afferents.core.errors import AfferentsError
from afferents.core.own import in_a_sentence
from afferents.core.progress import Progress
from afferents.core.recording import Recording
from afferents.core.responses import Responses
from afferents.execution.local import side_by_side
from afferents.pipeline.copies import notes_in
from afferents.pipeline.doubts import doubts_without_tracking
from afferents.pipeline.inspection.found import Inspection
from afferents.pipeline.inspection.sound import draw_vibration
from afferents.recordings import Checks, DataSet, facts

MOST_LOST = 0.01
"""Share of marker positions lost beyond which a recording is named."""


@dataclass(frozen=True)
class Look:
    """What there is of one recording, None if it can't be read; and what is wrong with it."""

    row: dict[str, Any] | None
    problems: list[str]


def look_at(number: int, recording: Recording, checks: Checks) -> tuple[int, Look]:
    """Check a recording's headers and content; its markers are not looked for.

    Parameters
    ----------
    number
        Comes back, to put recordings that were looked at side by side into their order.
    checks
        Its data set's, of the headers.
    """
    row = None
    try:
        with in_a_sentence(recording.name):
            doubts = checks(recording)
            row = asdict(facts(recording))
            doubts = doubts + doubts_without_tracking(recording)
    except AfferentsError as error:
        return number, Look(row, [str(error)])
    return number, Look(row, [str(doubt) for doubt in doubts])


def inspect_recordings(source: str, data_set: DataSet, out: Path, progress: Progress) -> Inspection:
    """Check every recording of a data set, all pictures and samples; draw the first vibration."""
    with in_a_sentence(source):
        session, checks = data_set.recordings(), data_set.checks()
    found = Inspection(source)
    speeds = ", ".join(f"{speed:g}" for speed in session.speeds_mm_s)
    found.sentences += [
        f"{len(session.recordings)} recordings of {len(session.textures)} textures "
        f"({', '.join(session.textures)}) at {len(session.speeds_mm_s)} speeds ({speeds} mm/s).",
        *data_set.describe(session),
    ]
    jobs = [(n, recording, checks) for n, recording in enumerate(session.recordings)]
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


def inspect_responses(
    source: str, data_set: DataSet, recordings: Sequence[Responses]
) -> Inspection:
    """Say what responses a data set holds."""
    found = Inspection(source, facts={"config": dict(data_set.config())})
    names = sorted({str(name) for r in recordings for name in r.data_vars})
    found.sentences.append(
        f"{data_set.title} of {len(recordings)} recordings with {', '.join(names)}."
    )
    found.sentences += notes_in({str(r.attrs["name"]): r.attrs for r in recordings}).sentences
    for responses in recordings:
        if dims.DETECTED in responses:
            lost = 1 - float(responses[dims.DETECTED].mean())
            if lost > MOST_LOST:
                name = responses.attrs["name"]
                found.problems.append(f"{name}: {100 * lost:.1f}% of marker positions are lost.")
    return found
