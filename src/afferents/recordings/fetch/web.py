"""Asking a server which files a page of a data set lists."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from html.parser import HTMLParser
from typing import Any, NamedTuple
from urllib.parse import unquote, urldefrag, urljoin, urlsplit

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.recordings.fetch.archives import RemoteFile, path_within
from afferents.recordings.fetch.packed import archive_among, is_packed

TIMEOUT_S = (10.0, 60.0)
"""To connect, and between two pieces of an answer."""
ANY_WAY_ROUND = (
    "see whether a browser opens it; --url names another place, and --manifest a list of files"
)
_PLAIN = {"Accept-Encoding": "identity", "User-Agent": "afferents (fetch)"}
_ERRORS = 400


def web() -> Any:
    """Return the library `requests`.

    Raises
    ------
    InputError
        If the extra is not installed.
    """
    return import_extra("fetch", "fetch", "requests", "pooch")


def opened(session: Any, url: str, how: str = "get", **options: Any) -> Any:
    """Ask for something; return the answer, after redirections.

    Raises
    ------
    InputError
        If there is no answer, or one that says that there is no such thing.
    """
    headers = _PLAIN | options.pop("headers", {})
    try:
        answer = session.request(
            how, url, timeout=TIMEOUT_S, headers=headers, allow_redirects=True, **options
        )
    except web().RequestException as error:
        raise InputError(
            f"{url}: expected an answer, found {_short(error)}; {ANY_WAY_ROUND}"
        ) from error
    if answer.status_code >= _ERRORS and answer.status_code != web().codes.range_not_satisfiable:
        found = f"{answer.status_code} {answer.reason}".strip()
        answer.close()
        raise InputError(f"{url}: expected an answer, found {found}; {ANY_WAY_ROUND}")
    return answer


def _short(error: Exception) -> str:
    """Return the kind of what went wrong: the libraries' own words are long."""
    words = {"ConnectionError": "no connection", "ConnectTimeout": "no answer in time"}
    words |= {"ReadTimeout": "no answer in time", "SSLError": "a certificate that does not hold"}
    return words.get(type(error).__name__, type(error).__name__)


# The files that a page of a data set lists: folders as web servers show them, and their links.

MOST_PAGES = 1000
"""So many pages of folders are read at most."""
_LICENCES = ("creativecommons.org/", "nationalarchives.gov.uk/", "opendatacommons.org/")


class Listing(NamedTuple):
    """What a page lists.

    Attributes
    ----------
    files
        By path; none has a checksum.
    licence
        As the page names it; empty where it names none.
    page
        Where the list was found, after redirections.
    """

    files: list[RemoteFile]
    licence: str
    page: str


class _Links(HTMLParser):
    """Collects links with their text, and says which of them name a licence."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.licence = ""
        self._in_licence = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take a link's target."""
        given = dict(attrs)
        target = given.get("href")
        if tag != "a" or not target:
            return
        self.links.append(target.strip())
        is_licence = "license" in (given.get("rel") or "") or any(
            name in target for name in _LICENCES
        )
        self._in_licence = is_licence and not self.licence

    def handle_data(self, data: str) -> None:
        """Take the text of a licence's link."""
        if self._in_licence and data.strip():
            self.licence = " ".join(data.split())

    def handle_endtag(self, tag: str) -> None:
        """End a link."""
        self._in_licence = self._in_licence and tag != "a"


def files_on(url: str, name: str) -> Listing:
    """Find the files of a data set on its landing page, or in a folder that a web server shows.

    Parameters
    ----------
    url
        A DOI's address, the landing page that it leads to, the folder itself, or one archive.
    name
        The data set's name on the server: files lie below ``.../datasets/NAME/``. Where the page
        links to nothing there, that folder of the same server is asked; and what lies below `url`
        itself counts too. Where none of these has files, but the page links to one archive of all
        of it, as data.bris does below ``/datasets/tar/``, that archive is the one file.

    Raises
    ------
    InputError
        If nothing answers, or no files are found.
    """
    if is_packed(urlsplit(url).path):
        return Listing([_named(url)], "", url)
    with web().Session() as session:
        page = opened(session, url)
        landing, found = page.url, _links_in(page)
        files = _files_below(session, _folder_of(landing, found.links, name), found.links, landing)
    return Listing(files or _one_archive(found.links, name, landing), found.licence, landing)


def _files_below(session: Any, base: str, links: list[str], landing: str) -> list[RemoteFile]:
    """Return the files that lie below a folder; none where a folder that no link names isn't."""
    listed = {link for link in links if link.startswith(base)}
    if not any(map(_is_file, listed)):
        is_guess = not listed and any(map(is_packed, links))
        if is_guess and not _answers(session, base):
            return []
        listed |= {base}
    files = sorted(_below(session, base, listed))
    paths = [(path_within(unquote(file.removeprefix(base)), landing), file) for file in files]
    return [RemoteFile(path, file) for path, file in paths]


def _answers(session: Any, url: str) -> bool:
    try:
        opened(session, url, "head").close()
    except InputError:
        return False
    return True


def _one_archive(links: list[str], name: str, landing: str) -> list[RemoteFile]:
    archive = archive_among(links, name)
    if archive is None:
        n_others = sum(map(is_packed, links))
        found = f"{n_others} archives of other names" if n_others else "none"
        expected = "links to the data set's files, or to one archive of them"
        raise InputError(f"{landing}: expected {expected}, found {found}; {ANY_WAY_ROUND}")
    return [_named(archive)]


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


def _below(session: Any, base: str, listed: set[str]) -> Iterator[str]:
    """Yield the files that links lead to, below a folder, and in its folders."""
    waiting, seen = sorted(listed), set(listed)
    n_pages = 0
    while waiting:
        link = waiting.pop()
        if _is_file(link):
            yield link
            continue
        n_pages += 1
        if n_pages > MOST_PAGES:
            raise InputError(
                f"{base}: expected at most {MOST_PAGES} folders, found more; {ANY_WAY_ROUND}"
            )
        links = _links_in(opened(session, link)).links
        new = {one for one in links if one.startswith(link) and one != link} - seen
        waiting += sorted(new)
        seen |= new


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


def sizes_of(files: Iterable[RemoteFile]) -> Iterator[RemoteFile]:
    """Yield files with their sizes, as far as the server says them."""
    with web().Session() as session:
        for file in files:
            yield file if file.n_bytes is not None else _sized(session, file)


def _sized(session: Any, file: RemoteFile) -> RemoteFile:
    answer = opened(session, file.url, "head")
    said = answer.headers.get("Content-Length", "")
    return replace(file, n_bytes=int(said)) if said.isdigit() else file
