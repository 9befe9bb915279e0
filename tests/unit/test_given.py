"""Models as they are asked for."""

import pytest

from afferents.errors import InputError
from afferents.models.model import MODELS, TABLE1, choose_models, list_names


def test_all_and_best_may_stand_among_other_names():
    assert choose_models("all") == list(TABLE1.values())
    assert choose_models("best") == []
    assert choose_models("all,best") == list(TABLE1.values())
    assert list_names("all, best") == ["all", "best"]
    wave = MODELS["ra-wave"]
    assert choose_models("ra-wave,all") == [*TABLE1.values(), wave]
    assert choose_models(["best", "sa-se", wave]) == [TABLE1["sa-se"], wave]
    assert list_names(wave) == []


def test_an_unknown_name_beside_them_is_refused():
    with pytest.raises(InputError, match="found 'tea'"):
        choose_models("all,tea")
