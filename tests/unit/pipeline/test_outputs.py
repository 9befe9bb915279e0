"""What stands where a command is to write: replaced only if it is ours, of the kind, and asked."""

import json
import os
import shutil

import pytest

from afferents.errors import InputError
from afferents.models.card import CARD, WEIGHTS
from afferents.models.export import _is_exported
from afferents.models.folder import is_model_folder
from afferents.outputs import is_our_picture, require_free, require_picture_folder

from ...conftest import shift_px


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


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


def test_a_drum_is_replaced_by_a_drum_if_asked(fails, run, tmp_path):
    path = tmp_path / "g.stl"
    assert run("drum", "g", path)[0] == 0
    before = path.read_bytes()
    assert "found an earlier one; add --force to replace it" in fails("drum", "0", path)
    assert path.read_bytes() == before
    assert run("drum", "0", path, "--force")[0] == 0
    assert path.read_bytes() != before


def test_a_sensor_file_and_its_picture_are_replaced_only_if_both_are_ours(
    fails, run, clip, tmp_path
):
    command = ("calibrate", clip, "--out", tmp_path / "mine.toml")
    (tmp_path / "mine.png").write_bytes(b"a photograph")
    assert "mine.png: expected a name that is free" in fails(*command, "--force")
    (tmp_path / "mine.png").unlink()
    assert run(*command)[0] == 0
    assert is_our_picture(tmp_path / "mine.png")
    assert "add --force" in fails(*command)
    assert run(*command, "--force")[0] == 0


def test_an_overlay_and_tracks_are_replaced_if_asked(fails, run, clip, tmp_path):
    command = ("inspect", clip, "--out", tmp_path / "p", "--overlay", tmp_path / "o.mp4", "--quiet")
    assert run(*command)[0] == 0
    assert "add --force" in fails(*command)
    assert run(*command, "--force")[0] == 0  # earlier pictures too
    (tmp_path / "p" / "markers.png").write_bytes(b"a photograph")
    assert "markers.png: expected a name that is free" in fails(*command, "--force")
    assert (tmp_path / "p" / "markers.png").read_bytes() == b"a photograph"
    track = ("track", clip, tmp_path / "t.zarr", "--quiet")
    assert run(*track)[0] == 0
    assert "add --force" in fails(*track)
    assert run(*track, "--force")[0] == 0


@pytest.mark.parametrize(
    "command",
    [
        ("extract", "SESSION", "d"),
        ("simulate", "d", "--textures", "a", "--speeds", "40"),
        ("evaluate", "STORE", "--out", "d", "--models", "vib-te"),
        ("train", "STORE", "d", "--model", "vib-te"),
        ("extract", "SESSION", "f"),
        ("simulate", "f", "--textures", "a", "--speeds", "40"),
        ("evaluate", "STORE", "--out", "f", "--models", "vib-te"),
        ("train", "STORE", "f", "--model", "vib-te"),
        ("extract", "SESSION", "SESSION"),
        ("evaluate", "STORE", "--out", "STORE", "--models", "vib-te"),
        ("train", "STORE", "STORE", "--model", "vib-te"),
    ],
)
def test_folders_of_something_else_are_left_alone(
    fails, sounds, stores, precious, tmp_path, command
):
    store = shutil.copytree(stores["audio"], tmp_path / "s.zarr")
    session = shutil.copytree(sounds, tmp_path / "session")
    places = {"SESSION": session, "STORE": store, "d": precious / "d", "f": precious / "f"}
    before = contents(tmp_path)
    fails(*(places.get(word, word) for word in command), "--quiet")
    assert contents(tmp_path) == before


def test_a_model_is_known_by_its_card_and_by_holding_nothing_else(tmp_path):
    model = tmp_path / "m"
    model.mkdir()
    (model / CARD).write_text("{}")
    (model / WEIGHTS).write_bytes(b"")
    assert is_model_folder(model)
    require_free(model, "a model", is_model_folder, force=True)
    with pytest.raises(InputError, match="what the command reads"):
        require_free(model, "a model", is_model_folder, force=True, reads=[model / CARD])
    (model / "notes.txt").write_text("precious")
    with pytest.raises(InputError, match="a folder that holds something else"):
        require_free(model, "a model", is_model_folder, force=True)


def test_an_exported_model_is_known_by_the_card_in_it(tmp_path):
    (tmp_path / "a.onnx").write_bytes(b"\x08\x0a...." + b'{"format":"afferents model",...}')
    (tmp_path / "b.onnx").write_bytes(b"\x08\x0a another network")
    (tmp_path / CARD).write_text(json.dumps({"format": "afferents model"}, indent=2))
    assert [_is_exported(tmp_path / name) for name in ("a.onnx", "b.onnx", CARD)] == [
        True, False, False,
    ]  # fmt: skip


def test_a_picture_folder_that_leads_nowhere(precious):
    for name, found in {"nowhere": "leads nowhere", "f": "no folder", "d": "notes.txt"}.items():
        with pytest.raises(InputError, match=found):
            require_picture_folder(precious / name)
