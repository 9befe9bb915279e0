"""The command that writes a store as a LeRobot data set."""

from pathlib import Path

from afferents.commands.given import Place
from afferents.core.progress import Progress


def export_lerobot(
    store: Place, out: Place, session: Place | None = None, quiet: bool = False
) -> int:
    """Write a store as a LeRobot data set (format 3.0): an episode a recording.

    Each frame of the camera holds the markers' displacement, SA-I, RA-I, the sound until the next
    frame, when it was taken and the sliding speed; the task is to feel the texture. Nothing acts,
    so there is no ``action``. LeRobot itself is not needed.

    Parameters
    ----------
    store
        As `extract` writes it.
    out
        Folder to write.
    session
        The folder that the store was extracted from, for its videos; None for no pictures.
    quiet
        Whether no progress is shown.

    Returns
    -------
    int
        Number of episodes.

    Raises
    ------
    InputError
        If there is no store, sensors or frame rates differ, the session is another one's, or `out`
        is there already.

    Examples
    --------
    >>> export_lerobot("responses.zarr", "touch-lerobot", session="session")
    130
    """
    from afferents.pipeline.lerobot import LeRobotExport
    from afferents.pipeline.lerobot import export_lerobot as run

    folder = None if session is None else Path(session)
    with Progress(quiet) as progress:
        return run(LeRobotExport(Path(store), Path(out), folder), progress)
