"""Beside LeRobot: versions that suit both exist, by what the packages say they need."""

import shutil
import subprocess
from pathlib import Path

import pytest

pytestmark = pytest.mark.system
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def versions(tmp_path):
    """Return the versions, by name, that uv finds for what is asked; nothing is installed."""
    uv = shutil.which("uv")
    if uv is None:
        pytest.skip("needs uv (pip install uv)")

    def find(asked, *options):
        (tmp_path / "asked.txt").write_text(asked)
        command = [uv, "pip", "compile", "--quiet", "--no-header", "--no-annotate"]
        done = subprocess.run(
            [*command, "--python-version", "3.12", *options, "asked.txt"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )
        if "Failed to fetch" in done.stderr:
            pytest.skip("needs PyPI")
        assert done.returncode == 0, done.stderr
        return dict(line.split("==") for line in done.stdout.splitlines() if "==" in line)

    return find


@pytest.mark.parametrize("version", ["0.6.1", "newest"])
def test_one_environment_holds_the_lab_and_all_of_lerobot(versions, version):
    if version == "newest":
        version = versions("lerobot", "--no-deps")["lerobot"]
    lab = (str(ROOT / "pyproject.toml"), "--extra", "lab")
    found = versions(f"lerobot[all]=={version}", *lab)
    assert {"numba", "onnxruntime", "torch"} <= set(found)
