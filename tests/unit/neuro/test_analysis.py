"""What analyses find in spikes whose code is known."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.neuro import (
    accuracy_by_resolution,
    accuracy_by_units,
    cut_windows,
    decode,
    rate_slopes,
    stretch_match,
    without_gaps,
)
from afferents.neuro.speed import match_by_class
from afferents.spikes import Spikes

# trains here are drawn without a refractory time
pytestmark = pytest.mark.filterwarnings("ignore:.*refractory time:UserWarning")

SPEEDS = (40.0, 60.0, 80.0, 120.0)


def made(train, textures, speeds=SPEEDS, units=3, seconds=4.0, resolution_s=0.0, seed=0):
    """Spikes whose trains `train(rng, texture number, speed, unit, seconds)` gives."""
    rng = np.random.default_rng(seed)
    trials = pd.DataFrame(
        [(f"t{t}", t, v) for t in range(textures) for v in speeds],
        columns=["texture", "number", "speed_mm_s"],
    )
    trains = [
        [np.sort(train(rng, t, v, u, seconds)) for u in range(units)]
        for t, v in zip(trials["number"], trials["speed_mm_s"], strict=True)
    ]
    table = {"name": range(units), "class": ["PC"] * units, "resolution_s": [resolution_s] * units}
    return Spikes.from_trains(trains, table, trials.assign(duration_s=seconds))


def poisson(rng, rate, seconds):
    return rng.uniform(0, seconds, rng.poisson(rate * seconds))


def by_rate(rng, texture, speed, unit, seconds):
    """Each texture a rate of its own in each unit, at every speed."""
    return poisson(rng, [15, 60, 150][(texture + unit) % 3], seconds)


def by_timing(rng, texture, speed, unit, seconds):
    """The same rate for all: 40 spikes/s, in bursts that come 5, 10 or 20 times a second."""
    bursts = 5 * 2**texture
    starts = (np.arange(bursts * seconds) + rng.uniform()) / bursts
    within = rng.normal(0, 0.004, (len(starts), 40 // bursts))
    return np.clip(starts[:, None] + within, 0, seconds).ravel()


def over_a_surface(rng, texture, speed, unit, seconds):
    """Spikes at places on a surface that repeats, one for each texture; begun anywhere."""
    place_mm = np.random.default_rng([texture, unit]).uniform(0, 40, 25)
    way = speed * seconds
    all_mm = (place_mm + 40 * np.arange(-1, way // 40 + 2)[:, None]).ravel()
    when = (all_mm - rng.uniform(0, 40)) / speed + rng.normal(0, 2e-4, len(all_mm))
    return when[(when >= 0) & (when <= seconds)]


@pytest.mark.parametrize("across", ["speeds", "windows"])
def test_rates_are_read_at_any_resolution(across):
    windows = cut_windows(made(by_rate, 3), 0.5)
    for resolution_s in (0.5, 0.05, 0.01):
        found = decode(windows, resolution_s, across)
        assert set(found) == set(SPEEDS)
        assert min(found.values()) > 0.9


def test_timing_is_read_only_as_finely_as_it_is_there():
    """Bursts 50 to 200 ms apart: bins of 20 ms show them, the rate alone does not."""
    spikes = made(by_timing, 3, units=2)
    found = accuracy_by_resolution(spikes, (0.02, 0.5))
    accuracy = found[found["across"] == "speeds"].set_index("resolution_s")["accuracy"]
    assert accuracy[0.02] > 0.95
    assert accuracy[0.5] < 0.6
    by_units = accuracy_by_units(spikes, (1, 2), draws=2)
    last = by_units[(by_units["n_units"] == 2) & (by_units["across"] == "speeds")]
    codes = last.set_index("code")["accuracy"]
    assert codes["timing"] > 0.95 > 0.6 > codes["rate"]


def test_nothing_is_read_from_spikes_that_say_nothing():
    spikes = made(lambda rng, t, v, u, s: poisson(rng, 30, s), 4)
    found = accuracy_by_resolution(spikes, (0.02, 0.5))
    assert found["accuracy"].max() < 0.45
    assert (found["chance"] == 0.25).all()


def test_the_speed_held_out_is_not_learnt_from():
    """A texture's rate says nothing but at 40 mm/s; so nothing can be read at 40 mm/s."""

    def only_at_forty(rng, texture, speed, unit, seconds):
        return poisson(rng, 20 + 40 * texture if speed == 40 else 40, seconds)

    found = decode(cut_windows(made(only_at_forty, 3), 0.5), 0.5, "speeds")
    assert found[40.0] < 0.6
    inside = decode(cut_windows(made(only_at_forty, 3), 0.5), 0.5, "windows")
    assert inside[40.0] > 0.9


