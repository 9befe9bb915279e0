"""The rig as a running sensor: runs one after another on one clock, and nothing left behind."""

import itertools
import threading

import numpy as np

from afferents.lab.live import Begin, CameraFrame, RigShow, RigSound, RigVideo, Sound

RUN_S = 2.0


def test_runs_follow_one_another():
    show = RigShow("g", 50, seed=3, run_s=RUN_S)
    try:
        events = list(itertools.islice(RigVideo(show).events(), 220))
        begins = [e for e in events if isinstance(e, Begin)]
        assert [b.truth for b in begins] == ["3 mm at 50 mm/s"] * 2
        pictures = [e for e in events if isinstance(e, CameraFrame)]
        first = [p for p in pictures if p.time_s < begins[1].time_s]
        assert len(first) == 180
        assert begins[1].time_s >= RUN_S
        steps = np.diff([p.time_s for p in first])
        np.testing.assert_allclose(steps, 1 / 90, atol=0.007)
        # Frames come when they are due, but for some that a busy processor was late for.
        late = np.array([p.arrived_s - p.time_s for p in first])
        assert np.median(late) - late.min() < 0.05
        sound = list(itertools.islice(RigSound(show).events(), 150))
        assert sum(len(e.samples) for e in sound if isinstance(e, Sound)) == 149 * 441
        folder = show.folder
        assert folder.is_dir()
    finally:
        show.close()
    assert not folder.exists()


def test_who_waits_for_a_run_is_let_go_when_all_is_closed():
    """A run that is never recorded comes no more."""
    show = RigShow("g", 50, run_s=60)
    waiting = threading.Thread(target=lambda: list(RigVideo(show).events()), daemon=True)
    waiting.start()
    while not show._runs:
        waiting.join(0.01)
    show.close()
    waiting.join(60)
    assert not waiting.is_alive()
