"""Three commands on one output, begun 0 to 6 s apart: what one alone would have left, each time."""

import random
import time
from pathlib import Path

import pytest

from ..kept import contents

pytestmark = pytest.mark.system

TRIALS = 20
AT_WORK, DONE = 2, 0


HOME = {
    "simulate": "afferents.rig.simulate",
    "extract": "afferents.extraction.extract",
    "evaluate": "afferents.evaluation.evaluate",
}
"""Where the functions of commands lie."""


@pytest.fixture
def start(launch):
    """Start a command in a folder."""

    def begin(arguments, cwd):
        imports = [HOME[arguments[0]]]
        return launch([*arguments, "--quiet"], imports=imports, cwd=str(cwd))

    return begin


def together(start, arguments, cwd, rng):
    """Run three at once; return their exit codes and what they said."""
    running = []
    for _ in range(3):
        running.append(start(arguments, cwd))
        time.sleep(rng.uniform(0, 3))
    said = [one.communicate(timeout=300)[1] for one in running]
    return [one.returncode for one in running], said


def run_alone(start, arguments, out, folder):
    calm = folder / "calm"
    calm.mkdir()
    assert start(arguments, calm).wait(300) == DONE
    return contents(calm / out)


def run_trials(start, arguments, out, folder, trials=TRIALS, ignore=(), expected=None):
    expected = expected or run_alone(start, arguments, out, folder)
    rng = random.Random(0)
    refused = 0
    for trial in range(trials):
        there = folder / f"{trial}"
        there.mkdir()
        codes, said = together(start, arguments, there, rng)
        assert DONE in codes, said
        for code, sentence in zip(codes, said, strict=True):
            assert code in (DONE, AT_WORK), sentence
            assert "Traceback" not in sentence
            if code == AT_WORK:
                refused += 1
                assert "at work there since" in sentence
        found = contents(there / out)
        assert found.keys() == expected.keys()
        differ = [p for p in expected if found[p] != expected[p] and Path(p).name not in ignore]
        assert not differ
    return refused


@pytest.mark.slow
def test_three_that_extract_into_one_store(start, sounds, tmp_path):
    assert (
        run_trials(start, ("extract", sounds, "s.zarr", "--workers", "2"), "s.zarr", tmp_path) > 0
    )


@pytest.mark.slow
def test_three_that_simulate_one_session(start, tmp_path):
    options = ("--textures", "a,g", "--speeds", "40,50", "--seconds", "2", "--workers", "2")
    assert run_trials(start, ("simulate", "session", *options), "session", tmp_path, trials=5) > 0


@pytest.mark.slow
def test_three_that_evaluate_into_one_folder(start, does, sounds, tmp_path):
    does("extract", sounds, tmp_path / "s.zarr", "--quiet")
    options = ("--out", "r", "--models", "ridge-te", "--window-s", "0.5", "--workers", "2")
    times = ("fold.json", "summary.json")  # they hold the seconds that it took
    command = ("evaluate", tmp_path / "s.zarr", *options)
    assert run_trials(start, command, "r", tmp_path, trials=5, ignore=times) > 0


def test_three_at_once_leave_what_one_leaves(start, sounds, stores, tmp_path):
    command, expected = ("extract", sounds, "s.zarr", "--workers", "1"), contents(stores["audio"])
    run_trials(start, command, "s.zarr", tmp_path, trials=1, expected=expected)
