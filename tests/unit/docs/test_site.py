"""The documentation site: nothing is missing from it, and what it prints can be run."""

import importlib
import re
import shlex
import sys
from pathlib import Path

import pytest
from matplotlib import pyplot

import afferents
from afferents.reporting.labels import ABBREVIATIONS

from .printed import DOCS, PAGES, ROOT, blocks, commands

SUBCLASSED = (
    "afferents.Channel",
    "afferents.DataSet",
    "afferents.ImageEncoding",
    "afferents.Model",
    "afferents.VibrationEncoding",
    "afferents.lab.devices.Camera",
    "afferents.lab.devices.Drive",
    "afferents.lab.devices.Microphone",
    "afferents.encodings.base.Encoding",
    "afferents.models.base.Classifier",
)
ROOMS = {"plot", "lab", "benchmark"}
"""Modules among the names of `afferents`: what is in them is listed under their names."""


def test_the_reference_lists_every_public_name_and_no_other():
    text = (DOCS / "api.md").read_text()
    listed = set(re.findall(r"^(?:   |\.\. py:data:: )(afferents\.[\w.]+)$", text, re.MULTILINE))
    public = {f"afferents.{name}" for name in dir(afferents) if name not in ROOMS}
    public |= {f"afferents.plot.{name}" for name in afferents.plot.__all__}
    assert sorted((public | set(SUBCLASSED)) - listed) == [], "add these to docs/api.md"
    for room in ROOMS & set(dir(afferents)):
        assert any(name.startswith(f"afferents.{room}.") for name in listed), room
    documented = re.findall(r"^   (afferents\.[\w.]+)$", text, re.MULTILINE)
    assert [name for name in documented if not hasattr(*found_by(name))] == []


def found_by(name):
    place, _, attribute = name.rpartition(".")
    return importlib.import_module(place), attribute


def test_every_page_is_in_the_contents():
    tocs = "".join("".join(blocks(page, "{toctree}")) for page in PAGES).splitlines()
    assert {page.stem for page in PAGES} - set(tocs) == {"index"}


def test_links_and_images_are_there():
    lost = [
        f"{page.name}: {link}"
        for page in PAGES
        for link in re.findall(r"\]\((?!https?:)([^)#\s]+)", page.read_text())
        if not link.startswith("examples/") and not (DOCS / link).exists()
    ]
    examples = {path.stem for path in (DOCS / "gallery").glob("*.py")} | {"index"}
    named = {
        name for page in PAGES for name in re.findall(r"examples/(\w+)\.rst", page.read_text())
    }
    assert lost == []
    assert named <= examples


def test_encodings_have_the_papers_names():
    """As its sections 2.2.1 and 2.4.1 have them, in one place of the code and on every page."""
    names = {short: words.partition(",")[0] for short, words in ABBREVIATIONS.items()}
    assert names == {
        "SE": "spatial encoding",
        "STE": "spatio-temporal encoding",
        "TE": "temporal encoding",
    }
    for page in ("glossary", "paper", "results"):
        text = " ".join((DOCS / f"{page}.md").read_text().split())
        assert [name for name in names.values() if name not in text] == []


def test_nothing_is_said_of_the_paper_that_it_does_not_say():
    wrong = (
        r"single\s+exposure|bumps\s+0\s+to\s+6|44\s+places|LEDs\s+round|paper's\s+a\s+minute|"
        r"(paper's\s+own|published)\s+recipe|once\s+a\s+\W*session\W*,\s+as\s+in\s+the\s+paper"
    )
    texts = [*DOCS.rglob("*.md"), *DOCS.rglob("*.py"), *(ROOT / "src").rglob("*.[pm][yd]")]
    assert [path for path in texts if re.search(wrong, path.read_text())] == []


def test_source_files_that_pages_name_are_there():
    pages = [*PAGES, DOCS.parent / "README.md", DOCS.parent / "CONTRIBUTING.md"]
    named = {
        path for page in pages for path in re.findall(r"`((?:\w+/)+\w+\.py)`", page.read_text())
    }
    package = Path(afferents.__file__).parent
    lost = [path for path in named if not any((a / path).exists() for a in (package, DOCS.parent))]
    assert named
    assert lost == []


@pytest.mark.system
def test_the_start_page_leads_to_tactile_images(session, example_cache, run, tmp_path, monkeypatch):
    """Its commands and Python in order, with a clip of ours."""
    page = DOCS / "start.md"
    monkeypatch.chdir(tmp_path)
    Path("CLIP.mp4").symlink_to(session / "1/20/video.mp4")
    for line in commands(page):
        code, _, err = run(*shlex.split(line)[1:])
        assert code == 0, f"{line}: {err}"
    to_check = Path("mine.png").read_bytes()
    for example in blocks(page, "python"):
        exec(example, {})
    pyplot.close("all")
    assert Path("first.png").stat().st_size > 5_000
    assert Path("clip.png").stat().st_size > 5_000
    assert Path("mine.png").read_bytes() == to_check  # the picture that calibrate wrote


@pytest.mark.system
@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path):
    """With the examples executed; it is what `make docs` does."""
    import subprocess

    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", DOCS, tmp_path / "html"]
    built = subprocess.run(command, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    words = (tmp_path / "html/searchindex.js").read_text()
    assert "novelti" in words or "novelty" in words


@pytest.mark.parametrize(
    ("what", "where"),
    [
        (r"import pickle|pickle\.(loads?|dumps?)\(", set()),
        (
            r"\bsubprocess\.|os\.system|os\.exec|os\.spawn|shell=",
            {"lab/devices/drives/guard.py", "lab/live/several.py"},
        ),
        (r"np\.load\((?!.*allow_pickle=False)|torch\.load\(|joblib\.load\(", set()),
        (r"create_server\(|\.bind\(|\.listen\(", {"lab/live/web/server.py"}),
    ],
)
def test_what_the_page_on_security_says_is_where_it_says(what, where):
    package = Path(afferents.__file__).parent
    found = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if re.search(what, path.read_text(encoding="utf-8"))
    }
    assert found == where


def test_files_that_are_named_to_be_read_are_there():
    text = (DOCS / "architecture.md").read_text()
    table = text[text.index("| read | and see |") : text.index("## The packages")]
    named = re.findall(r"`([a-z_/0-9]+\.py)`", table)
    assert len(named) > 30
    assert [one for one in named if not (ROOT / "src/afferents" / one).is_file()] == []
