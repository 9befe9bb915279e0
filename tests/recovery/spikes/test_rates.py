"""Firing rates on a session that nothing was fitted on: another seed of the rig, other drums."""

import numpy as np
import pytest

from afferents import cli
from afferents.neuro.neural import spikes_of_store
from afferents.spikes.units import UNIT_MODELS

REPORTED_HZ = {"SA": (10, 100), "RA": (10, 100), "PC": (20, 400)}
"""Between these lies the mean rate over textures: tens of spikes/s, and up to hundreds."""


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rates")
    asked = ("--textures", "a,c,g", "--speeds", 80, "--seconds", 2.6, "--seed", 2027)
    session, store = folder / "session", folder / "session.zarr"
    for command in (("simulate", session, *asked), ("extract", session, store)):
        words = [*map(str, command), "--workers", "1", "--quiet"]
        cli.run(words)
    return store


@pytest.fixture(scope="module", params=UNIT_MODELS)
def spikes(request, store):
    return spikes_of_store(store, model=request.param)


def rates(spikes, name, *textures):
    trials = spikes.trials["texture"].isin(textures).to_numpy()
    return spikes.of_class(name).select(trials=trials).rates()


@pytest.mark.parametrize("name", REPORTED_HZ)
def test_textures_that_slide_drive_units_as_often_as_fibres(spikes, name):
    low, high = REPORTED_HZ[name]
    found = rates(spikes, name, "1", "3")
    assert low < found.mean() < high
    assert found.max() < 550, "no nerve fibre does more"


def test_a_smooth_drum_leaves_rapidly_adapting_and_pacinian_units_nearly_silent(spikes):
    for name, share in (("RA", 0.1), ("PC", 0.01)):
        smooth, bumps = rates(spikes, name, "0").mean(), rates(spikes, name, "1", "3").mean()
        assert smooth < share * bumps


def test_a_unit_of_the_lowest_band_follows_the_bumps(spikes):
    """Drum c at 80 mm/s passes 57 bumps/s: spikes gather in one part of their cycle."""
    trial = int(np.flatnonzero(spikes.trials["texture"] == "1")[0])
    times = spikes.train(trial, int(np.flatnonzero(spikes.units.index == "PC-0")[0]))
    bumps_hz = 180 * 80 / (np.pi * 80)
    locked = [np.abs(np.exp(2j * np.pi * hz * times).mean()) for hz in (bumps_hz, 1.1 * bumps_hz)]
    assert locked[0] > 0.35
    assert locked[1] < 0.2
