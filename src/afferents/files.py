"""Who writes: a process on a host. A process number alone says nothing on another host."""

import errno
import hashlib
import json
import os
import re
import shutil
import socket
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple
from uuid import uuid4

from afferents.errors import InputError


class Owner(NamedTuple):
    """A process: its host, its number there, and when it started (0 where nothing says so).

    The start tells it from a later process of the same number.
    """

    host: str
    pid: int
    started: int

    @property
    def is_here(self) -> bool:
        """Whether it runs, or ran, where this process does, so that its end can be seen."""
        return self.host == host_here()

    @property
    def is_alive(self) -> bool:
        """Whether it runs still; to be asked of processes that are here."""
        try:
            os.kill(self.pid, 0)
        except ProcessLookupError:
            return False
        except PermissionError:  # another user's
            return True
        return self.started == _started(self.pid)

    def tag(self) -> str:
        """Return it as part of a file's name."""
        return f"{_short(self.host)}-{self.pid}.{self.started}"


_TAG = re.compile(r"(?P<host>[0-9a-f]{8})-(?P<pid>\d+)\.(?P<started>\d+)")


def this_process() -> Owner:
    """Return who asks."""
    return Owner(host_here(), os.getpid(), _started(os.getpid()))


def tagged(name: str) -> Owner | None:
    """Return whose tag a file's name has; None where it has none. Of other hosts the host is ''."""
    found = _TAG.search(name)
    if found is None:
        return None
    host = host_here() if found["host"] == _short(host_here()) else ""
    return Owner(host, int(found["pid"]), int(found["started"]))


@lru_cache(maxsize=1)
def host_here() -> str:
    """Return the host's name; containers of one name that don't see each other differ."""
    processes = ""
    with suppress(OSError):
        processes = os.readlink("/proc/self/ns/pid").strip("pid:[]")  # noqa: PTH115 (no real path)
    return f"{socket.gethostname()}{f' ({processes})' if processes else ''}"


def _short(host: str) -> str:
    return sha256(host.encode()).hexdigest()[:8]


def _started(pid: int) -> int:
    """Return when a process started, in ticks since the host did; 0 where /proc does not say."""
    try:
        # The second field, the program's name, may hold blanks and brackets itself.
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return 0


# Writing so that a file or folder is either whole or absent, and checksums.

PARTIAL_PREFIX = ".partial-"
"""Names that start like this are unfinished work of a run; never data."""
ABANDONED_S = 600.0
"""Unfinished work of another host is left alone until nothing of it has changed for so long."""

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

Replaceable = Callable[[Path], bool]
"""Says of a folder that is there whether it is what is about to be written, of an earlier run."""


def holds_only(*names: str) -> Replaceable:
    """Return what says that a folder holds nothing but files of these names."""
    return lambda folder: all(entry.name in names for entry in folder.iterdir())


