"""The first dataset.toml that `afferents init` writes beside tables, and what it reads as."""

import tomllib

import numpy as np
import pandas as pd
import pytest

import afferents
from afferents.recordings.data_sets import data_set_of


@pytest.fixture
def folder(tmp_path):
    """Write tables of these names, each of times and a taxel."""

    def write(names, time_s, columns=("time_ms", "taxel"), unit=1000, **how):
        for name in names:
            (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
            table = pd.DataFrame(np.c_[unit * time_s, np.sin(time_s)], columns=columns)
            table.to_csv(tmp_path / name, index=False, **how)
        return tmp_path

    return write


EVEN_S = np.arange(700) / 100


@pytest.mark.parametrize(
    ("names", "pattern"),
    [
        (["felt/20_1.csv", "silk/20_1.csv"], "{texture}/{speed}_{trial}.csv"),
        (["felt/x.csv", "silk/y.csv"], "{texture}/{run1}.csv"),
        (
            [f"T1/Data[Texture({n})][Speed(2400)][Trial(1)].csv" for n in (1, 12)],
            "T{t}/Data[Texture({texture})][Speed({speed})][Trial({trial})].csv",
        ),
        (
            [f"Texture{n}/Texture({n})Force(0.5).csv" for n in (1, 12)],
            "Texture{*}/Texture({texture})Force({force}).csv",
        ),
    ],
)
def test_names_of_tables(folder, names, pattern):
    root = folder(names, EVEN_S)
    made = afferents.init_session(root)
    said = tomllib.loads(made.path.read_text())
    assert made.path.name == "dataset.toml"
    assert said["files"]["pattern"] == pattern
    assert said["signal"] == {"time": "time_ms", "time_unit": "ms"}
    session = data_set_of(root).recordings()
    assert len(session.textures) == len(names)
    assert session.recordings[0].audio.read().attrs["sample_rate_hz"] == 100
    assert f"{len(names)} recordings of {len(names)} textures" in made.sentences[-1]


def test_uneven_rows_without_a_header_are_resampled(folder):
    rng = np.random.default_rng(0)
    time = np.cumsum(rng.choice([0.001, 0.004], 500))
    root = folder(["felt_20.csv", "silk_40.csv"], time, unit=1, header=False, sep=";")
    made = afferents.init_session(root)
    said = tomllib.loads(made.path.read_text())["signal"]
    assert (said["separator"], said["header"], said["time"]) == (";", False, 0)
    assert said["resample_hz"] == pytest.approx(400, rel=0.1)
    assert said["steady_s"] == "all"
    assert "so they are resampled" in " ".join(made.sentences)
    assert "2 recordings of 2 textures at 20, 40 mm/s" in made.sentences[-1]


def test_a_table_without_times_asks_for_its_rate(tmp_path):
    for name in ("felt_20", "silk_20"):
        np.save(tmp_path / f"{name}.npy", np.random.default_rng(0).normal(size=(500, 3)))
    made = afferents.init_session(tmp_path)
    assert "fill in sample_rate_hz, which nothing can confirm" in " ".join(made.sentences)
    assert "To be mended before it can be learnt from" in made.sentences[-1]
    made.path.write_text(made.path.read_text().replace("# sample_rate_hz", "sample_rate_hz"))
    assert data_set_of(tmp_path).recordings().recordings[0].audio.n_channels == 3


def test_what_stands_there_is_kept(folder, run, fails):
    root = folder(["felt_20.csv", "silk_20.csv"], EVEN_S)
    code, out, _ = run("init", root)
    assert code == 0
    assert out.splitlines()[-1] == f"Description to check: {root / 'dataset.toml'}"
    assert "add --force" in fails("init", root)
    (root / "dataset.toml").write_text("title = 'mine'\n")
    assert "holds something else" in fails("init", root, "--force")
