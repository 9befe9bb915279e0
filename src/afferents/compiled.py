"""Functions that Numba compiles, kept from one process to the next where there is a place."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba import njit

Function = Callable[..., Any]


def compiled(**options: Any) -> Callable[[Function], Function]:
    """Return what lets Numba compile a function, when it is first called.

    What comes of it is kept in ``NUMBA_CACHE_DIR`` where that is set, else beside the module, else
    in the user's home. Where none of these can be written Numba gives up, and where there is no
    home it takes a folder ``~`` where the command runs; so each process compiles anew there.

    Parameters
    ----------
    options
        Of `numba.njit`.
    """

    def decorate(function: Function) -> Function:
        with suppress(RuntimeError):  # no home, or Numba's, of folders that can't be written
            Path.home()
            kept: Function = njit(cache=True, **options)(function)
            return kept
        anew: Function = njit(**options)(function)
        return anew

    return decorate
