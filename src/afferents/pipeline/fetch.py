"""A public data set, brought here: what it is, how large, under which licence, and then its files.

Nothing that is there is overwritten. What an earlier run brought is checked and kept, and a file
that was broken off is gone on with.
"""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from afferents.core.errors import InputError
from afferents.core.files import checksum, naming
from afferents.core.lock import writing_alone
from afferents.core.progress import Mark, Progress
from afferents.recordings.remote import (
    ARCHIVES,
    Archive,
    Listing,
    RemoteFile,
    download,
    files_on,
    read_manifest,
    sizes_of,
    web,
    written,
)

CHECKSUMS = "afferents-checksums.txt"
"""In the folder: a line for each file that is here, as a manifest has it."""
_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


@dataclass(frozen=True)
class Fetching:
    """What is fetched.

    Attributes
    ----------
    archive
        The data set.
    folder
        Where it goes.
    url
        Another place where it is: a page or folder that lists its files, or, with a list of files
        at hand, what their paths count from. None for the data set's own.
    manifest
        A list of its files; see `recordings.remote.manifest`. None for the data set's own.
    """

    archive: Archive
    folder: Path
    url: str | None = None
    manifest: Path | None = None


@dataclass(frozen=True)
class Plan:
    """What there is to fetch, before anything of it is.

    Attributes
    ----------
    fetching
        What was asked for.
    files
        All of them, with what is known of sizes and checksums.
    here
        Paths of those that are here.
    licence
        Empty where nothing names one.
    page
        Where it was listed.
    """

    fetching: Fetching
    files: tuple[RemoteFile, ...]
    here: frozenset[str]
    licence: str
    page: str

    @property
    def missing(self) -> list[RemoteFile]:
        """The files that are not here."""
        return [file for file in self.files if file.path not in self.here]

    def describe(self) -> list[str]:
        """Say what it is, how large, under which licence, and how sure all that is."""
        archive, missing = self.fetching.archive, self.missing
        licence = self.licence or f"not named by {self.page}; read it there before you use them"
        said = [
            f"{archive.title} ({archive.page}).",
            f"Licence: {licence}.",
            f"{len(self.files)} files, {size_of_all(self.files)}, listed by {self.page}"
            + (f": {archive.extent}." if archive.extent and not self.fetching.manifest else "."),
        ]
        if self.here:
            said.append(f"{len(self.here)} are here; {size_of_all(missing)} to fetch.")
        unknown = sum(file.sha256 is None for file in missing)
        if unknown:
            said.append(
                f"Of {unknown} no checksum is known: what comes first is taken for right, and its "
                f"checksum noted in {self.fetching.folder / CHECKSUMS}."
            )
        if not archive.tried and self.fetching.url is None:
            said.append("This has not been tried against the real server: please tell us.")
        return said


@dataclass(frozen=True)
class Fetched:
    """What came of it: how many files were fetched and kept, and their size in bytes."""

    folder: Path
    fetched: int
    kept: int
    n_bytes: int


