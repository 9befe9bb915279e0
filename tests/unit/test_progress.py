"""Streams of few letters, and streams that take nothing."""

import io
import os
import subprocess
import sys

import pytest

from afferents.progress import Progress, flush_streams, prepare_streams, printable


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


def test_a_closed_stream_is_no_stream(monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    prepare_streams()
    assert sys.stdout.write("nobody hears it")
    sys.stdout.close()


def test_progress_is_shown_if_it_can_be(monkeypatch):
    monkeypatch.setattr(sys, "stderr", Full())
    with Progress() as progress:
        progress.note("nobody reads it")
        assert list(progress.track("ab", "working", 2)) == ["a", "b"]


def test_what_stdout_did_not_take_is_told(monkeypatch):
    assert flush_streams() is None
    with open("/dev/full", "w", encoding="utf-8") as full:  # noqa: PTH123
        monkeypatch.setattr(sys, "stdout", full)
        full.write("a")
        fault = flush_streams()
        assert fault is not None
        assert fault.strerror == "No space left on device"


def test_names_that_are_no_text_can_be_written():
    assert printable("é\udcff") == r"é\udcff"


@pytest.mark.system
def test_what_is_started_has_a_stream_for_a_closed_one():
    script = (
        "import subprocess, sys\n"
        "from afferents.progress import prepare_streams\n"
        "prepare_streams()\n"
        "sys.exit(subprocess.call([sys.executable, '-c', 'import os; os.fstat(2)']))"
    )
    one = subprocess.run([sys.executable, "-c", script], preexec_fn=lambda: os.close(2))
    assert one.returncode == 0
