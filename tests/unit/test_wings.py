"""What works without: the wings, the extras, PyTorch."""

import subprocess
import sys

import pytest

WITHOUT = """
import sys
from importlib.abc import MetaPathFinder

class Removed(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.startswith('afferents.') and name.startswith({removed!r}):
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Removed())
sys.modules.update(dict.fromkeys(name for name in {removed!r} if "." not in name))
import pkgutil
from importlib import import_module
import afferents
for part in pkgutil.walk_packages(afferents.__path__, 'afferents.'):
    if not part.name.startswith({left_out!r}):
        import_module(part.name)
from afferents import cli
cli.app(['inspect', '--help'], standalone_mode=False)
"""


WINGS = ("afferents.recorder", "afferents.neuro", "afferents.exchange")
PROGRAMS = ("afferents.__main__",)
EXTRAS = (
    "uvicorn",
    "starlette",
    "websockets",
    "onnx",
    "onnxruntime",
    "sounddevice",
    "pylsl",
    "serial",
    "pooch",
)
EXTRAS += (
    "requests",
    "dask",
    "distributed",
    "h5py",
    "pynwb",
    "neo",
    "elephant",
    "rosbags",
    "rerun",
)
LIVE = "import sys, afferents.live.outlets; print('torch' in sys.modules)"


def run_without(removed, left_out):
    code = WITHOUT.format(removed=removed, left_out=left_out)
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    assert "inspect" in said.stdout


@pytest.mark.parametrize("wing", WINGS)
def test_the_package_works_without_a_wing(wing):
    run_without((wing,), (*PROGRAMS, *WINGS))


def test_everything_but_the_guard_of_the_page_is_imported_without_extras():
    run_without(EXTRAS, (*PROGRAMS, "afferents.live.web.guard"))


def test_live_does_not_wait_for_pytorch():
    said = subprocess.run([sys.executable, "-c", LIVE], capture_output=True, text=True, check=True)
    assert said.stdout.split() == ["False"]
