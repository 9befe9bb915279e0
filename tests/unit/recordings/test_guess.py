"""What names of files say of texture, speed and trial is guessed right, or not at all."""

from itertools import product

import pytest
from hypothesis import given, settings, strategies as st

from afferents.recordings.draft import guess_data_set
from afferents.recordings.guess import (
    guess_pattern,
    guess_recordings,
    guess_rule,
)
from afferents.recordings.pattern import Pattern
from afferents.recordings.tables import find_dialect


@pytest.mark.parametrize(
    ("names", "pattern"),
    [
        (["felt_10mms.avi", "silk_20mms.avi"], "{texture}_{speed}mms.avi"),
        (["felt_10mm_s.avi", "silk_20mm_s.avi"], "{texture}_{speed}mm_s.avi"),
        (["felt_speed10.avi", "silk_speed20.avi"], "{texture}_speed{speed}.avi"),
        (["felt_v10_01.avi", "silk_v20_02.avi"], "{texture}_v{speed}_{trial}.avi"),
        (["felt 10.avi", "silk 20.avi"], "{texture} {speed}.avi"),
        (["felt_10mmps_01.mp4", "felt_20mmps_01.mp4"], "{texture}_{speed}mmps_{trial}.mp4"),
        (["cloth2_10.avi", "cloth2_20.avi"], "{texture}_{speed}.avi"),
        (["P80_20.avi", "P120_20.avi"], "{texture}_{speed}.avi"),
        (["felt_1.avi", "felt_2.avi", "silk_3.avi"], "{texture}_{trial}.avi"),
        (["cloth_v2.avi", "silk_v1.avi"], "{texture}_{trial}.avi"),
        (["velvet.avi", "v2.avi"], None),
        (["felt_2024-10-27-14-05-20.csv", "silk_2024-10-27-14-06-40.csv"], None),
        (["felt_20241027_140520.csv", "silk_20241027_140640.csv"], None),
    ],
)
def test_patterns_of_names(names, pattern):
    assert guess_pattern(names) == pattern


@pytest.mark.parametrize(
    ("form", "pattern"),
    [
        ("{t}_{v}_{k}.wav", "{texture}_{speed}_{trial}.wav"),
        ("{t}_{k}_{v}.wav", "{texture}_{trial}_{speed}.wav"),
        ("{t}/{k}/{v}.wav", "{texture}/{trial}/{speed}.wav"),
        ("{t}/{k}_{v}.wav", "{texture}/{trial}_{speed}.wav"),
        ("{t}_trial{k}_{v}mmps.wav", "{texture}_{trial}_{speed}mmps.wav"),
        ("{t}_20241027_{v}_{k:02}.wav", "{texture}_20241027_{speed}_{trial}.wav"),
        ("2024-10-27_{t}_{v}_{k}/", "2024-10-27_{texture}_{speed}_{trial}/"),
        ("{t}_2024-10-2{k}_14-30-0{k}_{v}.wav", "{texture}_{date}_{speed}.wav"),
        ("{t}-2024-10-27-14-30-{v}-{k}.wav", None),
        ("{t}_2024-10-27-14-30-{v}.wav", None),
        ("{v}_{t}_{k}.wav", "{speed}_{texture}_{trial}.wav"),
        ("{t}_a_{k}_{v}.wav", "{texture}_a_{trial}_{speed}.wav"),
    ],
)
def test_trials_and_dates_are_not_taken_for_speeds(form, pattern):
    grid = product(("felt", "wool"), (20, 30, 40), (1, 2, 3))
    assert guess_rule([form.format(t=t, v=v, k=k) for t, v, k in grid]) == pattern


def test_a_decimal_comma_is_part_of_a_speed():
    names = [f"{t}_{v}mmps_1.csv" for t in ("felt", "silk") for v in ("7,5", "12,5", "20")]
    assert guess_rule(names) == "{texture}_{speed}mmps_{trial}.csv"
    assert [one.speed_mm_s for one in guess_recordings(["felt at 12,5mm_s.avi"])] == [12.5]


