"""Cells from a session to a model and live: in grey levels, and never mixed with px."""

import json
import math

import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.evaluation.data import open_data
from afferents.evaluation.plan import recommended
from afferents.folds.controls import apply_control
from afferents.folds.corruption import Corruption, corrupted
from afferents.folds.held_out import SPEED
from afferents.models.folder import load_model
from afferents.store.fingerprint import fingerprint
from afferents.store.zarr_store import open_responses

from .conftest import trained

SENSOR = 'name = "plain"\nlayout = "cells"\nrows = 5\ncolumns = 6\nrest_frame = 10\n'


@pytest.fixture(scope="module")
def sensor(tmp_path_factory):
    path = tmp_path_factory.mktemp("sensor") / "cells.toml"
    path.write_text(SENSOR)
    return path


@pytest.fixture(scope="module")
def store(small_session, sensor, tmp_path_factory):
    out = tmp_path_factory.mktemp("cells") / "cells.zarr"
    afferents.extract(small_session, out, sensor=sensor, workers=1, quiet=True)
    return out


@pytest.fixture(scope="module")
def model(store, tmp_path_factory):
    folder = tmp_path_factory.mktemp("model")
    trained(store, "sa-wave", folder)
    return folder / "sa-wave"


def test_a_store_holds_cells_where_markers_stand(store):
    recordings = open_responses(store)
    assert len(recordings) == 9
    for one in recordings:
        assert one.sa1.dims == ("time", "marker")
        assert one.sizes["marker"] == 30
        assert (one.sa1.units, one.ra1.units) == ("grey levels", "grey levels/frame")
        assert one.attrs["method"] == "cells"
        assert set(map(int, one.row.values)) == set(range(5))
        assert one.sa1[11:].max() > 1


def test_live_says_what_the_store_says(small_session, sensor, store):
    (one,) = (r for r in open_responses(store) if r.attrs["name"] == "2/40")
    with afferents.stream(small_session / "2/40", sensor=sensor, speed=math.inf) as fingertip:
        touches = list(fingertip)
    np.testing.assert_array_equal([t.sa1 for t in touches], one.sa1[10:])
    np.testing.assert_array_equal([t.ra1 for t in touches], one.ra1[10:])
    assert touches[-1].touching
    assert not touches[0].touching
    image = touches[-1].image("sa1")
    assert image.shape == (5, 6)
    with pytest.raises(InputError, match="found cells"):
        _ = touches[-1].speed


def test_rest_is_set_anew(small_session, sensor):
    with afferents.stream(small_session / "2/40", sensor=sensor, speed=math.inf) as fingertip:
        events = []
        for n, touch in enumerate(fingertip):
            if n == 1:
                fingertip.set_rest()
            events += touch.events
    assert events == ["rest was set: grey levels count from here"]


def test_signals_carry_their_unit(small_session, sensor, does, fails, tmp_path):
    asked = ("live", "--video", small_session / "2/40", "--sensor", sensor, "--speed", "max")
    does(*asked, "--signals", "sa1,ra1", "--to", tmp_path / "t.jsonl")
    header = json.loads((tmp_path / "t.jsonl").read_text().splitlines()[0])
    assert header["units"] == {"sa1": "grey levels", "ra1": "grey levels/frame"}
    assert header["layout"] == "cells"
    sentence = fails(*asked, "--signals", "sa1,shear", "--to", tmp_path / "u.jsonl")
    assert "found 'shear', which cells don't have" in sentence


def test_a_model_is_trained_and_runs_live(small_session, model, store, does):
    x = afferents.samples(store, "sa1", "wavenumbers", quiet=True)
    found = afferents.load_model(model).predict(x)
    right = found.texture.values[found.probability.argmax("texture")] == x.texture
    assert right.mean() > 0.6
    assert load_model(model)[0].sensor["layout"] == "cells"
    said = does(
        "live", "--model", model.with_suffix(".onnx"), "--video", small_session / "2/40",
        "--speed", "max", "--json",
    )  # fmt: skip
    predicted = [json.loads(line) for line in said.splitlines() if line.startswith("{")]
    assert any(one["texture"] for one in predicted)


def test_a_model_of_one_unit_is_not_asked_about_the_other(models, stores, store, model, fails):
    of_px = models["sa-wave"].with_suffix("")
    x = {data: afferents.samples(data, "sa1", "wavenumbers", quiet=True)
         for data in (stores["video"], store)}  # fmt: skip
    with pytest.raises(InputError, match="in grey levels, as sa-wave learnt from, found px"):
        afferents.load_model(model).predict(x[stores["video"]])
    with pytest.raises(InputError, match="in px, as sa-wave learnt from, found grey levels"):
        afferents.load_model(of_px).predict(x[store])
    sentence = fails("explain", of_px, store, "--out", store.parent / "why", "--quiet")
    assert "expected SA-I and RA-I in px, as sa-wave learnt from, found grey levels" in sentence


def test_a_store_of_cells_is_not_evaluated_together_with_one_of_markers(stores, store, fails):
    sentence = fails(
        "evaluate", stores["video"], store, "--out", store.parent / "both", "--models", "sa-wave",
        "--quiet",
    )  # fmt: skip
    assert "DATA: expected SA-I in one unit, found px in 1:3/60 and grey levels" in sentence


def test_what_is_recommended_can_be_learnt_from_cells_alone(store):
    recordings = [one.drop_vars("ra2") for one in open_responses(store)]
    assert recommended(recordings) == "sa-wave"
    assert recommended(open_responses(store)) == "vib-te-aug"


@pytest.mark.parametrize("name", ["sa-wave-vector", "shear"])
def test_models_of_displacement_are_refused(store, fails, name):
    sentence = fails("evaluate", store, "--out", store.parent / "r", "--models", name, "--quiet")
    assert "cells have no displacement" in sentence


def test_nothing_works_out_displacement_of_cells(store, sensor, tmp_path, fails):
    recordings = open_responses(store)
    with pytest.raises(InputError, match="found cells; take 'permuted'"):
        apply_control(recordings, "shuffled", SPEED)
    with pytest.raises(InputError, match="with the positions of markers"):
        corrupted(recordings[0], False, Corruption(markers=0.1))
    assert "'plain' of cells" in fails("align", tmp_path, "--sensor", sensor)


def test_copies_are_found_by_what_changes(store, rng):
    """Cells never move, so that all recordings of one length would seem to be copies."""
    assert len(open_data([str(store)])[0].responses) == 9
    one = open_responses(store)[0]
    felt = one.sa1[-1:].values + rng.normal(size=(400, 30))
    long = one.drop_dims("time").assign_coords(time=np.arange(400) / 30)
    long = long.assign(sa1=(one.sa1.dims, felt, one.sa1.attrs))
    long = long.assign(position=long.rest_position.expand_dims(time=long.time))
    assert "tracks" in fingerprint(long.assign_attrs(steady_s="null"))
