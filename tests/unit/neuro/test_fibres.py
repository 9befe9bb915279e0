"""Fibres of the fingertip, as the public file has them: what is known of them is read, and no more.

The file is made here in its layout; the true one was never at hand.
"""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from tests.unit.neuro.conftest import FINGERTIP

from afferents import read_natural
from afferents.errors import InputError
from afferents.neuro import (
    accuracy_by_resolution,
    cut_windows,
    decode,
    left_out,
    without_gaps,
)
from afferents.spikes import Spikes

PAGE = (Path(__file__).resolve().parents[3] / "docs" / "neuroscience.md").read_text("utf-8")
CLASSES = ["SA1", "SA1", "RA", "RA", "PC"]
N_TEXTURES, N_FIBRES, N_REPETITIONS = 6, 5, 4


def made(rate, seed=0, repetitions=N_REPETITIONS):
    """Poisson trains (speed, texture, fibre, repetition), of `rate(texture, fibre, speed)`."""
    rng = np.random.default_rng(seed)
    trains = np.empty((3, N_TEXTURES, N_FIBRES, repetitions), object)
    for at in np.ndindex(trains.shape):
        speed, seconds = list(FINGERTIP.items())[at[0]]
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


def shown(language):
    """The block of the page that reads the file."""
    (block,) = (
        b for b in re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL) if "RawPAF" in b
    )
    return block


@pytest.fixture
def read(tmp_path, write_fingertip, monkeypatch):
    """Read trains as the page does: in lines of Python, or by a description."""
    monkeypatch.chdir(tmp_path)

    def read_as(language, trains, recorded, old="", new=""):
        write_fingertip("RawPAFData.mat", trains, recorded, CLASSES)
        if language == "python":
            names = {}
            exec(shown("python"), names)
            return names["natural"]
        Path("fibres.toml").write_text(shown("toml").replace(old, new))
        return read_natural("fibres.toml")

    return read_as


@pytest.mark.parametrize("language", ["python", "toml"])
def test_the_page_reads_every_train_and_every_gap(read, recorded, language):
    trains = made(by_texture)
    spikes = read(language, trains, recorded)
    assert spikes.units["class"].tolist() == ["SA", "SA", "RA", "RA", "PC"]
    assert spikes.n_trials == 3 * N_TEXTURES * N_REPETITIONS
    for number, trial in spikes.trials.iterrows():
        v = list(FINGERTIP).index(trial["speed_mm_s"])
        assert trial["duration_s"] == FINGERTIP[trial["speed_mm_s"]]
        for fibre in range(N_FIBRES):
            at = (v, int(trial["texture"]) - 1, fibre, int(trial["repetition"]))
            assert spikes.recorded[number, fibre] == recorded[at]
            expected = trains[at] if recorded[at] else []
            np.testing.assert_allclose(spikes.train(number, fibre), expected)


def silent_at_times(texture, fibre, speed):
    return 0.5 if fibre == 2 and texture < 3 else by_texture(texture, fibre, speed)


def test_no_empty_cell_is_silence_unless_rates_say_so(read, recorded):
    """The shape of an empty cell says nothing: each occurs among the silent and the missing."""
    trains = made(silent_at_times)
    fires = np.frompyfunc(len, 1, 1)(trains).astype(int) > 0
    gap = read("toml", trains, recorded)
    assert gap.recorded.sum() == (recorded & fires).sum() < recorded.sum()
    assert np.nanmin(gap.counts()) > 0
    told = read("toml", trains, recorded, 'empty = "gap" ', 'rates = "rates" ')
    assert told.recorded.sum() == recorded.sum()
    assert (told.counts() == 0).sum() == (recorded & ~fires).sum() > 3
    file = scipy.io.loadmat("RawPAFData.mat")
    shapes = {
        one.shape for cells in file["spikes"].ravel() for one in cells.ravel() if not one.size
    }
    assert shapes == {(0, 0), (0, 1), (1, 0)}


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (
            lambda rates: np.nan_to_num(rates),
            r"NaN in 'rates' for trials .* none in \d+ empty cells",
        ),
        (lambda rates: rates + 1, "0 spikes and a rate of 1, at speed 1, texture 1, fibre 3"),
        (lambda rates: rates * np.nan, r"[1-9]\d* spikes and a rate of nan"),
        (lambda rates: np.where(rates > 60, np.nan, rates), r"\d+ spikes and a rate of nan, at"),
        (
            lambda rates: rates[:5],
            "3 x 6 x 5 x 4 trials in 'rates', nested as 'spikes', found others",
        ),
    ],
)
def test_rates_that_contradict_the_times_are_refused(read, recorded, tmp_path, spoil, said):
    trains = made(silent_at_times)
    read("toml", trains, recorded, 'empty = "gap" ', 'rates = "rates" ')
    file = {k: v for k, v in scipy.io.loadmat("RawPAFData.mat").items() if not k.startswith("__")}
    for v in range(3):
        file["rates"][0, v] = spoil(file["rates"][0, v])
    scipy.io.savemat("RawPAFData.mat", file)
    with pytest.raises(InputError, match=said) as refused:
        read_natural("fibres.toml")
    assert "\n" not in str(refused.value)


