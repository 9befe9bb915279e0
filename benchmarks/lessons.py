"""Four drums of the rig taught at one speed, asked at three others, and two that nobody taught.

    python benchmarks/lessons.py [SEEDS]

For each seed another fingertip, six drums of the thirteen, and a clip of each run. The first four
drums are taught as `afferents live --learn` is, in one touch each; then every clip is played.
"""

import json
import math
import sys
import tempfile
from pathlib import Path
from statistics import mean

import numpy as np
from scipy.stats import t as student

from afferents.lab.live import Begin, LivePipeline, Pace, ReplayedVideo, run
from afferents.lab.live.prediction import Prediction
from afferents.markers.sensor import load_sensor
from afferents.recordings.video import open_video
from afferents.rig.config import Rig
from afferents.rig.record import VIDEO, record
from afferents.rig.surface import bumped_surface
from afferents.store.recording import Video

DRUMS = [f"{number / 2:g}" for number in range(13)]
TAUGHT, UNKNOWN = 4, 2
AT_MM_S, ASKED_MM_S = 40.0, (20.0, 60.0, 80.0)
SECONDS = 6.0
"""Of a run, of which the drum turns 5."""


class Fingertip:
    """One fingertip and its drums, each run recorded and played as it is asked for."""

    def __init__(self, seed: int, folder: Path) -> None:
        self.seed, self.rig = seed, Rig().printed(seed)
        self.clip = folder / "run"
        source = ReplayedVideo(self.record("0", AT_MM_S), Pace(math.inf))
        self.pipeline = LivePipeline.without_models([source], load_sensor("tip_b"))
        self.pipeline.learn(folder / "lessons", simulated=True)

    def record(self, drum: str, speed_mm_s: float) -> Video:
        """Record a run."""
        surface = bumped_surface(float(drum), self.rig.drum)
        record(self.rig, self.clip, drum, surface, speed_mm_s, SECONDS, self.seed)
        return open_video(self.clip / VIDEO)

    def play(self, drum: str, speed_mm_s: float, name: str | None = None) -> list[Prediction]:
        """Play a run, which teaches it by a name; return what is predicted while touched."""
        source = ReplayedVideo(self.record(drum, speed_mm_s), Pace(math.inf))
        assert self.pipeline.video is not None
        assert self.pipeline.lessons is not None
        self.pipeline.video.begin(Begin("video", 0.0))
        if name is not None:
            self.pipeline.lessons.start(name, speed_mm_s)
        predictions = list(run([source], self.pipeline))
        return [one for one in predictions if one.state in ("texture", "unknown")]


def verdict(touch: list[Prediction]) -> str | None:
    """Return what is said at the end of a touch; None where most of it was unknown."""
    if np.mean([one.state == "unknown" for one in touch]) > 0.5:
        return None
    return max(touch[-1].evidence, key=touch[-1].evidence.__getitem__)


def shares(seed: int) -> dict[str, float]:
    """Teach and ask with one fingertip; return how often what was right."""
    drums = np.random.default_rng(seed).permutation(DRUMS).tolist()
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        fingertip = Fingertip(seed, Path(folder))
        for drum in drums[:TAUGHT]:
            fingertip.play(drum, AT_MM_S, name=drum)
        for drum in drums[: TAUGHT + UNKNOWN]:
            for speed_mm_s in ASKED_MM_S:
                touch = fingertip.play(drum, speed_mm_s)
                right = None if drum in drums[TAUGHT:] else drum
                kind = "never taught" if right is None else "taught"
                at = {f"{kind}, frames": mean([one.texture == right for one in touch])}
                at[f"{kind}, touches"] = float(verdict(touch) == right)
                if right is not None:
                    named = [one.texture == right for one in touch if one.texture]
                    at["taught and named, frames"] = mean(named) if named else math.nan
                    at[f"taught, touches at {speed_mm_s:g} mm/s"] = at["taught, touches"]
                for what, share in at.items():
                    found.setdefault(what, []).append(float(share))
    return {what: float(np.nanmean(its)) for what, its in found.items()}


def main() -> None:
    """Print the mean over seeds with its 95% interval; chance is one answer of five."""
    n = int(sys.argv[1]) if sys.argv[1:] else 5
    by_seed = []
    for seed in range(n):
        by_seed.append(shares(seed))
        print(json.dumps({"seed": seed, **by_seed[-1]}), flush=True)
    for what in by_seed[0]:
        its = np.array([one[what] for one in by_seed])
        half = student.ppf(0.975, n - 1) * its.std(ddof=1) / math.sqrt(n)
        low, high = max(0, its.mean() - half), min(1, its.mean() + half)
        chance = 1 / TAUGHT if "named" in what else 1 / (TAUGHT + 1)
        print(f"{what}: {its.mean():.0%} [{low:.0%}, {high:.0%}], chance {chance:.0%}")


if __name__ == "__main__":
    main()
