"""Recordings of natural afferents are read as they are described, or refused in a sentence."""

import re

import numpy as np
import pandas as pd
import pytest

from afferents import read_natural
from afferents.errors import InputError
from afferents.neuro import described_natural

TEXTURES, SPEEDS = ["denim", "silk", "corduroy"], [40.0, 80.0, 120.0]
DESCRIPTION = """
file = "spikes.mat"

[spikes]
variable = "spikes"
levels = [["fibre", "texture", "speed", "repetition"]]
empty = "silence"

[fibres]
classes = "class"

[trials]
textures = "names"
speeds_mm_s = [40, 80, 120]
duration_s = 1.0
"""


def described(folder, text=DESCRIPTION, **changes):
    """Write a description, with lines replaced by those of the same key."""
    for key, value in changes.items():
        text, n = re.subn(rf"(?m)^{key} = .*$", f"{key} = {value}", text)
        assert n == 1, key
    (folder / "natural.toml").write_text(text)
    return folder / "natural.toml"


@pytest.fixture
def content(trains, as_cell):
    """Variables of a file: one cell array, classes and names of textures."""
    cells = np.empty(trains.shape, object)
    for at in np.ndindex(trains.shape):
        cells[at] = np.array([[np.nan]]) if trains[at] is None else np.atleast_2d(trains[at])
    return {
        "spikes": cells,
        "class": as_cell(["SA1", "SA-I", "RA", "PC"]),
        "names": as_cell(TEXTURES),
    }


def require_equal(spikes, trains):
    """Each train is found again at its texture, speed and repetition, gaps as gaps."""
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


def test_one_cell_array(tmp_path, write_mat, content, trains):
    write_mat(tmp_path / "spikes.mat", content)
    spikes = read_natural(described(tmp_path))
    require_equal(spikes, trains)
    assert spikes.units.index.tolist() == ["SA-1", "SA-2", "RA-1", "PC-1"]
    assert described_natural(spikes) == [
        "4 fibres (2 SA, 1 RA, 1 PC), 3 textures at 40, 80, 120 mm/s.",
        "Without any spike: SA-2.",
        "Not recorded: 2 of 72 trains (3%).",
    ]


def test_structs_of_nested_cells_in_ms(tmp_path, write_mat, trains, as_cell):
    """An array of structs, a fibre each, in which a cell a speed holds textures x repetitions."""
    fibres = []
    for f, name in enumerate(["SA1", "SA1", "QA", "PC"]):
        speeds = []
        for v in range(3):
            cells = np.empty((3, 2), object)
            for i, r in np.ndindex(3, 2):
                one = trains[f, i, v, r]
                cells[i, r] = np.array([[np.nan]]) if one is None else 1000 * one[:, None]
            speeds.append(cells)
        fibres.append({"times": as_cell(speeds), "type": name, "id": f"f{f}"})
    fibres[0]["times"][0, 2] = np.empty((0, 0))  # nothing at the fastest speed
    write_mat(tmp_path / "spikes.mat", {"fibres": fibres, "v": np.array([[4.0, 8, 12]])})
    spikes = read_natural(
        described(
            tmp_path,
            DESCRIPTION + 'speed_unit = "cm/s"',
            variable='"fibres.times"\nunit = "ms"',
            levels='[["fibre"], ["speed"], ["texture", "repetition"]]',
            classes='"fibres.type"\nnames = "fibres.id"',
            textures='["denim", "silk", "corduroy"]',
            speeds_mm_s='"v"',
        )
    )
    missing = trains.copy()
    missing[0, :, 2] = None
    require_equal(spikes, missing)
    assert spikes.units.index.tolist() == ["f0", "f1", "f2", "f3"]
    assert spikes.units["class"].tolist() == ["SA", "SA", "RA", "PC"]


def test_a_struct_of_one_fibre(tmp_path, write_mat, content, trains):
    """MATLAB keeps an array of one struct as that struct: the level of fibres is gone."""
    times = content["spikes"][0]
    rates = np.array([[[len(one) for one in row] for row in face] for face in trains[0]])
    fibre = {"times": times, "rates": rates, "type": "SA1"}
    write_mat(tmp_path / "spikes.mat", {"fibres": fibre, "names": content["names"]})
    given = {
        "variable": '"fibres.times"',
        "levels": '[["fibre"], ["texture", "speed", "repetition"]]',
        "classes": '"fibres.type"',
    }
    require_equal(read_natural(described(tmp_path, **given)), trains[:1])
    given["empty"] = '"silence"\nrates = "fibres.rates"'
    require_equal(read_natural(described(tmp_path, **given)), trains[:1])


def test_numbers_filled_up_with_nan(tmp_path, write_mat, trains, content):
    full = np.full((*trains.shape, 20), np.nan)
    for at in np.ndindex(trains.shape):
        one = [] if trains[at] is None else trains[at]
        full[at][: len(one)] = one
    write_mat(tmp_path / "spikes.mat", {**content, "spikes": full})
    silent = trains.copy()
    silent[1] = None  # nobody can tell silence from a gap here
    require_equal(read_natural(described(tmp_path)), silent)


