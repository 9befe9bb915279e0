"""What decided, of models of every kind: pictures, numbers, and sentences for what can't be."""

import json
import shutil

import numpy as np
import pytest
import xarray as xr

from afferents.reporting import explain
from afferents.reporting.explain import Examples, lose_frequencies


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(explain, "SAMPLES", 2)


def explained(run, model, store, out):
    code, said, err = run("explain", model, store, "--out", out, "--quiet")
    assert code == 0, err
    return said, json.loads((out / "explanation.json").read_text())


@pytest.mark.parametrize("name", ["sa-se", "ra-ste", "ra-wave-vector"])
def test_of_images_the_markers_are_told(run, models, stores, tmp_path, name):
    said, facts = explained(run, models[name].with_suffix(""), stores["video"], tmp_path / "why")
    assert facts["speeds_mm_s"] == [40]
    assert facts["not_learnt_from"] is True
    assert "at 40 mm/s, not learnt from:" in said
    lost = np.array(facts["markers"]["loss_nats"])
    assert lost.shape == (3, 19, 19)
    assert np.ptp(lost) > 0
    pictures = {path.name for path in (tmp_path / "why").glob("*.png")}
    waves = {"waves.png"} if name == "ra-wave-vector" else set()
    assert pictures == {"markers.png"} | waves
    if waves:
        assert np.array(facts["waves"]["loss_nats"]).shape == (3, 19, 10)


def test_of_vibration_the_frequencies_are_told(run, models, stores, tmp_path):
    model = models["vib-te-aug"].with_suffix("")
    _, facts = explained(run, model, stores["audio"], tmp_path / "why")
    assert np.array(facts["frequencies"]["loss_nats"]).shape == (3, 50)
    assert facts["frequencies"]["frequency"][0] == pytest.approx(1.5)
    assert len(facts["harmonics"]["harmonic"]) == len(facts["harmonics"]["loss_nats"])
    assert (tmp_path / "why" / "harmonics.png").is_file()


def test_multiples_are_those_of_a_drums_own_rate():
    """A model that hears the drum's own line alone: 7.16 Hz at 40 mm/s, 14.3 Hz at 80 mm/s."""
    frequency = np.arange(0, 50, 0.25)
    speeds = np.array([40.0, 80.0])
    own = np.array([np.abs(frequency - v * 45 / (np.pi * 80)).argmin() for v in speeds])
    values = np.zeros((2, 1, len(frequency)), np.float32)
    values[[0, 1], 0, own] = 1
    samples = xr.DataArray(
        values,
        {"frequency": frequency, "speed_mm_s": ("sample", speeds)},
        ("sample", "channel", "frequency"),
        attrs={"named_by_spacing": True},
    )

    def predict(given):
        heard = 0.8 * given[:, 0].max(axis=1) + 0.1
        return np.log(np.stack([heard, 1 - heard], axis=1))

    examples = Examples(None, samples, ("4", "0"), np.array([0, 0]))
    lost = lose_frequencies(predict, examples)["harmonics"]
    assert lost.harmonic.values[lost.values.argmax()] == 1
    assert (lost.sel(harmonic=[0.5, 1.5, 2, 3]) == 0).all()


def test_what_can_not_be_explained(run, models, stores, tmp_path):
    def refused(*arguments):
        code, _, said = run("explain", *arguments, "--out", tmp_path / "why", "--quiet")
        assert code == 2
        assert not (tmp_path / "why").exists()
        return said

    other = tmp_path / "other"
    shutil.copytree(models["sa-se"].with_suffix(""), other)
    card = json.loads((other / "model.json").read_text())
    (other / "model.json").write_text(json.dumps(card | {"fps_hz": 30}))
    assert "expected 30 frames/s, as sa-se learnt from, found 90" in refused(other, stores["video"])
    sound, sight = (models[name].with_suffix("") for name in ("vib-te-aug", "sa-se"))
    assert "a model's folder" in refused(tmp_path, stores["audio"])
    said = "expected sa1 in the form that sa-se learnt from, found none in 1/30"
    assert said in refused(sight, stores["audio"])
    assert refused(sound, stores["video"]).startswith("afferents:")


@pytest.mark.parametrize(("n", "n_rows", "n_columns"), [(3, 1, 4), (7, 2, 4), (13, 2, 7)])
def test_images_fill_the_figure_however_many_textures_there_are(n, n_rows, n_columns):
    axes = {"texture": [str(i) for i in range(n)], "row": range(5), "column": range(5)}
    lost = xr.DataArray(np.random.default_rng(0).normal(size=(n, 5, 5)), axes, tuple(axes))
    figure = explain.explanation_figure("markers", lost, "a test")
    figure.draw_without_rendering()
    images = [one for one in figure.axes if one.images and one.get_visible()]
    assert len(images) == n + 1
    boxes = np.array([one.get_position().extents for one in images])
    assert (len({*boxes[:, 1].round(3)}), len({*boxes[:, 0].round(3)})) == (n_rows, n_columns)
    assert boxes[:, 2].max() > 0.7
    assert boxes[:, 0].min() < 0.2
