"""A data set that came as one archive: what is in it, and how its files come out of it.

An archive is other people's, so nothing of it is believed: only ordinary files are taken, only
below the folder that they go into, and none before all its names have been looked at.
"""

import hashlib
import lzma
import stat
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, NamedTuple

from afferents.errors import InputError, reason_of
from afferents.files import write_aside
from afferents.recordings.fetch.archives import path_within

ENDINGS = (".zip", ".tar", ".tar.gz", ".tgz", ".tar.bz2", ".tar.xz")
"""Of archives that are taken; where a page offers several of one data set, the first of these."""
AGAIN = "remove it and run the same command again, or take another archive by --url"
_DAMAGE = (EOFError, tarfile.TarError, zipfile.BadZipFile, zlib.error, lzma.LZMAError)
_BLOCK = 1 << 20
_TAR_BLOCK = 512
_ZIP_LOCKED = 0x1
_OF_MACS = "__MACOSX"


class Unpacked(NamedTuple):
    """A file that came out of an archive: its path, its SHA-256 and its size in bytes."""

    path: str
    sha256: str
    n_bytes: int


@dataclass(frozen=True)
class Member:
    """A file in an archive.

    Attributes
    ----------
    path
        Where it goes.
    n_bytes
        Its size.
    opened
        Opens what is in it.
    """

    path: str
    n_bytes: int
    opened: Callable[[], AbstractContextManager[IO[bytes]]]


def is_packed(path: str) -> bool:
    """Say by its name whether a file is an archive."""
    return path.lower().endswith(ENDINGS)


def archive_among(links: Sequence[str], name: str) -> str | None:
    """Return the one link to an archive of a whole data set, if there is one.

    Parameters
    ----------
    name
        The data set's on its server. An archive of that name goes before others.
    """
    archives = [link for link in links if is_packed(link)]
    archives = [link for link in archives if name in link] or archives
    if len({_stem(link) for link in archives}) != 1:
        return None
    return min(archives, key=lambda link: _ending(link)[0])


def _ending(link: str) -> tuple[int, str]:
    return next((n, end) for n, end in enumerate(ENDINGS) if link.lower().endswith(end))


def _stem(link: str) -> str:
    return link[: -len(_ending(link)[1])].rpartition("/")[2]


@contextmanager
def members_of(packed: Path) -> Iterator[list[Member]]:
    """Yield what an archive holds, without the folder that all of it lies in.

    Files that systems leave behind, with names that begin with a dot, are left out.

    Raises
    ------
    InputError
        If it is no archive or not whole, or holds a link, a device, a file twice, a file with a
        password, or a name that leads out of the folder; nothing has been unpacked then. While
        the block runs: if what is in it is damaged.
    """
    reader = _of_zip if packed.name.lower().endswith(".zip") else _of_tar
    try:
        with reader(packed) as members:
            kept = [one for one in members if not _is_left_behind(one.path)]
            yield _without_common_folder(_checked(kept, packed))
    except _DAMAGE as error:
        expected = "a whole archive, .zip or .tar"
        raise InputError(
            f"{packed}: expected {expected}, found damage ({_words(error)}); {AGAIN}"
        ) from error


def unpack(members: Sequence[Member], folder: Path, moved: Callable[[int], None]) -> list[Unpacked]:
    """Write files of an archive into a folder that is made; return what was written.

    Parameters
    ----------
    moved
        Told how many bytes are written.

    Raises
    ------
    InputError
        If there is no room or no permission; nothing is left of the folder.
    """
    done: list[Unpacked] = []
    with write_aside(folder) as partial:
        partial.mkdir()
        n_bytes = 0
        for member in members:
            target = partial / member.path
            target.parent.mkdir(parents=True, exist_ok=True)
            one = _written(member, target)
            done.append(one)
            n_bytes += one.n_bytes
            moved(n_bytes)
    return done