def test_cells_of_fewer_repetitions_are_gaps(tmp_path, write_mat, as_cell):
    times = np.array([[0.1, 0.2]])
    nested = as_cell([as_cell([times, times]), as_cell([times])])
    cells = as_cell([nested, nested])
    write_mat(tmp_path / "spikes.mat", {"spikes": cells, "d": np.array([[0.5], [0.3]])})
    text = """
file = "spikes.mat"
[spikes]
levels = [["texture"], ["fibre"], ["repetition"]]
[fibres]
classes = ["SA", "PC"]
[trials]
textures = [1, 2.5]
speeds_mm_s = 80
duration_s = "d"
durations_by = ["texture"]
"""
    spikes = read_natural(described(tmp_path, text))
    assert spikes.recorded.tolist() == [[True, True], [True, False]] * 2
    assert spikes.trials["texture"].tolist() == ["1", "1", "2.5", "2.5"]
    assert spikes.trials["duration_s"].tolist() == [0.5, 0.5, 0.3, 0.3]
    assert set(spikes.trials["speed_mm_s"]) == {80.0}


def test_other_axes_and_a_cut(tmp_path, write_mat, as_cell):
    cells = np.empty((1, 2, 2), object)
    for at in np.ndindex(cells.shape):
        cells[at] = np.array([[-0.5, 0.25, 1.5]])
    write_mat(tmp_path / "spikes.mat", {"spikes": cells})
    text = """
file = "spikes.mat"
[spikes]
levels = [["fibre", "texture", "force"]]
cut = [-1, 1]
[fibres]
classes = ["PC"]
[trials]
textures = ["a", "b"]
speed_unknown = true
conditions = { force = [0.5, 1.0] }
"""
    spikes = read_natural(described(tmp_path, text))
    assert spikes.trials["force"].tolist() == [0.5, 1.0, 0.5, 1.0]
    assert spikes.trials["duration_s"].tolist() == [2.0] * 4
    assert spikes.trials["speed_mm_s"].isna().all()
    np.testing.assert_allclose(spikes.train(0, 0), [0.5, 1.25])
    # what the cut leaves empty was recorded, and is silent
    cells[0, 0, 0] = np.array([[-2.0, 3.0]])
    cells[0, 0, 1] = np.empty((0, 0))
    write_mat(tmp_path / "spikes.mat", {"spikes": cells})
    gaps = text.replace("cut =", 'empty = "gap"\ncut =')
    spikes = read_natural(described(tmp_path, gaps))
    assert spikes.trials["force"].tolist() == [0.5, 0.5, 1.0]
    assert spikes.rates()[0, 0] == 0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"variable": '"spike"'}, "the variable 'spike', found variables .*names"),
        ({"unit": '"ms"', "duration_s": "0.0001"}, "times within the trial"),
        ({"duration_s": "0.001"}, "if times are in ms, divide them by 1000"),
        ({"textures": '["a", "b", "a"]'}, "textures of different names, found two named 'a'"),
        ({"speeds_mm_s": "[]"}, "the speed of trials, found none; add speeds_mm_s"),
        ({"speeds_mm_s": "[40, 80, 80]"}, "different speeds of more than 0, found 40, 80, 80"),
        ({"classes": '["SA", "RA", "PC", "hair"]'}, "'hair'; say in words which"),
        ({"levels": '[["fibre", "texture"], ["speed"]]'}, "a cell array of fibre x texture"),
        ({"levels": '[["trial"]]'}, "name fibre and texture; a list of trials is read as a table"),
        ({"levels": '[["fibre", "fibre"]]'}, "'fibre' stands twice"),
        ({"file": '"other.mat"'}, "the file 'other.mat' beside it, found no such file"),
        ({"file": '"spikes.xlsx"'}, r"a file of \.mat, \.nwb, \.csv, \.parquet"),
    ],
)
def test_descriptions_that_do_not_fit_are_refused(tmp_path, write_mat, content, changes, said):
    write_mat(tmp_path / "spikes.mat", content)
    text = DESCRIPTION
    if "unit" in changes:
        text = text.replace("empty =", 'unit = "s"\nempty =')
    with pytest.raises(InputError, match=said) as refused:
        read_natural(described(tmp_path, text, **changes))
    assert "\n" not in str(refused.value)


def test_empty_cells_must_be_explained(tmp_path, write_mat, content):
    write_mat(tmp_path / "spikes.mat", content)
    said = "18 empty cells, the first at fibre 2, texture 1, speed 1, repetition 1"
    with pytest.raises(InputError, match=said):
        read_natural(described(tmp_path, DESCRIPTION.replace('empty = "silence"\n', "")))
    spikes = read_natural(described(tmp_path, empty='"gap"'))
    assert (~spikes.recorded).sum() == 18 + 2


