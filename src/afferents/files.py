"""Writing so that a file or folder is either whole or absent, and checksums."""

import errno
import hashlib
import json
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from typing import Any
from uuid import uuid4

from afferents.errors import InputError

PARTIAL_PREFIX, LOCK = ".partial-", ".afferents-lock"
"""Names of a run that is at work: what it has not finished, and its lock; never data."""
MARK = "afferents"
"""We write it into every file that a user names, where its format has room for it."""
_HEAD_BYTES = 4096
_NAME_KEPT = 80
"""Characters of a target's name that its temporary name begins with: names have an end."""
_SYSTEM = {
    errno.ENOSPC: "no space left on the disk",
    errno.EDQUOT: "no space left of your quota",
    errno.EFBIG: "a limit to the size of files",
    errno.EACCES: "no permission",
    errno.EPERM: "no permission",
    errno.EROFS: "a file system that is read-only",
    errno.EMFILE: "too many files open",
    errno.ENAMETOOLONG: "a name that is too long",
    errno.ENOTDIR: "a file where a folder should be",
    errno.EIO: "a disk that fails",
}
"""Errors of the system while something is written, in words."""

Recognise = Callable[[Path], bool]
"""Returns whether a file or folder that exists is an earlier output of the same kind."""


def nothing(_: Path) -> bool:
    """Recognise nothing: what exists stays."""
    return False


def holds_only(*names: str, or_ours: Recognise = nothing) -> Recognise:
    """Return what recognises a folder of nothing but files of these names, or that are ours.

    What a run that is at work leaves there does not count. Without names it recognises an empty
    folder.
    """

    def recognises(folder: Path) -> bool:
        return folder.is_dir() and all(
            entry.name in (*names, LOCK) or entry.name.startswith(PARTIAL_PREFIX) or or_ours(entry)
            for entry in folder.iterdir()
        )

    return recognises


def has_mark(path: Path, mark: str) -> bool:
    """Return whether a path is a file whose first bytes hold our mark."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return mark.encode() in file.read(_HEAD_BYTES)


def is_our_picture(path: Path) -> bool:
    """Return whether a file is a PNG of ours."""
    return path.suffix == ".png" and has_mark(path, f"Software\0{MARK}")


def require_free(
    target: Path, is_ours: Recognise = nothing, *, force: bool = True, reads: Iterable[Path] = ()
) -> None:
    """Refuse a target that must not be written: the one rule for all outputs.

    What exists is replaced, or gone on with, only if it is an earlier output of the same kind.
    Never replaced is what the command reads, a device, or a link to nowhere.

    Parameters
    ----------
    is_ours
        Recognises an earlier output of the same kind.
    force
        False where a user must give ``--force`` to replace an earlier output, and did not.
    reads
        Files and folders that the command reads.

    Raises
    ------
    InputError
        Saying what is in the way.
    """
    do = ""
    try:
        read = [Path(os.path.realpath(one)) for one in reads]  # raises nothing
        found = _find_hindrance(target, is_ours, read)
        if not found and not force and target.exists():
            found, do = "an earlier output", "add --force to replace it, or "
    except (OSError, RuntimeError) as error:  # a link to itself is a RuntimeError
        found = _describe(error) if isinstance(error, OSError) else "a link that leads to itself"
    if found:
        raise InputError(
            f"{target}: expected a name that is free, found {found}; {do}choose another name"
        )


def _find_hindrance(target: Path, is_ours: Recognise, reads: list[Path]) -> str:
    """Return what must not be replaced, in words; empty where nothing is in the way."""
    there = next(place for place in (target, *target.parents) if os.path.lexists(place))
    if not there.exists():
        return "a link that leads nowhere"
    if there != target:
        return "" if there.is_dir() else f"{there.name}, which is no folder,"
    place = target.resolve()
    if any(place in (read, *read.parents) for read in reads):
        return "what the command reads"
    if not (target.is_file() or target.is_dir()):
        return "a device or a pipe"
    if is_ours(target):
        return ""
    kind = "a folder" if target.is_dir() else "a file"
    return kind if is_ours is nothing else f"{kind} that holds something else"


@contextmanager
def write_aside(target: Path, replaces: Recognise = Path.is_file) -> Iterator[Path]:
    """Yield a temporary path next to `target`; rename it to `target` if the block succeeds.

    Works for files and folders. If the block raises, the temporary path is removed and an
    earlier `target` is left untouched.

    Parameters
    ----------
    replaces
        Recognises what may be replaced: by default any file. Commands look at a file that a user
        names with `require_free` first, before any work.

    Raises
    ------
    InputError
        If something that must not be replaced stands at `target`. If the disk is full, or there is
        no permission.
    """
    require_free(target, replaces)
    target = target.resolve() if target.is_symlink() else target  # a link stays a link
    partial = target.parent / _partial_name(target.name)
    made = [folder for folder in target.parents if not folder.exists()]
    try:
        with naming(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            yield partial
            require_free(target, replaces)
            if target.is_dir() and partial.is_dir():  # which can't take a folder's place
                earlier = target.parent / _partial_name(target.name)
                target.replace(earlier)
                partial.replace(target)
                remove(earlier)
            else:
                partial.replace(target)
    except BaseException:
        remove(partial)
        for folder in made:
            with suppress(OSError):  # something else has been written there
                folder.rmdir()
        raise


@contextmanager
def naming(target: Path) -> Iterator[None]:
    """Turn the system's errors of writing `target` into a sentence that names it.

    Raises
    ------
    InputError
        If the disk is full, a file may not be so large, or there is no permission.
    """
    try:
        yield
    except OSError as error:
        if error.filename and not str(error.filename).startswith(str(target.parent)):
            raise  # of a file that is read meanwhile
        kept = "nothing of it is left, and what was there before is untouched"
        raise InputError(
            f"{target}: expected room and permission to write it, found {_describe(error)} "
            f"({kept}); make room, or choose another place"
        ) from error


def _partial_name(name: str) -> str:
    return f"{PARTIAL_PREFIX}{name[:_NAME_KEPT]}-{os.getpid()}-{uuid4().hex[:8]}"


def _describe(error: OSError) -> str:
    return _SYSTEM.get(error.errno or 0) or error.strerror or "a write that was cut short"


def remove(path: Path) -> None:
    """Remove a file or folder, whatever of it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def remove_partials(folder: Path) -> None:
    """Remove what a run that was killed left unfinished anywhere below `folder`.

    To be called by who has the folder's lock (`outputs.writing_alone`): no other run writes there.
    """
    for partial in sorted(folder.rglob(f"{PARTIAL_PREFIX}*")):
        remove(partial)


