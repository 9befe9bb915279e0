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

MEANS = {"sa-se": 46, "ra-se": 53, "sa-ste": 46, "ra-ste": 70, "vib-te": 50, "vib-te-aug": 90}


def test_every_family_has_ten_speeds_whose_mean_is_that_of_table1():
    assert {name: of.mean_percent for name, of in published_families().items()} == MEANS
    assert published_speeds() == tuple(range(10, 101, 10))
    assert (len(published_textures()), published_textures()[8]) == (13, "4")
    carried = json.loads((Path(published.__file__).parent / "published/accuracy.json").read_text())
    for name, family in published_families().items():
        digitised = np.array(list(family.by_speed.values()))
        assert len(digitised) == 10
        assert digitised.mean() == pytest.approx(family.mean_percent, abs=0.6)
        printed = carried["families"][name]["by_speed"].values()
        assert np.abs(digitised - [fold["title_percent"] for fold in printed]).max() < 1.0


def test_confusion_rows_are_true_textures_and_sum_to_100():
    for name, family in published_families().items():
        matrix = published_confusion(name)
        assert matrix.shape == (13, 13)
        np.testing.assert_allclose(matrix.sum(axis=1), 100, atol=0.2)
        assert np.trace(matrix) / 13 == pytest.approx(family.mean_percent, abs=0.6)
