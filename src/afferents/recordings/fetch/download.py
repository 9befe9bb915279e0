"""One file from a server: whole, with the right checksum, and gone on with where it was left."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from afferents.documents import read_json
from afferents.errors import AfferentsError, InputError, reason_of
from afferents.files import checksum, remove, write_json
from afferents.recordings.fetch.archives import RemoteFile
from afferents.recordings.fetch.listing import ask, import_web

PART, NOTE = ".part", ".part.json"
"""Endings of what is there of a file, and of what the server said of it."""
TRIES, WAIT_S = 5, 1.0
"""So often in a row a connection may break with nothing new of the file; each time so much longer
is waited."""
_PIECE = 1 << 16
"""Bytes written at a time: a piece in which the connection breaks is asked for again."""


def download(
    file: RemoteFile, folder: Path, session: Any, moved: Callable[[int], None]
) -> RemoteFile:
    """Bring a file into a folder; return it with its size and checksum.

    A part that an earlier run left is gone on with, if the server still has the same file.

    Parameters
    ----------
    moved
        Told how many bytes of the file are here.

    Raises
    ------
    InputError
        If the server doesn't give it whole, its checksum is another than the list's, or there is
        no room; what came so far stays beside it, to be gone on with, unless it is wrong.
    """
    target = folder / file.path
    part, note = part_of(file, folder), folder / f"{file.path}{NOTE}"
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        failures, before = 0, size_here(part)
        while not _goes_to_the_end(file, part, note, session, moved):
            here = size_here(part)
            failures = failures + 1 if here <= before else 1
            before = max(before, here)
            if failures >= TRIES:
                raise InputError(
                    f"{file.url}: expected the whole file, found a connection that breaks after "
                    f"{here} bytes; run the same command again: it goes on from there"
                )
            time.sleep((failures - 1) * WAIT_S)
        remove(note)
        whole = replace(file, sha256=checksum(part), n_bytes=size_here(part))
        if file.sha256 not in (None, whole.sha256):
            remove(part)
            raise InputError(
                f"{target}: expected the file with SHA-256 {file.sha256}, as it is listed, found "
                f"another at {file.url} (not kept); fetch it again; if it stays so, the file was "
                "changed where it comes from, or on the way"
            )
        part.replace(target)
    except OSError as error:
        raise InputError(
            f"{target}: expected room and permission to write it, found {reason_of(error)}; make "
            "room, or choose another folder; the same command goes on from what is there"
        ) from error
    return whole


def part_of(file: RemoteFile, folder: Path) -> Path:
    """Return where an earlier run left what it has of a file, to be gone on with."""
    return folder / f"{file.path}{PART}"


def size_here(path: Path) -> int:
    """Return the size of a file in bytes; 0 where there is none."""
    return path.stat().st_size if path.is_file() else 0


def _goes_to_the_end(
    file: RemoteFile, part: Path, note: Path, session: Any, moved: Callable[[int], None]
) -> bool:
    """Ask for what is missing, and append it; say whether the file is whole then."""
    web, known = import_web(), _noted(file, note)
    start = size_here(part) if known else 0  # else who knows of what it is a part
    if start and start == known["n_bytes"]:
        return True
    headers = {"Range": f"bytes={start}-", "If-Range": known["validator"] or None} if start else {}
    with ask(session, file.url, headers=headers, stream=True) as answer:
        if answer.status_code == web.codes.range_not_satisfiable:
            remove(part)
            return False
        if answer.status_code != web.codes.partial_content:
            start = 0  # the server gives all of it, or another file by now
        length = answer.headers.get("Content-Length", "")
        n_bytes = start + int(length) if length.isdigit() else None
        found = (answer.headers.get(name, "") for name in ("ETag", "Last-Modified"))
        strong = next((one for one in found if one and not one.startswith("W/")), "")
        write_json(note, {"url": file.url, "validator": strong, "n_bytes": n_bytes})
        with part.open("r+b" if start else "wb") as out:
            out.truncate(start)
            out.seek(start)
            try:
                for piece in answer.iter_content(_PIECE):
                    out.write(piece)
                    moved(out.tell())
            except web.RequestException:
                return False
            return n_bytes in (None, out.tell())


def _noted(file: RemoteFile, note: Path) -> dict[str, Any]:
    """Return what an earlier answer said of a file, if a mix of two would be found out."""
    try:
        noted = read_json(note, "a note of a download")
    except AfferentsError:
        return {}
    told = noted.get("validator") or file.sha256
    return noted if noted.get("url") == file.url and told else {}
