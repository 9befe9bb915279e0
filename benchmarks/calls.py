"""How many functions a frame goes through from its mp4 to a prediction, and in how many files.

    python benchmarks/calls.py

Offline the frame is decoded, its markers are tracked, their displacement becomes a tactile image,
and a network says the texture. Python tells of every call (`sys.setprofile`). Counted are functions
of this package, each once, in two parts: those that are called for every frame of a recording, and
those that all its frames go through together, from marker positions on. What prepares (opening,
the rest frame, checks of the clip) is neither.
"""

import argparse
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import xarray as xr

import afferents
from afferents.encodings.settings import Encodings
from afferents.evaluation.data import encode, find_sources
from afferents.extraction.track import tracked
from afferents.markers.sensor import load_sensor
from afferents.models.model import MODELS
from afferents.recordings.video import open_video

PACKAGE = str(Path(afferents.__file__).parent)
MODEL = "sa-se"


def entered(work: Callable[[], object]) -> Counter[CodeType]:
    """Return how often some work enters functions of the package, in the order of first calls."""
    found: Counter[CodeType] = Counter()

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(PACKAGE) and code.co_name[0] != "<":
            found[code] += 1

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return found


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--list", action="store_true", help="name the functions")
    asked = parser.parse_args()
    sensor, labels = load_sensor("tip_b"), {"name": "clip", "texture": "0", "speed_mm_s": 50.0}
    (source,) = find_sources(MODELS[MODEL], Encodings())
    with tempfile.TemporaryDirectory() as folder:
        session, store, model = (Path(folder) / name for name in ("session", "store", "model"))
        afferents.simulate(session, textures=["a", "g"], speeds_mm_s=[40, 50, 60], seconds=2.0,
                           workers=1, quiet=True)  # fmt: skip
        afferents.extract(session, store, workers=1, quiet=True)
        afferents.train(store, model, MODEL, preset="quick", quiet=True)
        recogniser = afferents.load_model(model)
        video = next(session.glob("*/50/video.mp4"))

        def track() -> xr.Dataset:
            return tracked(open_video(video), sensor, "windowed")

        responses = track().assign_attrs(labels, steady_s="[0.5, 1.9]")

        def recognise() -> object:
            return recogniser.predict(encode(responses, source, "all"))

        recognise()  # imports and compiles
        tracking, n = entered(track), responses.sizes["time"]
        each = [code for code, calls in tracking.items() if calls >= n / 2]
        together = [code for code in entered(recognise) if code not in each]
    for said, codes in (("for each frame", each), ("for all together", together)):
        print(f"{said}: {len(codes)} functions")
        for code in codes if asked.list else ():
            print(f"  {Path(code.co_filename).relative_to(PACKAGE)}: {code.co_qualname}")
    files = {code.co_filename for code in (*each, *together)}
    print(f"a frame's way offline: {len(each) + len(together)} functions in {len(files)} files")


if __name__ == "__main__":
    main()
