"""A public data set, brought here: what it is, how large, under which licence, and then its files.

Nothing that is there is overwritten. What an earlier run brought is checked and kept, and a file
that was broken off is gone on with.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from rich.filesize import decimal

from afferents.errors import InputError
from afferents.files import Place, checksum, free_bytes, naming
from afferents.outputs import writing_alone
from afferents.progress import Mark, Progress
from afferents.recordings.fetch.archives import (
    Archive,
    RemoteFile,
    archive_named,
    format_manifest,
    read_manifest,
)
from afferents.recordings.fetch.download import download, part_of, size_here
from afferents.recordings.fetch.listing import ask_sizes, import_web, list_files

CHECKSUMS = "afferents-checksums.txt"
"""In the folder: a line for each file that is here, as a manifest has it."""


@dataclass(frozen=True)
class Plan:
    """What there is to fetch, before anything of it is.

    Attributes
    ----------
    archive, folder
        The data set, and where it goes.
    files
        All of them, with what is known of sizes and checksums.
    here
        Paths of those that are here.
    page
        Where it was listed.
    is_elsewhere
        Whether another address than the data set's own was given.
    """

    archive: Archive
    folder: Path
    files: tuple[RemoteFile, ...]
    here: frozenset[str]
    page: str
    is_elsewhere: bool

    @property
    def missing(self) -> list[RemoteFile]:
        """The files that are not here."""
        return [file for file in self.files if file.path not in self.here]

    def describe(self) -> list[str]:
        """Say what it is, how large, under which licence, and how sure all that is."""
        archive, missing = self.archive, self.missing
        licence = archive.licence or f"named by {archive.page}; read it before you use them"
        said = [
            f"{archive.title} ({archive.page}).",
            f"Licence: {licence}.",
            f"{len(self.files)} file(s), {_in_words(self.files)}, listed by {self.page}.",
        ]
        if self.here:
            said.append(f"{len(self.here)} are here; {_in_words(missing)} to fetch.")
        unknown = sum(file.sha256 is None for file in missing)
        if unknown:
            said.append(
                f"Of {unknown} no checksum is known: what comes first is taken for right, and its "
                f"checksum noted in {self.folder / CHECKSUMS}."
            )
        if not self.is_elsewhere:
            said.append("This has not been tried against the real server: please tell us.")
        return said


@dataclass(frozen=True)
class Fetched:
    """What came of it: how many files were fetched and kept, and their size in bytes."""

    folder: Path
    fetched: int
    kept: int
    n_bytes: int


def plan_fetch(
    archive: Archive,
    folder: Path,
    progress: Progress,
    url: str | None = None,
    manifest: Path | None = None,
) -> Plan:
    """Find out which files there are, and which of them are here; nothing is fetched.

    Parameters
    ----------
    url, manifest
        See `fetch`.

    Raises
    ------
    InputError
        If nothing answers or lists them, or what is here is something else.
    """
    import_web()
    where = page = url or archive.url
    listed = manifest or archive.manifest
    if listed is None:
        files = list_files(where)
    elif archive.manifest is None and url is None:
        expected = "--url as well, which says what the paths of the list count from"
        raise InputError(f"--manifest: expected {expected}, found none")
    else:
        files, page = read_manifest(listed, where), str(manifest or "this package")
    noted = _read_noted(folder, where)
    files = [_with_noted(file, noted.get(file.path, file)) for file in files]
    sized = tuple(progress.track(ask_sizes(files), "asking for sizes", len(files)))
    here = frozenset(file.path for file in sized if (folder / file.path).exists())
    return Plan(archive, folder, sized, here, page, is_elsewhere=url is not None)


def _read_noted(folder: Path, url: str) -> dict[str, RemoteFile]:
    """Return what is noted of the files in a folder, by path; `url` is what paths count from."""
    path = folder / CHECKSUMS
    return {file.path: file for file in read_manifest(path, url)} if path.is_file() else {}


def _with_noted(file: RemoteFile, noted: RemoteFile) -> RemoteFile:
    """Return a file with what was noted of it when it came, where its list doesn't say it."""
    sha256 = file.sha256 or noted.sha256
    return replace(file, sha256=sha256, n_bytes=file.n_bytes or noted.n_bytes)


