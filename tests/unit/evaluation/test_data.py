"""Data that are not whole: known as such, left out only if told, and said on the first page."""

import json
import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.channels import CHANNELS
from afferents.encodings.images import SpatialEncoding
from afferents.errors import InputError
from afferents.evaluation.data import Source, _require_one_frame_rate, data_quality, open_data
from afferents.evaluation.results import read_summary
from afferents.quality.issues import QualityIssue
from afferents.store.responses import add_issues
from afferents.store.zarr_store import open_responses, write_responses

ALONE = ("--quiet", "--workers", 1)
REPEATED = QualityIssue("repeated", "x/video.mp4", "frames of their own", "49% of them twice")


def test_leaving_out_says_what_could_be(stores):
    with pytest.raises(InputError, match="expected one of direction, found pressure"):
        open_data([str(stores["audio"])], {"pressure": "F250"})
    with pytest.raises(InputError, match=r"direction= one of .*, found sideways"):
        open_data([str(stores["audio"])], {"direction": "sideways"})


def test_a_copy_of_a_recording_under_another_name_is_refused(tmp_path):
    (tmp_path / "dataset.toml").write_text(
        '[files]\npattern = "{texture}_{speed}.npy"\n[signal]\nsample_rate_hz = 100\n'
    )
    for name in ("felt_20", "felt_40"):
        np.save(tmp_path / name, np.zeros((900, 1)))
    with pytest.raises(InputError, match=r"felt_40.npy: .* the same bytes as .*felt_20.npy"):
        open_data([str(tmp_path / "dataset.toml")])


def test_half_a_store_is_known_as_one_and_evaluated_only_when_told(stores, tmp_path, does, fails):
    store, results = shutil.copytree(stores["audio"], tmp_path / "s.zarr"), tmp_path / "r"
    shutil.rmtree(store / "2/30")
    (data,) = open_data([str(store)], keep_going=True)
    assert list(data.failed) == ["2/30"]
    command = ("evaluate", store, "--out", results, "--models", "vib-te", "--held-out", 30, *ALONE)
    command = (*command, "--preset", "quick")
    sentence = fails(*command)
    assert "the 12 recordings of its session, found 11 (2/30 missing); extract again" in sentence
    assert "skipped 1 of the recordings: 2/30" in fails(*command, "--keep-going", code=3)
    out = does("report", results, "--quiet")
    assert "1 recording is missing: 2/30." in " ".join(out.split())
    assert "1 recording is missing: 2/30." in (results / "table1.md").read_text()
    assert "1 recording was skipped" in (results / "report.html").read_text()
    folds = json.loads((results / "summary.json").read_text())["models"]["vib-te"]["nested"]
    assert folds["n_test"] == 2 * 4  # of the others at that speed


@pytest.fixture
def doubtful(stores, tmp_path):
    """A store with a recording of which a fifth is lost, and one that was accepted."""
    found = shutil.copytree(stores["video"], tmp_path / "video.zarr")
    lost, accepted = (responses.load() for responses in open_responses(found)[:2])
    detected = np.array(lost["detected"])
    detected[-len(detected) // 5 :] = False
    position = np.where(detected[..., None], lost["position"], np.nan).astype(np.float32)
    lost["detected"].values, lost["position"].values = detected, position
    for one in (lost, add_issues(accepted, [REPEATED])):
        write_responses(found, one)
    return found


def test_shares_are_of_each_recording(doubtful, stores):
    recordings = open_responses(doubtful)
    said = data_quality(recordings)
    at_rest = recordings[0].attrs["rest_frame"]
    assert at_rest > 0  # before it nothing is looked for, so nothing is lost
    shares = [1 - float(one["detected"][at_rest:].mean()) for one in recordings]
    assert shares.index(max(shares)) == 0
    assert max(shares) > 0.19
    assert min(shares) == 0
    assert said["lost"].content() == {
        "median": pytest.approx(np.median(shares)),
        "worst": max(shares),
        "recording": recordings[0].attrs["name"],
        "n": len(recordings),
    }
    assert [(one.recording, one.found) for one in said["issues"]] == [
        (recordings[1].attrs["name"], (str(REPEATED),))
    ]
    assert data_quality(open_responses(stores["audio"])) == {}


def test_it_stands_on_the_first_page(doubtful, tmp_path, does):
    out = tmp_path / "r"
    command = ("evaluate", doubtful, "--out", out, "--models", "sa-wave-vector")
    does(*command, *ALONE)
    does("report", out, "--quiet")
    summary, page = read_summary(out).content(), (out / "report.html").read_text()
    first = page[: page.index("What was evaluated")]
    assert "49% of them twice" in first
    assert "Something is wrong with 1 recording;" in first
    assert f"at most {100 * summary['lost']['worst']:.1f}%, in recording 1/20" in first


def test_recordings_of_other_frame_rates_are_not_mixed():
    def at(fps_hz, name):
        time = {"time": np.arange(9) / fps_hz}
        return xr.Dataset({"sa1": ("time", np.zeros(9))}, time, {"name": name})

    source = Source(CHANNELS["sa1"], SpatialEncoding())
    _require_one_frame_rate([at(90, "a/1"), at(88, "b/1")], source)
    with pytest.raises(
        InputError, match=r"recording b/1: expected 90 frames/s.*found 45; evaluate"
    ):
        _require_one_frame_rate([at(90, "a/1"), at(45, "b/1")], source)
