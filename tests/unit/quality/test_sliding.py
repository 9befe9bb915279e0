"""The part in which the drum slides, and what lasts too long in it."""

import numpy as np

from afferents.quality.lasting import lasting, sliding_part, span_text

TIME_S = np.arange(1000) / 100


def holding(*spans):
    holds = np.zeros(len(TIME_S), bool)
    for begin, end in spans:
        holds |= np.clip(TIME_S, begin, end) == TIME_S
    return holds


def test_the_part_is_what_was_declared():
    assert sliding_part(0.0, 10.0, (1.5, 8.0)) == (1.5, 8.0)
    assert sliding_part(0.0, 10.0, (1.5, 1e9)) == (1.5, 10.0)


def test_without_it_the_ends_are_left_out():
    assert sliding_part(0.0, 65.0, None) == (2.5, 62.5)
    assert sliding_part(0.0, 4.0, None) == (1.0, 3.0)
    assert sliding_part(0.0, 4.0, (100.0, 200.0)) == (1.0, 3.0)


def test_what_lasts_long_enough_within_the_part_is_found_as_a_whole():
    assert lasting(holding((1.0, 5.0)), TIME_S, (2.0, 9.0), 0.5) == (1.0, 5.0)
    assert lasting(holding((1.0, 2.3)), TIME_S, (2.0, 9.0), 0.5) is None
    assert lasting(holding((3.0, 3.4)), TIME_S, (2.0, 9.0), 0.5) is None
    assert lasting(holding(), TIME_S, (2.0, 9.0), 0.5) is None


def test_a_key_frame_is_no_end():
    found = lasting(holding((1.0, 3.0), (3.5, 6.0), (8.0, 9.0)), TIME_S, (2.0, 9.0), 0.5)
    assert found == (1.0, 6.0)


def test_an_end_near_that_of_the_recording_is_said_to_be_it():
    assert span_text((1.0, 5.0), TIME_S) == "from 1.00 s to 5.00 s"
    assert span_text((1.0, 9.5), TIME_S) == "from 1.00 s to the end"
