"""What the page on files shows is what is read."""

import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import afferents

pytestmark = pytest.mark.system

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE = (DOCS / "neuroscience.md").read_text(encoding="utf-8")
TEXT = PAGE.partition("## Natural afferents")[2]


def write_table(path, trains):
    """A row a spike, and one without a time where a fibre was silent."""
    rows = []
    for fibre, texture, speed, repetition in np.ndindex(trains.shape):
        times = trains[fibre, texture, speed, repetition]
        if times is not None:
            kind = ("SA1", "SA1", "RA", "PC")[fibre]
            trial = (f"n{fibre}", kind, f"t{texture}", (40.0, 80.0, 120.0)[speed], repetition)
            rows += [(*trial, time) for time in (times if len(times) else [np.nan])]
    names = ["unit", "class", "texture", "speed_mm_s", "repetition", "time_s"]
    pd.DataFrame(rows, columns=names).assign(duration_s=1.0).to_csv(path, index=False)


def test_the_page_runs_from_top_to_bottom(written, other, trains, monkeypatch, capsys, tmp_path):
    pytest.importorskip("neo")
    monkeypatch.chdir(tmp_path)
    shutil.copy(written, "session.nwb")
    shutil.copy(other, "other.nwb")
    write_table("fibres.csv", trains)
    names = {}
    blocks = re.findall(r"```python\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(blocks) == 5
    for block in blocks:
        exec(block, names)
    said = capsys.readouterr().out
    assert "4 fibres (2 SA, 1 RA, 1 PC), 3 textures at 40, 80, 120 mm/s." in said
    assert "Without gaps: 2 of 2 SA, 1 of 1 RA, 0 of 1 PC units, 3 of 3 textures" in said
    n_trains = sum(one is not None for one in trains.flat)
    assert afferents.read_spikes("fibres.csv").recorded.sum() == n_trains

    np.testing.assert_allclose(names["again"].times, names["spikes"].times)
    assert names["other"].n_trials == 3
