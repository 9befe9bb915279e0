import subprocess
import sys
from importlib.metadata import version

import pytest

import afferents


def test_every_exported_name_is_there():
    assert set(afferents.__all__) <= set(dir(afferents))
    for name in afferents.__all__:
        assert getattr(afferents, name) is not None


@pytest.mark.system
def test_plot_is_a_module_and_internals_are_not_offered():
    code = "import afferents.plot as p; from afferents import plot; assert p is plot; p.markers"
    subprocess.run([sys.executable, "-c", code], check=True)
    assert not {"predict", "build"} & set(dir(afferents))


@pytest.mark.system
def test_the_command_line_starts_without_the_networks():
    code = "import sys, afferents.cli; print('torch' in sys.modules, 'matplotlib' in sys.modules)"
    printed = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert printed.stdout.split() == ["False", "False"]


def test_the_version_is_the_one_that_is_installed(run):
    assert afferents.__version__ == version("afferents")
    assert run("--version") == (0, f"{afferents.__version__}\n", "")
