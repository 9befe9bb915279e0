import pytest
from hypothesis import given, strategies as st
from pydantic import ValidationError

from afferents.errors import InputError
from afferents.folds.protocol import PROTOCOLS, Protocol

NESTED = PROTOCOLS["nested"]
TEN = tuple(float(v) for v in range(10, 101, 10))


def test_validation_speeds_of_the_papers_ten_are_these():
    chosen = [NESTED.validation_group(TEN, held_out) for held_out in TEN]
    assert chosen == [60, 70, 80, 90, 90, 20, 20, 30, 40, 50]
    assert PROTOCOLS["published"].validation_group(TEN, 40.0) == 40.0
    with pytest.raises(InputError, match="at least 3 speeds"):
        NESTED.validation_group((10.0, 20.0), 10.0)


@given(st.sets(st.floats(1, 500), min_size=4, max_size=30), st.data())
def test_nested_validates_on_another_speed_and_learns_from_the_slowest_and_fastest(speeds, data):
    held_out = data.draw(st.sampled_from(sorted(speeds)))
    chosen = NESTED.validation_group(tuple(speeds), held_out)
    assert chosen in speeds - {held_out}
    assert min(speeds) < chosen < max(speeds)


@pytest.mark.parametrize("wrong", [{"validation": "held-out-speed"}, {"scale_from": "everything"}])
def test_a_nested_protocol_that_looks_is_refused(wrong):
    with pytest.raises(ValidationError, match="training speeds alone"):
        Protocol(**{**NESTED.model_dump(), **wrong})
