"""Tables of natural afferents' spikes are read as they are, or refused in a sentence."""

import unicodedata

import numpy as np
import pandas as pd
import pytest

from afferents import read_spikes
from afferents.errors import InputError
from afferents.neuro import described_natural

TEXTURES, SPEEDS = ["denim", "silk", "corduroy"], [40.0, 80.0, 120.0]


@pytest.fixture
def table(trains):
    """A row a spike, times in ms; one without a time where the fibre was silent."""
    rows = []
    for f, i, v, r in np.ndindex(trains.shape):
        about = (f"n{f}", ["SA1", "SA-I", "QA", "pc "][f], TEXTURES[i], SPEEDS[v], r)
        one = trains[f, i, v, r]
        if one is not None:
            rows += [(*about, 1000 * t) for t in (one if len(one) else [np.nan])]
    names = ["unit", "class", "texture", "speed_mm_s", "repetition", "time_ms"]
    return pd.DataFrame(rows, columns=names).assign(duration_s=1.0)


@pytest.fixture
def read(tmp_path):
    """Read a table from a file."""

    def written(table, suffix="csv", **given):
        path = tmp_path / f"spikes.{suffix}"
        table.to_csv(path, index=False) if suffix == "csv" else table.to_parquet(path)
        return read_spikes(path, **given)

    return written


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_each_train_is_found_at_its_place_and_gaps_are_gaps(read, table, trains, suffix):
    spikes = read(table, suffix)
    trials = spikes.trials
    for f, i, v, r in np.ndindex(trains.shape):
        (t,) = trials.index[
            (trials["texture"] == TEXTURES[i])
            & (trials["speed_mm_s"] == SPEEDS[v])
            & (trials["repetition"] == r)
        ]
        assert spikes.recorded[t, f] == (trains[f, i, v, r] is not None)
        expected = [] if trains[f, i, v, r] is None else trains[f, i, v, r]
        np.testing.assert_allclose(spikes.train(t, f), expected, atol=1e-12)
    assert described_natural(spikes) == [
        "4 fibres (2 SA, 1 RA, 1 PC), 3 textures at 40, 80, 120 mm/s.",
        "Without any spike: n1.",
        "Not recorded: 2 of 72 trains (3%).",
    ]


@pytest.mark.filterwarnings("ignore:.*last third of its trial:UserWarning")
def test_durations_are_of_each_train_or_one_for_all(read, table):
    spikes = read(table.assign(duration_s=np.where(table["unit"] == "n0", 2.0, 1.0)))
    assert set(spikes.durations_s[:, 0]) == {2.0}
    assert set(spikes.durations_s[:, 2]) == {1.0}
    np.testing.assert_allclose(spikes.rates(), spikes.counts() / [[2, 1, 1, 1]])
    assert set(read(table.drop(columns="duration_s"), duration_s=2.0).trials["duration_s"]) == {2.0}
    table.loc[0, "duration_s"] = 2.0
    with pytest.raises(InputError, match=r"one duration_s a fibre, texture, .* found several"):
        read(table)


