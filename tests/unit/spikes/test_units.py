"""Units fire as their equations say, and alike on every run."""

import numpy as np
import pytest

from afferents.spikes.afferents import afferent_classes
from afferents.spikes.units import RATE_HZ, UNIT_MODELS, Drive, on_steps

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
