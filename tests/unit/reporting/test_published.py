"""The carried figures of the paper are those of the paper."""

import json
from pathlib import Path

import numpy as np
import pytest

from afferents.reporting import published
from afferents.reporting.published import (
    published_confusion,
    published_families,
    published_speeds,
    published_textures,
)

MEANS = {
    "sa-se": 46,
    "ra-se": 53,
    "sa-ste": 46,
    "ra-ste": 70,
    "vib-te": 50,
    "vib-te-aug": 90,
}


def test_table1_of_the_paper():
    means = {name: family.mean_percent for name, family in published_families().items()}
    assert means == MEANS


def test_every_family_has_ten_speeds_whose_mean_is_that_of_table1():
    assert published_speeds() == tuple(range(10, 101, 10))
    carried = json.loads((Path(published.__file__).parent / "published/accuracy.json").read_text())
    for name, family in published_families().items():
        digitised = np.array(list(family.by_speed.values()))
        assert len(digitised) == 10
        assert digitised.mean() == pytest.approx(family.mean_percent, abs=0.6)
        printed = carried["families"][name]["by_speed"].values()
        assert np.abs(digitised - [fold["title_percent"] for fold in printed]).max() < 1.0


def test_known_accuracies_at_single_speeds():
    assert published_families()["vib-te"].by_speed[10.0] == pytest.approx(17, abs=1)
    assert published_families()["vib-te-aug"].by_speed[90.0] == pytest.approx(100, abs=1)


def test_confusion_rows_are_true_textures_and_sum_to_100():
    for name, family in published_families().items():
        matrix = published_confusion(name)
        assert matrix.shape == (13, 13)
        np.testing.assert_allclose(matrix.sum(axis=1), 100, atol=0.2)
        assert np.trace(matrix) / 13 == pytest.approx(family.mean_percent, abs=0.6)


def test_textures_are_bump_spacings():
    assert published_textures()[0] == "0"
    assert published_textures()[8] == "4"
    assert len(published_textures()) == 13


def test_carried_data_agree_with_the_digitised_originals():
    originals = Path(__file__).resolve().parents[3] / "../shared/published/confusion.json"
    if not originals.is_file():
        pytest.skip("the digitised originals (../shared/published) are not here")
    folds = json.loads(originals.read_text())["vib-TE"]["models"]
    predicted_by_true = np.mean([fold["percent"] for fold in folds.values()], axis=0)
    np.testing.assert_allclose(published_confusion("vib-te"), predicted_by_true.T, atol=0.01)


def test_what_the_report_says_of_the_best_textures_is_so():
    """The paper writes a and m; by its matrices a is the best of all, and m never second."""
    for model in published_families():
        right = published_confusion(model).diagonal()
        assert right.argmax() == 0
        assert (right > right[-1]).sum() >= 3
