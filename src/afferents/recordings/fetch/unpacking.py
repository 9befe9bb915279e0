"""What was fetched, put in its place: the list of checksums, room on disk, archives unpacked."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path

from afferents.errors import InputError, then
from afferents.files import checksum, naming, remove
from afferents.progress import Progress
from afferents.recordings.fetch.archives import RemoteFile, read_manifest, written
from afferents.recordings.fetch.packed import Unpacked, members_of, unpack

CHECKSUMS = "afferents-checksums.txt"
"""In the folder: a line for each file that is here, as a manifest has it."""
_ASIDE = ".unpacked"
_UNITS = ((1e9, "GB"), (1e6, "MB"), (1e3, "kB"))


def noted_in(folder: Path, url: str) -> dict[str, RemoteFile]:
    """Return what is noted of the files in a folder, by path; `url` is what paths count from."""
    path = folder / CHECKSUMS
    return {file.path: file for file in read_manifest(path, url)} if path.is_file() else {}


def note(folder: Path, files: Sequence[RemoteFile]) -> None:
    """Note the checksums of files that are here."""
    with naming(folder / CHECKSUMS), (folder / CHECKSUMS).open("a", encoding="utf-8") as out:
        out.write(written(files))


def unpack_here(
    packed: Path, folder: Path, noted: Mapping[str, RemoteFile], progress: Progress
) -> tuple[list[RemoteFile], list[RemoteFile]]:
    """Put what an archive holds into a folder; return what is new there, and what was there.

    All of it is unpacked aside first, so that of a damaged archive nothing is in its place.

    Raises
    ------
    InputError
        If the archive is no good, there is no room, or what is here, or was once, is another.
    """
    aside = packed.with_name(packed.name + _ASIDE)
    remove(aside)
    with members_of(packed) as members:
        total = sum(member.n_bytes for member in members)
        require_room(folder, total, ", what is in the archive")
        with progress.task("unpacking", total) as mark:
            out = unpack(members, aside, lambda n: mark(n, packed.name))
    try:
        is_here = {one.path: _is_here(one, folder, noted.get(one.path)) for one in out}
        for one in out:
            if not is_here[one.path]:
                _put(aside / one.path, folder / one.path)
    finally:
        remove(aside)
    files = [RemoteFile(one.path, "", one.sha256, one.n_bytes) for one in out]
    return [f for f in files if not is_here[f.path]], [f for f in files if is_here[f.path]]


def _is_here(one: Unpacked, folder: Path, noted: RemoteFile | None) -> bool:
    """Say whether a file is here already, and refuse another in its place."""
    target = folder / one.path
    is_here = target.exists()
    known = noted.sha256 if noted else None
    sha256 = checksum(target) if is_here else known
    if sha256 is None or sha256 == one.sha256:
        return is_here
    expected = f"the file that the archive holds (SHA-256 {one.sha256[:12]}...)"
    found, do = f"another (SHA-256 {sha256[:12]}...)", "move it elsewhere"
    if not is_here:
        found = f"another noted in {folder / CHECKSUMS} (SHA-256 {sha256[:12]}...)"
        do = "the data set has changed: fetch it into a new folder"
    raise InputError(f"{target}: expected {expected}, found {found}{then(do)}")


def _put(source: Path, target: Path) -> None:
    with naming(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        source.replace(target)


def require_room(folder: Path, needed: int, what: str = "") -> None:
    """Refuse a disk that is too small.

    Parameters
    ----------
    needed
        Bytes.
    what
        What they are for, after a comma.

    Raises
    ------
    InputError
        If there is less.
    """
    above = (folder.resolve(), *folder.resolve().parents)
    there = next(parent for parent in above if parent.exists())
    free = shutil.disk_usage(there).free
    if needed > free:
        raise InputError(
            f"{folder}: expected room for {size_in_words(needed)}{what}, found "
            f"{size_in_words(free)} on that disk; make room, or choose a folder on another disk"
        )


def size_in_words(n_bytes: int) -> str:
    """Say how large something is."""
    for unit, name in _UNITS:
        if n_bytes >= unit:
            return f"{n_bytes / unit:.3g} {name}"
    return f"{n_bytes} bytes"
