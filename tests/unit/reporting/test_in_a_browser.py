"""The report as a person sees it: in a real browser that has no network."""

import os
import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest

from afferents.evaluation.data import open_data, origins_of
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Evaluation, Recipe
from afferents.evaluation.run import evaluate
from afferents.models.model import models_in
from afferents.progress import Progress
from afferents.reporting.report import write_report

pytestmark = pytest.mark.system

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--host-resolver-rules=MAP * ~NOTFOUND", "--hide-scrollbars", "--window-size=1100,4500",
)  # fmt: skip


@pytest.fixture(scope="module")
def page(stores, tmp_path_factory):
    """A report on the small session of sounds."""
    folder = tmp_path_factory.mktemp("report")
    quiet = Progress(quiet=True)
    data = open_data([str(stores["audio"])])
    options = EvaluationOptions(preset="quick", workers=1)
    models = models_in("vib-te")
    recipe = Recipe(folder / "r", origins_of(data), models, data[0].encodings, options)
    evaluate(Evaluation(recipe, data), quiet)
    return write_report(folder / "r", quiet)


def browse(page, tmp_path, *arguments):
    if CHROMIUM is None:
        if os.environ.get("AFFERENTS_REQUIRE_BROWSER"):
            pytest.fail("no chromium on this machine, and AFFERENTS_REQUIRE_BROWSER is set")
        pytest.skip("no chromium on this machine: apt-get install chromium")
    command = [CHROMIUM, *FLAGS, f"--user-data-dir={tmp_path}/profile", *arguments]
    done = subprocess.run(
        [*command, page.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout


def test_the_page_is_drawn(page, tmp_path):
    browse(page, tmp_path, f"--screenshot={tmp_path}/page.png")
    picture = cv2.imread(str(tmp_path / "page.png"))
    assert picture.shape == (4500, 1100, 3)
    dark = (picture.max(axis=2) < 100).mean()
    assert 0.005 < dark < 0.3
    # The figures' blue is on the page.
    assert (np.abs(picture.astype(int) - [178, 114, 0]).max(axis=2) < 12).any()


def test_the_browser_finds_the_table_and_the_figures(page, tmp_path):
    document = browse(page, tmp_path, "--dump-dom")
    rows = re.findall(r"<tr>.*?</tr>", document, flags=re.DOTALL)
    assert any("vib-TE" in row and "50" in row for row in rows)
    assert document.count("<img") >= 3
    assert document.count("alt=") >= document.count("<img")


WIDE = """() => {
  const edge = document.documentElement.clientWidth;
  const held = [...document.querySelectorAll(".scroll")];
  const over = [...document.body.querySelectorAll("*")].filter(one =>
    one.getBoundingClientRect().right > edge + 1 && !held.some(h => h !== one && h.contains(one)));
  const bar = held.filter(one => one.scrollWidth > one.clientWidth)
    .map(one => one.offsetHeight - one.clientHeight);
  return {over: over.map(one => one.outerHTML.slice(0, 80)), bar,
          page: document.documentElement.scrollWidth - edge};
}"""


@pytest.mark.parametrize(("width", "n_wide"), [(1200, 0), (375, 1)])
def test_nothing_lies_beyond_the_edge_and_wide_tables_have_a_bar(page, width, n_wide):
    api = pytest.importorskip("playwright.sync_api")
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine: apt-get install chromium")
    with api.sync_playwright() as run:
        window = run.chromium.launch(
            executable_path=CHROMIUM,
            args=["--no-sandbox"],
            ignore_default_args=["--hide-scrollbars"],
        )
        shown = window.new_page(viewport={"width": width, "height": 800})
        shown.goto(page.as_uri())
        found = shown.evaluate(WIDE)
        window.close()
    assert found["over"] == []
    assert found["page"] <= 0
    assert len(found["bar"]) >= n_wide
    assert all(height >= 8 for height in found["bar"])  # px: seen without being touched
