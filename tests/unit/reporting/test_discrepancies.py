"""The list of discrepancies, and its page."""

from pathlib import Path

from afferents.reporting.discrepancies import discrepancies, to_page

PAGE = Path(__file__).parents[3] / "docs" / "discrepancies.md"


def test_the_page_is_the_list():
    assert PAGE.read_text(encoding="utf-8") == to_page(), "run make results-pages"


def test_all_that_remains_is_said_whole_as_well():
    found = discrepancies()
    assert [one.number for one in found.discrepancy] == list(range(1, 45))
    text = to_page()
    for one in found.discrepancy:
        assert f"{one.number}. **{one.topic}**" in text
        assert one.differs in text
        # What differs from the code is not called the same as the code.
        assert not one.differs or one.published != "As the code."
    n_remaining = sum(bool(one.differs) for one in found.discrepancy) + len(found.software)
    assert len(found.remaining()) == n_remaining
