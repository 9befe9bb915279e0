"""The notebook for students runs from its first cell to its last, and shows what it says."""

import json
from pathlib import Path

import matplotlib as mpl
import pytest
from matplotlib import pyplot

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
