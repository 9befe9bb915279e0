"""Generate a small session of drum sounds, so that the demo runs without a sensor.

Each texture is a drum with N bumps round it (N the nearest integer to 180 / x for bump spacing
x in mm, none for the smooth drum); at speed v it sounds at the multiples of
f1 = N v / (pi 80 mm). Skin does not follow what is narrower than its footprint, so fine
textures have fewer harmonics. Every recording draws its own harmonic weights, loudness, drive
lines and noise. These are tones, not physics: they show that the way of the data works, no more.

    python scripts/demo_session.py FOLDER
"""

import math
import sys
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from afferents.core.files import write_aside, write_json

RATE_HZ, SECONDS = 44100, 10.0
SPACINGS_MM = np.arange(0, 6.5, 0.5)
SPEEDS_MM_S = (10, 20, 40, 60, 80, 100)
DRUM_MM = 80.0
CUTOFF_HZ = 150.0
FOOTPRINT_MM = 0.4
SEED = 0


def drum_sound(
    spacing_mm: float, speed_mm_s: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return the sensor's channel of one recording, full scale 1, shape (n_samples,)."""
    time = np.arange(round(RATE_HZ * SECONDS)) / RATE_HZ
    drive_hz = 14.4 * speed_mm_s / (math.pi * DRUM_MM)
    sound = rng.normal(0, 0.01, len(time)) + 0.004 * np.sin(2 * np.pi * 50 * time)
    sound += 0.01 * np.sin(2 * np.pi * drive_hz * time + rng.uniform(0, 2 * np.pi))
    if spacing_mm > 0:
        first_hz = round(180 / spacing_mm) * speed_mm_s / (math.pi * DRUM_MM)
        loudness = 0.12 * (speed_mm_s / 50) ** 0.5 * rng.uniform(0.8, 1.25)
        for k in range(1, 25):
            smoothing = math.exp(-((FOOTPRINT_MM * k / (spacing_mm * math.sqrt(2))) ** 2))
            weight = rng.uniform(0.7, 1.3) * (1.5 if k == 2 else 1.0) * smoothing
            gel = 1 / (1 + (k * first_hz / CUTOFF_HZ) ** 2)
            phase = rng.uniform(0, 2 * np.pi)
            sound += loudness * weight * gel * np.sin(2 * np.pi * k * first_hz * time + phase)
    return 0.5 * sound


def main(folder: Path) -> None:
    """Write every recording that is not there yet."""
    write_json(
        folder / "session.json",
        {"simulated": True, "steady_s": [0.0, SECONDS], "generator": Path(__file__).name},
    )
    for i, spacing in enumerate(SPACINGS_MM):
        for speed in SPEEDS_MM_S:
            rng = np.random.default_rng([SEED, i, speed])
            sensor = drum_sound(float(spacing), speed, rng)
            room = rng.normal(0, 0.01, len(sensor))
            target = folder / f"{spacing:g}" / str(speed) / "audio.wav"
            if not target.is_file():
                with write_aside(target) as partial, partial.open("wb") as file:
                    soundfile.write(file, np.stack([room, sensor], axis=1), RATE_HZ, format="WAV")
    print(f"{folder}: {len(SPACINGS_MM)} textures x {len(SPEEDS_MM_S)} speeds, generated tones")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
