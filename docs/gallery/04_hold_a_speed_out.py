"""
Hold a speed out
================

How well does a model recognise a texture? That depends on the test. If it is tested on other
moments of the recordings that it was trained on, it can learn the recording instead of the texture.
Here it is tested at a sliding speed that it was not trained on. This is the paper's question, and
the default of ``afferents.evaluate``.
"""

# %%
# A small session
# ---------------
# A *session* is a folder of recordings. This one is simulated: three drums at three speeds,
# three seconds each. ``extract`` turns it into SA-I, RA-I and RA-II, and keeps them in a
# *store*.

from pathlib import Path

from matplotlib import pyplot
from sklearn.linear_model import LogisticRegression
from sklearn.model_selection import KFold, LeaveOneGroupOut, cross_val_score

import afferents
from afferents import plot

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# Two ways to test
# ----------------
# Samples are what a classifier learns from; here single tactile images of SA-I. The same
# classifier is first tested on images drawn at random, then on all images of a speed that
# was left out.

images = afferents.samples("small.zarr", "sa1", "spatial", quiet=True)
values, texture = images.values.reshape(len(images), -1), images.texture.values
classifier = LogisticRegression(max_iter=300)

at_random = cross_val_score(classifier, values, texture, cv=KFold(3, shuffle=True, random_state=0))
by_speed = cross_val_score(
    classifier, values, texture, cv=LeaveOneGroupOut(), groups=images.group.values
)
print(f"images drawn at random: {at_random.mean():.0%} right")
print(f"a speed held out:       {by_speed.mean():.0%} right")

# %%
# Neighbouring frames of a video are nearly the same picture. If a model is trained on one, the
# other is no test. The second number shows how well the fingertip will do at a new speed.
#
# The whole evaluation
# --------------------
# ``evaluate`` does this for any model, with the same rule for everything that is chosen on
# the way: nothing of the held-out speed is seen before the one final test.

results = afferents.evaluate(
    "small.zarr",
    out="held-out",
    models=["sa-wave-vector", "vib-te"],
    preset="quick",
    quiet=True,
)
print(results.accuracy)

# %%
plot.accuracy_by_speed(results)
pyplot.show()

# %%
# A confusion matrix says which texture is taken for which.

plot.confusion(results, model="vib-te")
pyplot.show()

# %%
# The preset ``quick`` trains networks for a few seconds only, to see that everything runs.
# Use ``fast`` or ``paper`` for numbers. ``afferents.report("held-out")`` writes a page with
# all figures.
