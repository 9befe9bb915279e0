"""What this machine has: versions, cores, accelerator, codecs, and what is missing."""

import os
import platform
import shutil
import sys
from ctypes.util import find_library
from importlib import import_module
from importlib.metadata import PackageNotFoundError, metadata, requires, version
from types import ModuleType
from typing import Literal

from joblib import cpu_count
from packaging.requirements import Requirement

from afferents.plugins import how_to_install
from afferents.version import __version__

CODECS: dict[str, Literal["r", "w"]] = {"h264": "r", "libx264": "w", "mjpeg": "r", "mpeg4": "r"}
"""Codecs that sessions and other sensors' videos need; read or written."""
FOR_DEVELOPERS = ("dev", "docs")
"""Extras that no command needs."""
NATIVE = ("cv2", "soundfile")
"""Modules that need libraries of the system, so that one that is installed may still not work."""


def diagnose() -> tuple[list[tuple[str, str]], list[str]]:
    """Return (what, finding) rows, and sentences about what is missing."""
    missing: list[str] = []
    packages = _packages(missing)
    for name in NATIVE:
        _imported(name, missing)
    rows = [
        ("afferents", __version__),
        ("Python", sys.version.split()[0]),
        ("system", platform.platform()),
        ("processor", f"{processor()}, {cpu_count()} cores usable"),
        ("memory", _memory()),
        *_computing(missing),
        ("free disk here", f"{shutil.disk_usage('.').free / 1e9:.0f} GB"),
        *_codecs(missing),
    ]
    return rows + packages + _extras(), missing


def _imported(name: str, missing: list[str]) -> ModuleType | None:
    """Return a module, or None where it can't be imported, and enter why."""
    try:
        return import_module(name)
    except (ImportError, OSError) as error:  # OSError: a library of the system is not there
        missing.append(f"{name} cannot be imported ({error})")
        return None


def _computing(missing: list[str]) -> list[tuple[str, str]]:
    """Return what torch finds; nothing where there is none, which the extra `train` brings."""
    torch = _imported("torch", missing) if _installed("torch") else None
    if torch is None:
        return []
    cuda = torch.cuda.is_available()
    rows = [
        ("accelerator", torch.cuda.get_device_name() if cuda else "none that torch can use"),
        ("torch build", torch.__version__ + (" (CUDA)" if torch.version.cuda else " (CPU only)")),
    ]
    hardware = _imported("afferents.models.hardware", missing)
    if hardware is not None:
        there = hardware.has_bfloat16(torch.device("cuda" if cuda else "cpu"))
        rows.append(("bfloat16", "in hardware" if there else "not in hardware, float32 is used"))
    return rows


def _packages(missing: list[str]) -> list[tuple[str, str]]:
    rows = []
    for line in requires("afferents") or []:
        requirement = Requirement(line)
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        found = _installed(requirement.name) or "missing"
        if found == "missing" or not requirement.specifier.contains(found, prereleases=True):
            do = f"pip install '{requirement}'"
            missing.append(f"{requirement} is needed, {found} found; {do}")
        rows.append((requirement.name, found))
    return rows


def _extras() -> list[tuple[str, str]]:
    """Return which optional extras are there; none of them is missed."""
    extras = sorted(set(metadata("afferents").get_all("Provides-Extra") or []) - {*FOR_DEVELOPERS})
    return [(f"extra {extra}", _extra(extra)) for extra in extras]


def _extra(extra: str) -> str:
    needed = [
        requirement.name
        for requirement in map(Requirement, requires("afferents") or [])
        if requirement.marker
        and requirement.marker.evaluate({"extra": extra})
        and not requirement.marker.evaluate({"extra": ""})
    ]
    absent = [name for name in needed if _installed(name) is None]
    if absent:
        return f"not there ({', '.join(absent)}); {how_to_install(extra)}"
    if extra == "lab" and find_library("portaudio") is None:
        return "there, but for microphones (no PortAudio library)"
    return "there"


def _installed(package: str) -> str | None:
    """Return a package's version; None where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _codecs(missing: list[str]) -> list[tuple[str, str]]:
    """Return which codecs PyAV was built with; nothing where there is no PyAV."""
    av = _imported("av", missing)
    if av is None:
        return []
    return [("codec " + name, _codec(av, name, mode, missing)) for name, mode in CODECS.items()]


def _codec(av: ModuleType, name: str, mode: Literal["r", "w"], missing: list[str]) -> str:
    try:
        av.Codec(name, mode)
    except av.codec.codec.UnknownCodecError:
        doing = "decoding" if mode == "r" else "encoding"
        missing.append(f"PyAV was built without {name}, needed for {doing}; reinstall 'av'")
        return "missing"
    return "there"


def processor() -> str:
    """Return the processor's name where Linux tells it, else its kind."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:  # noqa: PTH123
            return next(x.split(":")[1].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _memory() -> str:
    try:
        pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not POSIX
        return "unknown"
    return f"{pages * size / 1e9:.0f} GB"