def test_a_texture_of_one_speed_is_refused_until_it_is_left_out():
    spikes = made(by_rate, 4)
    at = (spikes.trials["texture"] != "t3") | (spikes.trials["speed_mm_s"] == 40)
    some = spikes.select(trials=at.to_numpy())
    with pytest.raises(InputError, match=r"windows of 't3' .* those at 40 mm/s .* without_gaps"):
        accuracy_by_resolution(some, (0.5,))
    numbered = some.trials.drop(columns="number").assign(trial_id=range(some.n_trials))
    whole = without_gaps(replace(some, trials=numbered))
    assert set(whole.trials["texture"]) == {"t0", "t1", "t2"}


def test_resolutions_below_a_camera_s_frame_are_left_out():
    spikes = made(by_rate, 3, resolution_s=1 / 90)
    found = accuracy_by_resolution(spikes, (0.001, 0.005, 0.011, 0.1, 0.5, 2.0))
    assert sorted(found["resolution_s"].unique()) == [0.011, 0.1, 0.5]
    found = accuracy_by_resolution(spikes, (0.1, 0.15, 0.5), window_s=0.2)
    assert sorted(found["resolution_s"].unique()) == [0.1, 0.2]  # a window is the rate


def test_trains_over_a_surface_stretch_by_the_ratio_of_speeds():
    found = match_by_class(stretch_match(made(over_a_surface, 5, units=3), seconds=4.0))
    accuracy = found.set_index("stretched")["accuracy"]
    assert accuracy[True] > 0.9
    assert accuracy[False] < 0.5
    assert found["chance"].iloc[0] == pytest.approx(0.2)


def fibres(gaps, textures=55, units=39, repetitions=4, seed=0):
    """Made fibres of a monkey's fingertip: trains over a surface, 40, 80, 120 mm/s, with gaps."""
    rng = np.random.default_rng(seed)
    seconds = {40.0: 2.0, 80.0: 1.0, 120.0: 0.8}
    conditions = [(t, v, r) for t in range(textures) for v in seconds for r in range(repetitions)]
    trials = pd.DataFrame(
        [(f"t{t}", v, r, seconds[v]) for t, v, r in conditions],
        columns=["texture", "speed_mm_s", "repetition", "duration_s"],
    )
    never = rng.random((textures, units)) < gaps / 2
    missing = (rng.random((len(trials), units)) < gaps / 2 / (1 - gaps / 2)) | np.repeat(
        never, len(seconds) * repetitions, axis=0
    )
    trains = [
        [
            None if gone else np.sort(over_a_surface(rng, t, v, u, seconds[v]))
            for u, gone in enumerate(row)
        ]
        for (t, v, _), row in zip(conditions, missing, strict=True)
    ]
    classes = (["SA"] * 17 + ["RA"] * 15 + ["PC"] * 7)[:units]
    return Spikes.from_trains(trains, {"name": range(units), "class": classes}, trials)


def test_slopes_are_the_powers_that_rates_grow_by():
    powers = [0.0, 0.7, 1.2]
    spikes = made(
        lambda rng, t, v, u, s: poisson(rng, (20 + 10 * t) * (v / 40) ** powers[u], s),
        6,
        seconds=20.0,
    )
    found = rate_slopes(spikes)
    np.testing.assert_allclose(found["slope"], powers, atol=0.08)
    assert (found["n_textures"] == 6).all()
    silent = rate_slopes(made(lambda rng, t, v, u, s: poisson(rng, 30 * (u > 0), s), 3))
    assert np.isnan(silent["slope"][0])
    assert silent["n_textures"].tolist() == [0, 3, 3]


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: rate_slopes(made(by_rate, 1)), "at least 2 textures, found 1"),
        (lambda: rate_slopes(made(by_rate, 3, speeds=(40.0,))), "at least 2 speeds, found 1"),
        (
            lambda: rate_slopes(made(by_rate, 3, speeds=(40.0, np.nan))),
            "the speed of every trial, found 3 of 6",
        ),
        (
            lambda: cut_windows(made(by_rate, 2), 5.0),
            "trials of at least a window, 5 s, found a trial of 4 s",
        ),
        (
            lambda: decode(
                cut_windows(made(by_rate, 3, resolution_s=1 / 90), 0.5), 0.001, "speeds"
            ),
            r"bins of 0\.0111 s or more",
        ),
    ],
)
def test_what_can_not_be_analysed_is_refused(ask, said):
    with pytest.raises(InputError, match=said):
        ask()


def test_gaps_do_not_tell_the_texture():
    """The same rate everywhere, and each unit missing on one texture: nothing is to be read."""
    same = made(lambda rng, t, v, u, s: poisson(rng, 30, s), 4, units=5)
    number = same.trials["number"].to_numpy()
    trains = [
        [None if unit == number[t] else same.train(t, unit) for unit in range(5)]
        for t in range(same.n_trials)
    ]
    gapped = Spikes.from_trains(trains, same.units, same.trials)
    found = accuracy_by_resolution(gapped, (0.02, 0.5))
    assert (found["n_units"] == 1).all()
    assert found["accuracy"].max() < 0.5
    assert stretch_match(gapped)["accuracy"].mean() < 0.5
    with pytest.raises(InputError, match="recorded in every trial, found 4 with gaps"):
        accuracy_by_resolution(gapped.select(units=[0, 1, 2, 3]), (0.5,))
