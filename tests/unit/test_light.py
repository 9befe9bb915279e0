"""Without an extra's packages all else works, and what needs them says what to install."""

import pytest

from ..hiding import runner

pytestmark = pytest.mark.system
OF_TRAIN = ("torch", "sklearn", "skops", "safetensors", "onnx", "pyarrow")
OF_LAB = ("onnxruntime", "serial", "sounddevice", "starlette", "uvicorn", "websockets")
NEEDS = "expected the packages of the extra 'train', found No module named"
INSTALLS_LAB = "pip install 'afferents[lab]'"


@pytest.fixture
def light(tmp_path):
    """Run a command, or Python, where the packages of learning can't be imported."""
    return runner(tmp_path, OF_TRAIN)


@pytest.fixture
def bare(tmp_path):
    """The same without those of the lab as well."""
    return runner(tmp_path, OF_TRAIN + OF_LAB)


def test_recordings_markers_and_stores_need_no_extra(bare, session, tmp_path):
    clip = session / "1/20/video.mp4"
    for command in (
        ("--help",),
        ("inspect", session),
        ("calibrate", clip, "--out", "mine.toml"),
        ("track", clip, "tracks.nc"),
        ("extract", session, "s.zarr", "--workers", "1", "--quiet"),
        ("simulate", "rig", "--textures", "a", "--speeds", "50", "--seconds", "2"),
    ):
        ended = bare(*command)
        assert ended.returncode == 0, (command, ended.stderr)
    assert (tmp_path / "s.zarr").is_dir()


def test_what_meets_devices_or_shows_a_page_says_what_to_install(bare, session, tmp_path):
    clip = session / "1/20/video.mp4"
    (tmp_path / "m.onnx").touch()
    assert bare("record", "PLAN.toml", "--example").returncode == 0
    for command in (
        ("live", "--video", clip, "--web"),
        ("live", "--video", clip, "--model", "m.onnx"),
        ("live", "--video", clip, "--audio", "mic:default"),
        ("record", "PLAN.toml", "out", "--dry-run", "--web"),
    ):
        ended = bare(*command)
        assert ended.returncode == 2, command
        assert INSTALLS_LAB in ended.stderr, (command, ended.stderr)
        assert "Traceback" not in ended.stderr
    ended = bare("devices")
    assert ended.returncode == 0
    assert " ".join(ended.stdout.split()).count(INSTALLS_LAB) == 2  # microphones, serial ports


def test_the_signals_of_a_clip_need_no_extra(bare, session):
    clip = session / "1/20/video.mp4"
    ended = bare("live", "--video", clip, "--signals", "sa1", "--speed", "max")
    assert ended.returncode == 0, ended.stderr
    assert ended.stdout.startswith("{")


@pytest.mark.parametrize(
    "command",
    [
        ("evaluate", "s.zarr", "--out", "r"),
        ("train", "s.zarr", "m"),
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
    assert "pip install 'afferents[train]'; docs/install.md" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_what_reads_or_writes_parquet_says_what_to_install(light, tmp_path):
    (tmp_path / "x.parquet").touch()
    for arguments in (
        ("export-lerobot", "s.zarr", "out"),
        ("-c", "import afferents; afferents.read_spikes('x.parquet')"),
        (
            "-c",
            "from pathlib import Path; from afferents.recordings.description import Signal;"
            "from afferents.recordings.tables import read_table;"
            "read_table(Path('x.parquet'), Signal())",
        ),
    ):
        said = light(*arguments).stderr
        assert "expected the packages of the extra 'parquet', found No module" in said, said
        assert "pip install 'afferents[parquet]'" in said


def test_results_say_what_reads_them(light):
    """A report of a folder that is none says so first."""
    code = "from pathlib import Path; from afferents.evaluation.results import read_predictions;"
    ended = light("-c", f"{code} read_predictions(Path('r/predictions.parquet'))")
    assert f"{NEEDS} 'pyarrow'" in ended.stderr


def test_functions_that_learn_say_it_too(light):
    ended = light("-c", "import afferents; afferents.train")
    assert f"InputError: afferents.train: {NEEDS} 'torch'" in ended.stderr
    ended = light("-c", "import afferents; afferents.evaluate('s.zarr', 'r')")
    assert f"InputError: evaluate: {NEEDS} 'torch'" in ended.stderr


def test_an_error_of_ours_is_not_hidden_behind_the_missing_package(light):
    raising = "def fail(): raise RuntimeError('of ours')"
    ended = light(
        "-c", f"from afferents.cli import errors\n{raising}\nerrors.run_to_exit_code(fail, 0)"
    )
    assert ended.stderr.endswith("RuntimeError: of ours\n")
    assert "torch" not in ended.stderr