def relabelled(spikes, rng):
    """The same trains, textures permuted anew at each speed: what is learnt at others is no use."""
    texture = spikes.trials["texture"].to_numpy(object).copy()
    names = np.unique(texture)
    for speed in FINGERTIP:
        at = (spikes.trials["speed_mm_s"] == speed).to_numpy()
        named = dict(zip(names, rng.permutation(names), strict=True))
        texture[at] = [named[one] for one in texture[at]]
    return replace(spikes, trials=spikes.trials.assign(texture=texture))


def test_texture_is_read_at_a_speed_held_out_in_spite_of_gaps(read, recorded):
    """Rates grow in proportion to speed, so trains that are stretched have rates that agree."""
    fibres = read("python", made(by_texture), recorded)
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
    whole = without_gaps(read("python", made(by_texture), recorded)).of_class("PC")
    coarse = replace(whole, units=whole.units.assign(resolution_s=0.01))
    table = accuracy_by_resolution(coarse, (0.01, 0.025, 0.03, 0.25), 0.25, stretched=True)
    found = table.groupby("across")["resolution_s"].apply(list)
    assert found["speeds"] == [0.01, 0.025, 0.03, 0.25]
    assert found["stretched"] == [0.03, 0.25]


def test_labels_permuted_between_speeds_are_at_chance(read, recorded):
    whole = without_gaps(read("python", made(by_texture), recorded))
    speed = whole.trials["speed_mm_s"].to_numpy()
    cut = {to: cut_windows(whole.stretched(speed / to), 0.25) for to in FINGERTIP}
    true = [decode(cut[to], 0.25, "speeds", tested=to)[to] for to in FINGERTIP]
    assert min(true) > 0.9
    assert set(decode(cut[80.0], 0.25, "speeds", tested=80.0)) == {80.0}
    rng = np.random.default_rng(0)
    permuted = [
        decode(relabelled(cut[to], rng), 0.25, "speeds", tested=to)[to]
        for to in FINGERTIP
        for _ in range(40)
    ]
    assert np.mean(permuted) == pytest.approx(1 / 5, abs=0.05)


def test_gaps_change_nothing_in_what_is_left(read, recorded):
    """Of a texture, fibre and speed, the first repetitions that were recorded: nothing else."""
    trains = made(by_texture)
    whole = without_gaps(read("python", trains, recorded))
    assert whole.trials.groupby(["texture", "speed_mm_s"]).size().unique() == [2]
    for number, trial in whole.trials.iterrows():
        v, t = list(FINGERTIP).index(trial["speed_mm_s"]), int(trial["texture"]) - 1
        for unit, name in enumerate(whole.units.index):
            one = v, t, int(name) - 1
            repetition = np.flatnonzero(recorded[one])[trial["repetition"]]
            np.testing.assert_allclose(whole.train(number, unit), trains[one][repetition])
    assert without_gaps(whole) is whole


def test_gaps_alone_tell_nothing():
    """All fibres fire alike on all textures; which were recorded on which is all there is."""
    trains = made(lambda texture, fibre, speed: speed)
    there = np.random.default_rng(1).random(trains.shape) > 0.2
    there[:, np.arange(4), np.arange(4)] = False
    rows, trials = [], []
    for v, t, r in np.ndindex(3, N_TEXTURES, N_REPETITIONS):
        speed, seconds = list(FINGERTIP.items())[v]
        pairs = zip(trains[v, t, :, r], there[v, t, :, r], strict=True)
        rows.append([train if is_there else None for train, is_there in pairs])
        trials.append((f"t{t}", speed, r, seconds))
    trials = pd.DataFrame(trials, columns=["texture", "speed_mm_s", "repetition", "duration_s"])
    gapped = Spikes.from_trains(rows, {"name": range(5), "class": ["SA"] * 5}, trials)
    whole = without_gaps(gapped)
    assert 1 < whole.trials["texture"].nunique() < 6
    found = accuracy_by_resolution(whole, (0.05, 0.25), 0.25, stretched=True)
    assert (found["accuracy"] < found["chance"] + 0.2).all()


def test_too_many_gaps_are_refused(read, recorded):
    fibres = read("python", made(by_texture), recorded)
    one = (fibres.trials["texture"] == "1").to_numpy()
    with pytest.raises(InputError, match="on 2 textures or more at every speed, found none"):
        without_gaps(fibres.select(one))
    with pytest.raises(InputError, match=r"a speed of the trials \(40, 80, 120\), found 60"):
        decode(cut_windows(without_gaps(fibres), 0.25), 0.25, "speeds", tested=60.0)
