"""
Nerve fibres from a MATLAB file
===============================

Laboratories keep spikes in MATLAB files, each in cells of its own order. Some lines of Python turn
them into ``Spikes``, which the package analyses like those of artificial units. The file here has
the layout of a public one: fibres of the monkey's fingertip (Weber et al. 2013), ``RawPAFData.mat``
in `nbso13/bensmaia_gelsight_scripts <https://github.com/nbso13/bensmaia_gelsight_scripts>`__. Its
spikes are made up; the function below reads the public file just as well.
"""

# %%
# The file
# --------
# ``spikes`` has a cell for each speed, 40, 80 and 120 mm/s. In it are cells by texture, fibre and
# repetition: times in s, from the start of the trial. ``rates`` has the same order. No file says
# how long trials are, but spikes divided by rate do: 2 s at 40 mm/s, 1 s at 80 mm/s, and at
# 120 mm/s 0.8 s for some fibres, 0.5 s for the others. An empty cell is silence where its rate is
# 0, and a gap where it is NaN: the fibre was not recorded there.

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot
from scipy.io import loadmat, savemat

from afferents.neuro import described_natural, rate_slopes
from afferents.spikes import Spikes

rng = np.random.default_rng(0)
types, powers = ["SA", "RA", "PC", "SA", "RA", "PC"], {"SA": 0.3, "RA": 0.5, "PC": 0.5}
spikes, rates = np.empty((1, 3), object), np.empty((1, 3), object)
for v, speed_mm_s in enumerate((40, 80, 120)):
    spikes[0, v], rates[0, v] = np.empty((8, 6, 3), object), np.full((8, 6, 3), np.nan)
    for at in np.ndindex(8, 6, 3):  # texture, fibre, repetition
        lasting_s = (2.0, 1.0, 0.8 if at[1] < 3 else 0.5)[v]
        mean_hz = (8 + 4 * at[0]) * (speed_mm_s / 40) ** powers[types[at[1]]]
        times = np.cumsum(0.002 + rng.exponential(1 / mean_hz - 0.002, (300, 1)))
        times = times[times < lasting_s][:, None]
        if rng.random() < 0.2:
            times = np.empty((1, 0))  # a gap
        else:
            rates[0, v][at] = len(times) / lasting_s
        spikes[0, v][at] = times
made = {"spikes": spikes, "rates": rates}
for name, values in ("neuron_types", types), ("neuron_id", [f"fibre {n}" for n in range(1, 7)]):
    made[name] = np.array(values, object)[:, None]
savemat("made.mat", made)

# %%
# From cells to Spikes
# --------------------
# ``from_trains`` takes the times of each fibre for each trial, and None for a gap. Durations are
# given for each train. SciPy reads files up to version 7; what MATLAB saved with ``-v7.3`` is
# HDF5, which ``h5py`` reads.


def read_fibres(path: Path) -> Spikes:
    """Read a file of this layout."""
    file = loadmat(path)
    trains, durations_s, trials = [], [], []
    for cells, rates, speed_mm_s in zip(
        file["spikes"].ravel(), file["rates"].ravel(), (40, 80, 120), strict=True
    ):
        n_spikes = np.vectorize(np.size)(cells)
        with np.errstate(invalid="ignore"):  # 0 / 0 is NaN, which fmax leaves out
            lasting_s = np.fmax.reduce((n_spikes / rates).round(6), axis=(0, 2))  # by fibre
        recorded = ~np.isnan(rates * lasting_s[:, None])
        for texture, repetition in np.ndindex(cells.shape[0], cells.shape[2]):
            there = recorded[texture, :, repetition]
            if there.any():
                pairs = zip(cells[texture, :, repetition], there, strict=True)
                trains.append([times if is_there else None for times, is_there in pairs])
                durations_s.append(lasting_s)
                trials.append((str(texture + 1), speed_mm_s, repetition))
    units = {
        "name": [one.item() for one in file["neuron_id"].ravel()],
        "class": [one.item() for one in file["neuron_types"].ravel()],
    }
    table = pd.DataFrame(trials, columns=["texture", "speed_mm_s", "repetition"])
    return Spikes.from_trains(trains, units, table, path, durations_s)


natural = read_fibres(Path("made.mat"))
print(*described_natural(natural), sep="\n")
print("durations:", np.unique(natural.durations_s[natural.recorded]), "s")

# %%
# Durations matter
# ----------------
# With 0.8 s in place of 0.5 s, rates come out 37.5% too low, and a fibre seems to fire hardly
# faster on a faster surface. ``from_trains`` warns where no train of a fibre reaches the last third
# of its trial. Here are the slopes of ln rate over ln speed, which were made 0.3 for SA and 0.5 for
# RA and PC:

longest_s = np.nanmax(natural.durations_s, axis=1, keepdims=True)
wrong = replace(natural, durations_s=np.where(natural.recorded, longest_s, np.nan))
slopes = {
    name: rate_slopes(one).groupby("class", sort=False)["slope"].mean()
    for name, one in {"each train's duration": natural, "the longest for all": wrong}.items()
}
print(pd.DataFrame(slopes).round(2))

# %%

speeds = np.unique(natural.trials["speed_mm_s"])
for name, one in {"its own duration": natural, "the longest for all": wrong}.items():
    of_fibre = pd.Series(one.rates()[:, 4]).groupby(natural.trials["speed_mm_s"]).mean()
    pyplot.plot(speeds, of_fibre, "o-", label=name)
pyplot.gca().set(xlabel="speed (mm/s)", ylabel="spikes/s", title="fibre 5 (RA)", ylim=(0, None))
pyplot.legend()
pyplot.show()

# %%
# As a table
# ----------
# The same as a table with a row for each spike;
# ``afferents neural STORE --out OUT --natural fibres.csv`` then compares fibres and artificial
# units. :doc:`/neuroscience` says what is read from both.

natural.to_table().to_csv("fibres.csv", index=False)
print(pd.read_csv("fibres.csv").head(3).to_string(index=False))
