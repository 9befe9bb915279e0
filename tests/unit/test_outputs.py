"""What stands where a command is to write, and who writes it: one command at a time."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from afferents.errors import InputError
from afferents.files import LOCK, holds_only, is_our_picture, require_free
from afferents.models.card import CARD, WEIGHTS
from afferents.models.export import is_exported
from afferents.models.folder import is_model_folder
from afferents.outputs import is_locked, writing_alone

from ..conftest import shift_px
from ..kept import contents


@pytest.fixture
def precious(tmp_path):
    """A folder and a file that no command may touch, a pipe that stands for a device."""
    folder = tmp_path / "there"
    (folder / "d").mkdir(parents=True)
    (folder / "d" / "notes.txt").write_text("precious")
    (folder / "f").write_text("precious")
    (folder / "nowhere").symlink_to("not/there")
    os.mkfifo(folder / "pipe")
    return folder


@pytest.fixture
def clip(make_video, tmp_path):
    """A short video of the small session's form."""
    return make_video(tmp_path / "v.mp4", shift_px(1, 20, 20))


@pytest.mark.parametrize("name", ["d", "f", "pipe", "nowhere"])
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_nothing_of_a_users_is_replaced(fails, precious, clip, name, force):
    before = contents(precious)
    assert "a name that is free" in fails("drum", "g", precious / name, *force)
    overlay = ("inspect", clip, "--out", precious / "p", "--overlay", precious / name, "--quiet")
    assert "a name that is free" in fails(*overlay, *force)
    assert "a name that is free" in fails("track", clip, precious / name, "--quiet", *force)
    assert contents(precious) == before
    assert (precious / "pipe").is_fifo()
    assert (precious / "nowhere").is_symlink()
    assert not (precious / "p").exists()


def test_what_a_command_reads_is_never_its_output(fails, clip, tmp_path):
    before = clip.read_bytes()
    for force in ([], ["--force"]):
        overlay = ("inspect", clip, "--out", tmp_path / "p", "--overlay", clip, "--quiet")
        assert "found what the command reads" in fails(*overlay, *force)
        assert "found what the command reads" in fails("track", clip, clip, "--quiet", *force)
    assert clip.read_bytes() == before


@pytest.mark.parametrize(
    ("command", "picture"),
    [
        (("drum", "g", "OUT.stl"), None),
        (("track", "CLIP", "OUT.zarr", "--quiet"), None),
        (("calibrate", "CLIP", "--out", "OUT.toml"), "OUT.png"),
        (("inspect", "CLIP", "--out", "OUT", "--overlay", "OUT.mp4", "--quiet"), "OUT/markers.png"),
    ],
)
def test_an_earlier_output_is_replaced_if_asked_and_a_photograph_never(
    fails, does, clip, tmp_path, command, picture
):
    given = [str(clip) if w == "CLIP" else w.replace("OUT", f"{tmp_path}/o") for w in command]
    does(*given)
    assert "add --force" in fails(*given)
    does(*given, "--force")
    if picture:
        there = Path(picture.replace("OUT", f"{tmp_path}/o"))
        assert is_our_picture(there)
        there.write_bytes(b"a photograph")
        assert f"{there.name}: expected a name that is free" in fails(*given, "--force")
        assert there.read_bytes() == b"a photograph"


@pytest.mark.parametrize("place", ["d", "f"])
@pytest.mark.parametrize(
    "command",
    [
        ("extract", "SESSION", "PLACE"),
        ("simulate", "PLACE", "--textures", "a", "--speeds", "40"),
        ("evaluate", "STORE", "--out", "PLACE", "--models", "vib-te"),
        ("train", "STORE", "PLACE", "--model", "vib-te"),
        ("extract", "SESSION", "SESSION"),
        ("evaluate", "STORE", "--out", "STORE", "--models", "vib-te"),
        ("train", "STORE", "STORE", "--model", "vib-te"),
    ],
)
def test_folders_of_something_else_are_left_alone(
    fails, sounds, stores, precious, tmp_path, command, place
):
    store = shutil.copytree(stores["audio"], tmp_path / "s.zarr")
    session = shutil.copytree(sounds, tmp_path / "session")
    places = {"SESSION": session, "STORE": store, "PLACE": precious / place}
    before = contents(tmp_path)
    fails(*(places.get(word, word) for word in command), "--quiet")
    assert contents(tmp_path) == before


