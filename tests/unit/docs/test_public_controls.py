"""The gallery's page on controls prints what it says, where its data lie."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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
