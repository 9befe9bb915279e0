"""Regenerate the golden numbers: python tests/golden/make.py

Run it only when a change is meant to change them, and say in the commit why.
"""

import json
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import xarray as xr

from afferents import LeaveOneSpeedOut, load_sensor, sa1, stretch_spectrum
from afferents.encodings.augment import stretched_copies
from afferents.encodings.spectra import amplitude_spectrum
from afferents.evaluation.intervals import Accuracy, bootstrap_interval, count_right
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import number_in_recording
from afferents.markers.detect import detect
from afferents.markers.grid import assign_grid

HERE = Path(__file__).parent
NUMBERS = HERE / "numbers.json"


def drum_tone() -> np.ndarray:
    """One second of a 3 mm drum at 50 mm/s: 60 bumps, f1 = 60 * 50 / (pi 80) Hz, four lines."""
    time = np.arange(44100) / 44100
    first_hz = 60 * 50 / (np.pi * 80)
    return sum(np.sin(2 * np.pi * k * first_hz * time) / k for k in range(1, 5)).astype(np.float32)


def drawn_markers(shift_px: float) -> np.ndarray:
    """A frame of 19 x 19 discs turned by 6.2 degrees and shifted right."""
    image = np.zeros((480, 640), dtype=np.uint8)
    x, y = np.meshgrid(21.5 * np.arange(-9, 10), 21.5 * np.arange(-9, 10))
    turn = np.deg2rad(6.2)
    for u, v in zip(x.ravel(), y.ravel(), strict=True):
        place = (320 + shift_px + u * np.cos(turn) - v * np.sin(turn),
                 240 + u * np.sin(turn) + v * np.cos(turn))  # fmt: skip
        cv2.circle(
            image, [round(c * 256) for c in place], round(6.3 * 256), 255, -1, cv2.LINE_AA, 8
        )
    return image


def spectra() -> dict[str, object]:
    """Lines of the drum tone, and its spectrum stretched both ways."""
    spectrum = amplitude_spectrum(drum_tone())[:4000]
    rng = np.random.default_rng([0, 3])
    copies, _ = stretched_copies(spectrum[None, None], rng, "rebinned", 200)
    return {
        "largest_bins": np.argsort(spectrum)[::-1][:6].tolist(),
        "amplitudes": spectrum[[11, 12, 13, 24, 36, 48]].tolist(),
        "rebinned": stretch_spectrum(spectrum, 1.37)[[10, 15, 16, 17, 33]].tolist(),
        "fourier": stretch_spectrum(spectrum, 1.37, "fourier")[[10, 15, 16, 17, 33]].tolist(),
        "largest_bin_of_copies": copies[:, 0].argmax(axis=1).tolist(),
    }


def markers() -> dict[str, object]:
    """Detected positions, roll, and SA-I of a shift."""
    sensor = load_sensor("tip_b")
    ordered = []
    for shift in (0.0, 2.25):
        found = detect(drawn_markers(shift), sensor)
        grid = assign_grid(found, 19, 19, "drawn")
        ordered.append(found[np.lexsort((grid.column, grid.row))])
    rest, moved = (xr.DataArray(p, dims=("marker", "space")) for p in ordered)
    slow = sa1(moved.expand_dims("time"), rest)
    return {
        "n": len(rest),
        "roll_deg": grid.roll_deg,
        "first_position": rest.values[0].tolist(),
        "mean_sa1_px": float(slow.mean()),
    }


def folds() -> dict[str, object]:
    """Sizes of the published split of spectra, and the nested validation speeds."""
    speeds = np.repeat(np.arange(10.0, 101, 10), 119)
    rows = {"speed_mm_s": speeds, "recording": [f"{v:g}" for v in speeds], "texture": "a"}
    samples = xr.DataArray(
        np.zeros(len(speeds)),
        dims="sample",
        coords={k: ("sample", np.broadcast_to(v, len(speeds))) for k, v in rows.items()},
    )
    splitter = LeaveOneSpeedOut(PROTOCOLS["published"], random_halves=True, seed=0)
    fold = next(splitter.folds(samples))
    number = number_in_recording(samples["recording"].values)
    return {
        "sizes": [len(fold.train), len(fold.validation), len(fold.test)],
        "first_validating_windows": number[fold.validation][:8].tolist(),
        "nested_validation_speeds": [
            fold.validated_by for fold in LeaveOneSpeedOut().folds(samples)
        ],
    }


def interval() -> list[float]:
    """Bootstrap interval of 3 speeds x 4 textures."""
    rng = np.random.default_rng(1)
    rows = [
        (speed, f"{texture}/{speed}", texture, texture if rng.random() < 0.6 else "none")
        for speed in (10, 20, 30)
        for texture in "abcd"
        for _ in range(20)
    ]
    names = ["held_out_speed_mm_s", "recording", "true_texture", "predicted_texture"]
    found = bootstrap_interval(Accuracy(count_right(pd.DataFrame(rows, columns=names))))
    return [found.low, found.high]


def numbers() -> dict[str, object]:
    """All golden numbers."""
    return {"spectra": spectra(), "markers": markers(), "folds": folds(), "interval": interval()}


if __name__ == "__main__":
    NUMBERS.write_text(json.dumps(numbers(), indent=2) + "\n", encoding="utf-8")
