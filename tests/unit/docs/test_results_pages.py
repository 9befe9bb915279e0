"""Tables and the picture in the docs are those of their data, the code and the imports."""

import json
import re
import sys

import pytest

from .printed import DOCS, PAGES, ROOT

DATA = sorted((DOCS / "results").glob("*.json"))
SAYS = {"title", "commit", "date", "machine", "commands", "columns", "rows"}
TESTS = {
    name
    for path in (ROOT / "tests").rglob("*.py")
    for name in re.findall(r"^def (test_\w+)", path.read_text(), re.MULTILINE)
}
RELIABILITY = (DOCS / "reliability.md").read_text()


@pytest.fixture(scope="module")
def scripts():
    """The modules of the scripts that draw, by name."""
    sys.path.insert(0, str(ROOT / "scripts"))
    try:
        import architecture
        import results_pages
    finally:
        sys.path.remove(str(ROOT / "scripts"))
    return {"tables": results_pages, "picture": architecture}


def test_tables_are_drawn_from_the_data(scripts):
    drawn = scripts["tables"].pages()
    stale = [path.name for path, text in drawn.items() if path.read_text() != text]
    assert stale == [], "run make results-pages"


@pytest.mark.parametrize("path", DATA, ids=lambda path: path.stem)
def test_data_say_where_they_come_from_and_are_shown(path):
    found = json.loads(path.read_text())
    assert set(found) >= SAYS
    assert all(found[name] for name in SAYS)
    assert re.fullmatch(r"[0-9a-f]{7,}(; [0-9a-f]{7,})*", found["commit"])
    assert {len(row) for row in found["rows"]} == {len(found["columns"])}
    mark = f"<!-- results {path.stem} -->"
    assert sum(mark in page.read_text() for page in PAGES) == 1


def test_the_picture_of_the_packages_is_as_the_imports_are(scripts):
    drawn = scripts["picture"]
    assert drawn.PICTURE.read_text() == drawn.picture(), "run make results-pages"
    assert drawn.PAGE.read_text() == drawn.page(), "run make results-pages"
    there = {path.stem for path in (ROOT / "src/afferents").iterdir() if path.suffix in ("", ".py")}
    listed = {name for layer in drawn.layers() for name in layer}
    assert listed == {name for name in there if not name.startswith("__")}


def test_every_promise_names_a_test_that_exists():
    rows = re.findall(r"^\| (?!promise|---)(.+) \| (`test_.+) \|$", RELIABILITY, re.MULTILINE)
    named = {name for _, tests in rows for name in re.findall(r"`(test_\w+)`", tests)}
    assert len(rows) > 30
    assert sorted(named - TESTS) == []
