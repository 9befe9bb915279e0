"""A page of noise, served: `python served.py FILES PLACES`, with at most FILES open at a time.

The stream counts to 50 a second; its predictions carry the count as their time.
"""

import resource
import sys
import time
from types import SimpleNamespace

import numpy as np

from afferents.lab.live.prediction import Prediction
from afferents.lab.live.web import application
from afferents.lab.live.web.server import serve

RATE_HZ = 50


def main(files, places):
    application.ANSWERED_S = 2.0
    if places:
        application.count_places = lambda: places
    resource.setrlimit(resource.RLIMIT_NOFILE, (files, files))
    image = np.random.default_rng(0).integers(0, 255, (480, 640), dtype=np.uint8)
    sight = SimpleNamespace(counters=SimpleNamespace(frames=0), newest=None, picture=None)
    sight.rate_hz = RATE_HZ
    sight.follower = SimpleNamespace(describe=str, sensor=None)
    sight.quality = SimpleNamespace(figures=list, numbers={})
    pipeline = SimpleNamespace(reporters=[], video=sight, audio=None, trains=list, lessons=None)

    def predictions():
        while True:
            time.sleep(1 / RATE_HZ)
            sight.counters.frames += 1
            sight.picture = SimpleNamespace(frame=SimpleNamespace(image=image))
            yield Prediction("counting", "texture", float(sight.counters.frames))

    try:
        serve(predictions(), pipeline, "127.0.0.1", 0, None)
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
