"""What works without: the wings, the extras, PyTorch; what waits for no heavy package."""

import subprocess
import sys

import pytest

import afferents

pytestmark = pytest.mark.system

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
cli.run(['inspect', '--help'])
"""
HELP = """
import sys
from afferents.cli import run
run(['--help'])
print(*sys.modules)
"""
WINGS = ("afferents.lab", "afferents.neuro", "afferents.robots")
EXTRAS = (
    "onnx", "onnxscript", "pyarrow", "skops", "pylsl", "serial", "requests", "dask", "distributed",
    "h5py", "pynwb", "neo", "elephant", "rosbags", "rerun", "onnxruntime", "sounddevice",
    "starlette", "uvicorn", "websockets",
)  # fmt: skip
HEAVY = {"torch", "xarray", "pandas", "scipy", "cv2", "numba", "av", "matplotlib", "sklearn"}


def printed_by(code):
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    return said.stdout


@pytest.mark.parametrize(
    ("removed", "left_out"),
    [*(((wing,), WINGS) for wing in WINGS), (EXTRAS, ("afferents.lab.live.web.application",))],
)
def test_the_package_works_without(removed, left_out):
    code = WITHOUT.format(removed=removed, left_out=("afferents.__main__", *left_out))
    assert "inspect" in printed_by(code)


def test_help_and_live_do_not_wait_for_heavy_packages():
    """They take most of a second to import; a mistyped word should not wait for it."""
    loaded = set(printed_by(HELP).splitlines()[-1].split())
    assert "cyclopts" in loaded
    assert not loaded & (HEAVY | {"importlib.metadata"})
    live = "import sys, afferents.lab.live.outlets; print('torch' in sys.modules)"
    assert printed_by(live).split() == ["False"]


def test_every_exported_name_is_there_and_internals_are_not_offered():
    assert set(afferents.__all__) <= set(dir(afferents))
    assert all(getattr(afferents, name) is not None for name in afferents.__all__)
    assert not {"predict", "build"} & set(dir(afferents))
    printed_by(
        "import afferents.plot as p; from afferents import plot; assert p is plot; p.markers"
    )
