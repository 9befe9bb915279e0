"""Pages show what the data have, and what runs without a pinned commit still runs.

python -m pytest studies
"""

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import here

PINNED = sorted(p.stem for p in HERE.glob("*.py") if "Pinned to commit" in p.read_text())
DATA = sorted(path for path in here.DATA.glob("*.json") if path.stem != "rig-predictions")


def test_pages_are_drawn_from_the_data():
    stale = [path.name for path, text in here.pages().items() if path.read_text() != text]
    assert stale == [], "run python studies/here.py"


@pytest.mark.parametrize("path", DATA, ids=lambda path: path.stem)
def test_data_name_their_source_and_stand_on_one_page(path):
    found = json.loads(path.read_text())
    assert all(found[name] for name in ("title", "commit", "date", "machine", "commands", "rows"))
    mark = f"<!-- results {path.stem} -->"
    assert sum(mark in page.read_text() for page in HERE.glob("*.md")) == 1


def test_links_of_the_pages_lead_somewhere():
    lost = [
        f"{page.name}: {link}"
        for page in HERE.glob("*.md")
        for link in re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text())
        if not (HERE / link).exists()
    ]
    assert lost == []


def test_the_papers_accuracies_are_rounded_as_it_prints_them():
    """41 and 43, of which the colours give 40.5 and 42.5."""
    rows = json.loads((here.DATA / "rig-speeds.json").read_text())["rows"]
    where = HERE.parent / "src/afferents/reporting/published/accuracy.json"
    families = json.loads(where.read_text())["families"].values()
    printed = [[f"{v['title_percent']}" for v in one["by_speed"].values()] for one in families]
    assert [row[2:] for row in rows if row[1] == "paper"] == printed


def test_every_constant_of_the_rig_has_a_source():
    from rig_constants import SOURCES, constants_table

    first = ("paper", "published", "chosen", "the drum's")
    assert all(source.startswith(first) for source in SOURCES.values())
    assert constants_table().count("\n") == len(SOURCES) + 1  # refuses what has no source


def test_natural_surfaces_have_the_heights_stated():
    from natural_surfaces import SHAPE, cords, weave

    rng = np.random.default_rng(0)
    cord, cloth = cords(11, rng), weave(11, 200.0, rng)
    assert cord.shape == cloth.shape == SHAPE
    assert 0.4 < np.ptp(cord) < 0.8
    assert 0.3 < np.ptp(cloth) < 1.5


def test_measures_of_images_find_a_pattern_that_is_there():
    from rig_measures import contrast

    pins = np.arange(19) * 1.2 / (3.0 * np.sqrt(2)) * 2 * np.pi
    noise = np.random.default_rng(0).normal(size=(20, 19, 19))
    pattern = np.cos(pins[:, None] + pins) + np.cos(pins[:, None] - pins)
    assert max(contrast(noise)) < 3
    assert min(contrast(noise + pattern)) > 10


@pytest.mark.parametrize("name", PINNED)
def test_what_is_pinned_is_imported_or_the_reason_is_given(name):
    try:
        __import__(name)
    except (ImportError, AttributeError) as problem:
        pytest.skip(f"runs at its commit alone: {problem}")