def fetch_planned(plan: Plan, progress: Progress) -> Fetched:
    """Check what is here, and fetch what is not.

    Raises
    ------
    InputError
        If a file that is here is another, the disk is too small, or a file can't be had whole and
        right; what was fetched before stays, and the same command goes on from it.
    """
    folder, checksums = plan.folder, plan.folder / CHECKSUMS
    needed = sum((f.n_bytes or 0) - size_here(part_of(f, folder)) for f in plan.missing)
    if needed > (free := free_bytes(folder)):
        raise InputError(
            f"{folder}: expected room for {decimal(needed)}, found {decimal(free)} on that disk; "
            "make room, or choose a folder on another disk"
        )
    fetched, done = 0, 0
    total = sum(file.n_bytes or 0 for file in plan.files) or len(plan.files)
    with (
        writing_alone(folder, "fetch"),
        progress.task("fetching", total) as mark,
        import_web().Session() as web,
    ):
        noted = _read_noted(folder, plan.page)
        for file in plan.files:
            if (folder / file.path).exists():
                whole = _check(file, folder / file.path)
            else:
                whole = download(file, folder, web, partial(_mark, mark, done, file.path))
                fetched += 1
            done += whole.n_bytes or 0
            mark(done, file.path)
            if file.path not in noted:
                with naming(checksums), checksums.open("a", encoding="utf-8") as out:
                    out.write(format_manifest([whole]))
    return Fetched(folder, fetched, len(plan.files) - fetched, done)


def _mark(mark: Mark, before: int, text: str, n_bytes: int) -> None:
    mark(before + n_bytes, text)


def _check(file: RemoteFile, target: Path) -> RemoteFile:
    """Return a file that is here with its checksum, if it is the one that is listed."""
    sha256, n_bytes = checksum(target), target.stat().st_size
    if file.sha256 not in (None, sha256) or file.n_bytes not in (None, n_bytes):
        raise InputError(
            f"{target}: expected the file that is listed, found another ({n_bytes} bytes, SHA-256 "
            f"{sha256[:12]}...); move it elsewhere"
        )
    return replace(file, sha256=sha256, n_bytes=n_bytes)


def _in_words(files: Sequence[RemoteFile]) -> str:
    """Say how large files are together, as far as it is known."""
    unknown = sum(file.n_bytes is None for file in files)
    known = decimal(sum(file.n_bytes or 0 for file in files))
    if unknown == 0:
        return known
    return "of unknown size" if unknown == len(files) else f"at least {known}"


def fetch(
    name: str,
    folder: Place,
    url: str | None = None,
    manifest: Place | None = None,
    quiet: bool = False,
) -> "Fetched":
    """Fetch a public data set; what is here already is checked and kept.

    What it is, its size and its licence are printed before it begins. Needs the
    extra `fetch`. A file that was broken off is gone on with.

    Parameters
    ----------
    name
        ``pestell2022``, the recordings of the paper, ``fabricslide``, ``cluster-haptic-accel`` or
        ``cluster-haptic-audio``.
    folder
        Where it goes.
    url
        Another place where it is: a folder of a web server that lists its files, or, with
        `manifest`, what the paths in that count from.
    manifest
        A list of its files, ``PATH SHA-256 BYTES`` a line, or as ``sha256sum`` writes it.
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
    archive, given = archive_named(name), None if manifest is None else Path(manifest)
    with Progress(quiet) as progress:
        plan = plan_fetch(archive, Path(folder), progress, url, given)
        for sentence in plan.describe():
            progress.note(sentence)
        return fetch_planned(plan, progress)
