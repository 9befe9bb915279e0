"""Fibres like those of the monkey's fingertip: with gaps, and durations of their own."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from afferents.errors import InputError
from afferents.neuro import (
    accuracy_by_resolution,
    cut_windows,
    decode,
    left_out,
    without_gaps,
)
from afferents.spikes import Spikes

ROOT = Path(__file__).resolve().parents[3]
REAL = ROOT / "../shared/datasets/natural/RawPAFData.mat"
# trains here are drawn without a refractory time
pytestmark = pytest.mark.filterwarnings("ignore:.*refractory time:UserWarning")
CLASSES = ["SA", "SA", "RA", "RA", "PC"]
N_TEXTURES, N_FIBRES, N_REPETITIONS = 6, 5, 4
FINGERTIP = {40.0: 2.0, 80.0: 1.0, 120.0: 0.8}
"""Speeds, mm/s, and how long recordings last, s; at the fastest, every other fibre's last less."""


def lasting_s(speed, fibre):
    """How long a fibre was recorded at a speed."""
    return 0.5 if speed == 120.0 and fibre % 2 else FINGERTIP[speed]


def made(rate):
    """Poisson trains (speed, texture, fibre, repetition), of `rate(texture, fibre, speed)`."""
    rng = np.random.default_rng(0)
    trains = np.empty((3, N_TEXTURES, N_FIBRES, N_REPETITIONS), object)
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


def hold(trains, recorded):
    """Return such trains as spikes, with gaps where none was recorded."""
    trials, rows, durations_s = [], [], []
    for v, t, r in np.ndindex(3, N_TEXTURES, N_REPETITIONS):
        speed, there = list(FINGERTIP)[v], recorded[v, t, :, r]
        if there.any():
            pairs = zip(trains[v, t, :, r], there, strict=True)
            rows.append([train if is_there else None for train, is_there in pairs])
            durations_s.append([lasting_s(speed, fibre) for fibre in range(N_FIBRES)])
            trials.append((str(t + 1), speed, r))
    units = {"name": [f"n{fibre}" for fibre in range(N_FIBRES)], "class": CLASSES}
    table = pd.DataFrame(trials, columns=["texture", "speed_mm_s", "repetition"])
    return Spikes.from_trains(rows, units, table, durations_s=durations_s)


@pytest.mark.skipif(not REAL.is_file(), reason=f"the real file is not at {REAL}")
def test_the_real_file_is_read_as_the_gallery_shows_it():
    """Gaps are no silence; at 120 mm/s, 11 of 27 fibres were recorded for 0.8 s, 16 for 0.5 s."""
    page = ast.parse((ROOT / "docs/gallery/13_nerve_fibres.py").read_text("utf-8"))
    kinds = (ast.Import, ast.ImportFrom, ast.FunctionDef)
    page.body = [part for part in page.body if isinstance(part, kinds)]
    names = {}
    exec(compile(page, "13_nerve_fibres.py", "exec"), names)
    spikes = names["read_fibres"](REAL)
    fastest = (spikes.trials["speed_mm_s"] == 120).to_numpy()
    of_fibre = np.fmax.reduce(spikes.durations_s[fastest])
    found = dict(zip(*np.unique(of_fibre[~np.isnan(of_fibre)], return_counts=True), strict=True))
    assert found == {0.5: 16, 0.8: 11}
    assert spikes.recorded.sum() == 12_100
    assert (spikes.counts()[spikes.recorded] == 0).sum() == 1220


def test_texture_is_read_at_a_speed_held_out_in_spite_of_gaps(recorded):
    """Rates grow in proportion to speed, so trains that are stretched have rates that agree."""
    fibres = hold(made(by_texture), recorded)
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


def test_what_units_resolve_is_stretched_with_their_trains(recorded):
    """Spikes between frames 10 ms apart are 30 ms apart where 120 mm/s becomes 40 mm/s."""
    whole = without_gaps(hold(made(by_texture), recorded)).of_class("PC")
    coarse = replace(whole, units=whole.units.assign(resolution_s=0.01))
    table = accuracy_by_resolution(coarse, (0.01, 0.025, 0.03, 0.25), 0.25, stretched=True)
    found = table.groupby("across")["resolution_s"].apply(list)
    assert found["speeds"] == [0.01, 0.025, 0.03, 0.25]
    assert found["stretched"] == [0.03, 0.25]


def test_gaps_change_nothing_in_what_is_left(recorded):
    """Of a texture, fibre and speed, the first repetitions that were recorded: nothing else."""
    trains = made(by_texture)
    whole = without_gaps(hold(trains, recorded))
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


def test_too_many_gaps_are_refused(recorded):
    fibres = hold(made(by_texture), recorded)
    one = (fibres.trials["texture"] == "1").to_numpy()
    with pytest.raises(InputError, match="on 2 textures or more at every speed, found none"):
        without_gaps(fibres.select(one))
    windows = cut_windows(without_gaps(fibres), 0.25)
    assert set(decode(windows, 0.25, "speeds", tested=80.0)) == {80.0}
    with pytest.raises(InputError, match=r"a speed of the trials \(40, 80, 120\), found 60"):
        decode(windows, 0.25, "speeds", tested=60.0)
