"""Jobs side by side: everything comes back, errors as what they were, and no process is lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import sklearn  # noqa: F401 - sets an environment variable as it is imported

from afferents.errors import AfferentsError, InputError
from afferents.parallel import side_by_side


def square(number):
    return number**2


def refuse(number):
    raise InputError(f"a job: expected an even number, found {number}; take another")


def die(_):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize("workers", [1, 2])
def test_all_results_come_and_the_environment_is_left_as_it_was(workers):
    before = dict(os.environ)
    found = sorted(side_by_side(square, ((n,) for n in range(20)), workers))
    assert found == [n**2 for n in range(20)]
    assert dict(os.environ) == before


def folder_here():
    return Path.cwd()


@pytest.mark.parametrize("workers", [1, 2])
def test_jobs_are_done_in_the_folder_of_the_caller(workers, tmp_path, monkeypatch):
    """Relative paths mean the same there, also in processes that were started before."""
    list(side_by_side(folder_here, [()], workers))
    monkeypatch.chdir(tmp_path)
    assert list(side_by_side(folder_here, [()] * 3, workers)) == [tmp_path] * 3


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_stays_what_it_was(workers):
    with pytest.raises(InputError, match="a job: expected an even number, found 3; take another"):
        list(side_by_side(refuse, [(3,)], workers))


@pytest.mark.system
def test_a_process_that_died_is_one_sentence():
    with pytest.raises(AfferentsError, match=r"a worker process died, and again .* fewer --work"):
        list(side_by_side(die, [(0,), (1,)], 2))


def die_once(number, folder):
    """Two of the jobs kill their process when they are done for the first time."""
    begun = folder / f"{number}"
    first = not begun.exists()
    begun.touch()
    if first and number in (3, 7):
        die(number)
    return number


@pytest.mark.system
def test_a_process_that_died_costs_what_was_being_done(tmp_path):
    said = []
    found = list(side_by_side(die_once, [(n, tmp_path) for n in range(10)], 2, said.append))
    assert sorted(found) == list(range(10))
    assert 1 <= len(said) <= 2, "they may have died together"
    assert all("it did begins anew" in sentence for sentence in said)


def say_who_and_sleep(path):
    path.write_text(str(os.getpid()))
    time.sleep(120)


@pytest.mark.system
def test_workers_end_with_a_caller_that_was_killed(tmp_path):
    here = Path(__file__)
    script = (
        f"import sys; sys.path.insert(0, {str(here.parent)!r}); import {here.stem} as here\n"
        "from pathlib import Path; from afferents.parallel import side_by_side\n"
        "jobs = [(Path(sys.argv[1]) / name,) for name in 'ab']\n"
        "list(side_by_side(here.say_who_and_sleep, jobs, 2))"
    )
    caller = subprocess.Popen([sys.executable, "-c", script, str(tmp_path)])
    wait_for(lambda: all((tmp_path / n).exists() and (tmp_path / n).read_text() for n in "ab"))
    workers = [int((tmp_path / name).read_text()) for name in "ab"]
    caller.kill()
    caller.wait()
    wait_for(lambda: not any(psutil.pid_exists(worker) for worker in workers))


def wait_for(condition):
    for _ in range(600):
        if condition():
            return
        time.sleep(0.1)
    pytest.fail("it did not come within a minute")
