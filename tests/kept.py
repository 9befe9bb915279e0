"""What many tests need is made once a machine, and kept until what it is made of changes.

Processes that ask for the same thing at once wait for the first, which makes it aside and renames
it. Things lie in a folder named by a checksum of the modules that make them with all they import,
of the fixtures, what is installed, and what decides how this processor rounds;
`AFFERENTS_TEST_CACHE` says where such folders lie.
"""

import ast
import hashlib
import inspect
import json
import os
import platform
import re
import shutil
import time
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import distributions
from pathlib import Path

from filelock import FileLock

import afferents

HERE, PACKAGE = Path(__file__).parent, Path(afferents.__file__).parent
ROUNDING = ("ONEDNN_", "ATEN_", "MKL_", "OMP_", "OPENBLAS_", "NPY_", "NUMBA_", "OPENCV_")
"""Names of variables by which libraries are told how to compute begin so."""
UNUSED_S = 7 * 86400


def folder(made_by, fixture):
    """Return where what these modules make, as this file of tests tells them, lies here."""
    caches = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    root = Path(os.environ.get("AFFERENTS_TEST_CACHE", caches / "afferents-tests"))
    of_now = root / key(made_by, (HERE / "conftest.py", Path(__file__), Path(fixture)))
    of_now.mkdir(parents=True, exist_ok=True)
    os.utime(of_now)
    for other in root.iterdir():
        with suppress(FileNotFoundError):  # another process tidies up as well
            if time.time() - other.stat().st_mtime > UNUSED_S:
                shutil.rmtree(other, ignore_errors=True)
    return of_now


def key(made_by, fixtures=(), package=PACKAGE):
    """Return a checksum of what modules of a package import, the fixtures, and this machine."""
    found = hashlib.sha256()
    for path in sorted(closure(made_by, package)):
        found.update(f"{path.relative_to(package)}\0".encode() + path.read_bytes())
    for path in fixtures:
        found.update(f"{path.name}\0".encode() + path.read_bytes())
    found.update("\n".join(_here()).encode())
    return found.hexdigest()[:24]


def closure(names, package=PACKAGE):
    """Return the files of a package that these modules import, at once or when they are called.

    What a string names (``package.module:NAME``) counts, and data files beside a module.
    """
    found, waiting = set(), {package.name, *names} if names else set()
    while waiting:
        name = waiting.pop()
        path = _file(name, package)
        if path is None:
            waiting |= _behind(name, package)
        elif path not in found:
            found |= {path, *_data_beside(path)}
            waiting |= _mentioned(path, package)
    return found


def _file(name, package):
    """Return the file of a module; None if it is no module of the package."""
    path = package.parent.joinpath(*name.split("."))
    files = (path / "__init__.py", path.with_name(f"{path.name}.py"))
    return next((one for one in files if one.is_file()), None)


def _behind(name, package):
    """Return the modules of what a package imports when it is asked for, as its stub says."""
    parent, _, last = name.rpartition(".")
    stub = package.parent.joinpath(*parent.split("."), "__init__.pyi")
    if not stub.is_file():
        return set()
    imports = [
        node for node in ast.parse(stub.read_text()).body if isinstance(node, ast.ImportFrom)
    ]
    return {f"{parent}.{one.module}" for one in imports if last in {a.name for a in one.names}}


def _data_beside(path):
    """Return files of other kinds in a module's folder, and in folders there without modules."""
    beside = [one for one in path.parent.iterdir() if one.is_file()]
    for below in path.parent.iterdir():
        if below.is_dir() and below.name != "__pycache__" and not any(below.glob("*.py")):
            beside += [one for one in below.rglob("*") if one.is_file()]
    return {one for one in beside if one.suffix not in (".py", ".pyi", ".pyc")}


@cache
def _mentioned(path, package):
    """Return the names of modules that a file imports or names, and of the packages above them."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {one.name for one in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{one.name}" for one in node.names)}
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names.add(node.value.partition(":")[0])
    ours = {name for name in names if re.fullmatch(rf"{package.name}(\.\w+)*", name)}
    return {name[:end] for name in ours for end in (*_dots(name), None)}


def _dots(name):
    return [place for place, letter in enumerate(name) if letter == "."]


@cache
def _here():
    """Return what is installed, and what decides how this processor rounds."""
    installed = {f"{one.name} {one.version}" for one in distributions() if one.name != "afferents"}
    told = {f"{name}={value}" for name, value in os.environ.items() if name.startswith(ROUNDING)}
    about = [afferents.__version__, platform.python_version(), *sorted(installed), *sorted(told)]
    return [*about, *_processor()]


def _processor():
    known = ("model name", "flags", "Features")
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return [platform.processor()]
    return sorted({line for line in lines if line.startswith(known)})


def contents(folder, *patterns):
    """Return a checksum of every file, or of those whose names match, by their paths in there."""
    found = (path for pattern in patterns or ["*"] for path in sorted(folder.rglob(pattern)))
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in found
        if path.is_file()
    }


@contextmanager
def kept(name, make, made_by=()):
    """Give the folder `name`, which `make` fills where it is not there, or no longer whole.

    It is made anew when the modules of `made_by` change, or one that they import. Who is given it
    changes nothing in it; that is checked at the end.
    """
    there = folder(made_by, inspect.getsourcefile(inspect.unwrap(make))) / name
    sums = there.with_name(f"{name}.json")
    with FileLock(there.with_name(f"{name}.lock")):
        if not (sums.exists() and contents(there) == json.loads(sums.read_text())):
            aside = there.with_name(f"{name}.part")
            for old in (aside, there):
                shutil.rmtree(old, ignore_errors=True)
            aside.mkdir()
            make(aside)
            aside.rename(there)
            sums.write_text(json.dumps(contents(there)))
        before = contents(there)
    yield there
    assert contents(there) == before, f"a test has changed {there}, which others read"
