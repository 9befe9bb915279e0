"""
Why stretching spectra works
============================

A texture that slides past at twice the speed makes the same vibration twice as fast. So its
spectrum is stretched: what was at 10 Hz comes to lie at 20 Hz. A network that learns from stretched
copies of its recordings has seen speeds that nobody recorded. The paper calls this augmentation
(section 2.4.3). This example shows that the rule holds, and where it ends.
"""

# %%
# One drum at three speeds
# ------------------------
# The drum has bumps 4 mm apart along the diagonal (the paper's texture i).

from pathlib import Path

from matplotlib import pyplot

import afferents
from afferents.rig import Drum

if not Path("one-drum.zarr").exists():
    afferents.simulate("one-drum", textures="i", speeds_mm_s=[20, 40, 80], seconds=5, quiet=True)
    afferents.extract("one-drum", "one-drum.zarr", quiet=True)

spectra = afferents.samples("one-drum.zarr", "ra2", "spectral", quiet=True)
spectra = spectra.isel(channel=0)
print(dict(spectra.sizes))

# %%
# Over frequency, over waves per millimetre
# -----------------------------------------
# On the left, each speed has its lines somewhere else. On the right, the frequency is
# divided by the speed, which gives cycles per millimetre. Now the lines fall on one another, at
# multiples of the drum's own rate (dotted): they belong to the texture.

figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 3.5), layout="constrained")
for speed, of_speed in spectra.groupby("speed_mm_s"):
    mean = of_speed.mean("sample").sel(frequency=slice(2, 150))
    left.semilogy(mean.frequency, mean, label=f"{speed:g} mm/s")
    right.semilogy(mean.frequency / speed, mean)
left.set(xlabel="frequency (Hz)", ylabel="amplitude")
for multiple in range(1, 9):
    right.axvline(multiple * Drum().rate_hz(4, 1), color="black", linestyle=":", linewidth=0.8)
right.set(xlabel="cycles per mm", xlim=(0, 1.5))
left.legend()
pyplot.show()

# %%
# Stretch one to look like another
# --------------------------------
# ``stretch_spectrum`` makes of the spectrum at 40 mm/s what the rule expects at 80 mm/s.

mean = {
    speed: of_speed.mean("sample").values.astype("float32")
    for speed, of_speed in spectra.groupby("speed_mm_s")
}
stretched = afferents.stretch_spectrum(mean[40.0], factor=2.0)

figure, ax = pyplot.subplots(figsize=(8, 3.5), layout="constrained")
shown = slice(2, 150)
ax.semilogy(spectra.frequency[shown], mean[80.0][shown], label="recorded at 80 mm/s")
ax.semilogy(spectra.frequency[shown], stretched[shown], label="at 40 mm/s, stretched by 2")
ax.set(xlabel="frequency (Hz)", ylabel="amplitude")
ax.legend()
pyplot.show()

# %%
# The lines lie in the same places. Their heights do not agree everywhere. Skin and
# microphone pass some frequencies better than others, and the motor has lines of its own:
# these stay where they are when the speed changes. So a stretched copy is a good guess, and
# no recording.
