"""The whole way in one go, on a session of its own and on a given one."""

import json

import pytest

from afferents.core.model import TABLE1
from afferents.core.progress import Progress
from afferents.core.protocol import PROTOCOLS
from afferents.markers import load_sensor
from afferents.pipeline import reproduce as reproducing
from afferents.pipeline.reproduce import Reproduction, reproduce
from afferents.rig.simulation import simulation_of

from ...conftest import few_epochs

FEW = {"textures": ("a", "g"), "speeds_mm_s": (50.0, 70.0, 100.0), "seconds": 3.0}
SOME = {name: TABLE1[name] for name in ("ra-ste", "vib-te-aug")}
"""Enough to see that all are asked for; every model goes its whole way in `test_whole_way`."""


def run(out, session):
    both = tuple(PROTOCOLS.values())
    wanted = Reproduction(out, session, load_sensor("tip_b"), "quick", protocols=both, workers=1)
    with Progress(quiet=True) as progress:
        return reproduce(wanted, progress)


@pytest.fixture(scope="module", autouse=True)
def _some_families():
    assert reproducing.TABLE1 == TABLE1
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproducing, "TABLE1", SOME)
        yield


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page of a run without a session."""

    def few(session, preset, **given):
        return simulation_of(session, preset, **given, **FEW)

    with pytest.MonkeyPatch.context() as patch, few_epochs():
        patch.setattr(reproducing, "simulation_of", few)
        return run(tmp_path_factory.mktemp("reproduced") / "out", None)


@pytest.fixture(scope="module")
def simulated(page):
    return page.parent.parent / "session"


def test_it_ends_with_table_1_under_both_protocols(page):
    summary = json.loads((page.parent / "summary.json").read_text())
    assert set(summary["models"]) == {*SOME, "sa-wave-vector"}
    assert all(set(found) == {"nested", "published"} for found in summary["models"].values())
    nested = {name: found["nested"] for name, found in summary["models"].items()}
    assert not any(any(found["leaks"].values()) for found in nested.values())
    table = (page.parent / "table1.md").read_text()
    assert "Paper, its own recordings" in table
    assert "their numbers do not say how good a model is" in table
    lead = page.read_text().partition('<p class="lead">')[2]
    assert lead.startswith("SA-I vector waves, which we recommend, names ")


def test_the_report_says_that_it_was_simulated_and_reproduces_nothing(page):
    text = page.read_text()
    assert "Simulated recordings." in text
    assert "no reproduction" in text


def test_without_a_session_one_is_simulated(page, simulated):
    assert page.is_file()
    assert (simulated / "3" / "100" / "video.mp4").is_file()


def test_a_second_run_keeps_what_is_finished(page, simulated, monkeypatch):
    """It is given the session, so that none is simulated."""
    monkeypatch.setattr(reproducing, "simulation_of", None)
    out = page.parent.parent
    before = {p: p.stat().st_mtime_ns for p in out.rglob("fold.json")}
    assert len(before) == (len(SOME) + 1) * 2 * 3
    with few_epochs():
        run(out, simulated)
    assert {p: p.stat().st_mtime_ns for p in before} == before
