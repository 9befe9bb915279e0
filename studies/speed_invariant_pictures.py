"""Draw docs/images/orders.png: what speed does to spectra, and what it leaves of images.

python studies/speed_invariant_pictures.py STORE docs/images/orders.png

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from afferents.channels import CHANNELS
from afferents.encodings.settings import Encodings
from afferents.encodings.windows import Lines
from afferents.evaluation.data import Source, encode_all
from afferents.progress import Progress
from afferents.store.zarr_store import open_responses

SPEEDS, SPACINGS = (30.0, 50.0, 70.0, 90.0), ("2", "3", "4")


def main(store: Path, out: Path) -> None:
    """Encode three drums at four speeds, and draw them."""
    recordings = [
        r for r in open_responses(store)
        if r.attrs["texture"] in SPACINGS and r.attrs["speed_mm_s"] in SPEEDS
    ]  # fmt: skip
    how = Encodings().changed(mask=Lines.parse("50Hz,0.0573/mm"), frames=90)
    quiet = Progress(quiet=True)
    orders = encode_all(recordings, Source(CHANNELS["ra2"], how.of("orders")), "all", quiet)
    of_skin = Source(CHANNELS["sa1_vector"], how.of("wavenumbers"))
    waves = encode_all(recordings, of_skin, "all", quiet)
    figure, axes = plt.subplots(3, 3, figsize=(10, 7), layout="constrained", sharex="col")
    colours = plt.get_cmap("viridis")(np.linspace(0, 0.9, len(SPEEDS)))
    for row, texture in zip(axes, SPACINGS, strict=True):
        for speed, colour in zip(SPEEDS, colours, strict=True):
            of = [
                samples.values[
                    (samples["texture"].values == texture) & (samples["speed_mm_s"].values == speed)
                ].mean(axis=0)
                for samples in (orders, waves)
            ]
            frequency = orders["frequency"].values
            row[0].semilogx(frequency, of[0][0] / np.log(10), color=colour)
            row[1].semilogx(frequency / speed, of[0][0] / np.log(10), color=colour)
            along = waves["column_wavenumber"].values / 1.2  # pins are 1.2 mm apart
            row[2].plot(along, of[1][0, 0] / np.log(10), color=colour, label=f"{speed:g} mm/s")
        row[0].set_ylabel(f"bumps {texture} mm apart\nlog10 power")
        row[1].set_xlim(0.1, 4)
        row[1].set_xticks([0.1, 0.3, 1, 3], ["0.1", "0.3", "1", "3"])
        row[1].minorticks_off()
    for axis, label in zip(
        axes[-1],
        ("microphone: frequency, Hz", "frequency / speed, cycles per mm",
         "markers: along the slide, cycles per mm"),
        strict=True,
    ):  # fmt: skip
        axis.set_xlabel(label)
    axes[0, 2].legend(fontsize=8)
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
