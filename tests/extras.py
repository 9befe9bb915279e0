"""A test that needs an extra which is not installed is skipped, and says what it lacks.

What needs PyTorch is not marked, which would only grow stale: it shows by the import that fails, be
it the test's own or the package's, whose sentence names it. Where everything is installed, as
`make install` does, nothing is skipped for this.
"""

import os
import re
import shutil
from contextlib import contextmanager
from importlib.util import find_spec

import pytest

OF_EXTRAS = {
    "dask", "distributed", "dynamixel_sdk", "elephant", "grimp", "h5py", "ipykernel", "mcap",
    "mcap_ros2", "mypy", "myst_parser", "nbclient", "ndx_pose", "ndx_sound", "neo",
    "nwbinspector", "onnx", "onnxruntime", "onnxscript", "playwright", "pyarrow", "pylsl",
    "pynwb", "pyspike", "quantities", "requests", "rosbags", "safetensors", "serial", "sklearn",
    "skops", "sounddevice", "sphinx", "sphinx_gallery", "starlette", "torch", "trimesh",
    "uvicorn", "websockets",
}  # fmt: skip
ABSENT = {name for name in OF_EXTRAS if find_spec(name) is None}
SAID = re.compile(r"No module named '(\w+)|`Import (\w+)` failed")  # the latter of pandas


def lacking(text):
    """Return which absent package a text says is missing, if it says so of one."""
    return next((name for said in SAID.findall(text) for name in said if name in ABSENT), None)


def skip_if_lacking(text):
    """Skip the test whose command has printed that an extra is missing."""
    if name := lacking(text):
        pytest.skip(f"needs {name}")


@contextmanager
def open_browser(**how):
    """Open a real browser; skip the test where there is none, unless one is required."""
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        if os.environ.get("AFFERENTS_REQUIRE_BROWSER"):
            pytest.fail("no chromium on this machine, and AFFERENTS_REQUIRE_BROWSER is set")
        pytest.skip("no chromium on this machine: apt-get install chromium")
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"], **how)
        yield opened
        opened.close()


def _skipped(report, path):
    if report.failed and (name := lacking(report.longreprtext)):
        report.outcome, report.longrepr = "skipped", (str(path), 0, f"Skipped: needs {name}")
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    return _skipped((yield), collector.path)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    return _skipped((yield), item.path)
