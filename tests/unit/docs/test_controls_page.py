"""The page on controls: its Python runs on a CSV as it describes."""

import numpy as np
import pandas as pd

from .printed import DOCS, blocks


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
