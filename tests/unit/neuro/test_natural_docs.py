"""What the page on files shows is what is read."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import afferents

pytestmark = pytest.mark.system

DOCS = Path(__file__).resolve().parents[3] / "docs"
PAGE = (DOCS / "neuroscience.md").read_text(encoding="utf-8")
TEXT = PAGE.partition("## Natural afferents")[2]


def shown(language, holding=""):
    blocks = re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)
    return [block for block in blocks if holding in block]


def write_list_of_trials(path, trains):
    """A struct array with an element a trial."""
    fields = ("neuron", "type", "cloth", "speed", "trial", "times")
    rows = [
        (f"n{f}", ("SA1", "SA1", "RA", "PC")[f], f"t{i}", (40.0, 80.0, 120.0)[v], float(r), one)
        for f, i, v, r in np.ndindex(trains.shape)
        if (one := trains[f, i, v, r]) is not None
    ]
    trials = np.empty(len(rows), [(name, object) for name in fields])
    for number, row in enumerate(rows):
        trials[number] = row
    scipy.io.savemat(path, {"trials": trials})


def test_the_page_runs_from_top_to_bottom(written, other, trains, monkeypatch, capsys, tmp_path):
    pytest.importorskip("neo")
    monkeypatch.chdir(tmp_path)
    shutil.copy(written, "session.nwb")
    shutil.copy(other, "other.nwb")
    write_list_of_trials("trials.mat", trains)
    names = {}
    blocks = shown("python")
    assert len(blocks) == 6
    (of_trials,) = shown("python", "trials.mat")
    exec(of_trials, {})
    Path("spikes.csv").rename("fibres.csv")
    for block in blocks:
        exec(block, names)
    said = capsys.readouterr().out
    assert "4 fibres (2 SA, 1 RA, 1 PC), 3 textures at 40, 80, 120 mm/s." in said
    assert "Without gaps: 2 of 2 SA, 1 of 1 RA, 0 of 1 PC units, 3 of 3 textures" in said
    n_trains = sum(one is not None for one in trains.flat)
    assert afferents.read_spikes("spikes.csv").recorded.sum() == n_trains

    np.testing.assert_allclose(names["again"].times, names["spikes"].times)
    assert names["other"].n_trials == 3
