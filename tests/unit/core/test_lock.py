"""One command at a time writes an output; what a dead one left does not keep anybody out."""

import os
import subprocess
import sys
import threading
import time

import pytest

from afferents.errors import InputError
from afferents.outputs import LOCK, is_locked, writing_alone


def test_a_second_writer_is_refused_in_a_sentence_that_names_the_first(tmp_path):
    with (
        writing_alone(tmp_path / "out", "extract"),
        pytest.raises(InputError, match=rf"'extract' since .*process {os.getpid()} on .* at work"),
        writing_alone(tmp_path / "out", "simulate"),
    ):
        pass
    assert not (tmp_path / "out").exists()  # nothing was written into it


def test_what_was_written_stays_and_the_lock_goes(tmp_path):
    with writing_alone(tmp_path / "out", "extract"):
        (tmp_path / "out" / "result").write_text("x")
        assert is_locked(tmp_path / "out")
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["result"]


def test_a_folder_that_was_there_stays_even_if_it_is_empty(tmp_path):
    with writing_alone(tmp_path, "extract"):
        pass
    assert list(tmp_path.iterdir()) == []


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


def test_of_many_at_once_one_has_it(tmp_path):
    for _ in range(20):
        start, held, most, refused = threading.Barrier(8), [], [], []

        def take(start=start, held=held, most=most, refused=refused):
            start.wait()
            try:
                with writing_alone(tmp_path, "extract"):
                    held.append(1)
                    most.append(len(held))
                    time.sleep(0.005)
                    held.pop()
            except InputError:
                refused.append(1)

        threads = [threading.Thread(target=take) for _ in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert max(most) == 1
        assert len(most) + len(refused) == 8


def test_a_file_where_the_folder_should_be(tmp_path):
    (tmp_path / "out").write_text("precious")
    with pytest.raises(InputError, match="something else of that name"):
        writing_alone(tmp_path / "out", "extract").__enter__()
    assert (tmp_path / "out").read_text() == "precious"
