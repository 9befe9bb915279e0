"""Which files a data set has: asked of a folder of a web server, or of a hub."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from html import unescape
from pathlib import PurePosixPath
from typing import Any
from urllib.parse import quote, unquote, urldefrag, urljoin, urlsplit

from afferents.errors import InputError
from afferents.files import is_hidden
from afferents.plugins import import_extra
from afferents.recordings.fetch.archives import RemoteFile, path_within

TIMEOUT_S = (10.0, 60.0)
"""To connect, and between two pieces of an answer."""
ANY_WAY_ROUND = (
    "see whether a browser opens it; --url names another place, and --manifest a list of files"
)
_PLAIN = {"Accept-Encoding": "identity", "User-Agent": "afferents (fetch)"}
_HUB = re.compile(r"(?P<site>.+)/api/(?P<set>datasets/[^/]+/[^/]+)/tree/(?P<revision>[^/]+).*")
"""A folder as the Hugging Face hub lists it."""
_RAW = r"\g<site>/\g<set>/resolve/\g<revision>/"
"""What the paths in that list count from."""
_LINK = re.compile(r"""<a\b[^>]*?\bhref\s*=\s*["']?([^"'\s>]+)""", re.IGNORECASE)


def import_web() -> Any:
    """Return the library `requests`.

    Raises
    ------
    InputError
        If the extra is not installed.
    """
    return import_extra("fetch", "fetch", "requests")


def ask(session: Any, url: str, how: str = "get", **options: Any) -> Any:
    """Ask a server for something; return the answer, after redirections.

    Raises
    ------
    InputError
        If there is no answer, or one that says that there is no such thing.
    """
    requests = import_web()
    headers = _PLAIN | options.pop("headers", {})
    try:
        answer = session.request(
            how, url, timeout=TIMEOUT_S, headers=headers, allow_redirects=True, **options
        )
        if answer.status_code != requests.codes.range_not_satisfiable:
            answer.raise_for_status()
    except requests.HTTPError as error:
        found = f"{error.response.status_code} {error.response.reason}".strip()
        raise InputError(f"{url}: expected an answer, found {found}; {ANY_WAY_ROUND}") from error
    except requests.RequestException as error:  # its own words are long
        words = {"ConnectionError": "no connection", "SSLError": "a certificate that does not hold"}
        found = words.get(type(error).__name__, type(error).__name__)
        raise InputError(f"{url}: expected an answer, found {found}; {ANY_WAY_ROUND}") from error
    return answer


def list_files(url: str) -> list[RemoteFile]:
    """List the files of a data set.

    Parameters
    ----------
    url
        A folder of a web server that shows what is in it, or a folder of a data set of the
        Hugging Face hub, ``.../api/datasets/OWNER/NAME/tree/...``, which says checksums too.

    Raises
    ------
    InputError
        If nothing answers, or no files are found.
    """
    with import_web().Session() as session:
        if hub := _HUB.fullmatch(url):
            return list(_on_hub(session, url, hub.expand(_RAW)))
        with ask(session, url, stream=True) as answer:  # which may be a large file
            base = answer.url.rstrip("/") + "/"  # after redirections
        files = sorted(_crawl(session, base))
    if not files:
        expected = "a folder that lists the data set's files"
        raise InputError(f"{url}: expected {expected}, found none in it; {ANY_WAY_ROUND}")
    return [RemoteFile(path_within(unquote(one.removeprefix(base)), url), one) for one in files]


def _on_hub(session: Any, url: str, base: str) -> Iterator[RemoteFile]:
    """Yield the files below a folder, of which the hub lists a thousand a page, with checksums."""
    page = f"{url}?recursive=true"
    while page:
        answer = ask(session, page)
        try:
            listed = [
                (one["path"], one.get("lfs", {}).get("oid"), one["size"])
                for one in answer.json()
                if one["type"] == "file"
            ]
        except (ValueError, TypeError, KeyError) as error:
            raise InputError(
                f"{page}: expected the hub's list of files, found another answer; {ANY_WAY_ROUND}"
            ) from error
        for path, sha256, n_bytes in listed:
            if not is_hidden(PurePosixPath(path)):
                within = path_within(path, url)
                yield RemoteFile(within, base + quote(within), sha256, n_bytes)
        page = answer.links.get("next", {}).get("url")


def _crawl(session: Any, base: str) -> Iterator[str]:
    """Yield the files in a folder of a web server, and in folders in it, that are not hidden."""
    waiting, seen = [base], {base}
    while waiting:
        link = waiting.pop()
        if not link.endswith("/"):
            yield link
            continue
        found = _links_in(ask(session, link, stream=True))
        new = {one for one in found if one.startswith(link)} - seen
        new = {one for one in new if not is_hidden(PurePosixPath(unquote(one.removeprefix(link))))}
        waiting += sorted(new)
        seen |= new


def _links_in(page: Any) -> list[str]:
    """Return the links of a page, whole, without those that only sort a list."""
    is_html = "html" in page.headers.get("Content-Type", "html")
    links = _LINK.findall(page.text) if is_html else []
    page.close()
    whole = (urldefrag(urljoin(page.url, unescape(link)))[0] for link in links)
    return [link for link in whole if not urlsplit(link).query]


def ask_sizes(files: Iterable[RemoteFile]) -> Iterator[RemoteFile]:
    """Yield files with their sizes, as far as the server says them."""
    with import_web().Session() as session:
        for file in files:
            if file.n_bytes is not None:
                yield file
                continue
            length = ask(session, file.url, "head").headers.get("Content-Length", "")
            yield replace(file, n_bytes=int(length)) if length.isdigit() else file
