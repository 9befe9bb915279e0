"""The documentation site: nothing is missing from it, and what it prints can be run."""

import importlib
import re
import shlex
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import cv2
import numpy as np
import pytest
from matplotlib import pyplot

import afferents
from afferents.markers.sensor import load_sensor

from .printed import DOCS, PAGES, WITH_COMMANDS, blocks, commands, understood

SUBCLASSED = (
    "afferents.Channel",
    "afferents.DataSet",
    "afferents.ImageEncoding",
    "afferents.Model",
    "afferents.VibrationEncoding",
    "afferents.devices.Camera",
    "afferents.devices.Drive",
    "afferents.devices.Microphone",
    "afferents.encodings.base.Encoding",
    "afferents.models.base.Classifier",
)
ROOMS = {"plot", "live", "devices"}
"""Modules among the names of `afferents`: what is in them is listed under their names."""


@pytest.fixture(scope="module")
def from_code():
    spec = spec_from_file_location("from_code", DOCS / "from_code.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_reference_lists_every_public_name():
    listed = set(re.findall(r"^(?:   |\.\. py:data:: )(afferents\.[\w.]+)$", *reference()))
    public = {f"afferents.{name}" for name in dir(afferents) if name not in ROOMS}
    assert sorted(public - listed) == [], "add these to docs/api.md"
    assert set(SUBCLASSED) <= listed
    drawn = {f"afferents.plot.{name}" for name in afferents.plot.__all__}
    assert drawn <= listed
    for room in ROOMS & set(dir(afferents)):
        assert any(name.startswith(f"afferents.{room}.") for name in listed), room


def test_every_name_of_the_reference_is_there():
    listed = re.findall(r"^   (afferents\.[\w.]+)$", *reference())
    assert [name for name in listed if not hasattr(*found_by(name))] == []


def found_by(name):
    place, _, attribute = name.rpartition(".")
    return importlib.import_module(place), attribute


def reference():
    return (DOCS / "api.md").read_text(), re.MULTILINE


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


def test_the_tables_are_of_the_registries(from_code):
    parts = from_code.parts()
    for file, named in (
        ("models", afferents.MODELS),
        ("channels", afferents.CHANNELS),
        ("encodings", afferents.ENCODINGS),
        ("classifiers", afferents.CLASSIFIERS),
    ):
        rows = re.findall(r"^\| `([^`]+)` \| (.+?) \|", parts[f"{file}.md"], re.MULTILINE)
        assert [name for name, _ in rows] == list(named)
        assert all(len(said) > 2 for _, said in rows)


@pytest.mark.parametrize("page", WITH_COMMANDS, ids=lambda page: page.stem)
def test_printed_commands_are_understood(page, tmp_path, monkeypatch):
    """Each is read as a shell would hand it over: command, options, and their values."""
    monkeypatch.chdir(tmp_path)
    own = blocks(DOCS / "own-models.md", "python")
    (tmp_path / "my_models.py").write_text(own[0])
    for line in commands(page):
        understood(line)


def of_rows_and_columns(clip, session):
    clip.symlink_to(session / "1/20/video.mp4")


def of_a_hexagon(clip, session):
    """White discs where the sensor `hex127` has its markers; they move to the right."""
    places = np.array(load_sensor("hex127").markers)
    video = cv2.VideoWriter(str(clip), cv2.VideoWriter.fourcc(*"mp4v"), 90, (640, 480))
    for shift in np.clip(np.arange(40) - 12, 0, 8) / 2:
        image = np.full((480, 640, 3), 20, np.uint8)
        for x, y in places:
            centre = (round((x + shift) * 256), round(y * 256))
            cv2.circle(image, centre, 6 * 256, (230, 230, 230), -1, cv2.LINE_AA, 8)
        video.write(image)
    video.release()


@pytest.mark.system
@pytest.mark.parametrize("write_clip", [of_rows_and_columns, of_a_hexagon])
def test_the_start_page_leads_to_tactile_images(
    write_clip, session, example_cache, run, tmp_path, monkeypatch
):
    """Its commands and Python in order, with a clip of ours."""
    page = DOCS / "start.md"
    monkeypatch.chdir(tmp_path)
    write_clip(Path("CLIP.mp4"), session)
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


@pytest.mark.system
@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["01_track_a_clip", "02_what_afferents_look_like", "05_your_own_classifier"]
)
def test_examples_run_as_notebooks(name, tmp_path, example_cache):
    import nbformat
    from nbclient import NotebookClient
    from sphinx_gallery.gen_gallery import DEFAULT_GALLERY_CONF
    from sphinx_gallery.notebook import jupyter_notebook, save_notebook
    from sphinx_gallery.py_source_parser import split_code_and_text_blocks

    script = DOCS / "gallery" / f"{name}.py"
    _, parts = split_code_and_text_blocks(script)
    path = tmp_path / f"{name}.ipynb"
    save_notebook(jupyter_notebook(parts, DEFAULT_GALLERY_CONF, str(tmp_path)), path)
    book = nbformat.read(path, as_version=4)
    NotebookClient(book, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    outputs = [out for cell in book.cells for out in cell.get("outputs", [])]
    assert any("image/png" in out.get("data", {}) for out in outputs)
