"""Models as they are asked for."""

import pytest

from afferents.errors import InputError
from afferents.models.model import MODELS, TABLE1, models_in, names_in


def test_all_and_best_may_stand_among_other_names():
    assert models_in("all") == list(TABLE1.values())
    assert models_in("best") == []
    assert models_in("all,best") == list(TABLE1.values())
    assert names_in("all, best") == ["all", "best"]
    wave = MODELS["ra-wave"]
    assert models_in("ra-wave,all") == [*TABLE1.values(), wave]
    assert models_in(["best", "sa-se", wave]) == [TABLE1["sa-se"], wave]
    assert names_in(wave) == []


def test_an_unknown_name_beside_them_is_refused():
    with pytest.raises(InputError, match="found 'tea'"):
        models_in("all,tea")
