"""The script that tests trained folds under many corruptions."""

import sys
from pathlib import Path

import pandas as pd
import pytest

SCRIPTS = Path(__file__).resolve().parents[3] / "scripts"


def test_each_fold_is_tested_under_every_amount(stores, tmp_path, monkeypatch, capsys):
    monkeypatch.syspath_prepend(str(SCRIPTS))
    import robustness

    arguments = [
        "robustness.py", str(stores["video"]), "--out", str(tmp_path), "--models", "ra-wave-vector",
        "--frames-a-sample", "5", "--held-out", "40", "--workers", "1", "--markers", "0.001,50",
        "--frames", "0.1", "--lost", "", "--sound", "0dB",
    ]  # fmt: skip
    monkeypatch.setattr(sys, "argv", arguments)
    robustness.main()
    counts = pd.read_parquet(tmp_path / "robustness.parquet")
    samples = counts[counts["touch"] == "a sample"]
    asked = {("", "none"), ("markers", "0.001"), ("markers", "50"), ("frames", "0.1")}
    assert {*zip(samples["corruption"], samples["amount"], strict=True)} == asked
    counted = samples.groupby("amount")[["right", "n"]].sum()
    share = counted["right"] / counted["n"]
    few = 3 / counted["n"]["none"]  # samples at the edge between two textures
    assert share["0.001"] == pytest.approx(share["none"], abs=few)
    assert share["50"] < share["none"]
    assert (tmp_path / "robustness.png").stat().st_size > 10_000
    assert "| `ra-wave-vector` | markers | 50 |" in (tmp_path / "robustness.md").read_text()
