"""The command line starts without what only commands need."""

import subprocess
import sys

import pytest

HEAVY = {"torch", "xarray", "pandas", "scipy", "cv2", "numba", "av", "matplotlib", "sklearn"}
HEAVY |= {"importlib.metadata"}
ASK = (
    "import sys; from afferents.cli import app\n"
    "try: app(['--help'], prog_name='afferents')\n"
    "except SystemExit: pass\n"
    "print(*sys.modules)"
)


@pytest.mark.system
def test_help_needs_no_heavy_package():
    """They take most of a second to import; `--help` and a mistyped word should not wait for it."""
    said = subprocess.run([sys.executable, "-c", ASK], capture_output=True, text=True, check=True)
    loaded = set(said.stdout.splitlines()[-1].split())
    assert "typer" in loaded
    assert not loaded & HEAVY
