"""What is wrong with a recording is refused, or kept by its kind."""

import pytest

from afferents.errors import InputError
from afferents.quality.issues import QualityIssue, parse_kinds, require_accepted

FROZEN = QualityIssue("frozen", "v.mp4", "a picture that changes", "the same one")
LOUD = QualityIssue("loud", "a.wav", "samples within full scale", "3 beyond it")


def test_what_is_not_accepted_is_refused_with_the_way_to_accept_it():
    with pytest.raises(InputError, match=r"^v\.mp4: .*found the same one; .*--accept frozen$"):
        require_accepted([LOUD, FROZEN], {"loud"})


def test_what_is_accepted_comes_back():
    assert require_accepted([LOUD, FROZEN], {"loud", "frozen"}) == [LOUD, FROZEN]
    assert require_accepted([], ()) == []


def test_kinds_are_read_by_name():
    assert parse_kinds(["frozen", "loud"]) == {"frozen", "loud"}
    with pytest.raises(InputError, match=r"--accept: expected one of length, dark, .* found 'ice'"):
        parse_kinds(["ice"])
