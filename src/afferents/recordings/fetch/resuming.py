"""One file from a server: whole, with the right checksum, and gone on with where it was left."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from afferents.documents import read_json
from afferents.errors import AfferentsError, InputError, reason_of
from afferents.files import checksum, remove, write_json
from afferents.recordings.fetch.archives import RemoteFile
from afferents.recordings.fetch.web import opened, web

PART, NOTE = ".part", ".part.json"
"""Endings of what is there of a file, and of what the server said of it."""
TRIES, WAIT_S = 5, 1.0
"""So often in a row a connection may break with nothing new of the file; each time so much longer
is waited."""
_PIECE = 1 << 16
"""Bytes written at a time: a piece in which the connection breaks is asked for again."""
_VALIDATORS = ("ETag", "Last-Modified")

Moved = Callable[[int], None]
"""Told how many bytes of a file are here."""


def download(file: RemoteFile, folder: Path, session: Any, moved: Moved) -> str:
    """Bring a file into a folder; return its SHA-256.

    `pooch` checks the file and puts it in its place; the bytes come by `Resuming`. A part that an
    earlier run left is gone on with, if the server still has the same file.

    Raises
    ------
    InputError
        If the server doesn't give it whole, its checksum is another than the list's, or there is
        no room; what came so far stays beside it, to be gone on with, unless it is wrong.
    """
    pooch = _pooch()
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
        raise _no_room(target, error) from error
    return file.sha256 or checksum(target)


def n_bytes_here(file: RemoteFile, folder: Path) -> int:
    """Return how many bytes of a file an earlier run left in a folder, to be gone on with."""
    part = _beside(folder / file.path, PART)
    return part.stat().st_size if part.is_file() else 0


class Resuming:
    """Writes a file as `pooch` wants it, and goes on with what is there of it already.

    Parameters
    ----------
    target
        The place of the file when it is whole; its part lies beside it.
    moved
        Told as the file grows.
    """

    def __init__(self, file: RemoteFile, target: Path, session: Any, moved: Moved) -> None:
        self._url, self._session, self._moved = file.url, session, moved
        self._is_checked = file.sha256 is not None
        self._part, self._note = _beside(target, PART), _beside(target, NOTE)

    def __call__(self, _url: str, output_file: str | Path, _pooch: object) -> None:
        """Fill the file that `pooch` names."""
        failures, before = 0, self._n_here()
        while not self._goes_to_the_end():
            here = self._n_here()
            failures = failures + 1 if here <= before else 1
            before = here
            if failures >= TRIES:
                raise InputError(
                    f"{self._url}: expected the whole file, found a connection that breaks after "
                    f"{here} bytes; run the same command again: it goes on from there"
                )
            if here == 0 or failures > 1:
                time.sleep(failures * WAIT_S)
        os.replace(self._part, output_file)  # noqa: PTH105 (pooch may give a string)
        remove(self._note)

    def _n_here(self) -> int:
        return self._part.stat().st_size if self._part.is_file() else 0

    def _goes_to_the_end(self) -> bool:
        """Ask for what is missing, and write it; say whether the file is whole then."""
        start, known = self._n_here(), self._noted()
        headers = {}
        if start and known:
            headers["Range"] = f"bytes={start}-"
            if known["validator"]:
                headers["If-Range"] = known["validator"]
        else:
            start = 0  # who knows of what it is a part
        codes, answer = web().codes, opened(self._session, self._url, headers=headers, stream=True)
        with answer:
            if answer.status_code == codes.range_not_satisfiable:
                if start == known.get("n_bytes"):
                    return True
                remove(self._part)
                return False
            if start and not _begins_at(start, answer):
                remove(self._part)
                return False
            if answer.status_code != codes.partial_content:
                start = 0  # the server gives all of it, or another file by now
            whole = _length(answer, start)
            self._keep_note(answer, whole)
            end = self._write(answer, start)
        return end is not None and (whole is None or end == whole)

    def _write(self, answer: Any, start: int) -> int | None:
        """Append what comes; return the size then, or None if the connection broke."""
        pieces = answer.iter_content(_PIECE)
        with self._part.open("r+b" if start else "wb") as out:
            out.truncate(start)
            out.seek(start)
            while True:
                try:
                    piece = next(pieces, b"")
                except web().RequestException:
                    return None
                if not piece:
                    return out.tell()
                out.write(piece)
                self._moved(out.tell())

    def _noted(self) -> dict[str, Any]:
        """Return what an earlier answer said of the file, if a mix of two would be found out."""
        try:
            noted = read_json(self._note, "a note of a download")
        except AfferentsError:
            return {}
        told = noted.get("validator") or self._is_checked
        return noted if noted.get("url") == self._url and told else {}

    def _keep_note(self, answer: Any, whole: int | None) -> None:
        validators = (answer.headers.get(name, "") for name in _VALIDATORS)
        strong = next((said for said in validators if said and not said.startswith("W/")), "")
        write_json(self._note, {"url": self._url, "validator": strong, "n_bytes": whole})


def _beside(target: Path, ending: str) -> Path:
    return target.with_name(target.name + ending)


def _begins_at(start: int, answer: Any) -> bool:
    """Say whether an answer that is a part is the part that was asked for."""
    said = answer.headers.get("Content-Range", "")
    return not said or said.startswith(f"bytes {start}-")


def _length(answer: Any, start: int) -> int | None:
    """Return the size of the whole file, as far as an answer says it."""
    said = answer.headers.get("Content-Length", "")
    return start + int(said) if said.isdigit() else None


def _no_room(target: Path, error: OSError) -> InputError:
    return InputError(
        f"{target}: expected room and permission to write it, found {reason_of(error)}; make "
        "room, or choose another folder; the same command goes on from what is there"
    )


def _pooch() -> Any:
    """Return the library `pooch`, silent but for what is wrong."""
    web()
    import pooch

    pooch.get_logger().setLevel("ERROR")
    return pooch
