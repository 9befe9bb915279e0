"""What Numba compiles works where it can be kept, and where it can't."""

import runpy
import sys
from pathlib import Path

import numba
import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="homes are found otherwise there")
TWICE = """
from afferents.compiled import compiled

@compiled(nogil=True)
def twice(x):
    return 2 * x
"""


@pytest.fixture
def kept_at(tmp_path, monkeypatch):
    """Let a function be compiled of a file beside which nothing can be kept; return where it is."""
    script = tmp_path / "package/script.py"
    script.parent.mkdir()
    script.write_text(TWICE)
    (script.parent / "__pycache__").touch()  # root may write into any folder, but not into a file
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    monkeypatch.chdir(tmp_path)

    def compile_with(home):
        if home is None:
            monkeypatch.delenv("HOME")
        else:
            monkeypatch.setenv("HOME", str(home))
        monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
        twice = runpy.run_path(str(script))["twice"]
        assert twice(21) == 42
        return twice.stats.cache_path

    return compile_with


def test_it_is_kept_in_the_home(kept_at, tmp_path):
    assert Path(kept_at(tmp_path)).is_relative_to(tmp_path)


def test_a_home_that_cannot_be_written_keeps_nothing(kept_at, tmp_path):
    assert kept_at(tmp_path / "package/script.py") is None


def test_without_a_home_nothing_is_written_where_the_command_runs(kept_at, tmp_path, monkeypatch):
    def unknown(number):
        raise KeyError(number)

    monkeypatch.setattr("pwd.getpwuid", unknown)
    assert kept_at(None) is None
    assert [path.name for path in tmp_path.iterdir()] == ["package"]
