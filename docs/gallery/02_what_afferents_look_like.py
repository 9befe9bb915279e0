"""
What SA-I, RA-I and RA-II look like
===================================

Afferents are the nerve fibres that carry touch to the brain. Three kinds are imitated here. SA-I
respond while the skin is held deformed. RA-I respond while the deformation changes. RA-II respond
to vibration.
"""

from matplotlib import pyplot

import afferents
from afferents import plot
from afferents.rig import Drum

responses = afferents.example(quiet=True)

# %%
# SA-I
# ----
# SA-I is how far each marker stands from its place at rest, in pixels. There is one number
# for each marker and frame, so each frame gives an image: a *tactile image*, with one
# square for a marker.

figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
for ax, time_s in zip(axes, (0.5, 1.0, 3.0), strict=True):
    plot.tactile_image(responses.sa1, time_s=time_s, ax=ax)
pyplot.show()

# %%
# At 0.5 s nothing touches. At 1 s a drum presses on the skin and begins to turn. At 3 s it has
# dragged the skin to one side.
#
# RA-I
# ----
# RA-I is how much SA-I changes from one frame to the next. A skin that is held still gives
# none, however deep it is pressed.

figure, axes = pyplot.subplots(1, 3, figsize=(11, 3.2), layout="constrained")
for ax, time_s in zip(axes, (0.5, 1.0, 3.0), strict=True):
    plot.tactile_image(responses.ra1, time_s=time_s, ax=ax)
pyplot.show()

# %%
# RA-II
# -----
# RA-II comes from a microphone in the gel of the fingertip. It is far quicker than the
# camera: 44,100 numbers a second instead of 90 images.

figure, axes = pyplot.subplots(3, 1, figsize=(8, 7), layout="constrained")
plot.responses(responses.sa1, ax=axes[0])
plot.responses(responses.ra1, ax=axes[1])
plot.responses(responses.ra2, ax=axes[2])
pyplot.show()

# %%
# In the order of the plots: SA-I rises as the drum drags the skin and stays high, RA-I is high
# where something changes, and RA-II hums while the drum turns.
#
# The hum has a pitch. The drum has bumps 4 mm apart, counted along the diagonal of their lattice.
# Along the slide the pattern repeats each sqrt(2) times 4 mm. At 40 mm/s it passes 7.16 times in a
# second, and the vibration has lines at multiples of that (dotted).

rate_hz = Drum().rate_hz(spacing_mm=4, speed_mm_s=40)
ax = plot.spectrum(responses.ra2)
for multiple in range(1, 9):
    ax.axvline(multiple * rate_hz, color="black", linestyle=":", linewidth=0.8)
ax.set(xlim=(0, 100), title=f"multiples of {rate_hz:.2f} Hz")
pyplot.show()
