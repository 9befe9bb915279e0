"""
A replay, live
==============

A trained model can classify while the fingertip slides: frame by frame, from a running camera.
Without a camera, a recording can be played as if it happened now. What is computed is the same.
"""

from pathlib import Path

from matplotlib import pyplot

import afferents
from afferents.lab.live import Pace, ReplayedVideo, stream

if not Path("small.zarr").exists():
    afferents.simulate("small", textures="agm", speeds_mm_s=[20, 40, 60], seconds=3, quiet=True)
    afferents.extract("small", "small.zarr", quiet=True)

# %%
# One file to use
# ---------------
# ``export`` writes a trained model into one ONNX file, with all that is needed to use it.

afferents.train("small.zarr", "replayed", model="sa-wave-vector", force=True, quiet=True)
touch = afferents.export("replayed", "touch.onnx", force=True)

# %%
# Play a recording
# ----------------
# The drum has bumps 3 mm apart and turns at 40 mm/s, a speed that the model was not trained on.
# The pace is infinite here, which means as fast as possible; ``Pace(1)`` plays at true
# speed. For your sensor, take ``afferents.lab.live.Camera("0")`` instead.

video = afferents.open_video("small/3/40/video.mp4")
predictions = list(stream([ReplayedVideo(video, Pace(float("inf")))], touch))
one = predictions[200]
print(len(predictions), "predictions; one of them:")
print(one.texture, {name: round(p, 3) for name, p in one.evidence.items()})

# %%
# Evidence over time
# ------------------
# A prediction is what a model says at one moment. Its evidence adds up what came before,
# and fades within seconds.

figure, ax = pyplot.subplots(figsize=(8, 3.2), layout="constrained")
sure = [each for each in predictions if each.evidence]
for texture in sure[-1].evidence:
    ax.plot(
        [each.time_s for each in sure],
        [each.evidence[texture] for each in sure],
        label=f"{texture} mm",
    )
ax.set(xlabel="time (s)", ylabel="evidence", ylim=(-0.02, 1.02))
ax.legend(title="bumps apart (0: smooth)")
pyplot.show()

# %%
# The drum is brought on during the first 1.5 s. Until then there is no steady sliding, on which
# alone the model was trained.
#
# The same from a shell, as bars in the terminal or as a page in the browser::
#
#     afferents live --model touch.onnx --video replay:small/3/40