def _written(member: Member, target: Path) -> Unpacked:
    digest, n_bytes = hashlib.sha256(), 0
    with member.opened() as source, target.open("xb") as out:
        while block := _read(source):
            out.write(block)
            digest.update(block)
            n_bytes += len(block)
    if n_bytes != member.n_bytes:
        raise EOFError(f"{member.path} ends after {n_bytes} of {member.n_bytes} bytes")
    return Unpacked(member.path, digest.hexdigest(), n_bytes)


def _read(source: IO[bytes]) -> bytes:
    try:
        return source.read(_BLOCK)
    except OSError as error:  # of what is read, not of what is written
        raise EOFError(reason_of(error)) from error


@contextmanager
def _of_zip(packed: Path) -> Iterator[list[Member]]:
    with zipfile.ZipFile(packed) as archive:
        yield [_in_zip(archive, one, packed) for one in archive.infolist() if not one.is_dir()]


def _in_zip(archive: zipfile.ZipFile, info: zipfile.ZipInfo, packed: Path) -> Member:
    kind = stat.S_IFMT(info.external_attr >> 16)
    _require(packed, info.filename, kind in (0, stat.S_IFREG), "a link or a device")
    _require(packed, info.filename, not info.flag_bits & _ZIP_LOCKED, "a file with a password")
    is_known = info.compress_type in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
    is_known |= info.compress_type in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    _require(packed, info.filename, is_known, "a compression that is not known here")
    return Member(info.filename, info.file_size, lambda: archive.open(info))


@contextmanager
def _of_tar(packed: Path) -> Iterator[list[Member]]:
    with tarfile.open(packed) as archive:
        infos = [one for one in archive.getmembers() if not one.isdir()]
        _require_end(archive)
        yield [_in_tar(archive, one, packed) for one in infos]


def _in_tar(archive: tarfile.TarFile, info: tarfile.TarInfo, packed: Path) -> Member:
    _require(packed, info.name, info.isreg(), "a link or a device")

    def opened() -> AbstractContextManager[IO[bytes]]:
        source = archive.extractfile(info)
        if source is None:
            raise tarfile.ReadError(info.name)
        return source

    return Member(info.name, info.size, opened)


def _require_end(archive: tarfile.TarFile) -> None:
    """Refuse a tar that was cut off between two files, which Python takes for whole."""
    source = archive.fileobj
    if source is not None:
        source.seek(archive.offset)
        if source.read(_TAR_BLOCK) != bytes(_TAR_BLOCK):
            raise EOFError("it is cut off")


def _checked(members: list[Member], packed: Path) -> list[Member]:
    """Return the files of an archive, if their names are such that all have a place."""
    if not members:
        raise InputError(f"{packed}: expected an archive with files in it, found none; {AGAIN}")
    within = [Member(path_within(m.path, packed), m.n_bytes, m.opened) for m in members]
    seen: set[str] = set()
    for one in within:
        _require(packed, one.path, one.path not in seen, "two files of one name")
        seen.add(one.path)
    for one in within:
        above = (str(folder) for folder in PurePosixPath(one.path).parents)
        _require(packed, one.path, seen.isdisjoint(above), "a file where a folder should be")
    return within


def _without_common_folder(members: list[Member]) -> list[Member]:
    tops = {one.path.partition("/")[0] for one in members}
    if len(tops) != 1 or not all("/" in one.path for one in members):
        return members
    return [Member(one.path.partition("/")[2], one.n_bytes, one.opened) for one in members]


def _is_left_behind(path: str) -> bool:
    parts = PurePosixPath(path).parts
    return _OF_MACS in parts or any(part.startswith(".") and part != ".." for part in parts)


def _require(packed: Path, path: str, holds: bool, found: str) -> None:
    if not holds:
        expected = "ordinary files, each with a name of its own"
        raise InputError(
            f"{packed}: expected {expected}, found {found} ('{path}'); unpack it by hand, with care"
        )


def _words(error: Exception) -> str:
    return str(error).partition("\n")[0] or "it is cut off"
