"""The command that writes a file for neuroscientists: a store as NWB."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from afferents.commands.given import Place
from afferents.core.errors import InputError
from afferents.core.progress import Progress


def export_nwb(
    store: Place,
    out: Place,
    session: Place | None = None,
    model: str = "izhikevich",
    seed: int = 0,
    classes: str | Sequence[str] = ("SA", "RA", "PC"),
    sound: bool = True,
    markers: bool = True,
    start_time: str | datetime | None = None,
    force: bool = False,
    quiet: bool = False,
) -> Path:
    """Write a store as an NWB file: spikes of artificial afferents, trials, sound and markers.

    Recordings lie one after another on the session's clock. Needs the extra ``nwb``.

    Parameters
    ----------
    store
        As `extract` writes it.
    out
        File to write, ending in ``.nwb``.
    session
        The folder that the store was extracted from: its videos are then named in the file, by
        their paths from there. None for no videos.
    model, seed, classes
        Of the units: ``izhikevich`` or ``lif``, how they differ, and some of SA, RA and PC.
    sound, markers
        Whether the vibration and the marker tracks are written too.
    start_time
        When the session began, such as ``2026-03-31T09:30+02:00``; without a zone it is UTC. None
        for when the store was written.
    force
        Whether a file that was exported there before may be replaced.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputError
        If there is no store, the session is another one's, the packages are missing, or another
        file is there already.

    Examples
    --------
    >>> export_nwb("responses.zarr", "session.nwb", session="session")
    PosixPath('session.nwb')
    """
    from afferents.pipeline.nwb import NwbExport
    from afferents.pipeline.nwb import export_nwb as run

    named = classes.replace(",", " ").split() if isinstance(classes, str) else classes
    folder = None if session is None else Path(session)
    wanted = NwbExport(
        Path(store), Path(out), folder, model, seed, tuple(named), sound, markers, _time(start_time)
    )
    with Progress(quiet) as progress:
        run(wanted, progress, force)
    return Path(out)


def _time(given: str | datetime | None) -> datetime | None:
    """Return when a session began."""
    if given is None or isinstance(given, datetime):
        return given
    try:
        return datetime.fromisoformat(given)
    except ValueError:
        wanted = "a date and time such as 2026-03-31T09:30+02:00"
        raise InputError("--start-time", wanted, f"'{given}'") from None
