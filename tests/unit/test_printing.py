"""Commands whose words nobody can take: one sentence or none, never a traceback."""

import os
import subprocess
import sys

import pytest

from afferents.evaluation.fold_files import FoldKey
from afferents.evaluation.job_status import plan
from afferents.files import write_json

pytestmark = pytest.mark.system

ASCII = {"LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.fixture
def results(tmp_path):
    """An evaluation that has failed at a name that no ASCII terminal can spell."""
    plan(tmp_path, [FoldKey.of("vib-te", "nested", 0, 10.0)], workers=1)
    write_json(tmp_path / "folds/vib-te/nested/seed-0/10.failed", {"why": "é – \udcff"})
    return tmp_path


def afferents(*arguments, **how):
    command = [sys.executable, "-m", "afferents", *arguments]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **how}
    done = subprocess.run(command, check=False, **pipes)
    return done.returncode, done.stdout or b"", done.stderr or b""


@pytest.mark.parametrize(
    ("changed", "printed"),
    [
        (ASCII, rb"\xe9 \u2013 ?"),
        ({"PYTHONIOENCODING": "latin-1"}, rb"\u2013 ?"),
        ({"PYTHONUTF8": "1"}, b"\xc3\xa9 \xe2\x80\x93 ?"),
    ],
)
def test_a_terminal_of_few_letters(results, changed, printed):
    code, out, err = afferents("status", results, env={**os.environ, **changed})
    assert (code, err) == (0, b"")
    assert printed in out


def test_a_name_that_is_no_text_in_an_ascii_terminal():
    name = b"no/\xff\xc3\xa9"
    code, _, err = afferents("status", name, env={**os.environ, **ASCII})
    assert code == 2
    assert err.startswith(rb"afferents: no/\udcff\udcc3\udca9: expected ")


def test_stdout_that_is_full(results):
    with open("/dev/full", "wb") as full:  # noqa: PTH123
        code, _, err = afferents("status", results, stdout=full)
    assert code == 2
    assert err == (
        b"afferents: stdout: expected room for what the command says, "
        b"found No space left on device\n"
    )


def test_a_reader_that_left_has_heard_enough(results):
    read, write = os.pipe()
    os.close(read)
    code, _, err = afferents("status", results, stdout=write)
    os.close(write)
    assert (code, err) == (1, b"")


@pytest.mark.parametrize("stream", [1, 2])
def test_streams_that_are_closed(results, stream):
    code, _, err = afferents("status", results, preexec_fn=lambda: os.close(stream))
    assert (code, err) == (0, b"")
