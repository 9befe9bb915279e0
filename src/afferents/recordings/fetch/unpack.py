"""A data set that came as one archive: its files come out of it aside, and then into their places.

An archive is other people's: Python's own filters keep what is in it within the folder.
"""

import lzma
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from rich.filesize import decimal

from afferents.errors import InputError, reason_of
from afferents.files import PARTIAL_PREFIX, checksum, free_bytes, naming
from afferents.progress import Progress
from afferents.recordings.fetch.archives import RemoteFile

ENDINGS = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")
"""Of archives that are taken."""
_TAR_BLOCK = 512
_OF_MACS = "__MACOSX"


def is_packed(path: str) -> bool:
    """Say by its name whether a file is an archive."""
    return path.lower().endswith(ENDINGS)


def unpack(
    packed: Path, folder: Path, noted: Mapping[str, RemoteFile], progress: Progress
) -> tuple[list[RemoteFile], list[RemoteFile]]:
    """Put what an archive holds into a folder; return what is new there, and what was there.

    All of it is unpacked aside first, so that of a damaged archive nothing is in its place. A
    folder that holds all of it is left out, and so are files with names that begin with a dot.

    Raises
    ------
    InputError
        If the archive is damaged, or holds what leads out of the folder, a device or a link; if
        there is no room; if what is here, or was once (`noted`), is another. Nothing is in its
        place then.
    """
    with (
        naming(folder / packed.name),
        tempfile.TemporaryDirectory(prefix=PARTIAL_PREFIX, dir=folder) as aside,
    ):
        _extract(packed, Path(aside), progress)
        files = _files_below(Path(aside), packed)
        new: list[RemoteFile] = []
        here: list[RemoteFile] = []
        for path, source in files.items():
            one = RemoteFile(path, "", checksum(source), source.stat().st_size)
            (here if _is_here(one, folder, noted.get(path)) else new).append(one)
        for one in new:
            (folder / one.path).parent.mkdir(parents=True, exist_ok=True)
            files[one.path].replace(folder / one.path)
    return new, here


@contextmanager
def _opened(packed: Path, into: Path) -> Iterator[tuple[dict[Any, int], Callable[[Any], object]]]:
    """Yield the size of each member of an archive, and what takes it out."""
    if packed.name.lower().endswith(".zip"):
        with zipfile.ZipFile(packed) as archive:
            sizes = {info: info.file_size for info in archive.infolist()}
            yield sizes, partial(archive.extract, path=into)
    else:
        with tarfile.open(packed) as tar:
            members = {member: member.size for member in tar.getmembers()}
            if tar.fileobj is not None:  # Python takes one for whole that ends between two files
                tar.fileobj.seek(tar.offset)
                if tar.fileobj.read(_TAR_BLOCK) != bytes(_TAR_BLOCK):
                    raise EOFError("it is cut off")
            yield members, partial(tar.extract, path=into, filter="data")


def _extract(packed: Path, into: Path, progress: Progress) -> None:
    try:
        with _opened(packed, into) as (sizes, take):
            total, done = sum(sizes.values()), 0
            require_room(into, total, ", what is in the archive")
            with progress.task("unpacking", total) as mark:
                for member, size in sizes.items():
                    take(member)
                    done += size
                    mark(done, packed.name)
    except (tarfile.FilterError, RuntimeError, KeyError) as error:  # RuntimeError: a password
        raise InputError(
            f"{packed}: expected ordinary files, found {reason_of(error)}; unpack it by "
            "hand, with care"
        ) from error
    except (EOFError, tarfile.TarError, zipfile.BadZipFile, zlib.error, lzma.LZMAError) as error:
        raise InputError(
            f"{packed}: expected a whole archive, .zip or .tar, found damage "
            f"({reason_of(error)}); remove it and run the same command again, or take "
            "another archive by --url"
        ) from error


def _files_below(root: Path, packed: Path) -> dict[str, Path]:
    """Return files by their paths below a folder, or below the one folder that holds them all."""
    found = {path.relative_to(root): path for path in sorted(root.rglob("*")) if not path.is_dir()}
    kept = {
        path: file
        for path, file in found.items()
        if not any(part.startswith(".") or part == _OF_MACS for part in path.parts)
    }
    if not kept or any(file.is_symlink() for file in kept.values()):
        raise InputError(
            f"{packed}: expected an archive of ordinary files, found "
            f"{'links among them' if kept else 'none'}; unpack it by hand, with care"
        )
    tops = {path.parts[0] for path in kept}
    within = len(tops) == 1 and all(len(path.parts) > 1 for path in kept)
    return {
        (path.relative_to(path.parts[0]) if within else path).as_posix(): file
        for path, file in kept.items()
    }


def _is_here(one: RemoteFile, folder: Path, noted: RemoteFile | None) -> bool:
    """Say whether a file is here already, and refuse another in its place."""
    target = folder / one.path
    is_here = target.exists()
    sha256 = checksum(target) if is_here else (noted.sha256 if noted else None)
    if sha256 in (None, one.sha256):
        return is_here
    found, do = "another", "move it elsewhere"
    if not is_here:
        found, do = "another noted", "the data set has changed: fetch it into a new folder"
    raise InputError(
        f"{target}: expected the file that the archive holds (SHA-256 {str(one.sha256)[:12]}...), "
        f"found {found} (SHA-256 {str(sha256)[:12]}...); {do}"
    )


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
    free = free_bytes(folder)
    if needed > free:
        raise InputError(
            f"{folder}: expected room for {decimal(needed)}{what}, found {decimal(free)} on that "
            "disk; make room, or choose a folder on another disk"
        )