def test_to_table_comes_back_with_its_gaps_silence_and_durations(read, table):
    spikes = read(table)
    spikes.durations_s[:, 2] = 1.25
    again = read(spikes.to_table())
    np.testing.assert_array_equal(again.offsets, spikes.offsets)
    np.testing.assert_allclose(again.times, spikes.times)
    np.testing.assert_array_equal(again.durations_s, spikes.durations_s)
    pd.testing.assert_frame_equal(again.trials[list(spikes.trials)], spikes.trials)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"unit": "neuron"}, "a column 'unit', found columns neuron, class,.*rename"),
        ({"time_ms": "t"}, "a column 'time_s', found columns"),
        ({"time_ms": "time_s"}, "if times are in ms, divide them by 1000"),
        ({"duration_s": "d"}, "a column 'duration_s', .*; add it, or give duration_s"),
        ({"repetition": "trial"}, "found several 'trial' in one; number repetitions"),
        ({"speed_mm_s": "v"}, "found several 'v' in one"),
        (
            lambda t: t.replace({"QA": "hair"}),
            "classes SA, RA or PC of fibres, found 'hair'; write",
        ),
        (lambda t: t.assign(time_ms=t["class"]), "numbers in the column 'time_ms'"),
        (lambda t: t[::-1], r"times in ascending order, .*; sort them"),
        (
            lambda t: t.assign(**{"class": np.resize(["SA", "RA"], len(t))}),
            "one class a fibre in 'class', found several",
        ),
        (lambda t: t.assign(duration_s=-1.0), r"trains of a positive duration"),
    ],
)
def test_tables_that_do_not_fit_are_refused(read, table, change, said):
    with pytest.raises(InputError, match=said) as refused:
        read(change(table) if callable(change) else table.rename(columns=change))
    assert "\n" not in str(refused.value)


def test_files_that_are_no_tables_are_refused(tmp_path):
    (tmp_path / "half.parquet").write_bytes(b"PAR1")
    for name, said in (
        ("none.csv", "no such file"),
        ("spikes.mat", r"become Spikes in Python"),
        ("half.parquet", "a table that can be read, found"),
    ):
        with pytest.raises(InputError, match=said):
            read_spikes(tmp_path / name)


def test_a_condition_that_tells_trials_apart_is_not_lost(read, table):
    at = table.assign(force=1.0, monkey="K")
    assert read(at).n_units == 4
    twice = pd.concat([at, at.assign(force=2.0)]).sort_values("time_ms")
    with pytest.raises(InputError, match="found several 'force' in one; number repetitions"):
        read(twice)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_labels_may_be_called_na_and_may_not_be_missing(read, table, suffix):
    named = table.assign(texture=table["texture"].replace("silk", "NA"))
    assert set(read(named, suffix).trials["texture"]) == {"denim", "NA", "corduroy"}
    named["texture"] = table["texture"].replace("silk", None)
    with pytest.raises(InputError, match="'texture' of every row, found none in row"):
        read(named, suffix)


@pytest.mark.parametrize("name", ["caf\N{LATIN SMALL LETTER E WITH ACUTE}", "soft silk"])
def test_a_texture_is_one_however_its_name_is_spelt(read, table, name):
    other = unicodedata.normalize("NFD", name).replace(" ", "\N{NO-BREAK SPACE}")
    silk, odd = table["texture"] == "silk", np.arange(len(table)) % 2 == 1
    table.loc[silk, "texture"] = name
    table.loc[silk & odd, "texture"] = other
    assert set(read(table).trials["texture"]) == {"denim", name, "corduroy"}
    table.loc[silk & odd, "texture"] = name.title()
    with pytest.raises(InputError, match="each texture under one name, found"):
        read(table)


def test_the_unit_of_times_is_checked_in_both_directions(read, table):
    """Seconds in a column of ms lie in the first ms of their trials; ms in one of s beyond them."""
    table["time_ms"] /= 1000
    with pytest.raises(InputError, match=r"found all \d+ in the first 1 ms; if times are in s"):
        read(table)
    right = read(table.rename(columns={"time_ms": "time_s"}))
    with pytest.warns(UserWarning, match="apart or more: if times and durations are in ms"):
        read(right.to_table().assign(time_s=1e6 * right.to_table()["time_s"], duration_s=1e6))


def test_duplicate_spikes_are_refused(read, table):
    twice = pd.concat([table, table]).sort_values(
        ["unit", "texture", "speed_mm_s", "repetition", "time_ms"]
    )
    with pytest.raises(InputError, match=r"0.5 ms apart .* in 3 of 4 units \(n0, n2, n3\)"):
        read(twice)
    with pytest.warns(UserWarning, match=r"1 of \d+ intervals .* 0.5 ms, in 1 units \(n0\)"):
        read(pd.concat([table[:1], table]))
