"""Errors that a user can act on: one sentence each, exit code 2 at the command line."""


def reason_of(error: BaseException) -> str:
    """Return in words why something failed: of the system's errors no number and no second path."""
    reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return " ".join(str(reason).split())


def raised(error: BaseException) -> str:
    """Return in a line what somebody else's code raised."""
    return f"{type(error).__name__}: {error}".partition("\n")[0]


class AfferentsError(Exception):
    """Base of every error that is the input's or the configuration's fault, not ours.

    The command line prints its one sentence and exits with code 2; `--debug` shows the
    traceback as well.
    """


class InputError(AfferentsError):
    """A file or argument is not what it should be.

    Parameters
    ----------
    where
        The file, folder or argument at fault.
    expected, found
        What should have been there, and what was.
    do
        What the user can do about it (optional, an imperative clause).
    """

    def __init__(self, where: object, expected: str, found: str, do: str = "") -> None:
        """Build the sentence from its parts."""
        self._parts = (str(where), expected, found, do)
        remedy = f"; {do}" if do else ""
        super().__init__(f"{where}: expected {expected}, found {found}{remedy}")

    def at(self, where: object) -> "InputError":
        """Return the same, found elsewhere: of a file, where the error knew of its content only."""
        return InputError(where, *self._parts[1:])

    def __reduce__(self) -> tuple[type["InputError"], tuple[str, str, str, str]]:
        """Come back from another process as what it was."""
        return InputError, self._parts


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
