"""Numbers that must not move unless a change is meant to move them; see make.py, make_path.py."""

import json
from pathlib import Path

import pytest

from .flat import flat

HERE = Path(__file__).parent

# Libraries choose their kernels by the processor, and sums taken in another order round otherwise.
# The largest differences that scripts/test_processors.sh's processors made, and some more.
ROUNDED = {
    "truth": 1.1 / 1024,  # positions are kept in steps of 1/1024 px: another rounding is a step
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
TRAINED_ELSEWHERE = {"predictions": 0.5, "onnx": 0.5, "live": 0.5, "folds": 0.15, "report": 0.15}
ACCURACIES = ("validation_accuracy", "mean_accuracy", "by")


@pytest.mark.timeout(300)  # it compiles what the whole path needs
def test_the_whole_path_stands(load, tmp_path):
    script = load(HERE / "make_path.py")
    kept = json.loads((HERE / "path.json").read_text(encoding="utf-8"))
    found = json.loads(json.dumps(script.path(tmp_path)))
    assert not differences(kept, found, script.NETWORK)


def differences(kept, found, network):
    """Return what of the numbers found is further from those kept than rounding explains."""
    elsewhere = found["processor"] != kept["processor"]
    expected, found = ({k: v for k, v in flat(one).items() if k != "/processor"}
                       for one in (kept, found))  # fmt: skip
    if elsewhere:  # which of its states a live model goes through is decided at thresholds
        expected, found = ({k: v for k, v in one.items() if "/states/" not in k}
                           for one in (expected, found))  # fmt: skip
    assert found.keys() == expected.keys()
    return [
        f"{name}: {value} became {found[name]}"
        for name, value in expected.items()
        if not stands(found[name], value, bound(name, elsewhere, network, expected))
    ]


def bound(name, elsewhere, network, kept):
    """Return how far a number may be from the kept one; None where only its type is asked for.

    What is decided by comparing floats is exact on the processor that made the kept numbers. On
    another one, two samples may be on the other side, and a penalty may be the next one.
    """
    step, *parts = name.split("/")[1:]
    if not elsewhere:
        return ROUNDED[step]
    is_network = network in name
    if is_network and step != "samples" and (step != "report" or set(ACCURACIES) & set(parts)):
        return TRAINED_ELSEWHERE[step]
    if parts[-1] == "penalty":
        return 3 * kept[name]
    if set(ACCURACIES) & set(parts):
        return 2 / kept[count_of(name)]
    if "confusion" in parts and not is_network:
        return 2
    return None if step == "report" else ROUNDED[step]


def count_of(name):
    """Return the name of the number of samples that an accuracy was counted over."""
    if name.startswith("/folds/"):  # a ridge's is that of its training samples, each left out once
        return name.replace("validation_accuracy", "n_train")
    return "/".join(name.split("/")[:4]) + "/n_test"


def stands(found, expected, most):
    if most is None:  # of a network's counts, and of intervals and tables of counts
        return type(found) is type(expected)
    if isinstance(expected, float) or (isinstance(expected, int) and most >= 1):
        return found == pytest.approx(expected, abs=most, rel=1e-6)
    return found == expected


@pytest.mark.parametrize(
    ("name", "change", "here", "there"),
    [
        ("/folds/ra/validation_accuracy", -1 / 240, False, True),
        ("/folds/ra/validation_accuracy", -3 / 240, False, False),
        ("/folds/ra/penalty", 70.0, False, True),
        ("/folds/ra/epochs", 1, False, False),
        ("/report/models/ra/mean_accuracy", 1 / 60, False, True),
        ("/report/models/ra/mean_accuracy", 0.1, False, False),
        ("/report/models/ra/confusion/0", 2, False, True),
        ("/report/models/net/confusion/0", 40, False, True),
        ("/report/models/net/mean_accuracy", 0.2, False, False),
        ("/live/ra/probabilities/0", 0.02, True, True),
    ],
)
def test_counts_are_bounded_as_counts(name, change, here, there):
    ra = {"mean_accuracy": 0.5, "confusion": [30], "n_test": 60}
    kept = {
        "processor": "a",
        "folds": {"ra": {"validation_accuracy": 0.8, "n_train": 240, "penalty": 30.0, "epochs": 0}},
        "report": {"models": {"ra": ra, "net": ra}},
        "live": {"ra": {"probabilities": [0.5]}},
    }
    for processor, passes in (("a", here), ("b", there)):
        found = json.loads(json.dumps(kept)) | {"processor": processor}
        *way, last = name.split("/")[1:]
        place = found
        for part in way:
            place = place[part]
        key = int(last) if isinstance(place, list) else last
        place[key] += change
        assert (not differences(kept, found, "net")) == passes


def test_golden_numbers_stand(load):
    expected = flat(json.loads((HERE / "numbers.json").read_text()))
    found = flat(load(HERE / "make.py").numbers())
    assert found.keys() == expected.keys()
    # Spectra are float32: a transform of 44,100 points rounds some 16 times, and 16 * eps is 2e-6.
    # That moves no largest bin: those that stand next to each other differ by 4e-4 or more.
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-4, abs=1e-5), name
