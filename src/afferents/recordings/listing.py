"""Which files a data set has: from a list with checksums, a web server's folder, or the hub."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from html import unescape
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote, unquote, urldefrag, urljoin, urlsplit

from afferents.errors import InputError, reading
from afferents.files import is_hidden
from afferents.plugins import import_extra

TIMEOUT_S = (10.0, 60.0)
"""To connect, and between two pieces of an answer."""
ANY_WAY_ROUND = (
    "see whether a browser opens it; --url names another place, and --manifest a list of files"
)
UNKNOWN = "-"
_SHA256 = r"(?P<sha256>[0-9a-fA-F]{64}"
_LINES = (  # as sha256sum writes it, and ours
    re.compile(rf"{_SHA256})\s+\*?(?P<path>.+)"),
    re.compile(rf"(?P<path>.+?)\s+{_SHA256}|-)\s+(?P<bytes>\d+|-)"),
)
_HUB = re.compile(r"(?P<site>.+)/api/(?P<set>datasets/[^/]+/[^/]+)/tree/(?P<revision>[^/]+).*")
"""A folder as the Hugging Face hub lists it."""
_GITHUB = re.compile(r".+/repos/(?P<repository>[^/]+/[^/]+)/git/trees/(?P<revision>[^/]+)")
"""A repository as GitHub lists it."""
RAW = "https://raw.githubusercontent.com"
"""Where GitHub has the files themselves."""
_LINK = re.compile(r"""<a\b[^>]*?\bhref\s*=\s*["']?([^"'\s>]+)""", re.IGNORECASE)


@dataclass(frozen=True)
class RemoteFile:
    """A file on a server.

    Attributes
    ----------
    path
        Where it goes, from the folder that all go into.
    url
        Where it is.
    sha256, n_bytes
        None where they are not known.
    """

    path: str
    url: str
    sha256: str | None = None
    n_bytes: int | None = None


def read_manifest(path: Path, url: str) -> list[RemoteFile]:
    """Read a list of files: ``PATH SHA-256 BYTES`` a line, or as ``sha256sum`` writes it.

    A ``-`` stands for what is not known. Lines that begin with ``#`` are left out.

    Parameters
    ----------
    url
        What the paths count from on the server.

    Raises
    ------
    InputError
        If it can't be read, names no file, or has a line of another form or a path that leads out
        of the folder; naming the line.
    """
    with reading(path, "a list of files", OSError, UnicodeDecodeError):
        lines = path.read_text(encoding="utf-8").splitlines()
    found: dict[str, RemoteFile] = {}
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.startswith("#"):
            continue
        where = f"line {number} of {path}"
        match = next(filter(None, (one.fullmatch(line.strip()) for one in _LINES)), None)
        if match is None:
            expected = f"PATH SHA-256 BYTES, or '{UNKNOWN}' for what is not known"
            raise InputError(f"{where}: expected {expected}, found '{line.strip()}'")
        name = path_within(match["path"], where)
        known = {what: text for what, text in match.groupdict().items() if text != UNKNOWN}
        sha256, n_bytes = known.get("sha256"), known.get("bytes")
        at = urljoin(url.rstrip("/") + "/", quote(name))
        found[name] = RemoteFile(
            name, at, sha256 and sha256.lower(), int(n_bytes) if n_bytes else None
        )
    if not found:
        raise InputError(f"{path}: expected a list of files, found none in it")
    return list(found.values())


def format_manifest(files: Iterable[RemoteFile]) -> str:
    """Return a list as `read_manifest` reads it."""
    return "".join(
        f"{one.path} {one.sha256 or UNKNOWN} {UNKNOWN if one.n_bytes is None else one.n_bytes}\n"
        for one in files
    )


def path_within(path: str, where: object) -> str:
    """Return a path that a server or a list names, if it stays in the folder.

    Raises
    ------
    InputError
        If it leads elsewhere, or has a name that begins with a dot.
    """
    parts = PurePosixPath(path).parts
    bad = not parts or path.startswith("/") or any(letter in path for letter in "\\:\0")
    if bad or any(part.startswith(".") for part in parts):
        raise InputError(f"{where}: expected paths of files within the data set, found '{path}'")
    return "/".join(parts)


def import_web() -> Any:
    """Return the library `requests`, which `pooch` brings.

    Raises
    ------
    InputError
        If the extra is not installed.
    """
    return import_extra("fetch", "fetch", "requests", "pooch")


def ask(session: Any, url: str, how: str = "get", **options: Any) -> Any:
    """Ask a server for something; return the answer, after redirections.

    Raises
    ------
    InputError
        If there is no answer, or one that says that there is no such thing.
    """
    requests = import_web()
    headers = {"Accept-Encoding": "identity", "User-Agent": "afferents (fetch)"}
    try:
        answer = session.request(
            how, url, timeout=TIMEOUT_S, headers=headers, allow_redirects=True, **options
        )
        answer.raise_for_status()
    except requests.RequestException as error:  # its own words are long
        words = {"ConnectionError": "no connection", "SSLError": "a certificate that does not hold"}
        found = words.get(type(error).__name__, type(error).__name__)
        if isinstance(error, requests.HTTPError):
            found = f"{error.response.status_code} {error.response.reason}".strip()
        raise InputError(f"{url}: expected an answer, found {found}; {ANY_WAY_ROUND}") from error
    return answer


def list_files(url: str) -> list[RemoteFile]:
    """List the files of a data set.

    Parameters
    ----------
    url
        A folder of a web server that shows what is in it; a folder of a data set of the Hugging
        Face hub, ``.../api/datasets/OWNER/NAME/tree/...``, which has checksums too; or a
        repository of GitHub, ``.../repos/OWNER/NAME/git/trees/HEAD``.

    Raises
    ------
    InputError
        If nothing answers, or no files are found.
    """
    with import_web().Session() as session:
        if hub := _HUB.fullmatch(url):
            base = hub.expand(r"\g<site>/\g<set>/resolve/\g<revision>/")
            return list(_list_by_api(session, f"{url}?recursive=true", base, "the hub's"))
        if github := _GITHUB.fullmatch(url):
            base = github.expand(rf"{RAW}/\g<repository>/\g<revision>/")
            return list(_list_by_api(session, f"{url}?recursive=1", base, "GitHub's"))
        with ask(session, url, stream=True) as answer:  # which may be a large file
            base = answer.url.rstrip("/") + "/"  # after redirections
        files = sorted(_list_folders(session, base))
    if not files:
        expected = "a folder that lists the data set's files"
        raise InputError(f"{url}: expected {expected}, found none in it; {ANY_WAY_ROUND}")
    return [RemoteFile(path_within(unquote(one.removeprefix(base)), url), one) for one in files]


def _list_by_api(session: Any, page: str, base: str, whose: str) -> Iterator[RemoteFile]:
    """Yield the files that are not hidden of a data set or repository, page by page.

    The hub lists a thousand a page, with SHA-256; GitHub lists all on one, without.
    """
    while page:
        answer = ask(session, page)
        try:
            tree = answer.json()
            is_cut_off = isinstance(tree, dict) and tree["truncated"]
            tree = tree["tree"] if isinstance(tree, dict) else tree
            listed = [
                (one["path"], one.get("lfs", {}).get("oid"), one["size"])
                for one in tree
                if one["type"] in ("file", "blob")
            ]
        except (ValueError, TypeError, KeyError) as error:
            raise InputError(
                f"{page}: expected {whose} list of files, found another answer; {ANY_WAY_ROUND}"
            ) from error
        if is_cut_off:
            raise InputError(
                f"{page}: expected a list of all files, found one that was cut off; clone the "
                "repository with git instead"
            )
        for path, sha256, n_bytes in listed:
            if not is_hidden(PurePosixPath(path)):
                within = path_within(path, page)
                yield RemoteFile(within, base + quote(within), sha256, n_bytes)
        page = answer.links.get("next", {}).get("url")


def _list_folders(session: Any, base: str) -> Iterator[str]:
    """Yield the files in a folder of a web server, and in folders in it, that are not hidden."""
    waiting, seen = [base], {base}
    while waiting:
        link = waiting.pop()
        if not link.endswith("/"):
            yield link
            continue
        with ask(session, link, stream=True) as page:
            is_html = "html" in page.headers.get("Content-Type", "html")
            links = _LINK.findall(page.text) if is_html else []
        for one in {urldefrag(urljoin(page.url, unescape(link)))[0] for link in links} - seen:
            within = PurePosixPath(unquote(one.removeprefix(link)))
            if one.startswith(link) and not urlsplit(one).query and not is_hidden(within):
                seen.add(one)
                waiting.append(one)


def ask_sizes(files: Iterable[RemoteFile]) -> Iterator[RemoteFile]:
    """Yield files with their sizes, as far as the server has them."""
    with import_web().Session() as session:
        for file in files:
            if file.n_bytes is None:
                length = ask(session, file.url, "head").headers.get("Content-Length", "")
                file = replace(file, n_bytes=int(length) if length.isdigit() else None)
            yield file
