"""One file from a server: whole, with the right checksum, and gone on with where it was left."""

import os
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

    `pooch` checks the file and puts it in its place; the bytes come by `Resuming`. A part that an
    earlier run left is gone on with, if the server still has the same file.

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
    import_web()
    import pooch

    pooch.get_logger().setLevel("ERROR")
    target = folder / file.path
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        pooch.retrieve(
            file.url,
            f"sha256:{file.sha256}" if file.sha256 else None,
            fname=target.name,
            path=target.parent,
            downloader=Resuming(file, target, session, moved),
        )
    except ValueError as error:  # pooch: the checksum is another
        raise InputError(
            f"{target}: expected the file with SHA-256 {file.sha256}, as it is listed, found "
            f"another at {file.url} (not kept); fetch it again; if it stays so, the file was "
            "changed where it comes from, or on the way"
        ) from error
    except OSError as error:
        raise InputError(
            f"{target}: expected room and permission to write it, found {reason_of(error)}; make "
            "room, or choose another folder; the same command goes on from what is there"
        ) from error
    return replace(file, sha256=file.sha256 or checksum(target), n_bytes=target.stat().st_size)


def part_of(file: RemoteFile, folder: Path) -> Path:
    """Return where an earlier run left what it has of a file, to be gone on with."""
    return folder / f"{file.path}{PART}"


def size_here(path: Path) -> int:
    """Return the size of a file in bytes; 0 where there is none."""
    return path.stat().st_size if path.is_file() else 0


class Resuming:
    """Writes a file as `pooch` wants it, and goes on with what is there of it already.

    Parameters
    ----------
    target
        The place of the file when it is whole; its part lies beside it.
    moved
        Told as the file grows.
    """

    def __init__(
        self, file: RemoteFile, target: Path, session: Any, moved: Callable[[int], None]
    ) -> None:
        self._url, self._session, self._moved = file.url, session, moved
        self._is_checked = file.sha256 is not None
        self._part = target.with_name(target.name + PART)
        self._note = target.with_name(target.name + NOTE)

    def __call__(self, _url: str, output_file: str | Path, _pooch: object) -> None:
        """Fill the file that `pooch` names."""
        failures, before = 0, size_here(self._part)
        while not self._goes_to_the_end():
            here = size_here(self._part)
            failures = failures + 1 if here <= before else 1
            before = here
            if failures >= TRIES:
                raise InputError(
                    f"{self._url}: expected the whole file, found a connection that breaks after "
                    f"{here} bytes; run the same command again: it goes on from there"
                )
            time.sleep((failures - 1) * WAIT_S)
        os.replace(self._part, output_file)  # noqa: PTH105 (pooch may give a string)
        remove(self._note)

    def _goes_to_the_end(self) -> bool:
        """Ask for what is missing, and write it; say whether the file is whole then."""
        known = self._noted()
        start = size_here(self._part) if known else 0  # else who knows of what it is a part
        if start and start == known["n_bytes"]:
            return True
        headers = {"Range": f"bytes={start}-"} if start else {}
        if start and known["validator"]:
            headers["If-Range"] = known["validator"]
        codes, answer = (
            import_web().codes,
            ask(self._session, self._url, headers=headers, stream=True),
        )
        with answer:
            if answer.status_code == codes.range_not_satisfiable:
                remove(self._part)
                return False
            if answer.status_code != codes.partial_content:
                start = 0  # the server gives all of it, or another file by now
            length = answer.headers.get("Content-Length", "")
            whole = start + int(length) if length.isdigit() else None
            self._keep_note(answer, whole)
            end = self._write(answer, start)
        return end is not None and (whole is None or end == whole)

    def _write(self, answer: Any, start: int) -> int | None:
        """Append what comes; return the size then, or None if the connection broke."""
        with self._part.open("r+b" if start else "wb") as out:
            out.truncate(start)
            out.seek(start)
            try:
                for piece in answer.iter_content(_PIECE):
                    out.write(piece)
                    self._moved(out.tell())
            except import_web().RequestException:
                return None
            return out.tell()

    def _noted(self) -> dict[str, Any]:
        """Return what an earlier answer said of the file, if a mix of two would be found out."""
        try:
            noted = read_json(self._note, "a note of a download")
        except AfferentsError:
            return {}
        told = noted.get("validator") or self._is_checked
        return noted if noted.get("url") == self._url and told else {}

    def _keep_note(self, answer: Any, whole: int | None) -> None:
        found = (answer.headers.get(name, "") for name in ("ETag", "Last-Modified"))
        strong = next((one for one in found if one and not one.startswith("W/")), "")
        write_json(self._note, {"url": self._url, "validator": strong, "n_bytes": whole})
