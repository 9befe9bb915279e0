"""Errors that a user can act on: one sentence each, exit code 2 at the command line."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def reason_of(error: BaseException) -> str:
    """Return why something failed; of an error of the system its text, without number and path."""
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(reason).split())


def raised(error: BaseException) -> str:
    """Return one line about an error that another package's code raised."""
    return f"{type(error).__name__}: {error}".partition("\n")[0]


class AfferentsError(Exception):
    """Base of every error that is the input's or the configuration's fault, not ours.

    The command line prints its one sentence and exits with code 2; `--debug` shows the
    traceback as well.
    """


class InputError(AfferentsError):
    """A file or argument is not what it should be.

    Its sentence says which file or argument, what was expected, what was found, and what to do:
    ``the file: expected this, found that; do so``.
    """

    def at(self, where: object) -> "InputError":
        """Return the same error with a file in front, where it knew only the file's content."""
        return InputError(f"{where}: {str(self).partition(': ')[2]}")


@contextmanager
def reading(where: object, what: str, *kinds: type[Exception], do: str = "") -> Iterator[None]:
    """Turn what another package's reader raises into one sentence.

    Parameters
    ----------
    where
        The file, which must be there.
    what, do
        What it should be, and what to do if it is not.
    kinds
        Errors that the reader raises; none for any: readers of other packages raise what they like.

    Raises
    ------
    InputError
        If it does. Errors of this package and `MemoryError` pass unchanged.
    """
    if isinstance(where, Path) and not where.exists():
        raise InputError(f"{where}: expected {what}, found no such file{then(do)}")
    expected = kinds or (Exception,)
    try:
        yield
    except (AfferentsError, MemoryError):
        raise
    except expected as error:
        at = str(getattr(error, "filename", None) or where)  # of what lies in a folder
        at = at.removeprefix("file:")  # as FFmpeg was told
        raise InputError(f"{at}: expected {what}, found {reason_of(error)}{then(do)}") from error


def then(do: str) -> str:
    """Return what to do about an error as the end of its sentence; nothing where there is none."""
    return f"; {do}" if do else ""


class LeakageError(AfferentsError):
    """Something of the held-out speed was seen before the final test."""


class PartialFailureError(AfferentsError):
    """Some recordings failed and were skipped because `--keep-going` was given (exit code 3)."""


class Stopped(SystemExit):
    """A signal stopped the command: nothing that could be skipped or named.

    Parameters
    ----------
    number
        Of the signal; 128 more is the exit code, as shells have it.
    """

    code: int

    def __init__(self, number: int) -> None:
        """Keep the exit code."""
        super().__init__(128 + number)
