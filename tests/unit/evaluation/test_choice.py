"""Encodings that are chosen for a data set, and what is refused before anything is trained."""

import importlib.util
from pathlib import Path

import pytest

import afferents
from afferents.encodings.base import SignalInfo
from afferents.encodings.settings import ENCODINGS, Encodings
from afferents.errors import InputError
from afferents.evaluation.data import choose_encodings, open_data
from afferents.recordings.described import PACKAGED

SCRIPT = Path(__file__).resolve().parents[3] / "scripts/simulated_taxels.py"
PUBLISHED = SignalInfo(44100.0, 60.0, 60.0, 10.0, 100.0, 600.0, 1, True)
TAXELS = SignalInfo(200.0, 7.0, 7.0, 10.0, 60.0, 70.0, 4, False)


@pytest.fixture(scope="module")
def taxels(tmp_path_factory):
    """The worked example of docs/your-data.md."""
    spec = importlib.util.spec_from_file_location("simulated_taxels", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    folder = tmp_path_factory.mktemp("taxels")
    script.write(folder)
    return folder


@pytest.mark.parametrize("name", ENCODINGS)
def test_the_published_session_keeps_the_defaults(name):
    assert ENCODINGS[name].suiting(PUBLISHED, {}) == {}


@pytest.mark.parametrize("rate_hz", [20.0, 35.7, 100.0, 199.0, 400.0, 1000.0, 8000.0])
@pytest.mark.parametrize("shortest_s", [1.5, 5.0, 60.0])
@pytest.mark.parametrize("speeds", [(10, 10), (5, 20), (10, 150), (1, 500)])
@pytest.mark.parametrize("n_channels", [1, 16])
def test_what_is_chosen_fits_the_shortest_recording(rate_hz, shortest_s, speeds, n_channels):
    n = int(shortest_s * rate_hz)
    shortest_s = n / rate_hz
    known = SignalInfo(
        rate_hz, shortest_s, 60.0, *speeds, speeds[0] * shortest_s, n_channels, False
    )
    chosen = Encodings.suiting({}, "data", known)
    for name in ("spectral", "orders"):
        chosen.of(name).require(n, rate_hz, "a recording")
    assert chosen.of("spectral").model_bins == 200  # as many as the network needs
    per_mm = chosen.of("orders").per_mm
    assert len(per_mm) > 1


def test_the_axis_of_textures_is_what_is_heard_at_all_speeds():
    orders = Encodings.suiting({}, "data", TAXELS).of("orders")
    assert orders.window_s is None  # too short for as many samples as at 44.1 kHz
    assert orders.highest_hz == pytest.approx(95)
    assert orders.highest_per_mm == pytest.approx(95 / 60)
    assert orders.lowest_per_mm == pytest.approx(2 / 70)  # two periods in 70 mm


def test_what_is_given_stays_and_the_rest_goes_with_it():
    given = {"spectral": {"window_s": 3.0, "remove_mean": False}}
    spectral = Encodings.suiting(given, "data", TAXELS).of("spectral")
    assert (spectral.window_s, spectral.stride_s, spectral.remove_mean) == (3.0, 1.5, False)
    assert spectral.fft_points is None  # 600 samples have bins enough
    wanted = Encodings.suiting(given, "data", TAXELS, {"window_s": 1.0}).changed(window_s=1.0)
    assert (wanted.of("spectral").window_s, wanted.of("spectral").fft_points) == (1.0, 400)


def test_fabricslide_keeps_its_encodings(tmp_path):
    form = afferents.DATA_SETS["dataset"](tmp_path, PACKAGED["fabricslide"]).encodings
    known = SignalInfo(1000 / 28, 4.5, 40.0, 10.0, 150.0, 400.0, 16, False)
    suiting = Encodings.suiting(form, "data", known)
    assert suiting.describe() == Encodings.suiting(form, "data").describe()


def test_from_a_folder_of_csv_files_to_results(taxels, tmp_path, capsys):
    looked = afferents.inspect(taxels / "dataset.toml", tmp_path / "looked")
    assert looked.problems == []
    assert "24 recordings of 3 textures" in looked.sentences[0]
    found = afferents.evaluate(
        taxels / "dataset.toml", tmp_path / "r", "order-te-speed-known", workers=1
    )
    printed = capsys.readouterr()
    assert "orders: window_s = whole recordings" in printed.out + printed.err
    summary = found.summary
    assert summary["models"]["order-te-speed-known"]["nested"]["mean_accuracy"] > 0.6
    assert (summary["data"][0]["kind"], summary["data"][0]["simulated"]) == ("dataset", True)


@pytest.fixture
def described(taxels):
    """Write another description of the same files."""

    def write(name, old, new):
        text = (taxels / "dataset.toml").read_text()
        assert old in text
        (taxels / name).write_text(text.replace(old, new))
        return taxels / name

    return write


def test_another_description_of_the_same_files_is_other_data(taxels, described):
    (one,) = open_data([taxels / "dataset.toml"])
    (two,) = open_data([described("two.toml", "taxel*", "taxel[12]")])
    assert one.origin.fingerprint != two.origin.fingerprint
    assert choose_encodings([one], "all", {}).of("orders").bins_per_octave == 8


def test_what_can_not_be_learnt_is_refused_before_training(fails, taxels, described, tmp_path):
    out = ("--out", tmp_path / "r", "--quiet")
    few = fails("evaluate", taxels / "dataset.toml", *out, "--models", "vib-te-aug", "--bins", 100)
    assert "spectra: expected at least 135 bins for this network, found 100" in few
    one = described("one.toml", "{speed}mmps", "20mmps")
    one.write_text(one.read_text().replace("[files]", "[files]\nspeed_mm_s = 20"))
    alone = fails("evaluate", one, *out, "--models", "order-te")
    assert "with one speed no model can be tested at another" in alone
    assert not (tmp_path / "r").exists()


def test_where_no_speed_is_known_something_else_is_held_out(described, tmp_path):
    """What names call a speed is a condition here."""
    source = described("none.toml", "{speed}", "{pace}")
    options = {"split": "pace", "workers": 1, "quiet": True}
    found = afferents.evaluate(source, tmp_path / "r", "ridge-te", **options)
    assert found.summary["groups"] == ["10", "20", "40", "60"]
    with pytest.raises(InputError, match="speed"):
        afferents.evaluate(source, tmp_path / "o", "order-te", **options)
