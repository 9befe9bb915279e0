"""Whether the recordings of a session belong together: its grid, its files, its rates."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from afferents.errors import InputError
from afferents.recordings.check import RATE_TOLERANCE, lost_frames
from afferents.recordings.session_file import SessionFile
from afferents.store.recording import Recording, RecordingSet, natural_order, require_distinct


def require_grid(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    """Refuse a session with one texture or speed under two names, with holes, or with files amiss.

    A list of recordings is what there is; of files that are found, one may have been forgotten.

    Raises
    ------
    InputError
        Naming what is amiss.
    """
    speeds = set()
    for r in recordings:
        if r.speed_mm_s is not None:
            folders = [] if declared.recordings else r.name.split("/")[1:2]
            name = (folders or [f"{r.speed_mm_s:g}"])[0]
            speeds.add((name.lstrip("+-"), r.speed_mm_s))  # a sign says a direction
    require_distinct(root, (r.texture for r in recordings), speeds)
    if not declared.recordings:
        there = {(r.texture, r.speed_mm_s) for r in recordings if r.speed_mm_s is not None}
        wanted = {(texture, speed) for texture, _ in there for _, speed in there}
        missing = wanted - there - set(declared.holes)
        if holes := sorted(missing, key=lambda one: (natural_order(one[0]), one[1])):
            names = ", ".join(f"{texture}/{speed:g}" for texture, speed in holes)
            raise InputError(
                f"{root}: expected a recording of every texture at every speed, found none in "
                f"{names}; record what is missing or declare it in {declared.file}: holes = "
                f"{[list(one) for one in holes]}"
            )
    for what, usual in (("video", "video.mp4"), ("audio", "audio.wav")):
        lacking = [r.name for r in recordings if getattr(r, what) is None]
        if 0 < len(lacking) < len(recordings):  # models would be left out for all
            raise InputError(
                f"{root}: expected {what if declared.names_files else usual} in every condition or "
                f"in none, found none in {', '.join(lacking)}; record what is missing, or move "
                f"these folders away and declare them in {declared.file} as 'holes'"
            )


def require_rates_that_agree(session: RecordingSet, declared: SessionFile) -> None:
    """Refuse recordings of several frame rates or sample rates, or of several picture sizes.

    What is learnt from them is counted in frames, Hz and px, and would be mixed. Opens all files
    where no rate or size is declared of all; whether a file has it is `check_recording`'s.

    Raises
    ------
    InputError
        Naming two recordings that contradict each other.
    """
    sizes: dict[str, str] = {}
    for recording in session.recordings:
        video = recording.video
        if video is not None and not (recording.sensor or declared.frame_width):
            with suppress(InputError):  # which extracting it says
                sizes.setdefault(f"{video.width}x{video.height}", recording.name)
    if len(sizes) > 1:
        found = ", ".join(f"{size} px in {name}" for size, name in sizes.items())
        raise InputError(
            f"{session.root}: expected pictures of one size, found {found}; make a session of "
            "each size"
        )
    each = "make a session of each rate"
    true = f"if a container is wrong, write the recording's true fps_hz, else {each}"
    for what, tolerance, unit, do in (
        ("fps_hz", RATE_TOLERANCE, "frames a second", true),
        ("sample_rate_hz", 0.0, "samples a second", each),
    ):
        rates = [(r, _find_rate(r, what, declared)) for r in session.recordings]
        most = max((rate for _, rate in rates if rate), default=0.0)
        known = [
            (recording, rate)
            for recording, rate in rates
            if rate and not (rate < (1 - tolerance) * most and lost_frames(recording.video, most))
        ]
        for recording, rate in known:
            first, expected = known[0]
            if abs(rate - expected) > tolerance * expected:
                raise InputError(
                    f"{session.root}: expected recordings of one rate ({unit}), found "
                    f"{expected:g} in {first.name}, {rate:g} in {recording.name}; {do}"
                )


def _find_rate(recording: Recording, what: str, declared: SessionFile) -> float | None:
    """Return its own rate, Hz, else the one that is declared of all, else its file's, if any."""
    source = recording.video if what == "fps_hz" else recording.audio
    if source is None:
        return None
    own: float | None = getattr(source, "rate_hz", None) or getattr(declared, what)
    with suppress(InputError):  # which extracting it says
        return own or getattr(source, what)
    return None
