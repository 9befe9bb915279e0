"""A hexagonal fingertip goes the whole way: simulate, extract, evaluate, report, explain, live."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch

import afferents
from afferents import cli, dims
from afferents.evaluation.data import encode, find_sources, open_data
from afferents.evaluation.options import TrainingOptions
from afferents.evaluation.results import load_results
from afferents.evaluation.train import train_model
from afferents.lab.live import Network, Pace, ReplayedVideo
from afferents.models.export import export
from afferents.models.folder import load_model
from afferents.models.model import choose_models
from afferents.progress import Progress
from afferents.recordings.video import open_video
from afferents.reporting import explain
from afferents.reporting.data import read_figure_data
from afferents.store.zarr_store import open_responses

pytestmark = pytest.mark.system

ALONE = ("--quiet", "--workers", 1)
OWN = f"{Path(__file__).parent / 'own_markers.py'}"


def told(*arguments):
    cli.run([str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hexagonal") / "session"
    few = ("--textures", "a,g", "--speeds", "30,50,80", "--seconds", 2.6)
    told("simulate", folder, "--sensor", "hex127", *few, *ALONE)
    return folder


@pytest.fixture(scope="module")
def store(session):
    told("extract", session, session.parent / "s.zarr", "--sensor", "hex127", *ALONE)
    return session.parent / "s.zarr"


@pytest.fixture(scope="module")
def results(store):
    out = store.parent / "results"
    models = f"sa-se,ra-ste,ra-wave-vector,{OWN}:logistic"
    few = ("--models", models, "--held-out", "50", "--preset", "quick")
    told("evaluate", store, "--out", out, *few, *ALONE)
    return out


def trained(store, model):
    folder = store.parent / model.name
    (data,) = open_data([str(store)])
    options = TrainingOptions(preset="quick")
    card = train_model(data, model, folder, options, Progress(quiet=True))
    export(folder, folder.with_suffix(".onnx"))
    return card


@pytest.fixture(scope="module", params=["sa-se", "ra-wave-vector", "shear", f"{OWN}:network"])
def model(request, store):
    (wanted,) = choose_models(request.param)
    return wanted, trained(store, wanted), store.parent / wanted.name


def test_the_report_shows_no_pixels_beside_the_markers(results):
    summary = json.loads((results / "summary.json").read_text())
    assert set(summary["models"]) == {"sa-se", "ra-ste", "ra-wave-vector", "own-logistic"}
    data, notes = read_figure_data(load_results(results), Progress(quiet=True))
    assert not notes
    shown = np.isfinite(np.concatenate([row.images for row in data.frames["sa1", 1]]))
    assert 0.6 < shown.mean() < 0.8
    assert not shown[:, 0, 0].any()
    assert shown[:, 6, 6].all()


def test_what_is_live_is_what_was_evaluated(session, store, model):
    wanted, card, folder = model
    assert card.sensor["name"] == "hex127"
    limit = "shorter than twice the distance of the pins, 3.6 mm (here the bumps of 3)."
    assert (limit in " ".join(card.describe())) == (wanted.name == "ra-wave-vector")
    source = ReplayedVideo(open_video(session / "3" / "50" / "video.mp4"), Pace(math.inf))
    percepts = afferents.lab.live.stream([source], folder.with_suffix(".onnx"))
    live = {p.time_s: list(p.probabilities.values()) for p in percepts if p.probabilities}
    (responses,) = (r for r in open_responses(store) if r.attrs["name"] == "3/50")
    (made_of,) = find_sources(wanted, open_data([str(store)])[0].encodings)
    samples = encode(responses, made_of, "all")
    network = Network(folder.with_suffix(".onnx"))
    _, deployed = load_model(folder)
    assert network.card == card
    with torch.inference_mode():
        expected = deployed(torch.from_numpy(np.ascontiguousarray(samples.values)))[0].numpy()
    times = np.array(list(live))
    for stop_s, offline in zip(samples[dims.STOP].values, expected, strict=True):
        at = times[abs(times - stop_s).argmin()]
        assert abs(at - stop_s) < 0.005  # a frame later or earlier is 0.011 s away
        np.testing.assert_allclose(live[at], offline, rtol=1e-4, atol=1e-4)


def test_explain_asks_of_pixels_markers_and_parts(store, model, tmp_path, monkeypatch):
    monkeypatch.setattr(explain, "SAMPLES", 3)
    wanted, _, folder = model
    told("explain", folder, store, "--out", tmp_path / "why", "--quiet")
    facts = json.loads((tmp_path / "why" / "explanation.json").read_text())
    kind, shape = ("parts", (2, 6)) if wanted.name == "shear" else ("markers", (2, 12, 14))
    assert np.array(facts[kind]["loss_nats"]).shape == shape
    assert np.ptp(facts[kind]["loss_nats"]) > 0
    assert (tmp_path / "why" / f"{kind}.png").is_file()
