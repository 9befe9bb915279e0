"""Without PyTorch, scikit-learn and pyarrow all but learning works, which says what to install."""

import pytest

from ..hiding import runner

pytestmark = pytest.mark.system
OF_TRAIN = ("torch", "sklearn", "skops", "safetensors", "onnx", "pyarrow")
NEEDS = "expected the packages of the extra 'train', found No module named"


@pytest.fixture
def light(tmp_path):
    """Run a command, or Python, where the packages of learning can't be imported."""
    return runner(tmp_path, OF_TRAIN)


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
    assert "pip install -c constraints.txt '.[train]'; docs/install.md" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_what_reads_or_writes_parquet_says_what_to_install(light, tmp_path):
    (tmp_path / "x.parquet").touch()
    for arguments in (
        ("export-lerobot", "s.zarr", "out"),
        ("-c", "import afferents; afferents.read_spikes('x.parquet')"),
        (
            "-c",
            "from pathlib import Path; from afferents.recordings.tables import Signal, read_table;"
            "read_table(Path('x.parquet'), Signal())",
        ),
    ):
        said = light(*arguments).stderr
        assert "expected the packages of the extra 'parquet', found No module" in said, said
        assert "pip install -c constraints.txt '.[parquet]'" in said


def test_functions_that_learn_say_it_too(light):
    ended = light("-c", "import afferents; afferents.train")
    assert f"InputError: afferents.train: {NEEDS} 'torch'" in ended.stderr
    ended = light("-c", "import afferents; afferents.evaluate('s.zarr', 'r')")
    assert f"InputError: evaluate: {NEEDS} 'torch'" in ended.stderr


def test_an_error_of_ours_is_not_hidden_behind_the_missing_package(light):
    raising = "def fail(): raise RuntimeError('of ours')"
    ended = light(
        "-c", f"from afferents.cli import errors\n{raising}\nerrors.exit_code_of(fail, 0)"
    )
    assert ended.stderr.endswith("RuntimeError: of ours\n")
    assert "torch" not in ended.stderr
