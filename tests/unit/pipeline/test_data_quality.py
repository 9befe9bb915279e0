"""What was accepted or lost of the recordings reaches the first page of the report."""

import json
import shutil

import numpy as np
import pytest

from afferents.evaluation.results import read_summary
from afferents.evaluation.summary import data_quality
from afferents.quality.issues import QualityIssue
from afferents.store.responses import with_doubts
from afferents.store.zarr_store import open_responses, write_responses

REPEATED = QualityIssue("repeated", "x/video.mp4", "frames of their own", "49% of them twice")


@pytest.fixture
def store(stores, tmp_path):
    """A store with a recording of which a fifth is lost, and one that was accepted."""
    found = shutil.copytree(stores["video"], tmp_path / "video.zarr")
    lost, accepted = (responses.load() for responses in open_responses(found)[:2])
    detected = np.array(lost["detected"])
    detected[-len(detected) // 5 :] = False
    position = np.where(detected[..., None], lost["position"], np.nan).astype(np.float32)
    lost["detected"].values, lost["position"].values = detected, position
    for one in (lost, with_doubts(accepted, [REPEATED])):
        write_responses(found, one)
    return found


def test_shares_are_of_each_recording(store):
    recordings = open_responses(store)
    said = data_quality(recordings)
    name = recordings[0].attrs["name"]
    at_rest = recordings[0].attrs["rest_frame"]
    assert at_rest > 0  # before it nothing is looked for, so nothing is lost
    shares = [1 - float(one["detected"][at_rest:].mean()) for one in recordings]
    assert shares.index(max(shares)) == 0
    assert max(shares) > 0.19
    assert min(shares) == 0
    assert said["lost"].content() == {
        "median": pytest.approx(np.median(shares)),
        "worst": max(shares),
        "recording": name,
        "n": len(recordings),
    }
    assert [(one.recording, one.found) for one in said["accepted"]] == [
        (recordings[1].attrs["name"], (str(REPEATED),))
    ]


def test_sound_alone_has_neither(stores):
    assert data_quality(open_responses(stores["audio"])) == {}


def test_it_stands_on_the_first_page(store, tmp_path, run):
    out = tmp_path / "r"
    command = ("evaluate", store, "--out", out, "--models", "sa-wave-vector", "--workers", 1)
    assert run(*command, "--quiet")[0] == 0
    assert run("report", out, "--quiet")[0] == 0
    summary, page = read_summary(out).content(), (out / "report.html").read_text()
    assert summary["accepted"][0]["found"] == [str(REPEATED)]
    first = page[: page.index("What came out")]
    assert "49% of them twice" in first
    assert "recording was accepted as it is" in first
    assert f"at most {100 * summary['lost']['worst']:.1f}%, in recording 1/20" in first
    assert json.loads((out / "summary.json").read_text())["lost"] == summary["lost"]
