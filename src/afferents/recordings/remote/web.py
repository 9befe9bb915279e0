"""Asking a server: by the library `requests`, which comes with the extra `fetch`."""

from typing import Any

from afferents.core.errors import InputError
from afferents.core.extras import import_extra

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
        raise InputError(url, "an answer", _short(error), ANY_WAY_ROUND) from error
    if answer.status_code >= _ERRORS and answer.status_code != web().codes.range_not_satisfiable:
        found = f"{answer.status_code} {answer.reason}".strip()
        answer.close()
        raise InputError(url, "an answer", found, ANY_WAY_ROUND)
    return answer


def _short(error: Exception) -> str:
    """Return the kind of what went wrong: the libraries' own words are long."""
    words = {"ConnectionError": "no connection", "ConnectTimeout": "no answer in time"}
    words |= {"ReadTimeout": "no answer in time", "SSLError": "a certificate that does not hold"}
    return words.get(type(error).__name__, type(error).__name__)
