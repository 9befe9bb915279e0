"""One command at a time writes an output; what a dead one left is taken over."""

import json
import os
import subprocess
import sys
import threading
import time

import pytest

from afferents import outputs as locks
from afferents.errors import InputError
from afferents.files import Owner, tagged, this_process
from afferents.outputs import LOCK, is_locked, is_locked_by, writing_alone


def content_of(owner, **changed):
    return json.dumps(
        {**owner._asdict(), "command": "extract", "since": 0.0, "token": "x"} | changed
    )


def long_ago(path, seconds=3600):
    os.utime(path, (time.time() - seconds,) * 2)


@pytest.fixture
def dead():
    """A process that has ended."""
    done = subprocess.Popen([sys.executable, "-c", "pass"])
    done.wait()
    return this_process()._replace(pid=done.pid, started=1)


def test_a_second_writer_is_refused_in_a_sentence_that_names_the_first(tmp_path):
    with (
        writing_alone(tmp_path / "out", "extract"),
        pytest.raises(
            InputError, match=rf"'extract' at work there since .*process {os.getpid()} on"
        ),
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
    assert tmp_path.is_dir()


def test_the_lock_of_a_process_that_has_ended_is_taken_over_at_once(tmp_path, dead):
    (tmp_path / LOCK).write_text(content_of(dead))
    assert not is_locked(tmp_path)
    with writing_alone(tmp_path, "extract"):
        assert json.loads((tmp_path / LOCK).read_text())["pid"] == os.getpid()
    assert not (tmp_path / LOCK).exists()


def test_a_later_process_of_the_same_number_is_not_the_owner(tmp_path):
    mine = this_process()
    (tmp_path / LOCK).write_text(content_of(mine._replace(started=mine.started + 1)))
    with writing_alone(tmp_path, "extract"):
        pass


def test_of_another_host_only_the_heartbeat_tells(tmp_path):
    elsewhere = Owner("elsewhere", os.getpid(), 1)
    (tmp_path / LOCK).write_text(content_of(elsewhere))
    with pytest.raises(InputError, match="on elsewhere"), writing_alone(tmp_path, "extract"):
        pass
    long_ago(tmp_path / LOCK)
    with writing_alone(tmp_path, "extract"):
        pass


@pytest.mark.parametrize("text", ["", "[]", "{", '{"host": 5}'])
def test_a_lock_that_says_nothing_counts_by_its_heartbeat_too(tmp_path, text):
    (tmp_path / LOCK).write_text(text)
    with pytest.raises(InputError, match="at work there"), writing_alone(tmp_path, "extract"):
        pass
    long_ago(tmp_path / LOCK)
    with writing_alone(tmp_path, "extract"):
        pass


def test_the_heart_beats(tmp_path):
    with writing_alone(tmp_path, "extract", beat_s=0.01):
        long_ago(tmp_path / LOCK)
        until = time.monotonic() + 20
        while time.time() - (tmp_path / LOCK).stat().st_mtime > 60:
            assert time.monotonic() < until, "no heartbeat"
            time.sleep(0.01)


def test_a_lock_that_another_took_over_is_left_to_it(tmp_path):
    with writing_alone(tmp_path, "extract"):
        (tmp_path / LOCK).write_text(content_of(Owner("elsewhere", 1, 1)))
    assert (tmp_path / LOCK).exists()


def test_of_many_that_take_over_at_once_one_has_it(tmp_path, dead):
    for _ in range(20):
        (tmp_path / LOCK).write_text(content_of(dead))
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


def test_a_name_says_who_wrote_it():
    mine = this_process()
    assert tagged(f".partial-50-{mine.tag()}-0123abcd") == mine
    other = mine._replace(host="elsewhere")
    assert tagged(f".partial-50-{other.tag()}-0123abcd").host == ""
    assert tagged(".partial-50-abc") is None


def test_no_flock_on_this_file_system(tmp_path, monkeypatch, dead):
    def fails(*_):
        raise OSError("no locks available")

    monkeypatch.setattr(locks.fcntl, "flock", fails)
    (tmp_path / LOCK).write_text(content_of(dead))
    with writing_alone(tmp_path, "extract"):
        assert is_locked(tmp_path)


def test_its_token_tells_a_folder_from_another_of_the_same_path(tmp_path):
    with writing_alone(tmp_path / "one", "extract") as token:
        assert is_locked_by(tmp_path / "one", token)
        with writing_alone(tmp_path / "other", "extract"):
            assert not is_locked_by(tmp_path / "other", token)
    assert not is_locked_by(tmp_path / "one", token)
