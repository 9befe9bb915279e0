"""
Explain a decision
==================

Which part of the skin does a model decide by? ``explain`` finds out by taking parts away. It covers
one place after another and looks how much worse the answers become.
"""

from pathlib import Path

from matplotlib import pyplot

import afferents

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# A model to explain
# ------------------
# It decides by the waves in SA-I images: which patterns are pressed into the skin, and how
# strongly.

afferents.train("small.zarr", "waves", model="sa-wave-vector", force=True, quiet=True)

# %%
# What it would miss
# ------------------
# The loss is measured in *nats*, the natural logarithm of how much less likely the right
# answer becomes: with a loss of 1 nat it is given about a third of its probability.

found = afferents.explain("waves", "small.zarr", "why", quiet=True)
print(*found.sentences, sep="\n")

# %%
# Each square of a picture is one part that was taken away. The brighter it is, the more was
# lost.


def show(picture):
    drawn = pyplot.imread(picture)
    height, width = drawn.shape[:2]
    figure = pyplot.figure(figsize=(9, 9 * height / width))
    figure.add_axes((0, 0, 1, 1)).axis("off")
    figure.axes[0].imshow(drawn)
    pyplot.show()


show("why/markers.png")

# %%
# Places on the skin, above, and waves, below: their number per millimetre along and across
# the direction of sliding.

show("why/waves.png")
