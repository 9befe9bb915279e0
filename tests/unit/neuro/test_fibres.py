"""Fibres of the fingertip are read as the gallery shows it: from a made file, and the real one."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from tests.unit.neuro.conftest import FINGERTIP, lasting_s

from afferents.errors import InputError
from afferents.neuro import (
    accuracy_by_resolution,
    cut_windows,
    decode,
    left_out,
    without_gaps,
)

ROOT = Path(__file__).resolve().parents[3]
REAL = ROOT / "../shared/datasets/natural/RawPAFData.mat"
# trains here are drawn without a refractory time
pytestmark = pytest.mark.filterwarnings("ignore:.*refractory time:UserWarning")
CLASSES = ["SA", "SA", "RA", "RA", "PC"]
N_TEXTURES, N_FIBRES, N_REPETITIONS = 6, 5, 4


def made(rate, seed=0, repetitions=N_REPETITIONS):
    """Poisson trains (speed, texture, fibre, repetition), of `rate(texture, fibre, speed)`."""
    rng = np.random.default_rng(seed)
    trains = np.empty((3, N_TEXTURES, N_FIBRES, repetitions), object)
    for at in np.ndindex(trains.shape):
        speed = list(FINGERTIP)[at[0]]
        seconds = lasting_s(speed, at[2])
        n = rng.poisson(rate(at[1], at[2], speed) * seconds)
        trains[at] = np.sort(rng.uniform(0, seconds, n))
    return trains


def by_texture(texture, fibre, speed):
    """From 10 to 110 spikes/s at 40 mm/s, ordered by fibre, in proportion to speed."""
    return (10 + 20 * ((texture * (1 + 4 * (fibre % 2)) + fibre) % N_TEXTURES)) * speed / 40


@pytest.fixture
def recorded():
    """Like the real ones: few fourth repetitions, and one fibre that was lost before a texture."""
    there = np.random.default_rng(5).random((3, N_TEXTURES, N_FIBRES, N_REPETITIONS)) > 0.4
    there[..., :2] = True
    there[:, 5, 4] = False
    there[:, 0, 0, 0] = False
    return there


@pytest.fixture
def read(tmp_path, write_fingertip, read_fibres):
    """Read trains from a file of that layout."""

    def written(trains, recorded):
        return read_fibres(write_fingertip(tmp_path / "made.mat", trains, recorded, CLASSES))

    return written


def silent_at_times(texture, fibre, speed):
    return 0.5 if fibre == 2 and texture < 3 else by_texture(texture, fibre, speed)


def test_every_train_gap_silence_and_duration_is_read(read, recorded, tmp_path):
    """The shape of an empty cell says nothing: each occurs among the silent and the missing."""
    trains = made(silent_at_times)
    spikes = read(trains, recorded)
    assert spikes.units["class"].tolist() == CLASSES
    assert spikes.n_trials == 3 * N_TEXTURES * N_REPETITIONS
    for number, trial in spikes.trials.iterrows():
        v = list(FINGERTIP).index(trial["speed_mm_s"])
        for fibre in range(N_FIBRES):
            at = (v, int(trial["texture"]) - 1, fibre, int(trial["repetition"]))
            assert spikes.recorded[number, fibre] == recorded[at]
            expected = trains[at] if recorded[at] else []
            np.testing.assert_allclose(spikes.train(number, fibre), expected)
            if recorded[at]:
                duration_s = lasting_s(trial["speed_mm_s"], fibre)
                assert spikes.durations_s[number, fibre] == pytest.approx(duration_s)
    assert (spikes.counts() == 0).sum() > 3
    file = scipy.io.loadmat(tmp_path / "made.mat")
    cells = [one for cells in file["spikes"].ravel() for one in cells.ravel()]
    assert {one.shape for one in cells if not one.size} == {(0, 0), (0, 1), (1, 0)}


@pytest.mark.skipif(not REAL.is_file(), reason=f"the real file is not at {REAL}")
def test_the_real_file_has_durations_of_its_own_at_the_fastest_speed(read_fibres):
    """Of 27 fibres, 11 were recorded for 0.8 s and 16 for 0.5 s."""
    spikes = read_fibres(REAL)
    fastest = (spikes.trials["speed_mm_s"] == 120).to_numpy()
    of_fibre = np.fmax.reduce(spikes.durations_s[fastest])
    found = dict(zip(*np.unique(of_fibre[~np.isnan(of_fibre)], return_counts=True), strict=True))
    assert found == {0.5: 16, 0.8: 11}


def test_texture_is_read_at_a_speed_held_out_in_spite_of_gaps(read, recorded):
    """Rates grow in proportion to speed, so trains that are stretched have rates that agree."""
    fibres = read(made(by_texture), recorded)
    whole = without_gaps(fibres)
    assert whole.recorded.all()
    assert left_out(fibres, whole) == (
        "Without gaps: 2 of 2 SA, 2 of 2 RA, 1 of 1 PC units, 5 of 6 textures, repetitions "
        "2 at 40 mm/s, 2 at 80 mm/s, 2 at 120 mm/s; 150 of 263 recorded trains."
    )
    table = accuracy_by_resolution(whole, (0.25,), 0.25, stretched=True)
    assert set(table["n_trials"]) == {5 * 2 * 3}
    np.testing.assert_allclose(table["chance"], 1 / 5)
    by_class = table.pivot_table(index="class", columns="across", values="accuracy")
    assert (by_class.loc[["SA", "RA"], "stretched"] > 0.8).all()
    assert (by_class.loc[["SA", "RA"], "speeds"] > 0.5).all()
    assert by_class["speeds"].mean() < by_class["stretched"].mean() - 0.15


def test_what_units_resolve_is_stretched_with_their_trains(read, recorded):
    """Spikes between frames 10 ms apart are 30 ms apart where 120 mm/s becomes 40 mm/s."""
    whole = without_gaps(read(made(by_texture), recorded)).of_class("PC")
    coarse = replace(whole, units=whole.units.assign(resolution_s=0.01))
    table = accuracy_by_resolution(coarse, (0.01, 0.025, 0.03, 0.25), 0.25, stretched=True)
    found = table.groupby("across")["resolution_s"].apply(list)
    assert found["speeds"] == [0.01, 0.025, 0.03, 0.25]
    assert found["stretched"] == [0.03, 0.25]


def test_gaps_change_nothing_in_what_is_left(read, recorded):
    """Of a texture, fibre and speed, the first repetitions that were recorded: nothing else."""
    trains = made(by_texture)
    whole = without_gaps(read(trains, recorded))
    assert whole.trials.groupby(["texture", "speed_mm_s"]).size().unique() == [2]
    for number, trial in whole.trials.iterrows():
        v, t = list(FINGERTIP).index(trial["speed_mm_s"]), int(trial["texture"]) - 1
        for unit, name in enumerate(whole.units.index):
            one = v, t, int(name[1:])
            repetition = np.flatnonzero(recorded[one])[trial["repetition"]]
            expected = trains[one][repetition]
            expected = expected[expected < trial["duration_s"]]
            np.testing.assert_allclose(whole.train(number, unit), expected)
    assert without_gaps(whole) is whole


def test_too_many_gaps_are_refused(read, recorded):
    fibres = read(made(by_texture), recorded)
    one = (fibres.trials["texture"] == "1").to_numpy()
    with pytest.raises(InputError, match="on 2 textures or more at every speed, found none"):
        without_gaps(fibres.select(one))
    windows = cut_windows(without_gaps(fibres), 0.25)
    assert set(decode(windows, 0.25, "speeds", tested=80.0)) == {80.0}
    with pytest.raises(InputError, match=r"a speed of the trials \(40, 80, 120\), found 60"):
        decode(windows, 0.25, "speeds", tested=60.0)
