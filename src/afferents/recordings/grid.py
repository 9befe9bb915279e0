"""Whether the recordings of a session belong together: its grid, its files, its rates."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from afferents.core.errors import InputError
from afferents.core.recording import Recording, Session, natural_order, require_distinct
from afferents.recordings.check import RATE_TOLERANCE
from afferents.recordings.session_file import SessionFile


def require_grid(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    """Refuse a session with one texture or speed under two names, with holes, or with files amiss.

    A list of recordings is what there is; of files that are found, one may have been forgotten.

    Raises
    ------
    InputError
        Naming what is amiss.
    """
    speeds = {(_speed_named(r), r.speed_mm_s) for r in recordings if r.speed_mm_s is not None}
    require_distinct(root, (r.texture for r in recordings), speeds)
    if not declared.recordings:
        _require_no_holes(root, recordings, declared)
    for what, has in (
        ("video", {r.name: r.video is not None for r in recordings}),
        ("audio", {r.name: r.audio is not None for r in recordings}),
    ):
        _require_all_or_none(root, what, has, declared)


def _speed_named(recording: Recording) -> str:
    """Return a speed as the recording's name has it."""
    parts = recording.name.split("/")
    return parts[1] if len(parts) > 1 else f"{recording.speed_mm_s:g}"


def _require_no_holes(root: Path, recordings: Sequence[Recording], declared: SessionFile) -> None:
    present = {(r.texture, r.speed_mm_s) for r in recordings if r.speed_mm_s is not None}
    expected = {(texture, speed) for texture, _ in present for _, speed in present}
    missing = sorted(
        expected - present - set(declared.holes), key=lambda c: (natural_order(c[0]), c[1])
    )
    if missing:
        names = ", ".join(f"{texture}/{speed:g}" for texture, speed in missing)
        raise InputError(
            root,
            "a recording of every texture at every speed",
            f"none in {names}",
            f"record what is missing or declare it in {declared.file}: holes = "
            f"{[[texture, speed] for texture, speed in missing]}",
        )


def _require_all_or_none(
    root: Path, what: str, has: Mapping[str, bool], declared: SessionFile
) -> None:
    """Refuse a file that only some conditions have: models would be left out for all."""
    lacking = [name for name, there in has.items() if not there]
    if 0 < len(lacking) < len(has):
        file = what if declared.names_files else {"video": "video.mp4", "audio": "audio.wav"}[what]
        raise InputError(
            root,
            f"{file} in every condition or in none",
            f"none in {', '.join(lacking)}",
            "record what is missing, or move these folders away and declare them in "
            f"{declared.file} as 'holes'",
        )


def require_rates_that_agree(session: Session, declared: SessionFile) -> None:
    """Refuse recordings of several frame rates or sample rates, where none is declared.

    What is learnt from them is counted in frames and in Hz, and would be mixed. Opens all files.

    Raises
    ------
    InputError
        Naming two recordings that contradict each other.
    """
    if declared.fps_hz is None:
        do = (
            "if a container is wrong, write the recording's true fps_hz, else make a session of "
            "each rate"
        )
        _require_one(session, lambda r: r.fps_hz, RATE_TOLERANCE, "frames a second", do)
    if declared.sample_rate_hz is None:
        do = "make a session of each rate"
        _require_one(session, lambda r: r.sample_rate_hz, 0.0, "samples a second", do)


def _require_one(
    session: Session,
    rate_of: Callable[[Recording], float | None],
    tolerance: float,
    unit: str,
    do: str,
) -> None:
    first: tuple[str, float] | None = None
    for recording in session.recordings:
        rate = rate_of(recording)
        if rate is None:
            continue
        first = first or (recording.name, rate)
        if abs(rate - first[1]) > tolerance * first[1]:
            found = f"{first[1]:g} in {first[0]}, {rate:g} in {recording.name}"
            raise InputError(session.root, f"recordings of one rate ({unit})", found, do)
