"""Files are written whole or not at all, and never over what is somebody's."""

import errno
import os

import pytest

from afferents.errors import InputError
from afferents.files import holds_only, remove_partials, safe_names, write_aside, write_json


def test_a_failed_write_leaves_the_earlier_file(tmp_path):
    target = tmp_path / "a.json"
    write_json(target, {"a": 1})
    with pytest.raises(ValueError, match="not JSON"):
        write_json(target, {"a": float("nan")})
    assert target.read_text() == '{\n  "a": 1\n}\n'

    def write_half():
        with write_aside(tmp_path / "fold") as partial:
            partial.mkdir()
            (partial / "half").write_text("x")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_partials_of_a_killed_run_are_removed(tmp_path):
    (tmp_path / "3" / ".partial-50-abc").mkdir(parents=True)
    (tmp_path / "3" / "50").mkdir()
    (tmp_path / ".partial-summary").write_text("x")
    remove_partials(tmp_path)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["3", "50"]


def test_a_folder_is_replaced_only_by_what_it_holds(tmp_path):
    def write(**options):
        with write_aside(tmp_path / "fold", **options) as partial:
            partial.mkdir()
            (partial / "fold.json").write_text("new")

    write()
    with pytest.raises(InputError, match="found a folder"):
        write()
    write(replaces=holds_only("fold.json"))
    assert (tmp_path / "fold" / "fold.json").read_text() == "new"
    (tmp_path / "fold" / "notes.txt").write_text("precious")
    with pytest.raises(InputError, match="a folder that holds something else"):
        write(replaces=holds_only("fold.json"))
    assert (tmp_path / "fold" / "notes.txt").read_text() == "precious"
    assert [p.name for p in tmp_path.iterdir()] == ["fold"]


def test_a_file_never_replaces_a_folder_or_a_device(tmp_path):
    (tmp_path / "d").mkdir()
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "nowhere").symlink_to("not/there")
    (tmp_path / "loop").symlink_to("loop")
    found = {"d": "a folder", "pipe": "a device", "nowhere": "leads nowhere", "loop": "leads"}
    for name, said in found.items():
        with pytest.raises(InputError, match=said):
            write_json(tmp_path / name, {})
    assert (tmp_path / "pipe").is_fifo()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["d", "loop", "nowhere", "pipe"]


def test_a_link_stays_a_link_and_long_names_have_temporary_names_that_fit(tmp_path):
    real = tmp_path / ("x" * 250)
    (tmp_path / "link").symlink_to(real)
    write_json(real, {})
    write_json(tmp_path / "link", {"a": 1})
    assert (tmp_path / "link").is_symlink()
    assert "1" in real.read_text()
    assert len([*tmp_path.iterdir()]) == 2


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), "no space left on the disk"),
        (OSError(errno.EFBIG, "File too large"), "a limit to the size of files"),
        (OSError("12 requested and 3 written"), "a write that was cut short"),
    ],
)
def test_a_full_disk_is_said_with_the_files_name(tmp_path, error, sentence):
    def write():
        with write_aside(tmp_path / "a.stl") as partial:
            partial.write_text("half")
            raise error

    with pytest.raises(InputError, match=rf"a\.stl: .*{sentence}.*before is untouched"):
        write()
    assert list(tmp_path.iterdir()) == []


def test_an_error_of_what_is_read_stays_what_it_is(tmp_path):
    def copy():
        with write_aside(tmp_path / "out"):
            (tmp_path.parent / "not there").read_bytes()

    with pytest.raises(FileNotFoundError):
        copy()


def test_safe_names_stay_apart():
    names = {"a/b_c": "a_b_c", "a_b/c": "a_b_c-2", "a:b_c": "a_b_c-3", "a_b_c-2": "a_b_c-2-2"}
    assert safe_names([*names, "a/b_c"]) == names
