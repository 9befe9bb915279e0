"""From an extracted store to the spikes of artificial afferents."""

from collections.abc import Sequence
from pathlib import Path

from afferents.core.progress import Progress
from afferents.core.store import open_responses
from afferents.spikes.artificial import artificial_spikes
from afferents.spikes.population import Spikes


def spikes_of_store(
    store: str | Path,
    model: str = "izhikevich",
    seed: int = 0,
    classes: Sequence[str] = ("SA", "RA", "PC"),
    start_s: float | None = None,
    stop_s: float | None = None,
    progress: Progress | None = None,
) -> Spikes:
    """Return the spikes of units that the recordings of a store drive; a trial a recording.

    Parameters
    ----------
    store
        As `afferents extract` writes it.
    model, seed, classes, start_s, stop_s
        See `artificial_spikes`.

    Raises
    ------
    InputError
        If the store can't be read, and as `artificial_spikes`.
    """
    recordings = open_responses(store)
    progress = progress or Progress(quiet=True)
    read = progress.track(recordings, "spikes", len(recordings))
    return artificial_spikes(read, model, seed, classes, start_s, stop_s)
