"""What many tests need is made once a machine, and kept until what it is made of changes.

Processes that ask for the same thing at once wait for the first, which makes it aside and renames
it. Things lie in a folder named by a checksum of the package, the fixtures, what is installed, and
what decides how this processor rounds; `AFFERENTS_TEST_CACHE` says where such folders lie.
"""

import hashlib
import json
import os
import platform
import shutil
import time
from contextlib import contextmanager, suppress
from functools import cache
from importlib.metadata import distributions
from pathlib import Path

from filelock import FileLock

import afferents

HERE = Path(__file__).parent
ROUNDING = ("ONEDNN_", "ATEN_", "MKL_", "OMP_", "OPENBLAS_", "NPY_", "NUMBA_", "OPENCV_")
"""Names of variables by which libraries are told how to compute begin so."""
UNUSED_S = 7 * 86400


@cache
def folder():
    """Return where things of this package on this machine lie."""
    caches = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    root = Path(os.environ.get("AFFERENTS_TEST_CACHE", caches / "afferents-tests"))
    of_now = root / _key()
    of_now.mkdir(parents=True, exist_ok=True)
    os.utime(of_now)
    for other in root.iterdir():
        with suppress(FileNotFoundError):  # another process tidies up as well
            if time.time() - other.stat().st_mtime > UNUSED_S:
                shutil.rmtree(other, ignore_errors=True)
    return of_now


def _key():
    package, found = Path(afferents.__file__).parent, hashlib.sha256()
    fixtures = [*HERE.glob("**/conftest.py"), Path(__file__)]
    for root, files in ((package, package.rglob("*")), (HERE, fixtures)):
        for path in sorted(files):
            if path.is_file() and "__pycache__" not in path.parts:
                found.update(f"{path.relative_to(root)}\0".encode() + path.read_bytes())
    installed = {f"{one.name} {one.version}" for one in distributions() if one.name != "afferents"}
    told = {f"{name}={value}" for name, value in os.environ.items() if name.startswith(ROUNDING)}
    about = [afferents.__version__, platform.python_version(), *sorted(installed), *sorted(told)]
    found.update("\n".join([*about, *_processor()]).encode())
    return found.hexdigest()[:24]


def _processor():
    known = ("model name", "flags", "Features")
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return [platform.processor()]
    return sorted({line for line in lines if line.startswith(known)})


def contents(folder):
    """Return a checksum of every file."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def _noted(folder):
    """Return the same by relative names, as it is kept."""
    return {str(path.relative_to(folder)): found for path, found in contents(folder).items()}


@contextmanager
def kept(name, make):
    """Give the folder `name`, which `make` fills where it is not there, or no longer whole.

    Who is given it changes nothing in it; that is checked at the end.
    """
    there = folder() / name
    sums = there.with_name(f"{name}.json")
    with FileLock(there.with_name(f"{name}.lock")):
        if not (sums.exists() and _noted(there) == json.loads(sums.read_text())):
            aside = there.with_name(f"{name}.part")
            for old in (aside, there):
                shutil.rmtree(old, ignore_errors=True)
            aside.mkdir()
            make(aside)
            aside.rename(there)
            sums.write_text(json.dumps(_noted(there)))
        before = _noted(there)
    yield there
    assert _noted(there) == before, f"a test has changed {there}, which others read"