def test_a_model_is_known_by_its_card_and_by_holding_nothing_else(tmp_path):
    model = tmp_path / "m"
    model.mkdir()
    (model / CARD).write_text("{}")
    (model / WEIGHTS).write_bytes(b"")
    assert is_model_folder(model)
    require_free(model, is_model_folder)
    with pytest.raises(InputError, match="what the command reads"):
        require_free(model, is_model_folder, reads=[model / CARD])
    (model / "notes.txt").write_text("precious")
    with pytest.raises(InputError, match="a folder that holds something else"):
        require_free(model, is_model_folder)


def test_an_exported_model_is_known_by_the_card_in_it(tmp_path):
    (tmp_path / "a.onnx").write_bytes(b"\x08\x0a...." + b'{"format":"afferents model",...}')
    (tmp_path / "b.onnx").write_bytes(b"\x08\x0a another network")
    (tmp_path / CARD).write_text(json.dumps({"format": "afferents model"}, indent=2))
    assert [is_exported(tmp_path / name) for name in ("a.onnx", "b.onnx", CARD)] == [
        True, False, False,
    ]  # fmt: skip


def test_what_is_no_picture_folder(precious):
    found = {"nowhere": "leads nowhere", "f": "a file that", "d": "a folder that"}
    found |= {"f/g": "f, which is no folder", "nowhere/g": "leads nowhere"}
    for name, words in found.items():
        with pytest.raises(InputError, match=words):
            require_free(precious / name, holds_only(or_ours=is_our_picture))


def test_a_second_writer_is_refused_in_a_sentence_that_names_the_first(tmp_path):
    with (
        writing_alone(tmp_path / "out", "extract"),
        pytest.raises(InputError, match=rf"'extract' since .*process {os.getpid()} on .* at work"),
        writing_alone(tmp_path / "out", "simulate"),
    ):
        pass
    assert not (tmp_path / "out").exists()  # nothing was written into it
    with writing_alone(tmp_path / "out", "extract"):
        (tmp_path / "out" / "result").write_text("x")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["result"]


HOLD = "from afferents.outputs import writing_alone; from pathlib import Path; import sys, time\n"
HOLD += (
    "with writing_alone(Path(sys.argv[1]), 'extract'): print('held', flush=True); time.sleep(60)"
)


def test_a_process_that_was_killed_keeps_nobody_out(tmp_path):
    with subprocess.Popen([sys.executable, "-c", HOLD, tmp_path], stdout=subprocess.PIPE) as held:
        assert held.stdout.readline() == b"held\n"
        with pytest.raises(InputError, match=f"process {held.pid} on"):
            writing_alone(tmp_path, "extract").__enter__()
        held.kill()
    assert (tmp_path / LOCK).exists()
    assert not is_locked(tmp_path)
    with writing_alone(tmp_path, "extract"):
        assert is_locked(tmp_path)
    assert not (tmp_path / LOCK).exists()


def test_a_file_where_the_folder_should_be(tmp_path):
    (tmp_path / "out").write_text("precious")
    with pytest.raises(InputError, match="a file that holds something else"):
        writing_alone(tmp_path / "out", "extract").__enter__()
    assert (tmp_path / "out").read_text() == "precious"


def test_a_command_leaves_its_input_as_it_was(session, stores, tmp_path, does):
    inputs = [path for root in (session, stores["audio"]) for path in root.rglob("*")]

    def state():
        return {p: (p.stat().st_mtime_ns, p.is_file() and p.read_bytes()) for p in inputs}

    before, quiet = state(), ("--quiet", "--workers", 1)
    does("inspect", session, "--out", tmp_path / "looks", "--quiet")
    does("extract", session, tmp_path / "s.zarr", *quiet)
    does("evaluate", stores["audio"], "--out", tmp_path / "r", "--models", "vib-te", *quiet)
    does("report", tmp_path / "r", "--quiet")
    assert state() == before
