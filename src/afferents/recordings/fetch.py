"""A public data set, brought here: what it is, how large, under which licence, and then its files.

`pooch` brings each file under another name, compares its checksum, and renames it. Nothing that is
there is overwritten: what an earlier run brought is checked and kept.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict
from rich.filesize import decimal

from afferents import documents, outputs, plugins
from afferents.errors import InputError, reason_of
from afferents.files import Place, checksum, free_bytes, naming, remove
from afferents.progress import Mark, Progress
from afferents.recordings import listing
from afferents.recordings.listing import RemoteFile

CHECKSUMS = "afferents-checksums.txt"
"""In the folder: a line for each file that is here, as a manifest has it."""
RETRIES = 4
"""How often a file is requested again whose connection broke, or whose checksum is another."""
_HERE = Path(__file__).parent / "public"
_PIECE = 1 << 16


class PublicSet(BaseModel):
    """A data set that `fetch` knows; `data_sets.toml` says what its keys are."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str
    page: str
    url: str
    next_step: str
    licence: str = ""
    files: str = ""
    only: str = ""

    @property
    def manifest(self) -> Path | None:
        """The list of its files in this package; None where the server lists them."""
        return _HERE / self.files if self.files else None


@cache
def public_sets() -> Mapping[str, PublicSet]:
    """Return the data sets that `fetch` knows, by name."""
    path, what = _HERE / "data_sets.toml", "public data sets"
    return {
        name: documents.as_form(row, PublicSet, path, what)
        for name, row in documents.read_toml(path, what).items()
    }


@dataclass(frozen=True)
class Fetched:
    """What came of it: how many files were fetched and kept, and their size in bytes."""

    folder: Path
    fetched: int
    kept: int
    n_bytes: int


def fetch(
    name: str,
    folder: Place,
    url: str | None = None,
    manifest: Place | None = None,
    quiet: bool = False,
) -> Fetched:
    """Fetch a public data set, with its size and licence stated before it begins.

    Run it again to go on with the file at which it was stopped; what is here already is checked and
    kept. Needs the extra `fetch`.

    Parameters
    ----------
    name
        Data set: pestell2022 (the recordings of the paper), fabricslide, ntp, biotac-slide,
        vibrotexturerecog, cluster-haptic-accel or cluster-haptic-audio.
    folder
        Folder that it goes into.
    url
        Another place where it is: a folder of a web server that lists its files, or what the paths
        of the manifest count from.
    manifest
        List of its files: PATH SHA-256 BYTES a line, or as sha256sum writes.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    Fetched
        `folder`, and how many files were `fetched` and `kept`, together `n_bytes` bytes.

    Raises
    ------
    InputError
        If the server or its list is not what it should be, a file has another checksum, or there
        is no room.
    """
    sets, folder = public_sets(), Path(folder)
    if name not in sets:
        raise InputError(f"fetch: expected one of {', '.join(sets)}, found '{name}'")
    listing.import_web()
    public, listed = sets[name], None if manifest is None else Path(manifest)
    files, page = _find_files(public, folder, url, listed)
    with Progress(quiet) as progress:
        files = list(progress.track(listing.ask_sizes(files), "asking for sizes", len(files)))
        missing = [file for file in files if not (folder / file.path).exists()]
        progress.note(f"{public.title} ({public.page}).")
        licence = public.licence or f"named by {public.page}; read it before you use them"
        progress.note(f"Licence: {licence}.")
        progress.note(f"{len(files)} file(s), {_sum_sizes(files)}, listed by {page}.")
        if n_here := len(files) - len(missing):
            progress.note(f"{n_here} are here; {_sum_sizes(missing)} to fetch.")
        if unknown := sum(file.sha256 is None for file in missing):
            progress.note(
                f"Of {unknown} no checksum is known: what comes first is trusted, and its checksum "
                f"noted in {folder / CHECKSUMS}."
            )
        if url is None:
            progress.note("This has not been tried against the real server: please tell us.")
        needed = sum(file.n_bytes or 0 for file in missing)
        if needed > (free := free_bytes(folder)):
            raise InputError(
                f"{folder}: expected room for {decimal(needed)}, found {decimal(free)} on that "
                "disk; make room, or choose a folder on another disk"
            )
        with outputs.writing_alone(folder, "fetch"):
            n_bytes = _bring_all(files, folder, page, progress)
    return Fetched(folder, len(missing), n_here, n_bytes)


