import pytest

from afferents.core.files import remove_partials, write_aside, write_json


def test_a_failed_write_leaves_the_earlier_file(tmp_path):
    target = tmp_path / "a.json"
    write_json(target, {"a": 1})
    with pytest.raises(ValueError, match="not JSON"):
        write_json(target, {"a": float("nan")})
    assert target.read_text() == '{\n  "a": 1\n}\n'
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_failed_folder_leaves_nothing(tmp_path):
    def write_half():
        with write_aside(tmp_path / "fold") as partial:
            partial.mkdir()
            (partial / "half").write_text("x")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert list(tmp_path.iterdir()) == []


def test_partials_of_a_killed_run_are_removed(tmp_path):
    (tmp_path / "3" / ".partial-50-abc").mkdir(parents=True)
    (tmp_path / "3" / "50").mkdir()
    (tmp_path / ".partial-summary").write_text("x")
    remove_partials(tmp_path)
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["3", "50"]
