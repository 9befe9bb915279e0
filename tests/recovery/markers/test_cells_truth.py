"""Cells of a plain gel say that and when the skin moves: `scripts/cells_truth.py`, its own gel."""

import runpy
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[3] / "scripts/cells_truth.py"


def test_cells_of_a_made_gel_go_with_how_far_its_skin_moves():
    script = runpy.run_path(str(SCRIPT))
    (everywhere, _, means, _), noise = script["compared"](*script["made"]())
    assert everywhere > 0.8
    assert means > 0.9
    assert noise < 1.5
