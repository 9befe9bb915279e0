"""Write a folder of CSV files as a lab's sensor might leave them, for docs/your-data.md.

    python scripts/simulated_taxels.py FOLDER

Four taxels, 1.5 mm apart, slide over three textures at four speeds, twice each; 200 rows a second.
A texture is a height that repeats: each taxel feels it, later by its distance, through a skin that
smooths what is short, with an offset and noise. Beside the files lies a `dataset.toml`.
"""

import sys
from pathlib import Path

import numpy as np

RATE_HZ = 200
SECONDS = 8
SPEEDS_MM_S = (10, 20, 40, 60)
TRIALS = 2
APART_MM = 1.5
SKIN_MM = 0.4
"""Waves that are shorter are felt weakly."""
WAVES = {
    "cotton": ((0.25, 1.0), (0.5, 0.8)),
    "denim": ((0.35, 1.0), (0.7, 0.3), (0.9, 0.5)),
    "leather": ((0.2, 0.6), (0.6, 0.9)),
}
"""Cycles per mm, and how high each wave is."""
DATA_SET = """\
title = "Simulated taxels"
simulated = true

[files]
pattern = "{texture}/{speed}mmps_{trial}.csv"

[signal]
time = "time_s"
channels = ["taxel*"]
steady_s = [0.5, 7.5]
"""


def slide(texture: str, speed_mm_s: float, rng: np.random.Generator) -> np.ndarray:
    """Return what taxels feel, (time, taxel), in counts."""
    time_s = np.arange(SECONDS * RATE_HZ) / RATE_HZ
    even = 1 + 0.01 * np.sin(2 * np.pi * 0.3 * time_s + rng.uniform(0, 2 * np.pi))
    way_mm = np.cumsum(speed_mm_s * even) / RATE_HZ + rng.uniform(0, 100)
    felt = np.zeros((len(time_s), 4))
    for taxel in range(4):
        for per_mm, height in WAVES[texture]:
            weight = height * np.exp(-((per_mm * SKIN_MM) ** 2))
            felt[:, taxel] += weight * np.sin(2 * np.pi * per_mm * (way_mm - taxel * APART_MM))
    return 500 + 40 * rng.normal(size=4) + 30 * felt + 20 * rng.normal(size=felt.shape)


def write(folder: Path) -> None:
    """Write all files and their description."""
    rng = np.random.default_rng(0)
    for texture in WAVES:
        (folder / texture).mkdir(parents=True, exist_ok=True)
        for speed in SPEEDS_MM_S:
            for trial in range(1, TRIALS + 1):
                lines = ["time_s,taxel1,taxel2,taxel3,taxel4"]
                for n, row in enumerate(slide(texture, speed, rng)):
                    lines.append(f"{n / RATE_HZ:.3f}," + ",".join(f"{v:.1f}" for v in row))
                path = folder / texture / f"{speed}mmps_{trial}.csv"
                path.write_text("\n".join(lines) + "\n")
    (folder / "dataset.toml").write_text(DATA_SET)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
