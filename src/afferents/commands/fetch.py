"""The command that brings public data sets here."""

from typing import TYPE_CHECKING

from afferents.commands.given import Place
from afferents.core.progress import Progress

if TYPE_CHECKING:
    from afferents.pipeline.fetch import Fetched


def fetch(
    name: str,
    folder: Place,
    url: str | None = None,
    manifest: Place | None = None,
    keep_archive: bool = False,
    quiet: bool = False,
) -> "Fetched":
    """Fetch a public data set; what is here already is checked and kept.

    What it is, its size and its licence are printed before it begins. Files come by `pooch`
    (extra `fetch`); one that was broken off is gone on with. Where there is but one .zip or .tar of
    everything, it is unpacked.

    Parameters
    ----------
    name
        ``pestell2022``, the recordings of the paper, or ``fabricslide``.
    folder
        Where it goes.
    url
        Another place where it is: a page or folder of a web server that lists its files, one
        archive of them, or, with `manifest`, what the paths in that count from.
    manifest
        A list of its files, ``PATH SHA-256 BYTES`` a line, or as ``sha256sum`` writes it.
    keep_archive
        Whether a .zip or .tar of everything stays once it is unpacked.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Fetched
        `folder`, and how many files were `fetched` and `kept`, together `n_bytes` bytes.

    Raises
    ------
    InputError
        If the server or its list is not what it should be, a file has another checksum, or there
        is no room.
    """
    from pathlib import Path

    from afferents.pipeline.fetch import Fetching, archive_named, plan_fetch
    from afferents.pipeline.fetch import fetch as bring

    given = None if manifest is None else Path(manifest)
    fetching = Fetching(archive_named(name), Path(folder), url, given, keep_archive)
    with Progress(quiet) as progress:
        plan = plan_fetch(fetching, progress)
        for sentence in plan.describe():
            progress.note(sentence)
        return bring(plan, progress)