def test_dates_are_conditions():
    names = ["felt_2024-10-27_10mms.csv", "silk_2024-10-28_20mms.csv"]
    assert guess_rule(names) == "{texture}_{date}_{speed}mms.csv"
    names = ["felt_2024-10-27/20.csv", "silk_2024-10-28/40.csv"]
    assert guess_rule(names) == "{texture}_{date}/{speed}.csv"


def test_slow_speeds_before_as_many_trials_stay_speeds():
    names = [f"felt_{v}_{k}.wav" for v in (1, 2, 3) for k in (1, 2)]
    assert guess_rule(names) == "{texture}_{speed}_{trial}.wav"
    names = [f"{t}_{k}_{v}.wav" for t in ("soft_felt", "wool") for k in (1, 2) for v in (20, 30)]
    assert guess_rule(names) is None  # a part more or less: no pattern reads them


@settings(max_examples=60, deadline=None)
@given(
    textures=st.lists(
        st.from_regex(r"[a-z]{2,8}\d?", fullmatch=True), min_size=2, max_size=4, unique=True
    ),
    speeds=st.lists(st.integers(5, 200), min_size=2, max_size=4, unique=True),
    form=st.sampled_from(["{}mms", "{}mm_s", "speed{}", "v{}", "{}"]),
    joint=st.sampled_from("_- "),
)
def test_what_was_written_is_read_back(textures, speeds, form, joint):
    written = {
        f"{texture}{joint}{form.format(speed)}.avi": (texture, str(speed))
        for texture in textures
        for speed in speeds
    }
    guessed = guess_pattern(sorted(written))
    assert guessed is not None
    for name, expected in written.items():
        found = Pattern(guessed).values(name)
        assert (found["texture"], found["speed"]) == expected


@pytest.mark.parametrize(
    ("names", "pattern"),
    [
        (
            ["denim_015mms_1N_take1", "denim_030mms_2N_take2", "felt_015mms_1N_take1"],
            "{texture}_{speed}mms_{force}N_take{take}.csv",
        ),
        (
            ["run-felt-10mmps-3kPa", "run-silk-20mmps-5kPa"],
            "run-{texture}-{speed}mmps-{pressure}kPa.csv",
        ),
        (["foo", "bar"], "{texture}.csv"),
    ],
)
def test_parts_of_tables_names_are_numbers_with_units_or_words(names, pattern, tmp_path):
    tables = [tmp_path / f"{name}.csv" for name in names]
    for table in tables:
        table.write_text("time_ms,x\n0,1\n4,2\n8,1\n")
    lines, said = guess_data_set(tmp_path, tables)
    assert f'pattern = "{pattern}"' in lines
    assert ("No rule was found" in said[0]) == (pattern == "{texture}.csv")


@pytest.mark.parametrize(
    ("rows", "dialect"),
    [
        (["t,x", "0.1,0.2", "0.2,0.3"], (",", ".", True)),
        (["0.1,0.2", "0.2,0.3"], (",", ".", False)),
        (["t;x", "0,1;-0,2", "0,2;1,3"], (";", ",", True)),
        (["t\tx", "0,1\t0,2"], ("\t", ",", True)),
        (["1;2", "3;4"], (";", ".", False)),
        (["# t x", "0.1 0.2", "0.2 0.3"], (" ", ".", True)),
        (["# sensor", "0.1 0.2", "0.2 0.3"], (" ", ".", False)),
        (["t,frame,x", "0.1,base_link,0.2", "0.2,base_link,0.3"], (",", ".", True)),
        (["2,4506", "2,4979", "2,4331", "2,5153"], (";", ",", False)),
        (["x", "2,45", "12,4"], (";", ",", True)),
        (["-1,05", "0,9"], (";", ",", False)),
        (["512,498", "530,471", "547,466", "560,458"], (",", ".", False)),
        ([""], (",", ".", True)),
    ],
)
def test_what_separates_fields_and_decimals(tmp_path, rows, dialect):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(rows) + "\n")
    found = find_dialect(path)
    assert (found.separator, found.decimal, found.header) == dialect
