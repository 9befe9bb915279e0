"""One command at a time writes an output.

A lock in its folder sees to it, which the system lets go of when the process that has it ends,
whatever ends it.
"""

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

from afferents.errors import InputError
from afferents.files import LOCK, naming, require_free


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
            require_free(folder, Path.is_dir)
            folder.mkdir(parents=True, exist_ok=True)
            try:
                lock.acquire(timeout=0)
            except Timeout:
                raise InputError(
                    f"{folder}: expected an output that no other command is writing, found "
                    f"{lock_text(folder) or 'one'} at work there; wait until it has ended, or "
                    "choose another name"
                ) from None
            who = f"process {os.getpid()} on {socket.gethostname()}"
            with suppress(PermissionError):  # on Windows, nobody writes a file that is locked
                (folder / LOCK).write_text(f"'{command}' since {time.strftime('%H:%M:%S')} ({who})")
        yield
    finally:
        if lock.is_locked:
            with suppress(OSError):
                (folder / LOCK).unlink()  # while it is held: who waits for it sees that it is gone
            lock.release()
        if is_new:
            with suppress(OSError):  # what was written stays
                folder.rmdir()


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
