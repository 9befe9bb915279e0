"""
A network of your own
=====================

A network of PyTorch can be a classifier as well. You write a function that makes the network. The
package trains it, picks its weights without a look at the held-out speed, and tests it.
"""

from pathlib import Path

from torch import nn

import afferents

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# The function
# ------------
# It is given the number of textures and the shape of one sample. A sample of the encoding
# ``markers`` has a number for each marker, or two for a channel with directions. The
# network returns one score a texture, before any softmax.


def make_network(n_textures, sample_shape):
    components, markers = sample_shape
    return nn.Sequential(
        nn.Flatten(),
        nn.Linear(components * markers, 32),
        nn.ReLU(),
        nn.Linear(32, n_textures),
    )


print(make_network(3, (2, 361)))

# %%
# The model
# ---------
# ``ra1_vector`` is the step of each marker from one frame to the next, in x and y. The
# preset ``quick`` trains for a few passes only, to see that everything runs.
# ``sa1_vector`` was tried as well, and did far worse here. To pick a channel by such a figure
# is to tune on the test: with recordings of your own, choose on others than those you report.

perceptron = afferents.Model(
    "perceptron", channel="ra1_vector", encoding="markers", classifier=make_network
)
results = afferents.evaluate(
    "small.zarr",
    out="network",
    models=[perceptron],
    preset="quick",
    workers=1,
    quiet=True,
)
print(results.accuracy)

# %%
# Guessing would classify a third of the samples correctly. How the network is trained can be
# changed: ``recipe={"max_epochs": 20}`` is an option of ``evaluate``. A network whose function
# stands in a file can also be trained for good, exported, and run live
# (:doc:`/own-models`).
