"""
A hexagonal fingertip
=====================

The paper's fingertip has its markers in rows and columns. Most have not. This example simulates a
fingertip with 127 markers in a hexagon and shows how it becomes a tactile image.
"""

from pathlib import Path

from matplotlib import pyplot

import afferents
from afferents import plot

if not Path("hexagon.zarr").exists():
    afferents.simulate(
        "hexagon",
        sensor="hex127",
        textures="m",
        speeds_mm_s=[40],
        seconds=3,
        quiet=True,
    )
    afferents.extract("hexagon", "hexagon.zarr", sensor="hex127", quiet=True)

(responses,) = afferents.open_responses("hexagon.zarr")
print(dict(responses.sizes))

# %%
# What the camera sees
# --------------------

recording = afferents.read_session("hexagon").recordings[0]
frame = next(frame for frame in recording.video.frames() if frame.time_s > 2)
plot.markers(responses, frame)
pyplot.show()

# %%
# What each marker shows
# ----------------------
# SA-I needs no rows and columns: it is a number for each marker, wherever it stands.

slow = responses.sa1.sel(time=2, method="nearest")
at = responses.rest_position
figure, ax = pyplot.subplots(figsize=(4.6, 3.8), layout="constrained")
drawn = ax.scatter(at.sel(space="x"), at.sel(space="y"), c=slow, cmap="cividis")
ax.set(xlabel="x (px)", ylabel="y (px)", aspect="equal")
ax.invert_yaxis()
figure.colorbar(drawn, label="SA-I (px)")
pyplot.show()

# %%
# The tactile image
# -----------------
# Networks for images need rows and columns. So a grid of pixels is laid over the hexagon. A
# pixel shows what its three nearest markers show, in proportion to how near they are.
# Pixels outside the hexagon are left blank; networks are given 0 there.

plot.tactile_image(responses.sa1, time_s=2)
pyplot.show()

# %%
# From here on everything is as with a square fingertip. :doc:`/tracking` says why the pixels
# are made in this way, and what that costs.
