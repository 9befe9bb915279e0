"""What this machine has: versions, cores, accelerator, codecs, and what is missing."""

import os
import platform
import shutil
import sys
from importlib.metadata import PackageNotFoundError, requires, version
from typing import Literal

import av
import torch
from packaging.requirements import Requirement

from afferents import __version__
from afferents.training.hardware import has_bfloat16

CODECS: dict[str, Literal["r", "w"]] = {"h264": "r", "libx264": "w", "mjpeg": "r", "mpeg4": "r"}
"""Codecs that sessions and other sensors' videos need; read or written."""


def diagnose() -> tuple[list[tuple[str, str]], list[str]]:
    """Return (what, finding) rows, and sentences about what is missing."""
    missing: list[str] = []
    rows = [
        ("afferents", __version__),
        ("Python", sys.version.split()[0]),
        ("system", platform.platform()),
        ("processor", f"{_processor()}, {_cores()} cores usable"),
        ("memory", _memory()),
        ("accelerator", _accelerator()),
        ("torch build", torch.__version__ + (" (CUDA)" if torch.version.cuda else " (CPU only)")),
        (
            "bfloat16",
            "in hardware" if has_bfloat16(_device()) else "not in hardware, float32 is used",
        ),
        ("free disk here", f"{shutil.disk_usage('.').free / 1e9:.0f} GB"),
    ]
    rows += [("codec " + name, _codec(name, mode, missing)) for name, mode in CODECS.items()]
    rows += _packages(missing)
    return rows, missing


def _packages(missing: list[str]) -> list[tuple[str, str]]:
    rows = []
    for line in requires("afferents") or []:
        requirement = Requirement(line)
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            found = version(requirement.name)
        except PackageNotFoundError:
            found = "missing"
        if found == "missing" or not requirement.specifier.contains(found, prereleases=True):
            missing.append(f"{requirement} is needed, {found} found; pip install '{requirement}'")
        rows.append((requirement.name, found))
    return rows


def _codec(name: str, mode: Literal["r", "w"], missing: list[str]) -> str:
    try:
        av.Codec(name, mode)
    except av.codec.codec.UnknownCodecError:
        doing = "decoding" if mode == "r" else "encoding"
        missing.append(f"PyAV was built without {name}, needed for {doing}; reinstall 'av'")
        return "missing"
    return "there"


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as lines:  # noqa: PTH123
            return next(x.split(":")[1].strip() for x in lines if x.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _memory() -> str:
    pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return f"{pages * size / 1e9:.0f} GB"


def _device() -> torch.device:
    return torch.device("cuda" if torch.cuda.is_available() else "cpu")


def _accelerator() -> str:
    if torch.cuda.is_available():
        return torch.cuda.get_device_name()
    return "none that torch can use"


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