@contextmanager
def write_aside(target: Path, replaces: Replaceable | None = None) -> Iterator[Path]:
    """Yield a temporary path beside `target`; rename it to `target` if the block succeeds.

    Works for files and folders. If the block raises, the temporary path is removed and an
    earlier `target` is left untouched.

    Parameters
    ----------
    replaces
        Says which folder at `target` may be replaced; without it none is. A file is replaced by
        a file; whether a user's file may be is asked before (`outputs.require_free`).

    Raises
    ------
    InputError
        If something stands at `target` that is not to be replaced: a folder that holds other
        things, a device, a link to nowhere. If the disk is full, or there is no permission.
    """
    target = _followed(target)
    _require_replaceable(target, replaces)
    partial = target.parent / _partial_name(target.name)
    made = [folder for folder in target.parents if not folder.exists()]
    try:
        with naming(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            yield partial
            _require_replaceable(target, replaces)
            _rename(partial, target)
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
        if error.filename is None or str(error.filename).startswith(str(target.parent)):
            raise _not_written(target, error) from error
        raise  # of a file that is read meanwhile


def _followed(target: Path) -> Path:
    """Return where a link leads, so that it stays a link.

    Raises
    ------
    InputError
        If it leads nowhere, or to itself.
    """
    if not target.is_symlink():
        return target
    try:
        return target.resolve(strict=True)
    except (OSError, RuntimeError):
        raise InputError(
            f"{target}: expected a name to write to, found a link that leads nowhere; choose "
            "another name"
        ) from None


def _require_replaceable(target: Path, replaces: Replaceable | None) -> None:
    try:
        if not target.exists() or target.is_file():
            return
    except OSError as error:
        raise _not_written(target, error) from error
    if not target.is_dir():
        found = "a device or a pipe"
    elif replaces is not None and replaces(target):
        return
    else:
        found = "a folder" if replaces is None else "a folder that holds other things"
    raise InputError(
        f"{target}: expected a name that is free to write to, found {found}; choose another name"
    )


def _rename(partial: Path, target: Path) -> None:
    if target.is_dir() and partial.is_dir():
        earlier = target.parent / _partial_name(target.name)
        target.replace(earlier)
        partial.replace(target)
        remove(earlier)
    else:
        partial.replace(target)


def _partial_name(name: str) -> str:
    return f"{PARTIAL_PREFIX}{name[:_NAME_KEPT]}-{this_process().tag()}-{uuid4().hex[:8]}"


def _not_written(target: Path, error: OSError) -> InputError:
    found = _SYSTEM.get(error.errno or 0) or error.strerror or "a write that was cut short"
    kept = "nothing of it is left, and what was there before is untouched"
    return InputError(
        f"{target}: expected room and permission to write it, found {found} ({kept}); make room, "
        "or choose another place"
    )


def remove(path: Path) -> None:
    """Remove a file or folder, whatever of it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def remove_partials(folder: Path) -> None:
    """Remove what a run that was killed left unfinished anywhere below `folder`.

    What a process that lives is writing is left alone: another host's as long as something of it
    has changed within `ABANDONED_S`.
    """
    for partial in sorted(folder.rglob(f"{PARTIAL_PREFIX}*")):
        if _is_abandoned(partial):
            remove(partial)


def _is_abandoned(partial: Path) -> bool:
    writer = tagged(partial.name)
    if writer is None:
        return True
    return not writer.is_alive if writer.is_here else unchanged_s(partial) > ABANDONED_S


def unchanged_s(path: Path) -> float:
    """Return how long nothing of a file or folder has changed, s; 0 if it has just gone.

    By the clock of its own file system: of a network's that is another host's, minutes from this
    one's perhaps.
    """
    probe = path.parent / _partial_name("clock")
    try:
        probe.touch()
        now = probe.stat().st_mtime
        return now - max(one.stat().st_mtime for one in (path, *path.rglob("*")))
    except OSError:
        return 0.0
    finally:
        probe.unlink(missing_ok=True)


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

    A folder counts as its files, by name.
    """
    digest = hashlib.sha256()
    for file_path in (one for path in paths for one in _files_of(path)):
        with file_path.open("rb") as file:
            while block := file.read(1 << 20):
                digest.update(block)
    return digest.hexdigest()


def size_of(path: Path) -> int:
    """Return the size of a file in bytes, or of all files in a folder together.

    Raises
    ------
    OSError
        If there is none.
    """
    return sum(file.stat().st_size for file in _files_of(path))


def _files_of(path: Path) -> list[Path]:
    return sorted(one for one in path.iterdir() if one.is_file()) if path.is_dir() else [path]


def require_same_config(
    where: Path, kind: str, earlier: Mapping[str, Any], wanted: Mapping[str, Any]
) -> None:
    """Refuse to mix two configurations in one place.

    Parameters
    ----------
    where
        What was begun with `earlier` and is now asked to go on with `wanted`.
    kind
        What it holds, such as ``results``.

    Raises
    ------
    InputError
        Naming the first entry that differs.
    """
    differs = _first_difference(earlier, json.loads(json.dumps(wanted)))
    if differs:
        name, before, now = differs
        raise InputError(
            f"{where}: expected {kind} of this configuration ({name} {now}), found {kind} of "
            f"another ({name} {before}); choose another place"
        )


def _first_difference(
    before: Mapping[str, Any], now: Mapping[str, Any]
) -> tuple[str, Any, Any] | None:
    """Return the name of the first entry that differs, and what it is in each."""
    for name in sorted({*before, *now}):
        one, other = before.get(name), now.get(name)
        if isinstance(one, dict) and isinstance(other, dict):
            if within := _first_difference(one, other):
                inner, one, other = within
                return f"{name}.{inner}", one, other
        elif one != other:
            return name, one, other
    return None


Place = str | Path
