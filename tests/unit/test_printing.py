"""Streams of few letters, and streams that take nothing: one sentence or none, no traceback."""

import io
import os
import subprocess
import sys

import pytest

from afferents import progress
from afferents.evaluation.fold_files import FoldKey, write_plan
from afferents.files import write_json
from afferents.progress import Progress, flush_streams, prepare_streams, printable

ASCII = {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


class Full(io.StringIO):
    """Takes nothing."""

    def write(self, text):
        raise OSError(28, "No space left on device")

    def flush(self):
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_every_letter_can_be_printed(monkeypatch, encoding):
    stream = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stream)
    prepare_streams()
    stream.write("a \udcff –")
    stream.flush()
    assert stream.buffer.getvalue().startswith(rb"a \udcff ")
    assert printable("é\udcff") == r"é\udcff"


def test_what_is_not_taken_is_told_and_progress_is_shown_if_it_can_be(monkeypatch):
    assert flush_streams() is None
    monkeypatch.setattr(sys, "stdout", Full())
    assert flush_streams().strerror == "No space left on device"
    monkeypatch.setattr(sys, "stderr", Full())
    with Progress() as shown:
        shown.note("nobody reads it")
        assert list(shown.track("ab", "working", 2)) == ["a", "b"]


def lines_of(marks, capsys, monkeypatch, **how):
    """What is said of a task that is marked at these times, (s, completed, text)."""
    now_s = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s[0])
    with Progress(**how) as shown, shown.task("learning", 20) as mark:
        for now_s[0], done, text in marks:
            mark(done, text)
    said = capsys.readouterr().err
    assert not {"\r", "\x1b"} & {*said}
    return said.splitlines()


def test_in_a_pipe_progress_is_lines(capsys, monkeypatch):
    """A tenth, or half a minute; a task that is quick has no more than a line a second."""
    steady = [(10.0 * done, done, "fold 3") for done in range(21)]
    begins, *some, ends = lines_of(steady, capsys, monkeypatch)
    assert (begins, ends) == ("learning ...", "learning: done, 0:03:20")
    assert some[0] == "learning: 10%, 0:00:20, left 0:03:00, fold 3"
    assert [line.split()[1] for line in some] == [f"{10 * k}%," for k in range(1, 10)]
    slow = [(40.0 * done, done / 10, "") for done in range(5)]
    assert lines_of(slow, capsys, monkeypatch)[1] == "learning: 0%, 0:00:40, left 2:12:40"
    quick = [(0.02 * done, done, "") for done in range(21)]
    assert lines_of(quick, capsys, monkeypatch) == ["learning ...", "learning: done, 0:00:00"]
    assert lines_of(steady, capsys, monkeypatch, quiet=True) == []
    with pytest.raises(ZeroDivisionError), Progress() as shown:
        sum(1 / one for one in shown.track([0], "trying", 1))
    assert capsys.readouterr().err == "trying ...\n", "what failed is not done"


@pytest.fixture
def status(tmp_path):
    """Ask for an evaluation that has failed at a name that no ASCII terminal can spell."""
    write_plan(tmp_path, [FoldKey.of("vib-te", "nested", 0, 10.0)], workers=1)
    write_json(tmp_path / "folds/vib-te/nested/seed-0/10.failed", {"why": "é – \udcff"})

    def ask(folder=tmp_path, changed=None, **how):
        command = [sys.executable, "-m", "afferents", "status", folder]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **how}
        done = subprocess.run(command, env={**os.environ, **(changed or {})}, **pipes)
        return done.returncode, done.stdout or b"", done.stderr or b""

    return ask


@pytest.mark.system
def test_a_terminal_of_few_letters(status):
    code, out, err = status(changed=ASCII)
    assert (code, err) == (0, b"")
    assert rb"\xe9 \u2013 ?" in out
    code, _, err = status(b"no/\xff\xc3\xa9", ASCII)
    assert code == 2
    assert err.startswith(rb"afferents: no/\udcff\udcc3\udca9: expected ")


@pytest.mark.system
def test_stdout_that_is_full(status):
    with open("/dev/full", "wb") as full:  # noqa: PTH123
        code, _, err = status(stdout=full)
    said = b"stdout: expected room for what the command says, found No space left on device"
    assert (code, err) == (2, b"afferents: " + said + b"\n")


@pytest.mark.system
def test_a_reader_that_left_has_heard_enough(status):
    read, write = os.pipe()
    os.close(read)
    code, _, err = status(stdout=write)
    os.close(write)
    assert (code, err) == (1, b"")


@pytest.mark.system
@pytest.mark.parametrize("stream", [1, 2])
def test_streams_that_are_closed(status, stream):
    code, _, err = status(preexec_fn=lambda: os.close(stream))
    assert (code, err) == (0, b"")


@pytest.mark.system
def test_no_warning_of_a_library_reaches_the_terminal():
    script = (
        "import logging, warnings; from afferents.progress import silence_libraries\n"
        "silence_libraries()\n"
        "warnings.warn('Glyph 24067 missing'); logging.getLogger('matplotlib').warning('Bad key')"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
