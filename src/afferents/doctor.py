"""What this machine has, and what is missing."""

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


def diagnose() -> tuple[dict[str, dict[str, str]], list[str]]:
    """Return what was found, by the title of a table and by name, and what is missing in words."""
    missing: list[str] = []
    packages, extras = _find_packages(missing), _find_extras()
    for name in NATIVE:
        _import(name, missing)
    try:
        memory = f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 1e9:.0f} GB"
    except (AttributeError, ValueError, OSError):  # not POSIX
        memory = "unknown"
    machine = {
        "afferents": __version__,
        "Python": sys.version.split()[0],
        "system": platform.platform(),
        "processor": f"{processor()}, {cpu_count()} cores usable",
        "memory": memory,
        **_ask_torch(missing),
        "free disk here": f"{shutil.disk_usage('.').free / 1e9:.0f} GB",
    }
    codecs = _find_codecs(missing)
    found = {"This machine": machine, "Video": codecs, "Packages": packages, "Extras": extras}
    return found, missing


def _import(name: str, missing: list[str]) -> ModuleType | None:
    """Return a module, or None where it can't be imported, and enter why."""
    try:
        return import_module(name)
    except (ImportError, OSError) as error:  # OSError: a library of the system is not there
        missing.append(f"{name} cannot be imported ({error})")
        return None


def _ask_torch(missing: list[str]) -> dict[str, str]:
    """Return what torch finds; nothing where there is none, which the extra `train` brings."""
    torch = _import("torch", missing) if _find_version("torch") else None
    if torch is None:
        return {}
    cuda = torch.cuda.is_available()
    found = {
        "accelerator": torch.cuda.get_device_name() if cuda else "none that torch can use",
        "torch build": torch.__version__ + (" (CUDA)" if torch.version.cuda else " (CPU only)"),
    }
    if hardware := _import("afferents.models.hardware", missing):
        there = hardware.has_bfloat16(torch.device("cuda" if cuda else "cpu"))
        found["bfloat16"] = "in hardware" if there else "not in hardware, float32 is used"
    return found


def _find_packages(missing: list[str]) -> dict[str, str]:
    """Return the versions of the packages that every command needs."""
    found = {}
    for requirement in map(Requirement, requires("afferents") or []):
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        there = found[requirement.name] = _find_version(requirement.name) or "missing"
        if there == "missing" or not requirement.specifier.contains(there, prereleases=True):
            do = f"pip install '{requirement}'"
            missing.append(f"{requirement} is needed, {there} found; {do}")
    return found


def _find_extras() -> dict[str, str]:
    """Return which optional extras are there; none of them is missed."""
    found, every = {}, [Requirement(line) for line in requires("afferents") or []]
    named = set(metadata("afferents").get_all("Provides-Extra") or []) - {*FOR_DEVELOPERS}
    for extra in sorted(named):
        absent = [
            one.name
            for one in every
            if one.marker
            and one.marker.evaluate({"extra": extra})
            and not one.marker.evaluate({"extra": ""})
            and _find_version(one.name) is None
        ]
        there = "there"
        if absent:
            there = f"not there ({', '.join(absent)}); {how_to_install(extra)}"
        elif extra == "lab" and find_library("portaudio") is None:
            there = "there, but for microphones (no PortAudio library)"
        found[f"extra {extra}"] = there
    return found


def _find_version(package: str) -> str | None:
    """Return a package's version; None where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _find_codecs(missing: list[str]) -> dict[str, str]:
    """Return which codecs PyAV was built with; nothing where there is no PyAV."""
    found: dict[str, str] = {}
    if (av := _import("av", missing)) is None:
        return found
    for name, mode in CODECS.items():
        try:
            av.Codec(name, mode)
            found[f"codec {name}"] = "there"
        except av.codec.codec.UnknownCodecError:
            doing = "decoding" if mode == "r" else "encoding"
            missing.append(f"PyAV was built without {name}, needed for {doing}; reinstall 'av'")
            found[f"codec {name}"] = "missing"
    return found


def processor() -> str:
    """Return the processor's name where Linux tells it, else its kind."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:  # noqa: PTH123
            return next(x.split(":")[1].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()
