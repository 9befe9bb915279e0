"""Objects of a user's own, named by where they are: ``package.module:NAME`` or ``file.py:NAME``."""

import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from afferents.core.errors import InputError

_FORM = "package.module:NAME or file.py:NAME"


def imported(where: str) -> Any:
    """Return the object of that name.

    What is in a file is sent to other processes whole, so that they need not have the file.

    Raises
    ------
    InputError
        If the module can't be imported, whatever it raises, or has nothing of that name.
    """
    module_name, colon, name = where.rpartition(":")
    if not colon or not module_name or not name:
        raise InputError(where, _FORM, f"'{where}'")
    from_file = False
    if module_name.endswith(".py"):
        path = Path(module_name)
        if not path.is_file():
            raise InputError(where, "a Python file", "no such file")
        folder = str(path.resolve().parent)
        if folder not in sys.path:
            sys.path.insert(0, folder)
        module_name, from_file = path.stem, True
    try:
        found: Any = import_module(module_name)
    except Exception as error:
        said = f"{type(error).__name__}: {error}".partition("\n")[0]
        raise InputError(where, "a module that can be imported", said) from error
    if from_file:
        _send_whole(found)
    for part in name.split("."):
        if not hasattr(found, part):
            raise InputError(where, f"'{name}' in {module_name}", "nothing of that name")
        found = getattr(found, part)
    return found


def _send_whole(module: ModuleType) -> None:
    """Let what is in a module be sent to workers by value; joblib and Dask have a pickler each."""
    for pickler in ("joblib.externals.cloudpickle", "cloudpickle"):
        with suppress(ImportError):
            import_module(pickler).register_pickle_by_value(module)


def reference_of(own: Any) -> str:
    """Return ``module:NAME`` of a function or a class, by which it can be imported again.

    Raises
    ------
    InputError
        If it can't: it is made inside another function, or in a script or a notebook.
    """
    module, name = getattr(own, "__module__", None), getattr(own, "__qualname__", None)
    known = module and name and module != "__main__" and "<" not in name
    if not known:
        found = f"{name or type(own).__name__} of {module or 'nowhere'}"
        raise InputError(
            "classifier", "a function of a module that can be imported", found,
            "put it into a file of its own",
        )  # fmt: skip
    return f"{module}:{name}"
