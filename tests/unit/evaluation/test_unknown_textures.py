"""Textures held out: found where they are unlike, at the false alarms that are stated."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from afferents.encodings.samples import concatenate, make_samples
from afferents.encodings.wavenumbers import WavenumberEncoding
from afferents.evaluation.unknown import ask_unknown, ridges_of, summarise_unknown
from afferents.models.model import MODELS
from afferents.progress import Progress

SPEEDS = (10.0, 20.0, 30.0, 40.0, 50.0)


def samples(n_textures=6, n=80, noise=0.4, seed=0):
    """Textures that are corners of a simplex, and noise; `near` is as good as `t0`."""
    rng = np.random.default_rng(seed)
    names = [*(f"t{i}" for i in range(n_textures)), "near"]
    parts = []
    for number, name in enumerate(names):
        for speed in SPEEDS:
            true = 3 * np.eye(n_textures + 3)[number % n_textures]
            values = (true + rng.normal(0, noise, (n, len(true)))).astype(np.float32)
            attrs = {"name": f"{name}/{speed:g}", "texture": name, "speed_mm_s": speed}
            stop = np.arange(1.0, n + 1)
            parts.append(make_samples(values, ("feature",), stop - 1, stop, attrs))
    return concatenate(parts)


def asked(data):
    return ask_unknown(MODELS["sa-wave"], data, WavenumberEncoding(), Progress(quiet=True))


@pytest.fixture(scope="module")
def found():
    return summarise_unknown(asked(samples())).content()


def test_false_alarms_are_as_often_as_stated(found):
    assert found["false_alarms"]["samples"]["mean"] == pytest.approx(0.05, abs=0.02)


def test_what_is_unlike_is_found_and_what_is_alike_is_hidden(found):
    shares = {name: one["found_samples"] for name, one in found["by_texture"].items()}
    assert min(shares[f"t{i}"] for i in range(1, 6)) > 0.95
    assert max(shares["near"], shares["t0"]) < 0.2
    assert found["by_texture"]["t3"]["auroc"] > 0.99
    assert found["by_texture"]["near"]["auroc"] < 0.7


def test_nothing_of_the_held_out_is_learnt_from():
    data = samples(n=20)
    held = (data["texture"].values == "t3") | (data["speed_mm_s"].values == 20)
    rng = np.random.default_rng(1)
    other = rng.normal(0, 3, data.shape).astype(np.float32)
    fold = (data["texture"].values == "t1") & (data["speed_mm_s"].values == 20)
    spoilt = data.copy(data=np.where((held & ~fold)[:, None], other, data.values))
    pair = [
        rows[(rows.left_out == "t3") & (rows.held_out_speed_mm_s == 20) & (rows.texture == "t1")]
        for rows in map(asked, (data, spoilt))
    ]
    assert len(pair[0]) == 20
    np.testing.assert_allclose(pair[0]["novelty"], pair[1]["novelty"], rtol=1e-3)


def test_a_ridge_without_a_texture_and_speeds_knows_nothing_of_them():
    data = samples(n=10)
    left = data.isel(sample=np.flatnonzero(data["texture"].values != "near"))
    kept = left.isel(sample=np.flatnonzero(~np.isin(left["speed_mm_s"].values, (20, 30))))
    whole = ridges_of(data)(0, (20.0, 30.0))  # `near` is the first by name
    alone = ridges_of(kept)(0, ())
    assert whole.shape == (len(data), 7)
    assert not whole[:, 0].abs().max() > 1e-3
    assert alone.shape == (len(kept), 6)


def test_a_texture_felt_at_some_speeds_only(found):
    data = samples(n=20)
    gap = (data["texture"].values == "t2") & (data["speed_mm_s"].values > 10)
    rows = asked(data.isel(sample=np.flatnonzero(~gap)))
    assert set(rows[rows.left_out == "t2"].held_out_speed_mm_s) == {10.0}
    # Where its only speed is held out it was never felt: nobody asks whether it is known.
    assert rows[(rows.texture == "t2") & (rows.left_out != "t2")].empty


def test_a_speed_at_which_one_texture_was_felt_is_not_asked():
    data = samples(n=20)
    gap = (data["texture"].values != "t2") & (data["speed_mm_s"].values == 20)
    found = summarise_unknown(asked(data.isel(sample=np.flatnonzero(~gap)))).content()
    assert found["auroc_by_speed"].keys() == {"10", "30", "40", "50"}


def test_the_command_leaves_a_table_and_a_page(stores, tmp_path, run, does, fails):
    split = ("evaluate", stores["video"], "--out", tmp_path / "r", "--split", "texture",
             "--models", "sa-wave,order-te-speed-known", "--frames", 5, "--window-s", 0.2,
             "--workers", 1)  # fmt: skip
    out = does(*split, "--json")
    summaries = json.loads(out)
    assert summaries.keys() == {"unknown"}  # too few spacings to lie between
    assert summaries["unknown"]["false_alarms_stated"] == 0.05
    assert summaries["unknown"]["models"].keys() == {"sa-wave", "order-te-speed-known"}
    assert set(pd.read_parquet(tmp_path / "r" / "unknown.parquet")["left_out"]) == {"1", "2", "3"}
    assert "recognised as unknown" in run(*split)[1]
    does("report", tmp_path / "r", "--quiet")
    page = (tmp_path / "r" / "report.html").read_text()
    assert "Called unknown, by texture" in page
    assert "--split texture --models order-te-speed-known,sa-wave" in page
    assert (tmp_path / "r" / "textures.md").read_text().startswith("### Textures held out")
    # A later run adds its models, and only such as were asked in the same way.
    again = ("evaluate", "--config", tmp_path / "r" / "config.json", "--out", tmp_path / "r")
    found = json.loads(does(*again, "--models", "ra-wave,order-te-speed-known", "--json"))
    assert found["unknown"]["models"].keys() == {"sa-wave", "order-te-speed-known", "ra-wave"}
    assert "found results of another" in fails(*again, "--split", "speed")
    assert "models of tactile images or of vibra" in fails(*again, "--markers", 0.5)


def test_recordings_that_were_skipped_are_named(stores, tmp_path, fails):
    store = shutil.copytree(stores["video"], tmp_path / "s.zarr")
    shutil.rmtree(store / "3" / "20")
    said = fails("evaluate", store, "--out", tmp_path / "r", "--quiet", "--split", "texture",
                 "--models", "sa-wave", "--frames", 5, "--keep-going", "--workers", 1,
                 code=3)  # fmt: skip
    assert "skipped 1 of the recordings: 3/20" in said
