"""
Track your first clip
=====================

An optical fingertip has markers on the inside of its skin, and a camera that watches them. When the
skin is touched, the markers move. This example goes from a clip of that camera to the positions of
all markers.
"""

# %%
# The clip
# --------
# Any video that begins with the skin at rest will do. Put the path of yours in place of this
# one, which was simulated.

import afferents

responses = afferents.example(quiet=True)
clip = responses.video

# %%
# What does your sensor look like?
# --------------------------------
# ``calibrate`` finds the markers in the first frames. It learns how large and how bright
# they are and which layout they form, and writes that into a *sensor file*. You do this
# once for a sensor.

sensor = afferents.calibrate(clip, "mine.toml", force=True)
print(sensor.n_markers, "markers")

# %%
# Follow the markers
# ------------------
# ``track`` follows each marker through the clip. The result has labelled dimensions:
# ``position`` is in pixels of the camera, with x to the right and y down.

tracks = afferents.track(clip, "mine.toml")
print(tracks)

# %%
# A lost marker is never guessed. Its position is NaN, and ``detected`` is False there.

print(f"{float(tracks.detected.mean()):.1%} of all positions were found")

# %%
# The markers on a frame
# ----------------------
# Look at this picture before you trust anything else: every marker should have its circle.

from matplotlib import pyplot

from afferents import plot

frame = next(frame for frame in afferents.open_video(clip).frames() if frame.time_s > 3)
plot.markers(tracks, frame)
pyplot.show()

# %%
# From positions to touch
# -----------------------
# SA-I afferents of human skin respond while the skin is deformed. The artificial SA-I
# response of a marker is its distance from where it was at rest, in pixels.

slow = afferents.sa1(tracks.position, tracks.rest_position)
plot.responses(slow)
pyplot.show()

# %%
# The fingertip is touched after 0.7 s. The drum under it turns steadily from 1.5 s on, and
# drags the skin along.
