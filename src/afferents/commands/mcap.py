"""The command that writes recordings as ROS 2 bags in MCAP files."""

from collections.abc import Sequence
from pathlib import Path

from afferents.commands.given import Place
from afferents.core.progress import Progress


def export_mcap(
    source: Place,
    out: Place,
    store: Place | None = None,
    recordings: str | Sequence[str] = (),
    quality: int = 95,
    percepts: Place | None = None,
    quiet: bool = False,
) -> list[Path]:
    """Write recordings as ROS 2 bags in MCAP files, for Foxglove, rerun and ``ros2 bag play``.

    A bag holds the camera's pictures as JPEGs, the sound, the drum's way and speed, and, of a
    store, the markers (drawn on the picture too), SA-I and RA-I. Times count from the recording's
    zero. Needs the extra ``mcap``; no ROS.

    Parameters
    ----------
    source
        A session, or a store, which has no pictures.
    out
        Folder to write; in it a folder a recording, with an ``.mcap`` file.
    store
        Of a session: the store that was extracted from it.
    recordings
        Names such as ``4/60``; none for all.
    quality
        Of JPEGs, 1 to 100. Those that the camera gave go into the bag byte for byte.
    percepts
        File with what ``afferents live --json`` said of the one recording that is named.
    quiet
        Whether no progress is shown.

    Returns
    -------
    list of Path
        The bags.

    Raises
    ------
    InputError
        If there is no such session, store or recording, the package is missing, or `out` is there
        already.

    Examples
    --------
    >>> export_mcap("session", "bags", store="responses.zarr", recordings="4/60")
    [PosixPath('bags/4_60')]
    """
    from afferents.pipeline.bags import McapExport
    from afferents.pipeline.bags import export_mcap as run

    named = recordings.split(",") if isinstance(recordings, str) else list(recordings)
    wanted = McapExport(
        Path(source), Path(out), None if store is None else Path(store),
        tuple(name for name in named if name), quality,
        None if percepts is None else Path(percepts),
    )  # fmt: skip
    with Progress(quiet) as progress:
        return run(wanted, progress)
