"""What tests share is made once, and made again where it is no longer as it was."""

import pytest

from .. import kept as module
from ..kept import kept


@pytest.fixture
def made(tmp_path, monkeypatch):
    """How often something was made."""
    monkeypatch.setattr(module, "folder", lambda: tmp_path)
    return []


def test_it_is_made_once_and_again_where_it_was_spoiled(made):
    def make(folder):
        made.append(folder.name)
        (folder / "file").write_text("as it should be")

    for _ in range(2):
        with kept("thing", make) as there:
            assert (there / "file").read_text() == "as it should be"
    assert len(made) == 1
    (there / "file").write_text("cut sho")
    with kept("thing", make) as there:
        assert (there / "file").read_text() == "as it should be"
    assert len(made) == 2


def test_what_fails_leaves_nothing_that_passes_for_whole(made):
    def fail(folder):
        (folder / "half").write_text("")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), kept("thing", fail):
        pass
    with kept("thing", lambda folder: (folder / "whole").write_text("")) as there:
        assert [path.name for path in there.iterdir()] == ["whole"]


def test_who_changes_it_is_told(made):
    def change():
        with kept("thing", lambda folder: (folder / "file").write_text("1")) as there:
            (there / "file").write_text("2")

    with pytest.raises(AssertionError, match="a test has changed"):
        change()
