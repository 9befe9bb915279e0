"""How many functions a frame goes through to a prediction, and an evaluation to its first training.

    python benchmarks/calls.py

Offline a frame is decoded, its markers are tracked, their displacement becomes a tactile image, and
a network says the texture. Live a replay goes the same way, frame after frame. Python tells of
every call (`sys.setprofile`). Counted are functions of this package, each once: of a frame those
that are called for every frame of a recording, and those that all its frames go through together,
from marker positions on; what prepares (opening, the rest frame, checks of the clip) is neither. Of
an evaluation all count that are entered before its first model is fitted.
"""

import argparse
import sys
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Collection
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import xarray as xr

import afferents
from afferents.encodings.settings import Encodings
from afferents.evaluation.data import encode, find_sources
from afferents.extraction.track import track as track_clip
from afferents.lab.live import LivePipeline, Network, Pace, ReplayedVideo, run
from afferents.markers.sensor import load_sensor
from afferents.models import fitting
from afferents.models.model import MODELS
from afferents.recordings.video import open_video

PACKAGE = str(Path(afferents.__file__).parent)
MODEL = "sa-se"


def entered(work: Callable[[], object], until: CodeType | None = None) -> Counter[CodeType]:
    """Return how often some work enters functions of the package, in the order of first calls.

    Those of threads that it begins count, too; after `until` is entered no more do.
    """
    found: Counter[CodeType] = Counter()

    def note(frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event != "call" or until in found:
            return
        if code.co_filename.startswith(PACKAGE) and code.co_name[0] != "<":
            found[code] += 1

    threading.setprofile(note)
    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
        threading.setprofile(None)  # type: ignore[arg-type]  # as its documentation allows
    return found


def count(said: str, codes: Collection[CodeType], listed: bool) -> None:
    """Print how many functions and files there are, and which where that is wanted."""
    files = {code.co_filename for code in codes}
    print(f"{said}: {len(codes)} functions in {len(files)} files")
    for code in codes if listed else ():
        print(f"  {Path(code.co_filename).relative_to(PACKAGE)}: {code.co_qualname}")


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
            return track_clip(open_video(video), sensor)

        responses = track().assign_attrs(labels, steady_s="[0.5, 1.9]")

        def recognise() -> object:
            return recogniser.predict(encode(responses, source, "all"))

        recognise()  # imports and compiles
        tracking, n = entered(track), responses.sizes["time"]
        each = [code for code, calls in tracking.items() if calls >= n / 2]
        together = [code for code in entered(recognise) if code not in each]
        exported = Path(folder) / "model.onnx"
        afferents.export(model, exported)

        def follow() -> list[object]:
            clip = ReplayedVideo(open_video(video), Pace(0.5))
            return list(run([clip], LivePipeline.with_models([Network(exported)])))

        follow()
        live = [code for code, calls in entered(follow).items() if calls >= n / 2]
        out = Path(folder) / "results"
        evaluation = entered(
            lambda: afferents.evaluate(
                store, out, models=MODEL, preset="quick", workers=1, quiet=True
            ),
            until=fitting.fit.__code__,
        )
    count("for each frame", each, asked.list)
    count("for all together", together, asked.list)
    count("a frame's way offline", [*each, *together], False)
    count("a frame's way live", live, asked.list)
    count("evaluate, before its first training", evaluation, asked.list)


if __name__ == "__main__":
    main()
