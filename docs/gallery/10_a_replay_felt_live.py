"""
A replay felt live
==================

A trained model can feel as the fingertip slides: frame by frame, from a running camera. Without a
camera, a recording can be played as if it happened now. What is computed is the same.
"""

from pathlib import Path

from matplotlib import pyplot

import afferents
from afferents.live import Pace, ReplayedVideo, stream

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# One file to feel with
# ---------------------
# ``export`` writes a trained model into one ONNX file, with all that is needed to use it.

afferents.train("small.zarr", "felt", model="sa-wave-vector", force=True, quiet=True)
touch = afferents.export("felt", "touch.onnx", force=True)

# %%
# Play a recording
# ----------------
# The drum has bumps 3 mm apart and turns at 40 mm/s: the speed at which nothing was learnt.
# The pace is infinite here, which means as fast as possible; ``Pace(1)`` plays at true
# speed. For your sensor, take ``afferents.live.Camera("0")`` instead.

video = afferents.open_video("small/3/40/video.mp4")
percepts = list(stream([ReplayedVideo(video, Pace(float("inf")))], touch))
print(len(percepts), "percepts; one of them:")
print(percepts[200].texture, {name: round(p, 3) for name, p in percepts[200].evidence.items()})

# %%
# What was felt, over time
# ------------------------
# A *percept* is what a model says at one moment. Its evidence adds up what it has felt so
# far, and fades within seconds.

figure, ax = pyplot.subplots(figsize=(8, 3.2), layout="constrained")
felt = [percept for percept in percepts if percept.evidence]
for texture in felt[-1].evidence:
    ax.plot(
        [percept.time_s for percept in felt],
        [percept.evidence[texture] for percept in felt],
        label=f"{texture} mm",
    )
ax.set(xlabel="time (s)", ylabel="evidence", ylim=(-0.02, 1.02))
ax.legend(title="bumps apart")
pyplot.show()

# %%
# The drum is brought on during the first 1.5 s. Until then there is no steady sliding, and
# nothing that the model has learnt from.
#
# The same from a shell, as bars in the terminal or as a page in the browser::
#
#     afferents live --model touch.onnx --video replay:small/3/40
