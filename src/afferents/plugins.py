"""Packages of optional extras, and objects of a user's own."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module, invalidate_caches
from pathlib import Path
from types import ModuleType
from typing import Any

from afferents.errors import AfferentsError, InputError, raised, reason_of

_OF_TRAIN = ("torch", "sklearn", "skops", "safetensors", "pyarrow")
"""Packages that learning and its results need: more than half of the gigabytes."""
_of_files: set[str] = set()
"""Names of modules that were imported as files."""


def how_to_install(extra: str) -> str:
    """Say what to type for an optional extra."""
    without_cuda = "; docs/install.md says how without CUDA" if extra == "train" else ""
    return f"pip install 'afferents[{extra}]'{without_cuda}"


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
    except (ImportError, OSError, RuntimeError) as error:  # the latter of a library that it needs
        raise _lacking(extra, asked, error) from error
    return modules[0]


def missing_extra(error: ImportError, asked: str) -> InputError | None:
    """Return what to install where a package that learning needs is missing; else None.

    Parameters
    ----------
    asked
        The option, command or name that needs it.
    """
    if (error.name or "").partition(".")[0] not in _OF_TRAIN:
        return None
    return _lacking("train", asked, error)


def _lacking(extra: str, asked: str, error: Exception) -> InputError:
    expected, found = f"the packages of the extra '{extra}'", str(error).partition("\n")[0]
    return InputError(f"{asked}: expected {expected}, found {found}; {how_to_install(extra)}")


def named(where: str) -> Any:
    """Return the object that a user names by ``package.module:NAME`` or ``file.py:NAME``.

    What is in a file is sent to joblib's processes whole: they don't import it.

    Raises
    ------
    InputError
        If the module can't be imported, whatever it raises, has nothing of that name, or has the
        name of another module.
    """
    module, _, name = where.rpartition(":")
    if not module.endswith(".py"):
        return imported(where)
    path = Path(module)
    if not path.is_file():
        raise InputError(f"{where}: expected a Python file, found no such file")
    there = sys.modules.get(path.stem)
    if there and Path(getattr(there, "__file__", None) or "").resolve() != path.resolve():
        if path.stem not in _of_files:
            raise InputError(
                f"{where}: expected a file that has not the name of a module, found {path.stem}; "
                "rename it"
            )
        del sys.modules[path.stem]  # of a file of the same name in another folder
        invalidate_caches()
    found = imported(f"{path.stem}:{name}", where, path.resolve().parent)
    _of_files.add(path.stem)
    pickler = import_module("cloudpickle")  # which joblib pickles with
    pickler.register_pickle_by_value(sys.modules[path.stem])
    return found


def imported(where: str, said: str | None = None, folder: Path | None = None) -> Any:
    """Return the object of a name such as ``package.module:NAME``.

    Parameters
    ----------
    said
        How the user named it, for an error.
    folder
        Where modules are looked for first; by default the current folder, after all others.

    Raises
    ------
    InputError
        As `named`.
    """
    said = said or where
    module_name, _, name = where.rpartition(":")
    if not module_name or not name:
        raise InputError(f"{said}: expected package.module:NAME or file.py:NAME, found '{where}'")
    place = str(folder or Path.cwd())
    if folder:
        sys.path[:] = [place, *(other for other in sys.path if other != place)]
    elif place not in sys.path:
        sys.path.append(place)
    try:
        found: Any = import_module(module_name)
    except Exception as error:
        raise InputError(
            f"{said}: expected a module that can be imported, found {raised(error)}"
        ) from error
    for part in name.split("."):
        if not hasattr(found, part):
            raise InputError(
                f"{said}: expected '{name}' in {module_name}, found nothing of that name"
            )
        found = getattr(found, part)
    return found


def reference_of(own: Any, what: str = "classifier") -> str:
    """Return ``module:NAME`` of a function or a class, by which it can be imported again.

    Parameters
    ----------
    what
        It is, for the error.

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
            f"{what}: expected one of a module that can be imported, found {found}; put it into a "
            "file of its own"
        )
    return f"{module}:{name}"


@contextmanager
def in_a_sentence(where: str) -> Iterator[None]:
    """Raise as an `InputError` whatever somebody's own code raises as it reads the data `where`."""
    try:
        yield
    except AfferentsError:
        raise
    except Exception as error:
        at = getattr(error, "filename", None) or where
        found = reason_of(error) if isinstance(error, OSError) else raised(error)
        raise InputError(f"{at}: expected data that can be read, found {found}") from error
