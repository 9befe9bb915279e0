"""Spacing as a number: known truth in, truth out; nothing of what is held out is learnt from."""

import json

import numpy as np
import pandas as pd
import pytest
import torch

from afferents.encodings.samples import concatenate, make_samples
from afferents.evaluation.roughness import COVERAGE, _ask, _summary_of, can_ask_mm, sums_of
from afferents.models.model import MODELS
from afferents.progress import Progress

SPACINGS, SPEEDS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), (10.0, 20.0, 30.0, 40.0)


def samples(spacings=SPACINGS, speeds=SPEEDS, n=30, noise=0.2, seed=0):
    """Values that are linear in the spacing, one that is the speed, and noise."""
    rng = np.random.default_rng(seed)
    parts = []
    for spacing in spacings:
        for speed in speeds:
            true = np.array([spacing, -2 * spacing, speed / 10, 0.0])
            values = (true + rng.normal(0, noise, (n, 4))).astype(np.float32)
            attrs = {
                "name": f"{spacing:g}/{speed:g}",
                "texture": f"{spacing:g}",
                "speed_mm_s": speed,
            }
            stop = np.arange(1.0, n + 1)
            parts.append(make_samples(values, ("feature",), stop - 1, stop, attrs))
    return concatenate(parts)


def asked(data):
    sums = sums_of(data, torch.from_numpy(data.values))
    return _ask(MODELS["sa-wave"], sums, data, Progress(quiet=True))


def test_textures_never_felt_lie_between_those_that_were():
    rows = asked(samples())
    for _, of_kind in rows.groupby("kind"):
        found = _summary_of(of_kind).content()
        assert found["mae_mm"] < 0.15
        assert found["mae_mm_recordings"] < 0.05
        assert found["covered"] == pytest.approx(COVERAGE, abs=0.05)
    assert len(rows) == 2 * 6 * 4 * 30


def test_nothing_of_the_held_out_is_learnt_from():
    data = samples()
    held = (data["texture"].values == "3") & (data["speed_mm_s"].values == 20)
    spoilt = data.copy(data=np.where(held[:, None], 1e3, data.values).astype(np.float32))
    pair = [
        table[
            (table.kind == "unseen") & (table.spacing_mm != 3) & (table.held_out_speed_mm_s == 20)
        ]
        for table in (asked(data), asked(spoilt))
    ]
    np.testing.assert_allclose(pair[0]["predicted_mm"], pair[1]["predicted_mm"], atol=2e-2)


def test_the_command_says_mm_and_leaves_a_table(make_session, tmp_path, run, does):
    session = make_session(tmp_path / "s", textures=(0, 1, 2, 3, 4), seconds=0.5)
    run("extract", session, tmp_path / "s.zarr", "--quiet", "--workers", 1)
    split = ("evaluate", tmp_path / "s.zarr", "--out", tmp_path / "r", "--split", "texture",
             "--frames", 5, "--window-s", 0.2, "--workers", 1)  # fmt: skip
    models = ("--models", "sa-wave,order-te-speed-known")
    out = does(*split, *models, "--json")
    assert json.loads(out)["roughness"]["models"].keys() == {"sa-wave", "order-te-speed-known"}
    table = pd.read_parquet(tmp_path / "r" / "roughness.parquet")
    assert set(table["spacing_mm"]) == {1, 2, 3, 4}  # the smooth one has no spacing
    assert "Bump spacing as a number" in run(*split, *models)[1]


def test_fabrics_have_no_spacing():
    assert can_ask_mm(("0", "0.5", "1", "1.5", "2"))
    assert not can_ask_mm(("0", "0.5", "1", "1.5"))
    assert not can_ask_mm(("Linen", "1", "2", "3", "4"))


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--models", "vib-te"), "expected some of ridge-te, order-te-speed-known, sa-wave"),
        (("--textures", "1,2"), "at least 3 textures and 3 speeds for --split texture, found 2"),
        (("--protocol", "published"), "--protocol: expected nested with --split texture"),
        (("--held-out", "20"), "--held-out: expected none with --split texture"),
        (("--train-speeds", 2), "--train-speeds: expected none with --split texture"),
        (("--cluster", "tcp://nowhere:1"), "--cluster: expected none with --split texture"),
        ((), "a new, empty or results folder"),
    ],
)
def test_what_textures_held_out_can_not_be_asked(stores, tmp_path, fails, options, sentence):
    out = tmp_path / "r" if options else tmp_path
    (tmp_path / "x").touch()
    split = ("evaluate", stores["audio"], "--out", out, "--split", "texture")
    assert sentence in fails(*split, "--models", "ridge-te", "--window-s", 1, *options)
