"""Which waves of SA-I move with a drum's bumps, and where beats with the nodules put them.

The bumps' own waves are shorter than what the camera sees (pins end 3.6 mm deep in the gel). But
nodules, which stand under every second pin, press hardest on the drum: a wave that is sampled so
looks like a longer one, as spokes do in a film (Shannon, Proc. IRE 1949). This finds, at
a drum's own rate and its multiples, the strongest wave in SA-I, and the longest one that the
bumps' lattice, sampled by the nodules, is to look like.

    python studies/wave_beats.py S12.zarr [studies/data/rig-wave-beats.json]

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.
"""

import math
import sys
from itertools import product
from pathlib import Path

import here  # noqa: F401
import numpy as np
import results_pages as pages
from numpy.typing import NDArray

import afferents
from afferents.channels import CHANNELS
from afferents.encodings.images import component_images
from afferents.rig.camera import RigCamera
from afferents.rig.skin import Skin
from afferents.rig.surface import Drum
from afferents.store.responses import Responses, steady_s
from afferents.store.trimming import cut_frames

SPEED_MM_S, FPS_HZ = 40.0, RigCamera().fps_hz
N_PADDED = 64
"""Points of the transform over pins: 0.013 cycles/mm from one to the next."""
WIDTH = 4
"""Frequencies on either side of a multiple that count as its own."""

Floats = NDArray[np.float64]


def images_of(responses: Responses) -> Floats:
    """Return images (time, component, row, column) of SA-I at constant speed, tapered, px."""
    time, until = responses["time"].values, steady_s(responses)
    kept = cut_frames(time, "all", until, str(responses.attrs["name"]))
    moved = CHANNELS["sa1_vector"].response(responses).isel(time=kept)
    images = component_images(moved.fillna(0)).astype(np.float64)
    images -= images.mean(axis=0)
    tapers = [np.hanning(n + 2)[1:-1] for n in images.shape[2:]]
    return images * np.hanning(len(images))[:, None, None, None] * np.multiply.outer(*tapers)


def wave_at(images: Floats, hz: float) -> tuple[Floats, float]:
    """Return the strongest wave at a frequency, (along, across) in cycles/mm, and its power."""
    place = round(hz * len(images) / FPS_HZ)
    spectra = np.fft.fft(images, axis=0)[place - WIDTH : place + WIDTH + 1]
    power = np.abs(np.fft.fft2(spectra, (N_PADDED, N_PADDED))) ** 2
    by_wave = power.sum(axis=(0, 1))
    row, column = np.unravel_index(by_wave.argmax(), by_wave.shape)
    per_mm = np.fft.fftfreq(N_PADDED, Skin().pitch_mm)
    return np.array([per_mm[column], per_mm[row]]), float(by_wave.sum())


def looks_like(spacing_mm: float, multiple: int) -> Floats:
    """Return the longest wave that a multiple of the bumps' waves looks like, cycles/mm, >= 0."""
    pitch = Skin().pitch_mm
    own = [
        np.array([multiple, across]) / (math.sqrt(2) * spacing_mm)
        for across in range(multiple % 2, multiple + 1, 2)
    ]
    # What samples by nodules at every second pin, chequered, can't tell from one another.
    same = [
        np.array([m, n]) / (2 * pitch)
        for m, n in product(range(-6, 7), repeat=2)
        if (m + n) % 2 == 0
    ]
    folded = [wave - other for wave in own for other in same]
    return np.abs(min(folded, key=lambda wave: float(np.hypot(*wave))))


def main(store: str, out: str | None = None) -> None:
    """Print the table, and write it where that is asked for."""
    rows = []
    for responses in afferents.open_responses(store):
        spacing = float(responses.attrs["texture"])
        if responses.attrs["speed_mm_s"] != SPEED_MM_S or spacing == 0:
            continue
        base, highest = Drum().rate_hz(spacing, SPEED_MM_S), 0.49 * FPS_HZ
        images = images_of(responses)
        found = {n: wave_at(images, n * base) for n in (1, 2, 3) if n * base < highest}
        if not found:
            continue
        n = max(found, key=lambda one: found[one][1])
        own = n / (math.sqrt(2) * spacing)
        cells = (np.abs(found[n][0]), looks_like(spacing, n))
        rows.append([
            f"{spacing:g} mm", f"{n}", f"{own:.2f}", *(f"{a:.2f}, {b:.2f}" for a, b in cells),
        ])  # fmt: skip
        print(*rows[-1], sep="  ")
    if out:
        columns = [
            "bumps", "multiple of their rate", "their wave along the slide, per mm",
            "strongest wave found (along, across)", "as nodules sample it",
        ]  # fmt: skip
        title = "Waves of SA-I that move with the bumps"
        command = f"python studies/wave_beats.py {Path(store).name}"
        pages.write(Path(out), title, [command], columns, rows)


if __name__ == "__main__":
    main(*sys.argv[1:])