def archive_named(name: str) -> Archive:
    """Return a data set by its name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in ARCHIVES:
        raise InputError("fetch", f"one of {', '.join(ARCHIVES)}", f"'{name}'")
    return ARCHIVES[name]


def plan_fetch(fetching: Fetching, progress: Progress) -> Plan:
    """Find out which files there are, and which of them are here; nothing is fetched.

    Raises
    ------
    InputError
        If nothing answers or lists them, or what is here is something else.
    """
    web()
    listing, folder = _listing(fetching), fetching.folder
    noted = _noted(folder, fetching.url or fetching.archive.url)
    files = [_with_noted(file, noted.get(file.path)) for file in listing.files]
    sized = list(progress.track(sizes_of(files), "asking for sizes", len(files)))
    here = frozenset(file.path for file in sized if (folder / file.path).exists())
    licence = listing.licence or fetching.archive.licence
    return Plan(fetching, tuple(sized), here, licence, listing.page)


def fetch(plan: Plan, progress: Progress) -> Fetched:
    """Check what is here, and fetch what is not.

    Raises
    ------
    InputError
        If a file that is here is another, the disk is too small, or a file can't be had whole and
        right; what was fetched before stays, and the same command goes on from it.
    """
    folder = plan.fetching.folder
    _require_room(folder, plan.missing)
    with writing_alone(folder, "fetch"):
        noted = _noted(folder, plan.page)
        total = sum(file.n_bytes or 0 for file in plan.files)
        done, kept = 0, 0
        with progress.task("fetching", total or len(plan.files)) as mark, web().Session() as server:
            for file in plan.files:
                is_here = (folder / file.path).exists()
                sha256 = _kept(file, folder) if is_here else _got(file, folder, server, mark, done)
                kept += is_here
                n_bytes = (folder / file.path).stat().st_size
                done += n_bytes
                mark(done, file.path)
                if file.path not in noted:
                    _note(folder, replace(file, sha256=sha256, n_bytes=n_bytes))
    return Fetched(folder, len(plan.files) - kept, kept, done)


def _listing(fetching: Fetching) -> Listing:
    """Return the files that there are, by a list or by the server."""
    archive = fetching.archive
    manifest = fetching.manifest or archive.manifest
    if manifest is None:
        return files_on(fetching.url or archive.url, archive.key)
    if archive.manifest is None and fetching.url is None:
        expected = "--url as well, which says what the paths of the list count from"
        raise InputError("--manifest", expected, "none")
    files = read_manifest(manifest, fetching.url or archive.url)
    where = str(manifest) if fetching.manifest else "this package"
    return Listing(files, "", where)


def _with_noted(file: RemoteFile, noted: RemoteFile | None) -> RemoteFile:
    """Return a file with what was noted of it when it came, where its list doesn't say it."""
    if noted is None:
        return file
    sha256 = file.sha256 or noted.sha256
    return replace(file, sha256=sha256, n_bytes=file.n_bytes or noted.n_bytes)


def _noted(folder: Path, url: str) -> dict[str, RemoteFile]:
    path = folder / CHECKSUMS
    return {file.path: file for file in read_manifest(path, url)} if path.is_file() else {}


def _note(folder: Path, file: RemoteFile) -> None:
    with naming(folder / CHECKSUMS), (folder / CHECKSUMS).open("a", encoding="utf-8") as out:
        out.write(written([file]))


def _kept(file: RemoteFile, folder: Path) -> str:
    """Return the checksum of a file that is here, if it is the one that is listed."""
    target = folder / file.path
    sha256, n_bytes = checksum(target), target.stat().st_size
    same_size = file.n_bytes is None or file.n_bytes == n_bytes
    if file.sha256 not in (None, sha256) or not same_size:
        found = f"another ({n_bytes} bytes, SHA-256 {sha256[:12]}...)"
        raise InputError(target, "the file that is listed", found, "move it elsewhere")
    return sha256


def _got(file: RemoteFile, folder: Path, server: Any, mark: Mark, before: int) -> str:
    return download(file, folder, server, lambda n: mark(before + n, file.path))


def _require_room(folder: Path, missing: Sequence[RemoteFile]) -> None:
    """Refuse a disk that is too small, before anything is fetched."""
    needed = sum(file.n_bytes or 0 for file in missing)
    there = next(
        parent for parent in (folder.resolve(), *folder.resolve().parents) if parent.exists()
    )
    free = shutil.disk_usage(there).free
    if needed > free:
        raise InputError(
            folder, f"room for {_size(needed)}", f"{_size(free)} on that disk",
            "make room, or choose a folder on another disk",
        )  # fmt: skip


def size_of_all(files: Sequence[RemoteFile]) -> str:
    """Say how large files are together, as far as it is known."""
    unknown = sum(file.n_bytes is None for file in files)
    known = _size(sum(file.n_bytes or 0 for file in files))
    if unknown == 0:
        return known
    return "of unknown size" if unknown == len(files) else f"at least {known}"


def _size(n_bytes: int) -> str:
    for unit, name in _UNITS:
        if n_bytes >= unit:
            return f"{n_bytes / unit:.3g} {name}"
    return f"{n_bytes} bytes"
