"""The whole way of the data gives the numbers that it gave; see make_path.py."""

import json
from pathlib import Path

import pytest

from .flat import flat

HERE = Path(__file__).parent

# Libraries choose their kernels by the processor, and sums taken in another order round otherwise.
# The largest differences that scripts/test_processors.sh's processors made, and some more.
ROUNDED = {
    "truth": 1e-4,
    "store": 0.01,
    "samples": 0.05,
    "folds": 1e-6,
    "predictions": 0.03,
    "report": 1e-6,
    "onnx": 0.03,
    "live": 0.03,
}
# Training makes much of little: a network's weights differ by what one sum rounded. Where
# another processor made them, a network is only asked to be as good.
TRAINED_ELSEWHERE = {"predictions": 0.5, "onnx": 0.5, "live": 0.5, "folds": 0.15}


def test_the_whole_path_stands(load, tmp_path):
    script = load(HERE / "make_path.py")
    kept = json.loads((HERE / "path.json").read_text(encoding="utf-8"))
    found = json.loads(json.dumps(script.path(tmp_path)))
    elsewhere = found.pop("processor") != kept.pop("processor")
    expected, found = flat(kept), flat(found)
    assert found.keys() == expected.keys()
    wrong = [
        f"{name}: {value} became {found[name]}"
        for name, value in expected.items()
        if not stands(found[name], value, bound(name, elsewhere, script))
    ]
    assert not wrong, "\n".join(wrong[:40])


def bound(name, elsewhere, script):
    step = name.split("/")[1]
    if elsewhere and step == "report":
        return None
    if elsewhere and script.NETWORK in name and step != "samples":
        return TRAINED_ELSEWHERE[step]
    return ROUNDED[step]


def stands(found, expected, most):
    if most is None:  # counts of what lies near the edge between two textures
        return type(found) is type(expected)
    if isinstance(expected, float):
        return found == pytest.approx(expected, abs=most, rel=1e-6)
    return found == expected
