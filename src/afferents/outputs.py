"""Outputs: one command at a time writes each, and only where nothing of a user's is lost."""

import os
import socket
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from afferents.errors import InputError
from afferents.files import naming

# One command at a time writes an output: a lock in its folder, which the system lets go of when
# the process that has it ends, whatever ends it.

LOCK = ".afferents-lock"


@contextmanager
def writing_alone(folder: Path, command: str) -> Iterator[None]:
    """Let no other command write `folder` while the block runs; it is made if it is not there.

    If nothing has been written into a folder that was made here, it is removed again.

    Raises
    ------
    InputError
        If another command is writing there, or the folder can't be written.
    """
    is_new = not folder.exists()
    lock = FileLock(folder / LOCK)
    try:
        with naming(folder / LOCK):
            _take(lock, folder, command)
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):
                (folder / LOCK).unlink()  # while it is held: who waits for it sees that it is gone
            lock.release()
        if is_new:
            with suppress(OSError):  # what was written stays
                folder.rmdir()


def _take(lock: FileLock, folder: Path, command: str) -> None:
    _is_there(folder, "a folder to write")
    folder.mkdir(parents=True, exist_ok=True)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise InputError(
            f"{folder}: expected an output that no other command is writing, found "
            f"{lock_text(folder) or 'one'} at work there; wait until it has ended, or choose "
            "another name"
        ) from None
    who = f"process {os.getpid()} on {socket.gethostname()}"
    with suppress(PermissionError):  # on Windows, nobody writes a file that is locked
        (folder / LOCK).write_text(f"'{command}' since {time.strftime('%H:%M:%S')} ({who})")


def lock_text(folder: Path) -> str:
    """Return who is writing a folder, in words; empty where nobody is known to."""
    with suppress(OSError, UnicodeDecodeError):
        return (folder / LOCK).read_text()
    return ""


def is_locked(folder: Path) -> bool:
    """Tell whether a command that is alive is writing there."""
    path = folder / LOCK
    try:
        if path.is_file():
            with FileLock(path, timeout=0):
                return False
    except (Timeout, OSError):
        return True
    return False


# Whether what a command is asked to write may be written: one rule for every output.
#
# What is there already is replaced only if it is an earlier output of the same kind and the user
# says ``--force``; never what the command reads, never a folder that holds anything else, never a
# device.

MARK = "afferents"
"""What we write into every file that a user names, where its format has room for it."""
_HEAD_BYTES = 4096

Recognise = Callable[[Path], bool]
"""Says of a file or folder that is there whether it is an earlier output of the same kind."""


def require_free(
    target: Path,
    what: str,
    is_ours: Recognise,
    *,
    force: bool = False,
    reads: Sequence[Path] = (),
) -> None:
    """Refuse a target that must not be written, before any work is done.

    Parameters
    ----------
    what
        What is to be written, such as ``a drum``.
    is_ours
        Says whether what is there is one already.
    force
        Whether the user lets one be replaced.
    reads
        Files and folders that the command reads.

    Raises
    ------
    InputError
        If the target is one of these or holds one, is a device or a link to nowhere, or holds
        something else than an earlier output of the same kind that may be replaced.
    """
    try:
        if target.is_symlink() and not target.exists():
            raise _taken(target, what, "a link that leads nowhere")
        if not target.exists():
            return
        place = target.resolve()
        if any(place in (read, *read.parents) for read in (one.resolve() for one in reads)):
            raise _taken(target, what, "what the command reads")
        if not (target.is_file() or target.is_dir()):
            raise _taken(target, what, "a device or a pipe")
        ours = is_ours(target)
    except (OSError, RuntimeError) as error:  # a link to itself is a RuntimeError
        found = getattr(error, "strerror", None) or "a link that leads to itself"
        raise _taken(target, what, str(found)) from error
    if not ours:
        kind = "a folder" if target.is_dir() else "a file"
        raise _taken(target, what, f"{kind} that holds something else")
    if not force:
        raise _taken(target, what, "an earlier one", "add --force to replace it, or ")


def require_new_folder(folder: Path, what: str) -> None:
    """Refuse anything but a folder that is new, or empty but for a lock.

    Raises
    ------
    InputError
        If something else stands there.
    """
    if _is_there(folder, what) and any(entry.name != LOCK for entry in folder.iterdir()):
        raise _taken(folder, what, "a folder that holds something else")


def require_picture_folder(folder: Path, *files: str) -> None:
    """Refuse a folder that holds anything but pictures of ours, and `files` of ours.

    Raises
    ------
    InputError
        Naming what else it holds.
    """
    for entry in sorted(folder.iterdir()) if _is_there(folder, "pictures") else ():
        if not (entry.name in files or is_our_picture(entry)):
            raise InputError(
                f"{folder}: expected a new or empty folder, or one of earlier pictures, to draw "
                f"into, found '{entry.name}' in it; choose another --out"
            )


def require_pictures_free(folder: Path, *names: str) -> None:
    """Refuse to draw into what is no folder, or over a file that is no picture of ours.

    Pictures of an earlier run are replaced.

    Raises
    ------
    InputError
        Naming what is in the way.
    """
    _is_there(folder, "pictures")
    for path in (folder / name for name in names):
        if path.is_symlink() or (path.exists() and not is_our_picture(path)):
            raise _taken(path, "a picture", "a file that holds something else")


def is_our_picture(path: Path) -> bool:
    """Tell whether a file is a PNG of ours."""
    return path.suffix == ".png" and path.is_file() and has_mark(path, f"Software\0{MARK}")


def has_mark(path: Path, mark: str) -> bool:
    """Tell whether a file's first bytes hold our mark."""
    with path.open("rb") as file:
        return mark.encode() in file.read(_HEAD_BYTES)


def _is_there(folder: Path, what: str) -> bool:
    """Tell whether a folder is there; refuse what is none, and a link that leads nowhere."""
    if folder.is_symlink() and not folder.exists():
        raise _taken(folder, what, "a link that leads nowhere")
    if folder.exists() and not folder.is_dir():
        raise _taken(folder, what, "something that is no folder")
    return folder.exists()


def _taken(target: Path, what: str, found: str, do: str = "") -> InputError:
    return InputError(
        f"{target}: expected a name that is free, for {what}, found {found}; {do}choose another "
        "name"
    )
