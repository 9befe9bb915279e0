"""What the page on files shows is what is read."""

import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from afferents import read_natural

pytestmark = pytest.mark.system

DOCS = Path(__file__).resolve().parents[3] / "docs"
(PAGE,) = [*DOCS.glob("neuroscience-files.part.md")] or [DOCS / "neuroscience.md"]
TEXT = PAGE.read_text(encoding="utf-8").partition("## Natural afferents")[2]


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


@pytest.fixture
def described(tmp_path, write_mat, trains, as_cell):
    """The first example's description and the MATLAB file that it describes."""
    fibres = []
    for fibre, name in zip(trains, ["SA1", "SA1", "RA", "PC"], strict=True):
        cells = np.empty(fibre.shape, object)
        for at in np.ndindex(fibre.shape):
            one = fibre[at]
            cells[at] = np.array([[np.nan]]) if one is None else 1000 * np.atleast_2d(one)
        fibres.append({"spikes": cells, "type": name})
    names = as_cell(["denim", "silk", "corduroy"])
    write_mat(tmp_path / "spikes.mat", {"fibres": fibres, "names": names})
    (text,) = shown("toml", "spikes.mat")
    (tmp_path / "natural.toml").write_text(text)
    return tmp_path / "natural.toml"


@pytest.mark.parametrize("write_mat", ["v5"], indirect=True)
def test_the_page_runs_from_top_to_bottom(
    described, written, other, write_fingertip, trains, monkeypatch, capsys
):
    pytest.importorskip("neo")
    monkeypatch.chdir(described.parent)
    shutil.copy(written, "session.nwb")
    shutil.copy(other, "other.nwb")
    four = trains.transpose(2, 1, 0, 3)
    recorded = np.frompyfunc(lambda one: one is not None, 1, 1)(four).astype(bool)
    short = np.frompyfunc(lambda one: one if one is None else one[one < 0.8], 1, 1)(four)
    write_fingertip("RawPAFData.mat", short, recorded, ["SA1", "SA1", "RA", "PC"])
    write_list_of_trials("trials.mat", trains)
    names = {}
    blocks = shown("python")
    assert len(blocks) == 7
    for block in blocks:
        exec(block, names)
    said = capsys.readouterr().out
    assert "4 fibres (2 SA, 1 RA, 1 PC), 3 textures at 40, 80, 120 mm/s." in said
    assert "Without gaps: 2 of 2 SA, 1 of 1 RA, 0 of 1 PC units, 3 of 3 textures" in said
    Path("table.toml").write_text('file = "spikes.csv"\n[trials]\nduration_s = 1.0\n')
    of_table = read_natural(Path("table.toml"))
    np.testing.assert_array_equal(
        of_table.recorded.sum(), sum(one is not None for one in trains.flat)
    )
    np.testing.assert_allclose(names["again"].times, names["spikes"].times)
    assert names["other"].n_trials == 3
