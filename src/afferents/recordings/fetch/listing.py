"""Which files a data set has: asked of its landing page, a folder of a web server, or a hub."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any, NamedTuple
from urllib.parse import quote, unquote, urldefrag, urljoin, urlsplit

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.recordings.fetch.archives import RemoteFile, path_within
from afferents.recordings.fetch.unpack import ENDINGS, is_packed

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
_LICENCES = ("creativecommons.org/", "nationalarchives.gov.uk/", "opendatacommons.org/")


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


class Listing(NamedTuple):
    """What a page lists.

    Attributes
    ----------
    files
        By path; a hub alone says checksums.
    licence
        As the page names it; empty where it names none.
    page
        Where the list was found, after redirections.
    """

    files: list[RemoteFile]
    licence: str
    page: str


class _Links(HTMLParser):
    """Collects links, and the text of the first that names a licence."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.licence = ""
        self._in_licence = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take a link's target."""
        given = dict(attrs)
        target = given.get("href")
        if tag == "a" and target:
            self.links.append(target.strip())
            named = "license" in (given.get("rel") or "") or any(one in target for one in _LICENCES)
            self._in_licence = named and not self.licence

    def handle_data(self, data: str) -> None:
        """Take the text of a licence's link."""
        if self._in_licence and data.strip():
            self.licence = " ".join(data.split())
            self._in_licence = False


def list_files(url: str, name: str) -> Listing:
    """Find the files of a data set on its landing page, or in a folder that a web server shows.

    Parameters
    ----------
    url
        A DOI's address, the landing page that it leads to, the folder itself, one archive, or a
        folder of a data set of the Hugging Face hub, ``.../api/datasets/OWNER/NAME/tree/...``.
    name
        The data set's name on the server: files lie below ``.../datasets/NAME/``, or below `url`
        itself. Where the page links to none of them, but to one archive of all, as data.bris does
        below ``/datasets/tar/``, that archive is the one file; else the folder of that name on the
        same server is asked.

    Raises
    ------
    InputError
        If nothing answers, or no files are found.
    """
    if is_packed(urlsplit(url).path):
        return Listing([_named(url)], "", url)
    with import_web().Session() as session:
        if hub := _HUB.fullmatch(url):
            return Listing(list(_on_hub(session, url, hub.expand(_RAW))), "", url)
        page = ask(session, url)
        landing, found = page.url, _links_in(page)
        base = _folder_of(landing, found.links, name)
        listed = {link for link in found.links if link.startswith(base)}
        archive = _archive_among(found.links, name)
        if not listed and archive:
            return Listing([_named(archive)], found.licence, landing)
        # A page may link to the folder, or to some of what is in it.
        begin = listed if any(map(_is_file, listed)) else {*listed, base}
        is_guess = not listed and any(map(is_packed, found.links))
        files = [] if is_guess else sorted(_crawl(session, begin))
    if not files:
        n_others = sum(map(is_packed, found.links))
        there = f"{n_others} archives of other names" if n_others else "none"
        expected = "links to the data set's files, or to one archive of them"
        raise InputError(f"{landing}: expected {expected}, found {there}; {ANY_WAY_ROUND}")
    paths = [(path_within(unquote(file.removeprefix(base)), landing), file) for file in files]
    return Listing([RemoteFile(*one) for one in paths], found.licence, landing)


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
            if _is_hidden(path):
                continue
            within = path_within(path, url)
            yield RemoteFile(within, base + quote(within), sha256, n_bytes)
        page = answer.links.get("next", {}).get("url")


def _archive_among(links: list[str], name: str) -> str | None:
    """Return the one link to an archive of a whole data set; one of its name before others."""
    archives = [link for link in links if is_packed(link)]
    archives = [link for link in archives if name in link] or archives
    names = {link: next(end for end in ENDINGS if link.lower().endswith(end)) for link in archives}
    if len({link[: -len(end)].rpartition("/")[2] for link, end in names.items()}) != 1:
        return None
    return min(names, key=lambda link: ENDINGS.index(names[link]))


def _named(url: str) -> RemoteFile:
    """Return the file at an address, under the name that it has there."""
    return RemoteFile(path_within(unquote(urlsplit(url).path.rpartition("/")[2]), url), url)


def _folder_of(landing: str, links: list[str], name: str) -> str:
    """Return the folder that files lie below: the data set's own, or the page's."""
    marker = f"/datasets/{name}/"
    for link in links:
        if marker in f"{link}/":
            return link[: f"{link}/".index(marker)] + marker
    below = landing if landing.endswith("/") else f"{landing}/"
    if any(link.startswith(below) and link != below for link in links):
        return below
    return urljoin(landing, marker)


def _crawl(session: Any, listed: set[str]) -> Iterator[str]:
    """Yield the files that links lead to, and those in folders that are not hidden."""
    waiting, seen = sorted(listed), set(listed)
    while waiting:
        link = waiting.pop()
        if _is_file(link):
            yield link
            continue
        links = _links_in(ask(session, link)).links
        new = {one for one in links if one.startswith(link) and one != link} - seen
        new = {one for one in new if not _is_hidden(unquote(one.removeprefix(link)))}
        waiting += sorted(new)
        seen |= new


def _is_hidden(path: str) -> bool:
    """Tell whether a path has a name with a dot, as systems leave behind; none leads upwards."""
    names = path.split("/")
    return ".." not in names and any(name.startswith(".") for name in names)


def _is_file(link: str) -> bool:
    return not link.endswith("/")


def _links_in(page: Any) -> _Links:
    """Return the links of a page, whole, without those that only sort a list."""
    found = _Links()
    if "html" in page.headers.get("Content-Type", "html"):
        found.feed(page.text)
    page.close()
    whole = (urldefrag(urljoin(page.url, link))[0] for link in found.links)
    found.links = [link for link in dict.fromkeys(whole) if not urlsplit(link).query]
    return found


def ask_sizes(files: Iterable[RemoteFile]) -> Iterator[RemoteFile]:
    """Yield files with their sizes, as far as the server says them."""
    with import_web().Session() as session:
        for file in files:
            if file.n_bytes is not None:
                yield file
                continue
            length = ask(session, file.url, "head").headers.get("Content-Length", "")
            yield replace(file, n_bytes=int(length)) if length.isdigit() else file