def _find_files(
    public: PublicSet, folder: Path, url: str | None, manifest: Path | None
) -> tuple[list[RemoteFile], str]:
    """Return which files there are, with the checksums that are known, and what lists them."""
    where = page = url or public.url
    listed = manifest or public.manifest
    if listed is None:
        files = [
            file for file in listing.list_files(where) if fnmatchcase(file.path, public.only or "*")
        ]
    elif public.manifest is None and url is None:
        expected = "--url as well, which says what the paths of the list count from"
        raise InputError(f"--manifest: expected {expected}, found none")
    else:
        files, page = listing.read_manifest(listed, where), str(manifest or "this package")
    noted = _read_noted(folder, where)
    known = [(file, noted.get(file.path, file)) for file in files]
    return [
        replace(a, sha256=a.sha256 or b.sha256, n_bytes=a.n_bytes or b.n_bytes) for a, b in known
    ], page


def _read_noted(folder: Path, url: str) -> dict[str, RemoteFile]:
    """Return what is noted of the files in a folder, by path; `url` is what paths count from."""
    path = folder / CHECKSUMS
    return {file.path: file for file in listing.read_manifest(path, url)} if path.is_file() else {}


def _sum_sizes(files: Sequence[RemoteFile]) -> str:
    unknown = sum(file.n_bytes is None for file in files)
    known = decimal(sum(file.n_bytes or 0 for file in files))
    if unknown == 0:
        return known
    return "of unknown size" if unknown == len(files) else f"at least {known}"


def _bring_all(files: Sequence[RemoteFile], folder: Path, page: str, progress: Progress) -> int:
    """Check what is here, and fetch what is not; return the size of all, in bytes."""
    pup = plugins.import_extra("fetch", "fetch", "pooch").create(
        folder.absolute(), "", retry_if_failed=RETRIES, allow_updates=False,
        registry={file.path: file.sha256 for file in files},
        urls={file.path: file.url for file in files},
    )  # fmt: skip
    checksums, noted, done = folder / CHECKSUMS, _read_noted(folder, page), 0
    total = sum(file.n_bytes or 0 for file in files) or len(files)
    with progress.task("fetching", total) as mark, listing.import_web().Session() as session:
        for file in files:
            target = folder / file.path
            _bring(file, target, pup, session, mark, done)
            n_bytes = target.stat().st_size
            done += n_bytes
            mark(done, file.path)
            if file.path not in noted:
                whole = replace(file, sha256=checksum(target), n_bytes=n_bytes)
                with naming(checksums), checksums.open("a", encoding="utf-8") as out:
                    out.write(listing.format_manifest([whole]))
    return done


def _bring(file: RemoteFile, target: Path, pup: Any, session: Any, mark: Mark, before: int) -> None:
    """Fetch a file, or check it where it is here; `before` are the bytes of those before it.

    Raises
    ------
    InputError
        If it does not come whole, is another than is listed, or there is no room; what was fetched
        before stays.
    """

    def save(url: str, written: str, _pooch: Any) -> None:
        remove(Path(written))  # pooch made it readable for its owner alone
        with listing.ask(session, url, stream=True) as answer, Path(written).open("wb") as out:
            for piece in answer.iter_content(_PIECE):
                out.write(piece)
                mark(before + out.tell(), file.path)

    is_here = target.exists()
    try:
        pup.fetch(file.path, downloader=save)
        if is_here and file.n_bytes not in (None, target.stat().st_size):
            raise ValueError
    except listing.import_web().RequestException as error:
        raise InputError(
            f"{file.url}: expected the whole file, found a connection that breaks; run the same "
            "command again: it goes on with this file"
        ) from error
    except ValueError as error:  # as pooch has it where a checksum is another
        if is_here:
            raise InputError(
                f"{target}: expected the file that is listed, found another; move it elsewhere"
            ) from error
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