def write_json(target: Path, content: Any) -> None:
    """Write `content` as indented JSON, whole or not at all."""
    with write_aside(target) as partial:
        partial.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")


def write_text(target: Path, text: str) -> None:
    """Write text, whole or not at all; names of files in it need not be text themselves."""
    with write_aside(target) as partial:
        partial.write_text(text, encoding="utf-8", errors="backslashreplace")


def checksum(*paths: Path) -> str:
    """Return the SHA-256 (hex) of the files' contents, in the order given.

    Of a folder, such as one of images, the names of its files count too: they say when each was
    taken.

    Raises
    ------
    InputError
        If one is no file: a pipe never ends.
    """
    digest = hashlib.sha256()
    for file_path in (one for path in paths for one in _list_files(path)):
        if file_path.exists() and not file_path.is_file():
            raise InputError(f"{file_path}: expected a file, found a pipe or a device")
        if file_path not in paths:
            digest.update(file_path.name.encode(errors="surrogateescape"))
        with file_path.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def free_bytes(folder: Path) -> int:
    """Return how much room there is on the disk of a folder, which need not be there yet."""
    whole = folder.resolve()
    there = next(path for path in (whole, *whole.parents) if path.exists())
    return shutil.disk_usage(there).free


def size_of(path: Path) -> int:
    """Return the size of a file in bytes, or of all files in a folder together, hidden ones apart.

    Raises
    ------
    OSError
        If there is none.
    """
    return sum(file.stat().st_size for file in _list_files(path))


def is_hidden(path: PurePath) -> bool:
    """Tell whether one of a path's names begins with a dot, as of what systems leave behind."""
    return any(part.startswith(".") for part in path.parts)


def walk(folder: Path, above: tuple[Path, ...] = ()) -> Iterator[tuple[Path, list[Path]]]:
    """Yield a folder and those below it, each with its files; hidden ones are left out.

    Links to folders are followed, but none to a folder that the walk is in.

    Raises
    ------
    OSError
        If a folder can't be read.
    """
    above = (*above, folder.resolve())
    there = [path for path in folder.iterdir() if not path.name.startswith(".")]
    inner = [path for path in there if path.is_dir()]
    yield folder, [path for path in there if path not in inner]
    for path in inner:
        if path.resolve() not in above:
            yield from walk(path, above)


def safe_names(names: Iterable[str]) -> dict[str, str]:
    """Return for each name one without slashes and colons, for a file or an object in one.

    >>> safe_names(["a/b_c", "a_b/c"])
    {'a/b_c': 'a_b_c', 'a_b/c': 'a_b_c-2'}
    """
    found: dict[str, str] = {}
    for name in dict.fromkeys(names):
        plain = safe = re.sub("[/:]", "_", name)
        number = 1
        while safe in found.values():
            number += 1
            safe = f"{plain}-{number}"
        found[name] = safe
    return found


def _list_files(path: Path) -> list[Path]:
    if not path.is_dir():
        return [path]
    return sorted(p for p in path.iterdir() if p.is_file() and not p.name.startswith("."))


def require_same_config(
    where: Path, kind: str, earlier: Mapping[str, Any], wanted: Mapping[str, Any]
) -> None:
    """Refuse to mix two configurations in one place.

    Parameters
    ----------
    where
        What was begun with `earlier` and is now to go on with `wanted`.
    kind
        What it holds, such as ``results``.

    Raises
    ------
    InputError
        Naming the first entry that differs.
    """
    differs = first_difference(earlier, json.loads(json.dumps(wanted)))
    if differs:
        name, before, now = differs
        raise InputError(
            f"{where}: expected {kind} of this configuration ({name} {now}), found {kind} of "
            f"another ({name} {before}); choose another place"
        )


def first_difference(
    before: Mapping[str, Any], now: Mapping[str, Any]
) -> tuple[str, Any, Any] | None:
    """Return the name of the first entry that differs, and what it is in each."""
    for name in sorted({*before, *now}):
        one, other = before.get(name), now.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            if within := first_difference(one, other):
                inner, one, other = within
                return f"{name}.{inner}", one, other
        elif one != other:
            return name, one, other
    return None


Place = str | Path
