"""What goes wrong, as one sentence and an exit code.

Codes: 0 all is done; 1 whoever read the output left; 2 the user can mend it; 3 some recordings were
skipped; 128 + n stopped by signal n.
"""

import sys
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress

from afferents.errors import AfferentsError, PartialFailureError, Stopped
from afferents.plugins import missing_extra
from afferents.stopping import stopped_by

STOPPED = "stopped; what is finished is kept"


def exit_code_of(command: Callable[[], object], debug: bool) -> int:
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
        return _ended(STOPPED, debug, stop.code)
    except BrokenPipeError:  # whoever read the output left
        return 1
    except Exception as error:  # noqa: BLE001  told or raised again below
        if (number := stopped_by()) is not None:  # what was stopped failed in its own way
            return _ended(STOPPED, debug, 128 + number)
        return _failed(error, debug)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else int(bool(end.code))
    return 0


def exit_code_of_fault(fault: OSError, debug: bool) -> int:
    """Return the exit code of a command whose work is done, and whose words nobody can take."""
    return 1 if isinstance(fault, BrokenPipeError) else _ended(no_room(fault), debug)


def no_room(error: OSError) -> str:
    """Return the sentence that says that nothing more can be printed."""
    return f"stdout: expected room for what the command says, found {error.strerror}"


def fail_if_skipped(skipped: Mapping[str, str]) -> None:
    """Name the recordings that were skipped, and why.

    Raises
    ------
    PartialFailureError
        If there are any: exit code 3.
    """
    if skipped:
        reasons = "; ".join(f"{name} ({why})" for name, why in skipped.items())
        raise PartialFailureError(f"skipped {len(skipped)} of the recordings: {reasons}")


def _failed(error: Exception, debug: bool) -> int:
    """Say what went wrong; return the exit code. What is no fault of the input is raised again."""
    if isinstance(error, AfferentsError | OSError):
        return _ended(_sentence(error), debug, 3 if isinstance(error, PartialFailureError) else 2)
    if isinstance(error, UnicodeEncodeError):  # several libraries take no other names of files
        return _ended(_no_letters(error), debug)
    if isinstance(error, ImportError) and (missing := missing_extra(error, "this command")):
        return _ended(str(missing), debug)
    if _is_out_of_memory(error):
        do = "run it again with less data, or where there is more"
        return _ended(f"out of memory; {do}", debug)
    raise error


def _is_out_of_memory(error: Exception) -> bool:
    """Tell whether memory is short; PyTorch is asked only where it was imported."""
    if isinstance(error, RuntimeError) and "torch" in sys.modules:
        from afferents.models.hardware import is_out_of_memory

        return is_out_of_memory(error)
    return isinstance(error, MemoryError)


def _ended(sentence: str, debug: bool, code: int = 2) -> int:
    """Say in one sentence why a command ended; return its exit code."""
    with suppress(OSError):
        if debug:
            traceback.print_exc()
        print(f"afferents: {sentence}", file=sys.stderr)  # noqa: T201
    return code


def _sentence(error: BaseException) -> str:
    """Return what the error says; the system's own errors name the file first."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return str(error)


def _no_letters(error: UnicodeEncodeError) -> str:
    if error.object is None:  # of another process
        return (  # type: ignore[unreachable]
            "a name of a file or folder: expected letters of utf-8, found others; rename it"
        )
    found = error.object[max(0, error.start - 40) : error.end + 40]
    return f"{found}: expected letters that {error.encoding} has, found others; rename it"
