"""
Your own classifier in ten lines
================================

A *model* has three parts. The channel is a response over time, the encoding divides it into
samples, and the classifier learns their textures. Any part can be your own. Here it is the
classifier: a nearest-neighbour rule of scikit-learn, on single images of RA-I.
"""

from pathlib import Path

from matplotlib import pyplot
from sklearn.neighbors import KNeighborsClassifier

import afferents
from afferents import plot

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# The ten lines
# -------------
# Whatever has ``fit`` and ``predict_proba`` will do.

neighbours = afferents.Model(
    "neighbours",
    "15 nearest neighbours",
    channel="ra1",
    encoding="spatial",
    classifier=KNeighborsClassifier(15),
)
results = afferents.evaluate(
    "small.zarr", out="own", models=[neighbours, "sa-wave-vector"], quiet=True
)
print(results.accuracy)

# %%
# Your model is compared with one of ours under the same rules: the same speeds were left out,
# and what scales the samples was computed from training data alone.

plot.confusion(results, model="neighbours")
pyplot.show()

# %%
# To use your model from the command line, put it into a file: see :doc:`/own-models`.
