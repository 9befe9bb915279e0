"""A stretch of the drum is held out: the whole way, from the drive's log to the model."""

import json
import shutil

import numpy as np
import pytest

import afferents
from afferents.store.drum_path import DRIVE, MARK, Drum
from afferents.store.log import write_log

from ...conftest import few_epochs

SECONDS = 3.0
DRUM = Drum(circumference_mm=50, contact_mm=2, zero=MARK)
ASKED = {"split": "angle", "window_s": 0.1, "stride_s": 0.05, "workers": 1, "quiet": True}
"""An arc is 10 mm; a sample at 40 mm/s takes 4 mm, and 2 mm are the contact."""


@pytest.fixture(scope="module")
def store(sounds, tmp_path_factory):
    """Sounds of two textures at two speeds, of a drum that turned once at least."""
    root = tmp_path_factory.mktemp("angle")
    session = root / "session"
    for number, texture in enumerate("12"):
        for speed in (20, 40):
            folder = session / texture / str(speed)
            shutil.copytree(sounds / texture / str(speed), folder)
            time = np.arange(0, SECONDS + 0.05, 0.02)
            rows = zip(time, 13.0 * number + speed * time, strict=True)
            write_log(folder / DRIVE, ("time_s", "position_mm"), rows, 0.0, DRUM)
    shutil.copy(sounds / "session.json", session)
    afferents.extract(session, root / "s.zarr", workers=1, quiet=True)
    return root / "s.zarr"


@pytest.fixture(scope="module")
def evaluated(store, tmp_path_factory):
    out = tmp_path_factory.mktemp("angle") / "results"
    return afferents.evaluate(store, out, models="ridge-te", protocol="both", **ASKED)


def test_results_name_the_split_and_its_arcs(evaluated):
    summary = evaluated.summary
    assert (summary["split"], summary["groups"]) == ("angle", list("12345"))
    found = summary["models"]["ridge-te"]
    for protocol in ("nested", "published"):
        assert set(found[protocol]["by"]) == set("12345")
        assert found[protocol]["mean_accuracy"] > 0.9  # the textures sound apart
    assert not any(found["nested"]["leaks"].values())
    assert found["published"]["leaks"]["test_samples_of_a_group_seen_in_validation"] == 0
    assert list(evaluated.accuracy["held_out_group"].dropna().unique()) == list("12345")


def test_a_model_that_left_an_arc_out_is_explained_by_it(store, tmp_path):
    asked = {key: value for key, value in ASKED.items() if key != "workers"}
    with few_epochs():
        card = afferents.train(store, tmp_path / "m", "vib-te", preset="quick", **asked)
    assert (card.held_out.name, card.groups) == ("angle", ("1", "2", "4", "5"))
    afferents.explain(tmp_path / "m", store, tmp_path / "e", quiet=True)
    facts = json.loads((tmp_path / "e" / "explanation.json").read_text())
    assert (facts["groups"], facts["not_learnt_from"]) == (["3"], True)
