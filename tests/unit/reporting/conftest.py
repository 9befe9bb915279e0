"""Small results whose every number can be checked by hand, and small arrays to draw."""

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from afferents.encodings.samples import Samples, concatenate, make_samples
from afferents.evaluation.results import Results, Summary
from afferents.reporting.data import FrameRow, Shown

NAMED = {"named_by_spacing": True}
TEXTURES = ["0", "0.5", "Linen"]
SPEEDS = [10.0, 20.0, 40.0]
BY_SPEED = {"10": 0.25, "20": 0.5, "40": 0.75}
COUNTED = (
    "test_samples_of_a_speed_seen_in_training",
    "test_samples_of_a_speed_seen_in_validation",
    "test_samples_overlapping_validation",
    "test_samples_overlapping_training",
)
LEAKS = {
    "nested": dict.fromkeys(COUNTED, 0) | {"scale_saw_held_out_speed": False},
    "published": dict(zip(COUNTED, (0, 1234, 567, 0), strict=True))
    | {"scale_saw_held_out_speed": True},
}


BINS = {"ece": 0.2, "count": [2, 0, 10], "confidence": [0.4, 0, 0.9], "accuracy": [0.5, 0, 0.7]}


def accuracies() -> dict[str, Any]:
    """Return a mean of 50 %, its interval 40.2 to 60.3 %, and 10 mm/s the worst with 25 %."""
    return {
        "mean_accuracy": 0.5,
        "ci95": [0.402, 0.603],
        "by": dict(BY_SPEED),
        "ci95_by": {key: [share - 0.1, share + 0.1] for key, share in BY_SPEED.items()},
        "worst": "10",
        "inside": {
            "mean_accuracy": 0.5,
            "ci95": [0.3, 0.7],
            "by": {"20": 0.5},
            "ci95_by": {"20": [0.3, 0.7]},
            "worst": "20",
        },
    }


def outcome(protocol: str) -> dict[str, Any]:
    """Return an outcome; see `accuracies`."""
    shift = 20.0 if protocol == "nested" else 0.0
    return {
        **accuracies(),
        "recordings": accuracies(),
        "by_touch": {"0.11": None, "1": {**accuracies(), "seconds": 1.0, "samples": 2}},
        "macro_f1": 0.481,
        "confusion": [[2, 1, 1], [1, 2, 1], [1, 1, 2]],
        "reliability": copy.deepcopy(BINS),
        "n_test": 1234,
        "seeds": [0],
        "validations": {key: float(key) + shift for key in BY_SPEED},
        "validation_accuracy": {"10": [0.5], "20": [0.5], "40": [0.5]},
        "epochs": {"10": [12], "20": [26], "40": [9]},
        "best_epoch": {"10": [11], "20": [20], "40": [9]},
        "first_epoch": {},
        "seconds": 12.3,
        "leaks": dict(LEAKS[protocol]),
    }


@pytest.fixture
def summary() -> dict[str, Any]:
    """Two vibration models on three textures and three speeds, both protocols."""
    return {
        "schema": 3,
        "afferents": "0.1.0",
        "cut": "all",
        "preset": "quick",
        "data": [
            {
                "source": "fabricslide:elsewhere/cloth",
                "kind": "fabricslide",
                "fingerprint": "abc123",
                "n_recordings": 9,
                "simulated": False,
            }
        ],
        "textures": list(TEXTURES),
        "named_by_spacing": True,
        "speeds_mm_s": list(SPEEDS),
        "chance": 1 / 3,
        "recommended": "vib-te-aug",
        "intervals": {"replicate": "texture", "n": 3},
        "skipped": [],
        "models": {
            name: {protocol: outcome(protocol) for protocol in ("nested", "published")}
            for name in ("vib-te-aug", "vib-te")
        },
    }


@pytest.fixture
def results(summary: dict[str, Any]) -> Results:
    """Return the summary with predictions: at 10 mm/s one of four right, and so on."""
    rows = [
        (model, protocol, 0, speed, true, predicted)
        for model in summary["models"]
        for protocol in ("nested", "published")
        for n_right, speed in enumerate(SPEEDS, 1)
        for true in TEXTURES
        for predicted in [true] * n_right + [TEXTURES[TEXTURES.index(true) - 1]] * (4 - n_right)
    ]
    columns = ["model", "protocol", "seed", "held_out_speed_mm_s"]
    predictions = pd.DataFrame(rows, columns=[*columns, "true_texture", "predicted_texture"])
    found = Summary.model_validate(summary)
    return Results(Path("OUT/results"), {"preset": "quick"}, found, predictions)


@pytest.fixture
def spectra() -> Samples:
    """Spectra of the textures 3 and 4 with one line each, at 2 Hz a mm/s, 1 Hz bins."""
    frequency = np.arange(200.0)
    return concatenate(
        [
            make_samples(
                np.tile((frequency == 2 * speed).astype(np.float32), (2, 1, 1)),
                ("channel", "frequency"),
                np.array([0.0, 0.5]),
                np.array([1.0, 1.5]),
                {**NAMED, "texture": texture, "speed_mm_s": speed, "name": f"{texture}/{speed:g}"},
                coords={"frequency": frequency},
            )
            for texture in ("3", "4")
            for speed in (20.0, 40.0, 80.0)
        ]
    )


@pytest.fixture
def frames() -> list[FrameRow]:
    """Tactile images 4 x 5 at 100 Hz, ten of one recording and four of another."""
    images = np.arange(14 * 20, dtype=np.float32).reshape(14, 4, 5)
    time_s = np.arange(14) / 100
    return [
        FrameRow("A", Shown("3", 50.0, "g"), images[:10], time_s[:10], "px"),
        FrameRow("B", Shown("3", 10.0, "g"), images[10:], time_s[:4], "px"),
    ]
