"""Artificial units compared with natural fibres, and what was found in tables for people."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from tests.unit.neuro.test_analysis import fibres

from afferents.errors import InputError
from afferents.neuro import left_out, without_gaps
from afferents.neuro.figures import summarise_decoding, summarise_rates, summarise_stretching
from afferents.neuro.matching import choose_speeds, compare, matched
from afferents.neuro.speed import match_by_class
from afferents.spikes import Spikes

# trains here are drawn without a refractory time
pytestmark = pytest.mark.filterwarnings("ignore:.*refractory time:UserWarning")

TABLES = {
    "rates": pd.DataFrame(
        {"class": ["SA"] * 11, "texture": list("abcdefghijk"), "speed_mm_s": [40.0] * 11,
         "spikes_per_s": [10.0 * n for n in range(11)], "silent": [0.6] + [0.4] * 10}
    ),
    "resolution": pd.DataFrame(
        {"class": ["PC"] * 2, "across": ["speeds"] * 2, "resolution_s": [0.01, 0.5],
         "accuracy": [0.61, 0.32], "low": [0.5, np.nan], "high": [0.7, np.nan],
         "chance": [0.08] * 2}
    ),
    "stretch": pd.DataFrame(
        {"class": ["RA"] * 2, "from_mm_s": 40.0, "to_mm_s": 80.0, "stretched": [True, False],
         "accuracy": [0.72, 0.15], "chance": 0.02, "n_textures": 55, "n_units": 7, "n_trains": 30}
    ),
    "slopes": pd.DataFrame({"class": ["RA"] * 3, "slope": [0.5, 0.7, 0.9]}),
    "exponents": pd.DataFrame(
        {"texture": ["a", "b"] * 3, "speed_mm_s": [10.0] * 2 + [20.0] * 2 + [30.0] * 2,
         "recording": list("uvwxyz"), "exponent": [1.0, 2.0] * 3}
    ),
}  # fmt: skip


def rows_of(table):
    return {" ".join(row[0]): list(row[1:]) for row in table.itertuples()}


def test_summaries_say_what_the_tables_hold():
    natural = TABLES["rates"].assign(silent=0.0)
    rates = summarise_rates({**TABLES, "natural_rates": natural})
    assert rows_of(rates) == {
        "artificial SA": ["50", "10 to 90", "—", "1 of 11"],
        "natural SA": ["50", "10 to 90", "—", "0 of 11"],
    }
    slopes = TABLES["slopes"].assign(**{"class": "SA"})
    assert (
        rows_of(summarise_rates({**TABLES, "slopes": slopes}))["artificial SA"][2] == "0.70 ± 0.20"
    )
    decoding = summarise_decoding(TABLES, "")
    assert rows_of(decoding) == {"PC held out artificial": ["32", "61 [50, 70]", "10", "8"]}
    assert decoding.attrs["caption"].startswith("Windows of 0.5 s. ")
    assert decoding.attrs["caption"].endswith(
        "recognises 100% of recordings at a speed held out (chance 50%)."
    )
    stretching = summarise_stretching(TABLES, "")
    assert rows_of(stretching) == {
        "RA stretched": ["72"],
        "RA as is": ["15"],
        "RA chance": ["2"],
        "RA units": ["7"],
        "RA textures": ["55"],
    }


def test_summaries_put_populations_side_by_side():
    by_class = match_by_class(TABLES["stretch"])
    both = [
        pd.concat(table.assign(population=one) for one in ("artificial", "natural"))
        for table in (TABLES["resolution"], by_class)
    ]
    found = {"beside_resolution": both[0], "beside_stretch": both[1]}
    found["natural_stretch"] = by_class.assign(**{"class": "SA"})
    decoding = summarise_decoding({**TABLES, **found}, "Without gaps: all.")
    assert {row.rpartition("out ")[2] for row in rows_of(decoding)} == {
        "artificial",
        "matched artificial",
        "matched natural",
    }
    assert "of matched populations 0.5 s" in decoding.attrs["caption"]
    assert "Without gaps: all." in decoding.attrs["caption"]
    stretching = summarise_stretching({**TABLES, **found}, "Matched: all.")
    assert rows_of(stretching)["RA stretched"] == ["72", "72", "72", "—"]
    assert rows_of(stretching)["SA stretched"] == ["—", "—", "—", "72"]


def test_fibres_with_gaps_are_compared_with_artificial_units():
    """No fibre is there in every trial: trains are matched, and decoded from what is whole."""
    natural, artificial = fibres(0.44, textures=8), fibres(0.0, textures=6, repetitions=1, seed=1)
    found = compare(artificial, natural, 0.2, 0)
    same = "Matched: 6 textures, 17 SA, 15 RA, 7 PC units and 1 repetition of each; "
    assert found.matched.startswith(same)
    assert "were not recorded" in found.matched
    by = found.tables["beside_stretch"].set_index(["class", "population", "stretched"])["accuracy"]
    for population in ("artificial", "natural"):
        assert by["SA", population, True] > 0.7 > by["SA", population, False]
    assert set(found.tables["natural_stretch"]["n_textures"]) == {8}
    resolution = found.tables["beside_resolution"]
    assert set(resolution["population"]) == {"artificial", "natural"}
    assert resolution.groupby("class")["n_units"].nunique().eq(1).all()
    assert found.whole == left_out(natural, without_gaps(natural))


def test_fibres_that_share_nothing_are_matched_alone():
    """No fibre was recorded on a texture at every speed: at the fastest, or at the others."""
    artificial, natural = fibres(0.0, textures=4, units=8), fibres(0.0, textures=4, units=8)
    texture = natural.trials["texture"].str[1:].to_numpy(int)
    speed = natural.trials["speed_mm_s"].to_numpy()
    recorded = (texture[:, None] + np.arange(8)) % 2 == (speed[:, None] > 100)
    durations_s = np.where(recorded, natural.durations_s, np.nan)
    found = compare(artificial, replace(natural, durations_s=durations_s), 0.2, 0)
    assert "beside_resolution" not in found.tables
    assert found.whole.startswith("Texture can't be decoded from the fibres (")


def made(textures, speeds, classes, seconds):
    trials = pd.DataFrame(
        [(f"t{t}", v) for t in range(textures) for v in speeds], columns=["texture", "speed_mm_s"]
    ).assign(duration_s=seconds)
    trains = [[np.arange(0.05, seconds, 0.1)] * len(classes)] * len(trials)
    return Spikes.from_trains(trains, {"name": range(len(classes)), "class": classes}, trials)


def test_as_many_of_everything_as_both_have():
    rig = made(13, (10, 20, 30, 60, 90, 100), ["SA"] * 20 + ["RA"] * 20 + ["PC"] * 8, 20.0)
    nerve = made(55, (40, 80, 120), ["SA"] * 17 + ["PC"] * 7, 1.5)
    for one in matched(rig, nerve):
        assert one.trials["texture"].nunique() == 13
        assert one.units["class"].value_counts().to_dict() == {"SA": 17, "PC": 7}
        assert one.trials["duration_s"].unique() == [1.5]
    speeds = [sorted(one.trials["speed_mm_s"].unique()) for one in matched(rig, nerve)]
    assert speeds == [[30, 60, 90], [40, 80, 120]]


def test_repetitions_are_those_that_most_units_were_recorded_in():
    twice, thrice = (fibres(0.0, 3, 4, repetitions=n) for n in (2, 3))
    gapped = replace(thrice, durations_s=thrice.durations_s.copy())
    gapped.durations_s[thrice.trials["repetition"] == 0, 0] = np.nan
    for one in matched(twice, gapped, gaps=True):
        assert one.trials.groupby(["texture", "speed_mm_s"]).size().tolist() == [2] * 9
        assert one.recorded.all()
        assert set(one.trials["repetition"]) == {0, 1}


def test_speeds_are_chosen_by_their_ratios():
    here, there = choose_speeds(np.array([10.0, 25.0, 50.0, 100.0]), np.array([40.0, 80.0]))
    assert here.tolist() == [50.0, 100.0]
    assert there.tolist() == [40.0, 80.0]


def test_populations_of_nothing_in_common_are_refused():
    with pytest.raises(InputError, match="found SA and PC"):
        matched(made(3, (40, 80), ["SA"], 1.0), made(3, (40, 80), ["PC"], 1.0))
