"""What goes wrong, as one sentence and an exit code.

Codes: 0 all is done; 1 whoever read the output left; 2 the user can mend it; 3 some recordings were
skipped; 128 + n stopped by signal n.
"""

import sys
import traceback
from collections.abc import Callable
from contextlib import suppress

from afferents import plugins, stopping
from afferents.errors import AfferentsError, PartialFailureError, Stopped

STOPPED = "stopped; what is finished is kept"


def run_to_exit_code(command: Callable[[], object], debug: bool) -> int:
    """Run a command; return its exit code, after saying what went wrong.

    Parameters
    ----------
    debug
        Whether the traceback of an error is shown as well.
    """
    try:
        command()
    except Stopped as stop:
        traceback.clear_frames(stop.__traceback__)  # whoever waits in them tidies up
        return _end(STOPPED, debug, stop.code)
    except BrokenPipeError:  # whoever read the output left
        return 1
    except Exception as error:
        if (number := stopping.stopped_by()) is not None:  # what was stopped failed in its own way
            return _end(STOPPED, debug, 128 + number)
        code = 3 if isinstance(error, PartialFailureError) else 2
        if (sentence := _describe(error)) is None:
            raise
        return _end(sentence, debug, code)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def end_after_fault(fault: OSError, debug: bool) -> int:
    """Return the exit code of a command whose work is done, and whose words nobody can take."""
    return 1 if isinstance(fault, BrokenPipeError) else _end(describe_full(fault), debug)


def describe_full(error: OSError) -> str:
    """Return the sentence that says that nothing more can be printed."""
    return f"stdout: expected room for what the command says, found {error.strerror}"


def _end(sentence: str, debug: bool, code: int = 2) -> int:
    """Say in one sentence why a command ended; return its exit code."""
    with suppress(OSError):
        if debug:
            traceback.print_exc()
        print(f"afferents: {sentence}", file=sys.stderr)  # noqa: T201
    return code


def _describe(error: Exception) -> str | None:
    """Return what went wrong, in a sentence; None of what is no fault of the input."""
    if isinstance(error, OSError) and error.strerror:  # the system's own name the file first
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, AfferentsError | OSError):
        return str(error)
    if isinstance(error, UnicodeEncodeError):  # several libraries take no other names of files
        if error.object is None:  # of another process
            return (  # type: ignore[unreachable]
                "a name of a file or folder: expected letters of utf-8, found others; rename it"
            )
        found = error.object[max(0, error.start - 40) : error.end + 40]
        return f"{found}: expected letters that {error.encoding} has, found others; rename it"
    if isinstance(error, ImportError) and (missing := plugins.missing_extra(error, "this command")):
        return str(missing)
    is_short = isinstance(error, MemoryError)
    if isinstance(error, RuntimeError) and "torch" in sys.modules:  # else nothing of it is here
        from afferents.models.hardware import is_out_of_memory

        is_short = is_out_of_memory(error)
    return "out of memory; run it again with less data, or where there is more" * is_short or None
