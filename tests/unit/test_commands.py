"""The commands as functions: the way of the README, without a shell."""

import numpy as np
import pytest
import xarray as xr
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import LeaveOneGroupOut, cross_val_score

import afferents
from afferents.errors import InputError

NAMES = [
    "calibrate",
    "track",
    "simulate",
    "extract",
    "evaluate",
    "report",
    "reproduce",
    "train",
    "compare",
    "export",
    "export_lerobot",
    "export_mcap",
    "export_nwb",
    "explain",
    "explain_shear",
    "inspect",
    "samples",
    "view",
]


def test_their_names_are_found_and_their_help_is_whole():
    assert set(NAMES) <= set(dir(afferents))
    for name in NAMES:
        help_text = getattr(afferents, name).__doc__
        assert "Returns\n" in help_text, name
        assert "Parameters\n" in help_text, name


@pytest.mark.system
def test_from_a_session_to_a_report(session, tmp_path):
    store, results_folder = str(tmp_path / "s.zarr"), str(tmp_path / "r")
    recordings = afferents.extract(str(session), store, workers=1, quiet=True)
    assert {r.attrs["texture"] for r in recordings} == {"1", "2", "3"}
    mine = afferents.Model(
        "mine", channel="ra1", encoding="spatial", classifier=LogisticRegression(max_iter=500)
    )
    results = afferents.evaluate(
        store, out=results_folder, models=["sa-wave", mine], held_out=[40.0], frames=5, workers=1,
        quiet=True,
    )  # fmt: skip
    table = results.accuracy
    assert set(table["model"]) == {"sa-wave", "mine"}
    assert table["accuracy"].between(0, 1).all()
    assert table[table["held_out_speed_mm_s"].isna()]["ci95_low"].notna().all()
    page = afferents.report(results_folder, quiet=True)
    assert page.name == "report.html"
    card = afferents.train(store, tmp_path / "m", model="sa-wave", quiet=True)
    assert card.textures == ("1", "2", "3")
    assert afferents.export(tmp_path / "m", tmp_path / "m.onnx").is_file()
    found = afferents.explain(tmp_path / "m", store, tmp_path / "why", quiet=True)
    assert {path.name for path in found.pictures} == {"markers.png", "waves.png"}
    looked = afferents.inspect(store, tmp_path / "looked", quiet=True)
    assert looked.sentences


def test_samples_go_into_scikit_learn(stores):
    x = afferents.samples(stores["video"], channel="ra1", encoding="spatial", quiet=True)
    assert x.dims == ("sample", "row", "column")
    scores = cross_val_score(
        LogisticRegression(max_iter=20), x.values.reshape(len(x), -1), x.texture,
        groups=x.speed_mm_s, cv=LeaveOneGroupOut(),
    )  # fmt: skip
    assert len(scores) == len(np.unique(x.speed_mm_s))
    runs = afferents.samples(stores["video"], "sa1", "spatiotemporal", frames=4, quiet=True)
    assert runs.sizes["frame"] == 4


def test_a_video_by_its_name(session):
    tracks = afferents.track(str(session / "1" / "20" / "video.mp4"))
    assert tracks.position.dims == ("time", "marker", "space")


def test_track_gives_what_the_command_writes(session, tmp_path, run):
    video = session / "1" / "20" / "video.mp4"
    code, _, said = run("track", video, tmp_path / "t.zarr", "--sensor", "tip_b", "--quiet")
    assert code == 0, said
    written = xr.open_zarr(tmp_path / "t.zarr", consolidated=False).load()
    found = afferents.track(video, "tip_b")
    assert set(found.data_vars) == set(written.data_vars)
    for name in written.data_vars:
        np.testing.assert_array_equal(found[name], written[name])


def test_what_is_wrong_is_one_sentence(tmp_path, stores):
    with pytest.raises(InputError, match="a session folder, found no such folder"):
        afferents.extract(str(tmp_path / "none"), tmp_path / "s.zarr")
    with pytest.raises(InputError, match="--models: expected 'all', 'best' or some of"):
        afferents.evaluate(stores["video"], out=tmp_path / "r", models=["tea"], quiet=True)
    with pytest.raises(InputError, match="--frames: expected models that it is for"):
        afferents.evaluate(stores["video"], tmp_path / "r", "sa-se", frames=5, quiet=True)
    with pytest.raises(InputError, match="frame: expected models that it is for"):
        afferents.samples(stores["video"], "sa1", "spatiotemporal", frame=5, quiet=True)
    taken = afferents.Model("ra-se", channel="sa1", encoding="spatial", classifier="ridge")
    with pytest.raises(InputError, match="a name that no model of this package has, found 'ra-se'"):
        afferents.evaluate(stores["video"], tmp_path / "r", taken, quiet=True)
    assert not (tmp_path / "r").exists()
    with pytest.raises(InputError, match="encoding: expected an Encoding, or one of spatial"):
        afferents.samples(stores["video"], "sa1", "tea", quiet=True)
