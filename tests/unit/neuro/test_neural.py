"""`afferents neural`: from a store of the rig to tables and figures."""

import json

import numpy as np
import pandas as pd
import pytest

import afferents

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def found(stores, tmp_path_factory):
    out = tmp_path_factory.mktemp("neural") / "out"
    return afferents.neural(stores["video"], out, window_s=0.05, quiet=True), out


def test_tables_and_figures_are_written(found):
    results, out = found
    tables = ("rates", "resolution", "units", "slopes", "stretch", "exponents")
    figures = ("raster", "resolution", "units", "slopes", "stretch")
    written = {f"{name}.csv" for name in tables} | {f"{name}.png" for name in figures}
    assert {path.name for path in out.iterdir()} == written | {"neural.json"}
    assert set(results.spikes.units["class"]) <= {"SA", "RA", "PC"}
    assert len(pd.read_csv(out / "slopes.csv")) == results.spikes.n_units
    assert json.loads((out / "neural.json").read_text())["units"]["model"] == "izhikevich"
    assert [table.attrs["title"].split()[0] for table in results.summary] == [
        "Rates:",
        "Texture",
        "Trains",
    ]


def test_it_overwrites_its_own_folder(found, does, stores):
    _, out = found
    options = ("--classes", "RA", "--units", "lif", "--window-s", "0.05")
    printed = does("neural", stores["video"], *options, "--json", "--out", out)
    assert json.loads(printed)["units"]["classes"].keys() == {"RA"}
    printed = does("neural", stores["video"], *options, "--out", out)
    assert printed.startswith("Rates: ")
    assert max(map(len, printed.splitlines())) <= 80
    assert f"Picture: {out / 'raster.png'}" in printed.splitlines()


def test_tables_of_a_users_are_left(fails, tmp_path):
    (tmp_path / "rates.csv").write_text("precious")
    assert "found a folder that holds something else" in fails(
        "neural", tmp_path / "S.zarr", "--out", tmp_path
    )
    assert (tmp_path / "rates.csv").read_text() == "precious"


def test_what_is_doubtful_about_fibres_is_noted(run, fails, tmp_path):
    times = [f"a,SA,silk,40,0.8,{time:.4f}" for time in np.linspace(0.01, 0.5, 40)]
    lines = ["unit,class,texture,speed_mm_s,duration_s,time_s", *times]
    (tmp_path / "fibres.csv").write_text("\n".join(lines))
    options = ("--out", tmp_path / "out", "--natural", tmp_path / "fibres.csv")
    _, _, said = run("neural", tmp_path / "S.zarr", *options)
    assert f"warning: {tmp_path / 'fibres.csv'}: no train of 1 of 1 units (a) reaches" in said
    assert "UserWarning" not in said
    (tmp_path / "fibres.toml").touch()
    said = fails("neural", tmp_path / "S.zarr", *options[:3], tmp_path / "fibres.toml")
    assert "expected a table of spikes (.csv, .parquet) or an NWB file" in said


def test_fibres_are_compared(found, stores, tmp_path):
    """Fibres in a table, of which there are fewer: as many artificial units are compared."""
    results, _ = found
    few = results.spikes.of_class("RA").select(units=[40, 80, 120, 200, 260]).window(0, 0.3)
    few.to_table().to_csv(tmp_path / "fibres.csv", index=False)
    options = {"window_s": 0.05, "natural": tmp_path / "fibres.csv", "quiet": True}
    compared = afferents.neural(stores["video"], tmp_path / "out", classes=["RA"], **options)
    assert (tmp_path / "out" / "beside.png").stat().st_size > 10_000
    assert (tmp_path / "out" / "natural_raster.png").stat().st_size > 10_000
    assert ("natural", "RA") in compared.summary[0].index
    of_five = pd.read_csv(tmp_path / "out" / "natural_rates.csv")["spikes_per_s"]
    np.testing.assert_allclose(of_five.mean(), few.rates().mean())
    table = pd.read_csv(tmp_path / "out" / "beside_resolution.csv")
    assert set(table["population"]) == {"artificial", "natural"}
    assert len(set(table["n_units"])) == 1
    assert table["n_units"].max() <= 5
    assert compared.summary[2].attrs["caption"].startswith("Matched: ")
    again = afferents.neural(
        stores["video"], tmp_path / "out", classes=["RA"], window_s=0.05, quiet=True
    )
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert written == {f"{name}.csv" for name in again.tables} | {
        *(path.name for path in again.pictures),
        "neural.json",
    }
