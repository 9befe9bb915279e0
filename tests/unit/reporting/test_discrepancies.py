"""The list of discrepancies: whole, and the same on its page."""

from pathlib import Path

from afferents.reporting.discrepancies import discrepancies, to_page

PAGE = Path(__file__).parents[3] / "docs" / "discrepancies.md"


def test_there_are_44_in_order():
    assert [one.number for one in discrepancies().discrepancy] == list(range(1, 45))


def test_the_page_is_the_list():
    assert PAGE.read_text(encoding="utf-8") == to_page(), "run make results-pages"


def test_all_that_remains_is_said_whole_as_well():
    found = discrepancies()
    text = "\n".join(found.whole())
    for one in found.discrepancy:
        assert f"{one.number}. {one.topic}" in text
        assert one.differs in text
        # What differs from the code is not called the same as the code.
        assert not one.differs or one.published != "As the code."
    n_remaining = sum(bool(one.differs) for one in found.discrepancy) + len(found.software)
    assert len(found.remaining()) == n_remaining


def test_every_figure_that_is_drawn_otherwise_is_listed():
    said = {one.topic: one.differs for one in discrepancies().figure}
    assert "three columns" in said["Figure 7"]
    assert "grey" in said["Figures 8 and 10"]
    assert "from 0 to 1" in said["Figure 12"]
    assert "## Where --figures paper differs from the print" in to_page()
