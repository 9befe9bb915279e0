"""A simulated session made as the published one may be: `scripts/as_published.py`, and on from it.

The raw names and nothing else, mp4v under 30 frames a second, reflections, a hidden marker, sound
that is short, and a picture that lies beside the reference's.
"""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

import afferents
from afferents.extraction.copies import make_notes

SCRIPT = Path(__file__).resolve().parents[3] / "scripts/as_published.py"
SECONDS, N_FRAMES = 1.6, 144
EXTRA, LACKING, SHORT, SHIFTED = "0/40", "3/40", "3/40", "3/20"


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig") / "session"
    afferents.simulate(
        folder, textures="ag", speeds_mm_s=[20, 40], seconds=SECONDS, workers=1, quiet=True
    )
    return folder


@pytest.fixture(scope="module")
def folder(simulated, tmp_path_factory):
    """The same as it may be published."""
    script = runpy.run_path(str(SCRIPT))
    flaws = script["Flaws"](
        extra=(EXTRA,), lacking=(LACKING,), short=(SHORT,), shifted=(SHIFTED,), short_s=0.4
    )
    made = tmp_path_factory.mktemp("published") / "afferents"
    script["as_published"](simulated, made, flaws, 1, True)
    return made


@pytest.fixture(scope="module")
def extracted(folder, tmp_path_factory):
    """Its responses by either tracker, and where they are."""
    root = tmp_path_factory.mktemp("stores")
    return {
        method: afferents.extract(
            folder, root / method, method=method, fps_hz=90, workers=1, quiet=True
        )
        for method in ("windowed", "published")
    }


def test_inspect_names_the_cause_and_is_clean_once_it_is_given(folder, tmp_path, run, does):
    code, out, _ = run("inspect", folder, "--out", tmp_path / "p", "--quiet", "--json")
    found = json.loads(out)
    assert (code, len(found["problems"])) == (2, 4)
    assert "the container's rate is wrong: give --fps 90" in found["problems"][0]
    given = ("--out", tmp_path / "q", "--fps", 90, "--quiet", "--json")
    out = does("inspect", folder, *given)
    found = json.loads(out)
    assert found["problems"] == []
    said = " ".join(found["sentences"])
    assert "1.60 to 1.60 s long" in said
    assert "comes from it with the published tracker only" in said
    assert "can't be led by it" not in said


def test_either_tracker_goes_on_and_says_what_was_amiss(extracted):
    for method, recordings in extracted.items():
        for recording in recordings:
            name = recording.attrs["name"]
            np.testing.assert_allclose(recording.time, np.arange(N_FRAMES) / 90, atol=1e-6)
            assert recording.attrs["rest_blobs"] == {EXTRA: 362, LACKING: 360}.get(name, 361)
            lost = np.isnan(recording.position.values[10:, :, 0]).any(axis=0).sum()
            assert lost == int((method, name) == ("windowed", LACKING))
    replaced = {r.attrs["name"]: r.attrs["rest_replaced"] for r in extracted["published"]}
    assert replaced.pop(SHIFTED) > 100  # many count from where the reference has them
    assert replaced == {EXTRA: 0, LACKING: 1, "0/20": 0}
    said = " ".join(make_notes({r.attrs["name"]: r.attrs for r in extracted["published"]}).at_rest)
    assert f"2 recordings, {EXTRA} (362 blobs), {LACKING} (360 blobs): the rest frame shows" in said
    assert "markers farther from the reference clip's than the gate were put where those" in said
    said = " ".join(make_notes({r.attrs["name"]: r.attrs for r in extracted["windowed"]}).at_rest)
    assert f"1 recording, {EXTRA} (362 for 361): the rest frame shows blobs" in said
