"""The whole way in one go, its packaged options, and the store that it leaves."""

import json
import shutil
from inspect import signature

import pytest

import afferents
from afferents.evaluation.options import EvaluationOptions
from afferents.recordings.data_sets import read_session
from afferents.reproduction import reproduce as reproducing
from afferents.reproduction.reproduce import EXTRACTING, list_changes, read_preset
from afferents.reproduction.status import RunFolder
from afferents.rig.simulation import make_simulation
from afferents.store.zarr_store import holds_all

from ...conftest import few_epochs

FEW = {"textures": ("a", "g"), "speeds_mm_s": (50.0, 70.0, 100.0), "seconds": 3.0}
SOME = ("ra-ste", "vib-te-aug")
"""Enough to see that all are asked for; every model goes its whole way in `test_whole_way`."""


def reproduce(out, session):
    models = [*SOME, "best"]
    return afferents.reproduce(
        out, session, protocol="both", preset="quick", models=models, workers=1, quiet=True
    )


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """The results of a run without a session."""

    def few(session, preset, **given):
        return make_simulation(session, preset, **given, **FEW)

    with pytest.MonkeyPatch.context() as patch, few_epochs():
        patch.setattr(reproducing, "make_simulation", few)
        return reproduce(tmp_path_factory.mktemp("reproduced") / "out", None)


@pytest.fixture(scope="module")
def page(results):
    return results.root / "report.html"


@pytest.mark.system
def test_it_ends_with_table_1_under_both_protocols(results, page):
    summary = results.summary
    assert set(summary["models"]) == {*SOME, "sa-wave-vector"}
    assert all(set(found) == {"nested", "published"} for found in summary["models"].values())
    nested = {name: found["nested"] for name, found in summary["models"].items()}
    assert not any(any(found["leaks"].values()) for found in nested.values())
    table = (page.parent / "table1.md").read_text()
    assert "Paper, its own recordings" in table
    assert "their numbers do not say how good a model is" in table
    assert "Simulated recordings." in page.read_text()
    assert (page.parents[1] / "session" / "3" / "100" / "video.mp4").is_file()
    lead = page.read_text().partition('<p class="lead">')[2]
    assert lead.startswith("SA-I vector waves, which we recommend, recognises ")


@pytest.mark.system
def test_a_second_run_keeps_what_is_finished(results, monkeypatch):
    """It is given the session, so that none is simulated."""
    monkeypatch.setattr(reproducing, "make_simulation", None)
    out = results.root.parent
    before = {p: p.stat().st_mtime_ns for p in out.rglob("fold.json")}
    assert len(before) == (len(SOME) + 1) * 2 * 3
    with few_epochs():
        reproduce(out, out / "session")
    assert {p: p.stat().st_mtime_ns for p in before} == before


ASKED = ("--like", "published", "--cut", "all", "--preset", "quick", "--models", "sa-se,vib-te")
ASKED += ("--window-s", 0.1, "--stride-s", 0.05, "--held-out", 40, "--keep-going", "--workers", 1)


@pytest.fixture(scope="module")
def as_published(tmp_path_factory, make_session, add_reference_video):
    """A session named as the published one, with its reference clip; one video is damaged."""
    root = tmp_path_factory.mktemp("published") / "session"
    make_session(root, textures=(0, 3), speeds=(10, 40, 50))
    add_reference_video(root / "0" / "10")
    (root / "3" / "50" / "video.mp4").write_bytes(b"no video")
    return root


@pytest.mark.system
def test_like_published_says_its_choices_and_goes_the_whole_way(as_published, tmp_path, run):
    out = tmp_path / "out"
    with few_epochs():
        code, printed, error = run("reproduce", out, "--session", as_published, *ASKED, "--quiet")
    assert code == 3, "a recording is skipped"
    assert "skipped 1 of the recordings: 3/50" in error
    for said in (
        'method = "published"  # the nearest blob within 10 px, else the old position; ',
        'statistics = "keras"  # running statistics of batch normalisation from 0 and 1',
        "cut = all (published: published)",
        "Where this still differs from the authors' code (14 places):",
        "To do: 6 recordings to extract, and at most 2 trainings",
    ):
        assert said in error
    told = [printed.find(one) for one in ("Table 1.", "Held out, each in turn:", "Report: ")]
    assert -1 < told[0] < told[1] < told[2]
    upto = [line for line in printed[: told[2]].splitlines() if len(line) > 80]
    assert upto == [], "nothing is broken in a terminal of 80 columns"

    config = json.loads((out / "results" / "config.json").read_text())
    assert config["statistics"] == "keras"
    kept = {"warm_up_statistics": False, "precision": "float32"}
    assert all(kept.items() <= training.items() for training in config["training"].values())
    summary = json.loads((out / "results" / "summary.json").read_text())
    assert [set(found) for found in summary["models"].values()] == [{"published"}] * 2

    code, printed, _ = run("status", out)
    assert code == 0
    assert "5 of 6 recordings are extracted." in printed
    assert "2 of 2 trainings are done." in printed
    facts = json.loads(run("status", out, "--json")[1])
    assert facts["like"] == "published"


@pytest.mark.system
def test_arcs_are_counted_before_the_way_of_the_drum_is_known(as_published, tmp_path):
    run, options = RunFolder(tmp_path), EvaluationOptions(split="angle-3", models="sa-se")
    said = reproducing._count_jobs(read_session(as_published), run, options)
    assert "at most 3 trainings" in said


@pytest.mark.system
def test_what_makes_no_sense_is_refused_before_anything_is_begun(
    as_published, results, tmp_path, fails
):
    out, given = tmp_path / "out", ("--session", as_published)
    for options, said in (
        ((*given, "--like", "published"), "0/10: expected at least 5510 video frames"),
        (("--like", "published"), "--cut published: expected recordings of 65 s (--size pap"),
        ((*given, "--models", "tea"), "'tea'"),
        ((*given, "--split", "texture"), "--split: expected 'speed'"),
        ((*given, "--held-out", "15", "--keep-going"), "15"),
    ):
        assert said in fails("reproduce", out, *options, "--quiet")
    assert not out.exists()
    begun = results.root.parent
    asked = ("--session", begun / "session", "--cut", "published", "--quiet")
    assert "another (" in fails("reproduce", begun, *asked)


def test_what_we_recommend_is_what_commands_do_unless_told():
    recommended, usual = read_preset("recommended"), signature(afferents.extract).parameters
    extracting = {name: v for name, v in recommended.items() if name in EXTRACTING}
    assert extracting == {name: usual[name].default for name in extracting}
    evaluating = {name: v for name, v in recommended.items() if name not in EXTRACTING}
    assert EvaluationOptions(**evaluating) == EvaluationOptions()


def test_what_is_given_otherwise_is_named():
    given = {"cut": "all", "preset": "paper", "models": ["all"], "fps_hz": 90.0, "workers": 3}
    assert list_changes("published", given) == ["cut = all (published: published)"]
    assert list_changes("recommended", {**given, "held_out": "50"}) == [
        "preset = paper (recommended: fast)",
        "models = all (recommended: best,all)",
        "fps_hz = 90",
        "held_out = 50",
    ]


def test_a_demo_that_was_stopped_leaves_no_store_to_learn_from(stores, tmp_path):
    store = shutil.copytree(stores["audio"], tmp_path / "s.zarr")
    assert holds_all(store)
    shutil.rmtree(store / "2/30")
    assert not holds_all(store)
    assert not holds_all(tmp_path / "none.zarr")
