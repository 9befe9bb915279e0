"""Without PyTorch and scikit-learn: all but learning works, and learning says what to install."""

import os
import subprocess
import sys

import pytest

HIDING = """
import sys
from importlib.abc import MetaPathFinder


class Hidden(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {"torch", "sklearn", "skops", "safetensors", "onnx"}:
            raise ModuleNotFoundError(f"No module named '{name}'", name=name)


sys.meta_path.insert(0, Hidden())
"""
NEEDS = "expected the packages of the extra 'train', found No module named"


@pytest.fixture
def light(tmp_path):
    """Run a command, or Python, where the packages of learning can't be imported."""
    (tmp_path / "hidden").mkdir()
    (tmp_path / "hidden/sitecustomize.py").write_text(HIDING)
    paths = [str(tmp_path / "hidden"), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}

    def run(*arguments):
        arguments = list(map(str, arguments))
        command = [
            sys.executable,
            *(arguments if arguments[0] == "-c" else ["-m", "afferents", *arguments]),
        ]
        return subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )

    return run


def test_recordings_markers_and_stores_need_no_learning(light, session, tmp_path):
    clip = session / "1/20/video.mp4"
    for command in (
        ("inspect", session),
        ("calibrate", clip, "--out", "mine.toml"),
        ("track", clip, "tracks.nc"),
        ("extract", session, "s.zarr", "--workers", "1", "--quiet"),
        ("simulate", "rig", "--textures", "a", "--speeds", "50", "--seconds", "2"),
    ):
        ended = light(*command)
        assert ended.returncode == 0, (command, ended.stderr)
    assert (tmp_path / "s.zarr").is_dir()


@pytest.mark.parametrize(
    "command",
    [
        ("evaluate", "s.zarr", "--out", "r"),
        ("train", "s.zarr", "m"),
        ("report", "r"),
        ("explain", "m", "s.zarr", "--out", "w"),
        ("export", "m", "m.onnx"),
        ("reproduce", "out"),
        ("benchmark", "run", "rig/speed", "--models", "chance"),
    ],
    ids=lambda command: command[0],
)
def test_commands_that_learn_say_what_to_install(light, command):
    ended = light(*command)
    assert ended.returncode == 2
    assert NEEDS in ended.stderr
    assert "pip install 'afferents[train]'" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_functions_that_learn_say_it_too(light):
    ended = light("-c", "import afferents; afferents.train")
    assert f"InputError: afferents.train: {NEEDS} 'torch'" in ended.stderr
    ended = light("-c", "import afferents; afferents.evaluate('s.zarr', 'r')")
    assert f"InputError: evaluate: {NEEDS} 'torch'" in ended.stderr
