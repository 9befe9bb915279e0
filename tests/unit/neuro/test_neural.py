"""`afferents neural`: from a store of the rig to tables, figures and sentences."""

import json

import pandas as pd
import pytest

import afferents
from afferents.encodings.spikes import SpikeRateEncoding

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def found(stores, tmp_path_factory):
    out = tmp_path_factory.mktemp("neural") / "out"
    return afferents.neural(stores["video"], out, window_s=0.05, quiet=True), out


def test_tables_figures_and_sentences_are_written(found):
    results, out = found
    assert {path.name for path in out.iterdir()} == {
        *(
            f"{name}.csv"
            for name in ("rates", "resolution", "units", "slopes", "stretch", "exponents")
        ),
        *(f"{name}.png" for name in ("raster", "resolution", "units", "slopes", "stretch")),
        "neural.json",
    }
    assert set(results.spikes.units["class"]) <= {"SA", "RA", "PC"}
    again = pd.read_csv(out / "slopes.csv")
    assert len(again) == results.spikes.n_units
    facts = json.loads((out / "neural.json").read_text())
    assert facts["units"]["model"] == "izhikevich"
    assert any("spikes/s" in sentence for sentence in results.sentences)
    assert any("stretched" in sentence for sentence in results.sentences)


def test_it_goes_on_over_its_own_folder_and_no_other(found, run, stores, tmp_path):
    _, out = found
    asked = (
        "neural",
        stores["video"],
        "--classes",
        "RA",
        "--units",
        "lif",
        "--window-s",
        "0.05",
        "--json",
    )
    code, said, _ = run(*asked, "--out", out)
    assert code == 0
    assert json.loads(said)["units"]["classes"].keys() == {"RA"}
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.tex").touch()
    code, _, err = run(*asked, "--out", other)
    assert code == 2
    assert "'thesis.tex' in it" in err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--units", "hodgkin"), "one of izhikevich, lif"),
        (("--classes", "SA,SAII"), "some of SA, RA, PC"),
    ],
)
def test_bad_input_is_refused_in_a_sentence(run, stores, tmp_path, options, said):
    code, _, err = run("neural", stores["video"], "--out", tmp_path / "x", *options)
    assert code == 2
    assert said in err
    assert not (tmp_path / "x").exists()


NATURAL = """
file = "fibres.csv"

[columns]
fibre = "unit"

[trials]
duration_s = 0.3
"""


def test_fibres_are_put_beside(found, stores, tmp_path):
    """Fibres in a table, of which there are fewer: as many artificial units are compared."""
    results, _ = found
    few = results.spikes.of_class("RA").select(units=[40, 80, 120, 200, 260]).window(0, 0.3)
    few.to_table().to_csv(tmp_path / "fibres.csv", index=False)
    (tmp_path / "fibres.toml").write_text(NATURAL)
    beside = afferents.neural(
        stores["video"],
        tmp_path / "out",
        classes=["RA"],
        window_s=0.05,
        natural=tmp_path / "fibres.toml",
        quiet=True,
    )
    assert (tmp_path / "out" / "beside.png").stat().st_size > 10_000
    table = pd.read_csv(tmp_path / "out" / "beside_resolution.csv")
    assert set(table["population"]) == {"artificial", "natural"}
    assert len(set(table["n_units"])) == 1
    assert table["n_units"].max() <= 5
    assert any(sentence.startswith("Compared: ") for sentence in beside.sentences)


def test_models_learn_from_spikes_through_the_same_folds(stores, tmp_path):
    """Rates of units a marker, and intervals of units that hear; one model of one's own."""
    rates = afferents.Model(
        "rates",
        channel="ra1_spikes",
        encoding=SpikeRateEncoding(rate_frames=8),
        classifier="discriminant",
    )
    given = {"protocol": "nested", "preset": "quick", "quiet": True}
    seen = afferents.evaluate(stores["video"], out=tmp_path / "seen", models=[rates], **given)
    assert seen.accuracy["accuracy"].between(0, 1).all()
    assert set(seen.predictions["model"]) == {"rates"}
    heard = afferents.evaluate(
        stores["audio"], out=tmp_path / "heard", models=["spike-timing"], **given
    )
    assert set(heard.predictions["model"]) == {"spike-timing"}
    assert len(heard.predictions) > 10
