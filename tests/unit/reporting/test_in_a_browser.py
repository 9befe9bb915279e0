"""The report as a person sees it: in a real browser that has no network."""

import pytest

import afferents

from ...extras import open_browser

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def page(stores, tmp_path_factory):
    """A report on the small session of sounds."""
    out = tmp_path_factory.mktemp("report") / "r"
    afferents.evaluate(stores["audio"], out, "vib-te", preset="quick", workers=1, quiet=True)
    return afferents.report(out, quiet=True)


WIDE = """() => {
  const edge = document.documentElement.clientWidth;
  const held = [...document.querySelectorAll(".scroll")];
  const over = [...document.body.querySelectorAll("*")].filter(one =>
    one.getBoundingClientRect().right > edge + 1 && !held.some(h => h !== one && h.contains(one)));
  const bar = held.filter(one => one.scrollWidth > one.clientWidth)
    .map(one => one.offsetHeight - one.clientHeight);
  return {over: over.map(one => one.outerHTML.slice(0, 80)), bar,
          page: document.documentElement.scrollWidth - edge,
          drawn: [...document.images].filter(one => one.naturalWidth > 100).length};
}"""


@pytest.mark.parametrize(("width", "n_wide"), [(1200, 0), (375, 1)])
def test_nothing_lies_beyond_the_edge_and_wide_tables_have_a_bar(page, width, n_wide):
    with open_browser(ignore_default_args=["--hide-scrollbars"]) as window:
        shown = window.new_page(viewport={"width": width, "height": 800})
        shown.goto(page.as_uri())
        found = shown.evaluate(WIDE)
    assert found["over"] == []
    assert found["page"] <= 0
    assert len(found["bar"]) >= n_wide
    assert all(height >= 8 for height in found["bar"])  # px: seen without being touched
    assert found["drawn"] >= 3
