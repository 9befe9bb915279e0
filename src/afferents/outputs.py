"""Outputs: one command at a time writes each, and only where nothing of a user's is lost."""

import fcntl
import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO
from uuid import uuid4

from afferents.errors import InputError
from afferents.files import Owner, naming, this_process, unchanged_s

# One command at a time writes an output: a lock in its folder, with a heartbeat.
#
# The lock is a file that names its owner, and its time of change moves on while the owner lives.
# One whose process has ended is taken over at once; one of another host, where nobody here can see
# processes, when its heart has not beaten for `SILENT_S`.

LOCK = ".afferents-lock"
BEAT_S, SILENT_S = 5.0, 60.0


@contextmanager
def writing_alone(folder: Path, command: str, beat_s: float = BEAT_S) -> Iterator[str]:
    """Let no other command write `folder` while the block runs; it is made if it is not there.

    If nothing has been written into a folder that was made here, it is removed again.

    Yields
    ------
    The lock's token: who finds it in a folder, on whatever machine, sees this very folder.

    Raises
    ------
    InputError
        If another command is writing there, or the folder can't be written.
    """
    lock = folder / LOCK
    token = uuid4().hex
    made = _made(folder)
    try:
        _take(lock, command, token)
    except BaseException:
        _tidy(folder, made)
        raise
    ended = threading.Event()
    heart = threading.Thread(target=_beat, args=(lock, ended, beat_s), daemon=True)
    heart.start()
    try:
        yield token
    finally:
        ended.set()
        heart.join()
        if is_locked_by(folder, token):  # not taken over while this machine slept
            with suppress(OSError):
                lock.unlink()
        _tidy(folder, made)


def is_locked(folder: Path) -> bool:
    """Tell whether a command that is alive is writing there."""
    lock = folder / LOCK
    return lock.is_file() and not _is_stale(lock, _content(lock))


def is_locked_by(folder: Path, token: str) -> bool:
    """Tell whether the lock there is the one of this token, and so the folder the one it locks."""
    return bool(_content(folder / LOCK).get("token") == token)


def _made(folder: Path) -> bool:
    """Make the folder; say whether it was not there."""
    if folder.is_dir():
        return False
    if folder.exists():
        raise InputError(
            f"{folder}: expected a folder to write, found something else of that name; choose "
            "another name"
        )
    with naming(folder):
        folder.mkdir(parents=True, exist_ok=True)
    return True


def _tidy(folder: Path, made: bool) -> None:
    if made:
        with suppress(OSError):  # what was written stays
            folder.rmdir()


def _take(lock: Path, command: str, token: str) -> None:
    """Make the lock, or take over one that is stale."""
    mine = json.dumps(
        {**this_process()._asdict(), "command": command, "since": time.time(), "token": token}
    )
    with naming(lock):
        while True:
            try:
                _write_new(lock, mine)
                return
            except FileNotFoundError:  # its folder was empty, and its maker has removed it
                lock.parent.mkdir(parents=True, exist_ok=True)
            except FileExistsError:
                if _taken_over(lock, mine):
                    return


def _write_new(lock: Path, text: str) -> None:
    """Write a lock that is not there yet; none is left if the disk is full.

    Raises
    ------
    FileExistsError
        If it is there.
    """
    file = lock.open("x", encoding="utf-8")
    try:
        with file:
            file.write(text)
    except OSError:
        lock.unlink()
        raise


def _taken_over(lock: Path, mine: str) -> bool:
    """Write `mine` into a stale lock; False if it has gone meanwhile.

    Two that take over at once are kept apart by the system's lock on the file: the second finds
    the first one's name in it. Renaming or removing it could hit a lock that is alive.
    """
    try:
        with lock.open("r+", encoding="utf-8") as file:
            _hold(file)
            content = _content(lock)
            if not _is_stale(lock, content):
                raise _busy(lock.parent, content)
            if not _is_same_file(file, lock):
                return False
            file.seek(0)
            file.truncate()
            file.write(mine)
    except FileNotFoundError:
        return False
    return True


def _hold(file: TextIO) -> None:
    with suppress(OSError):  # some network file systems have no such locks
        fcntl.flock(file, fcntl.LOCK_EX)


def _is_same_file(file: TextIO, path: Path) -> bool:
    with suppress(FileNotFoundError):
        return os.path.samestat(os.fstat(file.fileno()), path.stat())
    return False


def _content(lock: Path) -> dict[str, Any]:
    """Return what a lock says; nothing where it has gone, or is being written."""
    try:
        content = json.loads(lock.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _is_stale(lock: Path, content: dict[str, Any]) -> bool:
    try:
        owner = Owner(str(content["host"]), int(content["pid"]), int(content["started"]))
    except (KeyError, TypeError, ValueError):
        return unchanged_s(lock) > SILENT_S
    return not owner.is_alive if owner.is_here else unchanged_s(lock) > SILENT_S


def _beat(lock: Path, ended: threading.Event, beat_s: float) -> None:
    while not ended.wait(beat_s):
        with suppress(OSError):
            os.utime(lock)


def _busy(folder: Path, content: dict[str, Any]) -> InputError:
    since = content.get("since")
    begun = time.strftime("%H:%M:%S", time.localtime(since)) if isinstance(since, float) else "?"
    who = f"process {content.get('pid', '?')} on {content.get('host', '?')}"
    return InputError(
        f"{folder}: expected an output that no other command is writing, found "
        f"'{content.get('command', '?')}' at work there since {begun} ({who}); wait until it has "
        "ended, or choose another name"
    )


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
        _refuse_what_is_read(target, what, reads)
        if target.is_symlink() and not target.exists():
            raise _taken(target, what, "a link that leads nowhere")
        if not target.exists():
            return
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
    if folder.is_symlink() and not folder.exists():
        raise _taken(folder, what, "a link that leads nowhere")
    if not folder.exists():
        return
    if not folder.is_dir():
        raise _taken(folder, what, "something else of that name")
    if any(entry.name != LOCK for entry in folder.iterdir()):
        raise _taken(folder, what, "a folder that holds something else")


def require_picture_folder(folder: Path, *files: str) -> None:
    """Refuse a folder that holds anything but pictures of ours, and `files` of ours.

    Raises
    ------
    InputError
        Naming what else it holds.
    """
    require_pictures_free(folder)
    for entry in sorted(folder.iterdir()) if folder.exists() else ():
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
    if folder.is_symlink() and not folder.exists():
        raise _taken(folder, "pictures", "a link that leads nowhere")
    if folder.exists() and not folder.is_dir():
        raise _taken(folder, "pictures", "something that is no folder")
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


def _refuse_what_is_read(target: Path, what: str, reads: Sequence[Path]) -> None:
    if not target.exists():
        return
    place = target.resolve()
    for source in reads:
        read = source.resolve()
        if place == read or place in read.parents:
            raise _taken(target, what, "what the command reads")


def _taken(target: Path, what: str, found: str, do: str = "") -> InputError:
    return InputError(
        f"{target}: expected a name that is free, for {what}, found {found}; {do}choose another "
        "name"
    )
