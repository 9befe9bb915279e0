"""Units fire as their equations say, and alike on every run."""

import numpy as np
import pytest

from afferents.spikes.afferents import afferent_classes
from afferents.spikes.units import RATE_HZ, UNIT_MODELS, Drive, UnitModel, on_steps

SECONDS = 4.0


def constant(currents, seconds=SECONDS):
    """A drive of units with a constant current each."""
    n = round(seconds * RATE_HZ)
    current = np.array([currents], np.float32)
    return Drive(current, np.zeros(n, np.int64), np.zeros(n, np.float32))


def rates(model, currents, values):
    fired = UNIT_MODELS[model].fire(constant(currents), values)
    return np.bincount(fired.unit, minlength=len(currents)) / SECONDS, fired


@pytest.mark.parametrize(("tau_ms", "refractory_ms"), [(20.0, 2.0), (10.0, 1.3), (3.0, 1.0)])
def test_a_leaky_unit_fires_as_often_as_its_formula_says(tau_ms, refractory_ms):
    currents = np.array([0.5, 0.99, 1.1, 2.0, 5.0, 20.0])
    found, _ = rates("lif", currents, {"tau_ms": tau_ms, "refractory_ms": refractory_ms})
    with np.errstate(invalid="ignore"):
        charging = tau_ms * np.log(currents / (currents - 1))
    expected = np.where(currents > 1, 1e3 / (refractory_ms + charging), 0)
    np.testing.assert_allclose(found, expected, atol=2 / SECONDS)
    assert (found[:2] == 0).all()


def test_intervals_of_a_leaky_unit_are_finer_than_a_step():
    _, fired = rates("lif", [3.0], {"tau_ms": 20.0, "refractory_ms": 2.0})
    intervals = np.diff(fired.time_s)
    expected = (2 + 20 * np.log(3 / 2)) / 1e3
    np.testing.assert_allclose(intervals, expected, atol=0.02e-3)


def test_izhikevich_s_kinds_differ_as_published():
    """Regular spiking adapts: intervals grow. Fast spiking does not, and fires faster."""
    regular = afferent_classes()["SA"].values("izhikevich")
    fast = afferent_classes()["RA"].values("izhikevich")
    slow_rate, adapting = rates("izhikevich", [10.0], regular)
    fast_rate, steady = rates("izhikevich", [10.0], fast)
    assert 2 * slow_rate[0] < fast_rate[0]
    intervals = np.diff(adapting.time_s)
    assert intervals[0] < 0.7 * intervals[-1]
    assert np.ptp(np.diff(steady.time_s)[2:]) < 2e-3


@pytest.mark.parametrize("model", UNIT_MODELS)
@pytest.mark.parametrize("afferent", afferent_classes().values(), ids=lambda a: a.name)
def test_more_current_means_more_spikes_and_none_means_none(model, afferent):
    values = afferent.values(model)
    found, _ = rates(model, [0.0, 3.0, 10.0, 30.0, 100.0], values)
    assert found[0] == 0
    assert (np.diff(found) >= 0).all()
    assert found[-1] > 50


@pytest.mark.parametrize("model", UNIT_MODELS)
def test_units_do_not_hear_each_other(model):
    values = afferent_classes()["SA"].values(model)
    rng = np.random.default_rng(1)
    current = (20 * rng.random((90, 7))).astype(np.float32)
    row, weight = on_steps(np.arange(90) / 90, 0.0, 1.0)
    together = UNIT_MODELS[model].fire(Drive(current, row, weight), values)
    for unit in range(7):
        alone = UNIT_MODELS[model].fire(Drive(current[:, [unit]], row, weight), values)
        np.testing.assert_array_equal(together.time_s[together.unit == unit], alone.time_s)


def test_every_number_has_a_unit_and_a_source():
    for afferent in afferent_classes().values():
        for model in UNIT_MODELS.values():
            given = getattr(afferent, model.name)
            assert set(given) == {"gain", *model.parameters}
            assert all(one.unit and len(one.source) > 10 for one in given.values())
    assert len(afferent_classes()["PC"].bands_hz) == 8


def test_steps_lie_between_frames():
    row, weight = on_steps(np.array([0.0, 0.01, 0.02]), 0.0, 0.03)
    at = np.round(row * 0.01 + weight * 0.01, 6)
    expected = np.minimum(np.arange(60) / RATE_HZ, 0.02)
    np.testing.assert_allclose(at, expected, atol=1e-6)
    assert isinstance(UNIT_MODELS["lif"], UnitModel)
