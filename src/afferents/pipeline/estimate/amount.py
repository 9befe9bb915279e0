"""How much there is to go through: recordings, their lengths, and the groups to hold out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from afferents.core import dims
from afferents.core.cut import AUDIO_S, Cut, cut_audio, cut_frames
from afferents.core.errors import AfferentsError, InputError
from afferents.core.recording import EDGE_S, Recording
from afferents.core.responses import label
from afferents.core.split import Group, Split
from afferents.core.steady import Steady
from afferents.evaluation.ablation import Ablation
from afferents.recordings import Facts, Session, facts


@dataclass(frozen=True)
class Amount:
    """What is to be gone through, by the headers of the files alone.

    Attributes
    ----------
    used
        Recordings that are evaluated, counted as so many of the length of the one measured.
    groups
        To be held out in turn; `n_groups` are there.
    """

    used: float
    groups: tuple[Group, ...]
    n_groups: int


def amount_of(
    session: Session,
    sample: Recording,
    cut: Cut,
    split: Split,
    held_out: Sequence[Group],
    ablation: Ablation,
    steady: Steady | None,
) -> Amount:
    """Return how much a session is.

    Parameters
    ----------
    sample
        The recording that is measured; others count by their length beside its.

    Raises
    ------
    InputError
        If a group or texture asked for is not there.
    """
    named = [label(xr.Dataset(), recording) for recording in session.recordings]
    evaluated = ablation.recordings(named)
    names = {str(one.attrs["name"]) for one in evaluated}
    there = split.groups_of(evaluated)
    split.require(held_out, there, "--held-out")
    seconds = {r.name: used_s(r, cut, steady) for r in session.recordings if r.name in names}
    return Amount(
        sum(seconds.values()) / used_s(sample, cut, steady),
        tuple(held_out) or tuple(there),
        len(there),
    )


def n_frames(recording: Recording) -> int:
    """Return how many frames a recording's video declares; 0 if it can't be read."""
    found = _facts(recording)
    return found.video.n_frames if found and found.video else 0


def used_s(recording: Recording, cut: Cut, steady: Steady | None = None) -> float:
    """Return about how much of a recording the cut leaves, s; 0 if it can't be read."""
    found = _facts(recording)
    if found is None:
        return 0.0
    if cut == "published":
        return AUDIO_S
    start_stop = steady or recording.steady_s
    if start_stop is not None:
        return max(1e-3, start_stop[1] - start_stop[0])
    lengths = [f.duration_s for f in (found.video, found.vibration) if f is not None]
    return max(1e-3, min(lengths) - 2 * EDGE_S)


def _facts(recording: Recording) -> Facts | None:
    """Return what a recording's headers say; None where that is refused when it is extracted."""
    try:
        return facts(recording)
    except AfferentsError:
        return None


def require_length(session: Session, cut: Cut) -> None:
    """Refuse recordings that are too short for the cut, before any is tracked.

    Raises
    ------
    InputError
        Naming the first.
    """
    for recording in session.recordings if cut == "published" else ():
        _require_fits(facts(recording), cut)


def typical(
    recordings: Sequence[Recording], cut: Cut, steady: Steady | None = None
) -> list[Recording]:
    """Return recordings that the cut leaves something of, those of usual length first."""
    fitting = [recording for recording in recordings if _fits(recording, cut)]
    seconds = {recording.name: used_s(recording, cut, steady) for recording in fitting}
    usual = float(np.median(list(seconds.values()))) if fitting else 0.0
    return sorted(fitting, key=lambda recording: abs(seconds[recording.name] - usual))


def _fits(recording: Recording, cut: Cut) -> bool:
    found = _facts(recording)
    if found is None:
        return False
    try:
        if cut == "published":
            _require_fits(found, cut)
    except InputError:
        return False
    return True


def _require_fits(found: Facts, cut: Cut) -> None:
    if found.video is not None:
        cut_frames(np.zeros(found.video.n_frames), cut, None, found.name)
    if found.vibration is not None:
        n, rate_hz = found.vibration.n_samples, found.vibration.sample_rate_hz
        cut_audio(n, rate_hz, cut, None, found.name)


def lengthened(responses: xr.Dataset, recording: Recording) -> xr.Dataset:
    """Return the responses to a clip of a recording, repeated to the recording's own length."""
    if dims.TIME not in responses.dims:
        return responses
    n, rate_hz = n_frames(recording), recording.fps_hz or 1.0
    seen = np.flatnonzero(responses[dims.DETECTED].values.any(axis=1))
    repeated = responses.isel({dims.TIME: seen[np.arange(n) % len(seen)]})
    return repeated.assign_coords({dims.TIME: np.arange(n) / rate_hz})
