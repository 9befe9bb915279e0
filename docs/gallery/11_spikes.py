"""
Spikes
======

A nerve fibre does not give a number for each frame. It gives spikes: short pulses, all alike, at
moments of its own. Here artificial nerve fibres, called *units*, are driven by the
fingertip's responses.
"""

from matplotlib import pyplot

import afferents
from afferents import plot

responses = afferents.example(quiet=True)
spikes = afferents.artificial_spikes([responses], start_s=0.5, stop_s=3.0)
print(spikes.units["class"].value_counts())

# %%
# There is one SA and one RA unit for each marker, and eight PC units. SA units are driven by
# SA-I, RA units by RA-I, and PC units by the microphone, each in a band of frequencies.
#
# At 0.5 s, where this begins, nothing touches: now and then a marker jitters so much that its RA
# unit fires. Then a drum presses on the skin, and turns.

colours = {"SA": "#0072B2", "RA": "#E69F00", "PC": "#D55E00"}
shown = [*range(0, 361, 24), *range(361, 722, 24), *range(722, 730)]
classes = spikes.units["class"].iloc[shown]
figure, ax = pyplot.subplots(figsize=(8, 4.5), layout="constrained")
ax.eventplot(
    [0.5 + spikes.train(0, unit) for unit in shown],
    colors=[colours[name] for name in classes],
    linewidths=0.6,
)
for name, colour in colours.items():
    ax.plot([], [], color=colour, label=name)
ax.set(xlabel="time (s)", ylabel="unit")
ax.legend(loc="upper left")
pyplot.show()

# %%
# SA units fire the more, the farther the drum drags the skin. RA units fire little when it
# touches, and much once it turns, since then most changes. PC units fire with the vibration. Here
# is one of them, with the sound:

unit = spikes.units.index.get_loc("PC-5")
train = 0.5 + spikes.train(0, unit)
print(f"{len(train)} spikes; the bands of all units are in spikes/pc.toml")

figure, axes = pyplot.subplots(2, 1, figsize=(8, 4.5), sharex=True, layout="constrained")
plot.responses(responses.ra2, ax=axes[0])
axes[1].eventplot(train, colors=colours["PC"], linewidths=0.6)
axes[1].set(xlim=(2.0, 3.0), xlabel="time (s)", yticks=[], title="PC-5, 40 to 160 Hz")
pyplot.show()

# %%
# How often each class fires, in spikes a second:

rates = spikes.units.assign(rate=spikes.rates()[0]).groupby("class", sort=False)["rate"]
print(rates.describe()[["mean", "min", "max"]].round(1))

# %%
# With a session of several textures and speeds, ``afferents neural`` answers what physiologists
# ask about nerve fibres: at which resolution texture can be read, and whether trains of spikes
# stretch with the speed. :doc:`/neuroscience` shows what comes out.
