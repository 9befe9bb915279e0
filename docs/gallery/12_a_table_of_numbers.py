"""
Another sensor: a table of numbers
==================================

No camera is needed for models of vibration. Any sensor that slides will do: an accelerometer, a
force cell, an electronic skin. Its recordings are tables with one row for each moment. This example
makes up such recordings, describes them in a few lines, and learns from them.
"""

# %%
# The recordings
# --------------
# Two channels of an accelerometer, 2000 rows a second, on three cloths at four speeds, twice each.
# A thread every 0.8 mm shakes the sensor 50 times a second when it slides at 40 mm/s, and how the
# cloth is woven says how strong the multiples of that are.

from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import pyplot

import afferents
from afferents import plot

rng = np.random.default_rng(0)
time_s = np.arange(0, 8, 1 / 2000)
folder = Path("cloths")
cloths = {"linen": (0.8, [1, 0.5, 0.1]), "denim": (1.1, [0.4, 1, 0.7]), "cord": (2.3, [1, 0, 0.8])}
for cloth, (thread_mm, strengths) in cloths.items():
    (folder / cloth).mkdir(parents=True, exist_ok=True)
    for speed_mm_s in (20, 30, 40, 60):
        for trial in (1, 2):
            wave = 2 * np.pi * speed_mm_s / thread_mm * time_s + rng.uniform(0, 2 * np.pi)
            x = sum(strength * np.sin(k * wave) for k, strength in enumerate(strengths, 1))
            noise = rng.normal(0, 1, (2, len(time_s)))
            table = pd.DataFrame({"time_s": time_s, "x": x + noise[0], "y": 0.4 * x + noise[1]})
            file = folder / cloth / f"{speed_mm_s}mmps_{trial}.csv"
            table.to_csv(file, index=False, float_format="%.4f")

# %%
# What they are
# -------------
# File names give texture and speed. ``simulated`` makes every report say that nothing was
# measured; leave it out for recordings of your own. ``afferents init FOLDER`` drafts such a file.

(folder / "dataset.toml").write_text("""
title = "Made-up cloths"
simulated = true

[files]
pattern = "{texture}/{speed}mmps_{trial}.csv"

[signal]
time = "time_s"
channels = ["x", "y"]
steady_s = "all"
""")

# %%
# Train at three speeds, test at the fourth
# -----------------------------------------
# On a logarithmic axis of frequency another speed shifts a spectrum, and keeps its shape.
# ``order-te`` searches for the shift, ``order-te-speed-known`` is told the speed, and ``ridge-te``
# takes spectra as they are.

results = afferents.evaluate(
    folder / "dataset.toml",
    out="cloths-held-out",
    models=["ridge-te", "order-te", "order-te-speed-known"],
    quiet=True,
)
table = results.accuracy.pivot_table(
    index="model", columns="held_out_speed_mm_s", values="accuracy"
)
print(table.rename(columns={np.nan: "mean"}).round(2))

# %%

plot.accuracy_by_speed(results)
pyplot.show()

# %%
# Plain spectra are of little use at a new speed. Searching for the speed helps, and knowing it
# helps most: if a robot knows how fast it slides, give that to the model.
#
# :doc:`/your-data` lists everything that describes files and signals.
