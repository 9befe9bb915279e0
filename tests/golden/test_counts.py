"""The tables of docs/results.md are those that the kept counts give; see scripts/count_folds.py."""

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COUNTS = ROOT / "docs" / "counts"


@pytest.fixture(scope="module")
def script(load):
    return load(ROOT / "scripts" / "count_folds.py")


def test_the_table_of_fast_is_what_was_counted(script):
    fast = script.read(COUNTS / "rig-fast.jsonl")
    assert_in_results(script.table(fast))


def test_fast_beside_paper_is_what_was_counted(script):
    fast, paper = (script.read(COUNTS / f"rig-{preset}.jsonl") for preset in ("fast", "paper"))
    assert_in_results(script.compare(fast, paper))


def assert_in_results(lines):
    results = (ROOT / "docs" / "results.md").read_text().splitlines()
    for line in lines:
        assert line in results
