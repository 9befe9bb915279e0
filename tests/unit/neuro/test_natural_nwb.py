"""Units and trials of NWB files that others have written."""

import h5py
import numpy as np
import pytest

from afferents import read_nwb, read_spikes
from afferents.errors import InputError
from afferents.neuro import described_natural

pynwb = pytest.importorskip("pynwb")

OWN = {"texture": "stimulus", "speed": "v", "fibre_class": "cell_type", "speed_unit": "cm/s"}


def test_a_file_of_others(other):
    spikes = read_nwb(other, **OWN)
    assert spikes.units["class"].tolist() == ["SA", "RA", "PC"]
    assert spikes.units.index.tolist() == ["0", "1", "2"]
    np.testing.assert_allclose(spikes.train(0, 0), [0.0, 0.5])
    np.testing.assert_allclose(spikes.train(1, 0), [0.0, 0.25])  # a spike where two trials touch
    np.testing.assert_allclose(spikes.train(2, 0), [1.0])
    np.testing.assert_allclose(spikes.train(0, 1), [0.25])
    recorded = [[True, True, False], [True, True, True], [True, False, False]]
    assert spikes.recorded.tolist() == recorded
    trials = spikes.trials
    assert trials["texture"].tolist() == ["denim", "silk", "denim"]
    assert trials["speed_mm_s"].tolist() == [40.0] * 3
    assert trials["repetition"].tolist() == [0, 0, 1]
    assert trials["duration_s"].tolist() == [1.0, 0.5, 1.0]
    assert trials["force"].tolist() == [0.5] * 3
    assert described_natural(spikes)[1] == "Without any spike: 2."


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fibre_class": "note"}, "classes SA, RA or PC of fibres, found 'afferent X'; write in"),
        ({"texture": "t"}, "a column 't', found columns .*stimulus, v, force"),
        (
            {"speed": "speed"},
            "a column 'speed', .*; name the one that is meant in read_nwb, or None",
        ),
        ({"speed_unit": "km/h"}, "speed_unit: expected one of mm/s, cm/s, m/s, found 'km/h'"),
        ({"words": {"PC": "SA1"}}, "expected classes of SA, RA, PC, found 'SA1'"),
    ],
)
def test_columns_that_are_not_there_are_refused(other, changes, said):
    with pytest.raises(InputError, match=said):
        read_nwb(other, **{**OWN, **changes})
    words = {"afferent X": "PC", "afferent Y": "RA"}
    spikes = read_nwb(other, **{**OWN, "fibre_class": "note"}, words=words)
    assert spikes.units["class"].tolist() == ["PC", "RA", "PC"]


def test_an_unknown_speed_must_be_said(other):
    spikes = read_nwb(other, **{**OWN, "speed": None})
    assert spikes.trials["speed_mm_s"].isna().all()
    assert "at unknown speeds" in described_natural(spikes)[0]


def test_files_that_hold_no_trials_of_units_are_refused(other, tmp_path, write_nwb):
    half, disordered = tmp_path / "half.nwb", write_nwb(tmp_path / "disordered.nwb")
    half.write_bytes(other.read_bytes()[: other.stat().st_size // 2])
    with h5py.File(disordered, "r+") as file:
        file["units/spike_times"][1:3] = [10.5, 10.0]
    for path, said in (
        (write_nwb(tmp_path / "a.nwb", units=False), "units and trials, found no units"),
        (write_nwb(tmp_path / "b.nwb", trials=[]), "units and trials, found no trials"),
        (disordered, "times in ascending order, found others in unit 0"),
        (tmp_path / "none.nwb", "an NWB file, found no such file"),
        (half, "an NWB file, found"),
    ):
        with pytest.raises(InputError, match=said):
            read_nwb(path, **OWN)


def test_a_file_with_our_columns_is_read_by_its_suffix(written):
    spikes, same = read_spikes(written), read_nwb(written)
    assert spikes.units.index.tolist() == same.units.index.tolist()
    np.testing.assert_array_equal(spikes.times, same.times)
    assert read_nwb(written, speed=None).trials["speed_mm_s"].isna().all()
