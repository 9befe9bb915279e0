"""
Unknown textures
================

A classifier that knows three textures names one of them, whatever it touches. So it should
also say when it doesn't know. For that every trained model measures *novelty*: how far a
sample lies from all that was learnt, as a multiple of what is usual. Above 1 a touch counts
as unknown.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot

import afferents

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# A model that knows three drums
# ------------------------------
# One is smooth, the others have bumps 3 and 6 mm apart. The model learns at 20 and 60 mm/s. The
# touches at 40 mm/s set how sure its answers may be, and what novelty is usual.

card = afferents.train("small.zarr", "three-drums", model="sa-wave-vector", force=True, quiet=True)
print(*card.describe(), sep="\n")

# %%
# A drum that it has not learnt
# -----------------------------

if not Path("stranger.zarr").exists():
    afferents.simulate("stranger", textures="j", speeds_mm_s=[40], seconds=3, quiet=True)
    afferents.extract("stranger", "stranger.zarr", quiet=True)

model = afferents.load_model("three-drums")
known = afferents.samples("small.zarr", "sa1_vector", "wavenumbers", quiet=True)
known = known[known.speed_mm_s.values == 40]
stranger = afferents.samples("stranger.zarr", "sa1_vector", "wavenumbers", quiet=True)

novelty = {
    "known drums": model.predict(known).novelty.values,
    "the unknown drum": model.predict(stranger).novelty.values,
}
for name, of_it in novelty.items():
    print(f"{name}: {np.mean(of_it > 1):.0%} of samples called unknown")

# %%
figure, ax = pyplot.subplots(figsize=(8, 3.2), layout="constrained")
bins = np.linspace(0, max(of_it.max() for of_it in novelty.values()), 40)
for name, of_it in novelty.items():
    ax.hist(of_it, bins, density=True, alpha=0.6, label=name)
ax.axvline(1, color="black", linestyle="--", label="limit")
ax.set(xlabel="novelty", ylabel="share of samples", yticks=[])
ax.legend()
pyplot.show()

# %%
# By construction about one sample in twenty of the known drums lies above the limit. How
# many of the unknown drum do depends on how much it resembles a known one, and on the
# model: with the model ``ra-wave-vector``, and only three drums learnt, hardly any sample
# of this drum is found. A single drum proves little, either way: try several.
