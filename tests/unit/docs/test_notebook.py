"""The notebook and the pages on controls run, and show what they say."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest
from matplotlib import pyplot

from .printed import DOCS, blocks

NOTEBOOK = Path(__file__).resolve().parents[3] / "docs/twelve_cells.ipynb"


@pytest.mark.system
@pytest.mark.timeout(600)
def test_the_notebook_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cells = [cell for cell in json.loads(NOTEBOOK.read_text())["cells"] if cell["source"]]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert len(code) == 12
    assert all(not cell.get("outputs") for cell in cells)  # kept without
    names = {}
    with mpl.rc_context({"backend": "Agg"}):
        for number, lines in enumerate(code, 1):
            exec(compile(lines, f"cell {number}", "exec"), names)
        assert len(pyplot.get_fignums()) == 6
        pyplot.close("all")
    assert set(names["by_speed"].index) == set(names["paper"])
    assert names["by_speed"].shape == (4, 4)


def test_the_example_runs_on_a_csv(tmp_path, monkeypatch, capsys):
    rng, parts = np.random.default_rng(0), []
    for texture, cycles in (("felt", 0.08), ("linen", 0.15), ("denim", 0.3)):
        for speed in (10, 20, 40):
            line = np.sin(2 * np.pi * cycles * np.arange(700))[:, None]
            one = pd.DataFrame(line + rng.normal(size=(700, 2)), columns=["taxel1", "taxel2"])
            parts.append(one.assign(recording=f"{texture}/{speed}", texture=texture, speed=speed))
    pd.concat(parts).to_csv(tmp_path / "slides.csv", index=False)
    monkeypatch.chdir(tmp_path)
    names = {}
    for example in blocks(DOCS / "controls.md", "python"):
        exec(example, names)
    assert names["X"].shape == (90, 64, 2)
    said = capsys.readouterr().out
    assert "3 groups, each held out in turn, 90 samples of 9 recordings" in said
    shown = blocks(DOCS / "controls.md", "text")[0]
    rows = [line[:18] for line in said.splitlines()[1:7]]
    assert rows == [line[:18] for line in shown.splitlines()[1:7]]


ROOT = Path(__file__).resolve().parents[3]
PAGE = ROOT / "docs/gallery/14_controls_on_public_data.py"
FABRICS = ROOT / "../shared/datasets/fabricslide"
_NUMBERS = re.compile(r"^(?:# )?([a-z ]+?) +(\d+\.\d)%?(?:  |$)", re.MULTILINE)


@pytest.mark.system
@pytest.mark.skipif(not FABRICS.is_dir(), reason="FabricSlide is not at ../shared/datasets")
def test_the_page_prints_what_it_says():
    done = subprocess.run(
        [sys.executable, PAGE, FABRICS],
        capture_output=True, text=True, check=True, env={**os.environ, "OMP_NUM_THREADS": "1"},
    )  # fmt: skip
    printed, written = (dict(_NUMBERS.findall(t)) for t in (done.stdout, PAGE.read_text()))
    assert len(written) == 10
    for name, percent in written.items():  # sums differ from processor to processor
        assert float(printed[name]) == pytest.approx(float(percent), abs=1), name