def test_times_out_of_order_are_refused_or_sorted(tmp_path, write_mat, content):
    content["spikes"][0, 0, 0, 0] = np.array([[0.3, 0.1]])
    write_mat(tmp_path / "spikes.mat", content)
    for unsorted in ("refuse", "sort"):
        path = described(tmp_path, empty=f'"silence"\nunsorted = "{unsorted}"')
        if unsorted == "refuse":
            with pytest.raises(InputError, match="times in ascending order"):
                read_natural(path)
    np.testing.assert_allclose(read_natural(path).train(0, 0), [0.1, 0.3])


@pytest.mark.parametrize("kept", [0.3, 0.9])
def test_a_broken_file_is_refused(tmp_path, write_mat, content, kept):
    path = write_mat(tmp_path / "spikes.mat", content)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))])
    with pytest.raises(InputError, match=r"spikes\.mat: expected"):
        read_natural(described(tmp_path))
    path.write_bytes(b"no MATLAB file at all" * 20)
    with pytest.raises(InputError, match="a MATLAB file, found "):
        read_natural(described(tmp_path))


TABLE = """
file = "spikes.csv"

[spikes]
unit = "ms"

[columns]
fibre = "neuron"
speed = "v"

[trials]
duration_s = 1.0
"""


@pytest.fixture
def table(trains):
    """A row a spike; one without a time where nothing was heard."""
    rows = []
    for f, i, v, r in np.ndindex(trains.shape):
        about = (f"n{f}", ["SA", "SA", "RA", "PC"][f], TEXTURES[i], SPEEDS[v], r)
        one = trains[f, i, v, r]
        if one is not None:
            rows += [(*about, 1000 * t) for t in (one if len(one) else [np.nan])]
    names = ["neuron", "class", "texture", "v", "repetition", "time_s"]
    return pd.DataFrame(rows, columns=names)


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_tables_with_a_row_a_spike(tmp_path, table, trains, suffix):
    path = tmp_path / f"spikes.{suffix}"
    table.to_csv(path, index=False) if suffix == "csv" else table.to_parquet(path)
    text = TABLE.replace("spikes.csv", path.name)
    require_equal(read_natural(described(tmp_path, text)), trains)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('speed = "v"', 'speed = "w"', "a column 'w', found columns neuron, class"),
        ('fibre = "neuron"', "", r"'unit', .* in \[columns\] \(fibre = \"ITS NAME\"\)$"),
        ("duration_s = 1.0", "", "how long trials last, found nothing"),
        ("duration_s = 1.0", "duration_s = [2.0, 1.0]", "how long trials last, found a list"),
        ('unit = "ms"', "", "if times are in ms, divide"),
        ('unit = "ms"', 'unit = "ms"\ncut = [0, 1]', r"\.csv files, found 'cut' in \[spikes\]"),
        ("duration_s = 1.0", "duration_s = 1.0\nspeeds_mm_s = [40]", "one number as speeds_mm_s"),
        ('fibre = "neuron"', 'fibre = "neuron"\ntime = "class"', "numbers in the column 'class'"),
    ],
)
def test_tables_that_do_not_fit_are_refused(tmp_path, table, old, new, said):
    table.to_csv(tmp_path / "spikes.csv", index=False)
    with pytest.raises(InputError, match=said):
        read_natural(described(tmp_path, TABLE.replace(old, new)))


def test_a_condition_that_tells_trials_apart_is_not_lost(tmp_path, table):
    at = table.assign(force=1.0, monkey="K")
    pd.concat([at, at.assign(force=2.0)]).to_csv(tmp_path / "spikes.csv", index=False)
    with pytest.raises(InputError, match="found several 'force' in one; number repetitions"):
        read_natural(described(tmp_path, TABLE.replace('"ms"', '"ms"\nunsorted = "sort"')))
    at.to_csv(tmp_path / "spikes.csv", index=False)
    assert read_natural(described(tmp_path, TABLE)).n_units == 4
    for given in ("speeds_mm_s = 40", "speed_unknown = true"):
        told = TABLE.replace("duration_s =", f"{given}\nduration_s =")
        with pytest.raises(InputError, match="found several 'v' in one"):
            read_natural(described(tmp_path, told))


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_labels_may_be_called_na_and_may_not_be_missing(tmp_path, table, suffix):
    path, text = tmp_path / f"spikes.{suffix}", TABLE.replace("csv", suffix)
    for name in ("NA", None):
        named = table.assign(texture=table["texture"].replace("silk", name))
        named.to_csv(path, index=False) if suffix == "csv" else named.to_parquet(path)
        if name:
            found = read_natural(described(tmp_path, text))
            assert set(found.trials["texture"]) == {"denim", "NA", "corduroy"}
    with pytest.raises(InputError, match="'texture' of every row, found none in row"):
        read_natural(described(tmp_path, text))


def test_a_unit_of_speeds_that_are_given_in_mm_s_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"speed_unit is of speeds in the file"):
        read_natural(described(tmp_path, DESCRIPTION + 'speed_unit = "cm/s"'))
