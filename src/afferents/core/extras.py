"""Packages of optional extras, imported when they are needed."""

from importlib import import_module
from types import ModuleType

from afferents.core.errors import InputError


def import_extra(extra: str, asked: str, *names: str) -> ModuleType:
    """Import packages of an optional extra; return the first.

    Parameters
    ----------
    asked
        The option or command that needs them.

    Raises
    ------
    InputError
        If one is missing.
    """
    try:
        modules = [import_module(name) for name in names]
    except ImportError as error:
        wanted, remedy = f"the packages of the extra '{extra}'", f"pip install 'afferents[{extra}]'"
        raise InputError(asked, wanted, str(error), remedy) from error
    return modules[0]
