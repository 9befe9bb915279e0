"""Dark, frozen and repeated pictures, put into videos and found again."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from afferents.quality.repeats import describe_repeats
from afferents.recordings.video import Footage, open_video
from afferents.store.recording import Frame

from ..films import write_film

FPS, N_FRAMES, SIZE = 90, 400, (160, 120)
CODECS = {
    "mjpeg": ("v.avi", "mjpeg", "yuvj420p", {}),
    "crf 18": ("v.mp4", "libx264", "yuv420p", {"crf": "18"}),
    "crf 35": ("v.mp4", "libx264", "yuv420p", {"crf": "35"}),
    # As the authors' kind of writer has it: every 12th frame anew.
    "mp4v": ("v.mp4", "mpeg4", "yuv420p", {"qscale": "5", "g": "12"}),
}


@pytest.fixture(scope="module")
def images():
    """A skin of blobs that slides at an uneven speed, and a camera's noise."""
    rng = np.random.default_rng(0)
    width, height = SIZE
    skin = cv2.resize(rng.random((20, 90), dtype=np.float32), (720, 160))
    step_px = 0.6 + 0.3 * np.sin(np.cumsum(rng.uniform(0, 1, N_FRAMES)))
    centre_px = 100 + np.cumsum(step_px)
    return [
        np.clip(
            40 + 120 * cv2.getRectSubPix(skin, SIZE, (x, 80.0)) + rng.normal(0, 2, (height, width)),
            0,
            255,
        ).astype(np.uint8)
        for x in centre_px
    ]


def decoded(video):
    footage = Footage(video)
    assert all(frame is not None for frame in footage.frames())
    return footage


def encoded(folder, images, codec="mjpeg"):
    """Encode images; return the footage, decoded."""
    name, codec, pixels, options = CODECS[codec]
    return decoded(open_video(write_film(folder / name, images, codec, pixels, FPS, None, options)))


class Drawn:
    """A video of frames at given times, without what a codec adds."""

    path, fps_hz, width, height = Path("v.mp4"), 90.0, *SIZE

    def __init__(self, images, time_s=None):
        time_s = np.arange(len(images)) / FPS if time_s is None else time_s
        self._frames = [Frame(t, i) for t, i in zip(time_s, images, strict=True)]

    def frames(self):
        return iter(self._frames)


@pytest.fixture(params=["mjpeg", "crf 18", "crf 35"])
def film(request, tmp_path):
    """Encode images in one of several ways; return the footage, decoded."""
    return lambda images: encoded(tmp_path, images, request.param)


def test_a_moving_skin_is_sound(film, images):
    footage = film(images)
    assert footage.find_issues() == []
    assert footage.figures.stalls.spans == ()
    # A short break is refused by none, at most named.
    broken = film(images[:150] + [images[150]] * 40 + images[190:])
    assert {issue.kind for issue in broken.find_issues()} <= {"stalled"}


CHANGES = {
    "from the middle on": (lambda i: i[:130] + [i[130]] * 270, "frozen", 130 / FPS),
    "from the start": (lambda i: i[:20] + [i[20]] * 380, "frozen", 20 / FPS),
    "always": (lambda i: [i[0]] * 400, "frozen", None),
    "twice": (lambda i: [x for x in i[::2] for _ in range(2)], "repeated", 1.11),
    "four times": (lambda i: [x for x in i[::4] for _ in range(4)], "repeated", 1.11),
    "dark": (lambda i: i[:150] + [x // 12 for x in i[150:]], "dark", 1.67),
}


@pytest.mark.parametrize("change", CHANGES)
def test_each_fault_is_found_as_what_it_is_and_where_it_begins(film, images, change):
    """And as nothing else: darkness is not taken for a frozen picture."""
    make, kind, begins_s = CHANGES[change]
    (doubt,) = film(make(images)).find_issues()
    assert doubt.kind == kind
    if begins_s is not None:
        began = float(doubt.found.split("from ")[1].split(" s")[0])
        assert began == pytest.approx(begins_s, abs=0.15 if kind == "frozen" else 0.01)
    if kind == "repeated":
        assert doubt.found.startswith("each about ")


def test_a_skin_that_rests_before_it_slides_is_sound(film, images):
    footage = film(images[:40] + [images[40]] * 140 + images[180:])
    assert footage.find_issues((2.1, 4.4)) == []
    assert [doubt.kind for doubt in footage.find_issues((0.5, 4.4))] == ["frozen"]


def test_a_frozen_picture_between_many_key_frames_is_found(tmp_path, images):
    (doubt,) = encoded(tmp_path, stalling(images, [(130, 330)]), "mp4v").find_issues()
    assert doubt.kind == "frozen"
    began = float(doubt.found.split("from ")[1].split(" s")[0])
    assert began == pytest.approx(130 / FPS, abs=0.25)


def test_without_noise_a_smooth_drum_is_not_taken_for_a_frozen_picture(images):
    """Simulated without nuisances: still, then a pull, then still; nothing is a stall either."""
    quiet = [images[0]] * 60 + images[60:90] + [images[90]] * 310
    assert decoded(Drawn(quiet)).find_issues() == []
    assert str(decoded(Drawn([images[0]] * 400)).figures.stalls) == "never"


def test_without_noise_a_picture_that_moved_while_the_drum_slid_is_frozen(images):
    """As a fast encoder leaves it, which takes all noise away."""
    quiet = [images[0]] * 40 + images[40:240] + [images[240]] * 160
    (doubt,) = decoded(Drawn(quiet)).find_issues((0.6, 4.4))
    assert (doubt.kind, doubt.found) == ("frozen", "the same one from 2.67 s to the end")


@pytest.mark.parametrize(
    "time_s",
    [
        *(np.arange(n) / FPS for n in (0, 1, 2, 20)),
        np.cumsum(np.random.default_rng(0).choice([0.0, 1 / 90, 1 / 30], N_FRAMES)),
        np.zeros(N_FRAMES),
    ],
    ids=["none", "one", "two", "twenty", "uneven", "all at once"],
)
def test_few_frames_and_strange_times_do_no_harm_and_decoding_again_measures_anew(images, time_s):
    footage = decoded(Drawn(images[: len(time_s)], time_s))
    assert footage.find_issues() == []
    first = footage.figures.changes
    assert first.shape == (len(time_s), 6)
    list(footage.frames())
    np.testing.assert_array_equal(footage.figures.changes, first)


def test_repeats_without_a_beat_are_found_by_their_share():
    """As real recorders write them: now and then a frame more, or less."""
    rng = np.random.default_rng(0)
    change = np.repeat([1.0, 0.03], 180) + 0.5 * np.repeat([1, 0.02], 180) * rng.random(360)
    change = change[np.argsort(np.arange(360) % 180 + 0.5 * (np.arange(360) >= 180))]
    keep = rng.random(360) > 0.05
    changes = np.cumsum(np.ones((keep.sum(), 6)), axis=1) * change[keep][:, None]
    assert describe_repeats(changes).endswith("of them twice or more often")


def test_a_texture_that_comes_back_every_few_frames_repeats_nothing():
    """A beat of four frames in what changes, but after four frames the picture is the old one."""
    rng = np.random.default_rng(0)
    change = np.tile([2.0, 1.0, 0.9, 1.0], 90) * (1 + 0.05 * rng.random(360))
    changes = np.stack([change, 1.5 * change, 1.2 * change, 0.1 * change, change, change], axis=1)
    assert describe_repeats(changes) == ""


def stalling(images, spans):
    """Return the images of a camera that repeats itself in some frames, (first, last)."""
    found = list(images)
    for first, last in spans:
        found[first : last + 1] = [images[first - 1]] * (last - first + 1)
    return found


def test_stalls_are_found_at_their_frames(tmp_path, images):
    """MJPEG: the same packet again. Of 6 equal frames in a row it is not said."""
    spans = [(100, 119), (150, 155), (200, 206), (300, 339)]
    footage = encoded(tmp_path, stalling(images, spans))
    seen = [
        (round(FPS * begin) + 1, round(FPS * end))
        for begin, end in footage.figures.stalls.spans
        if begin
    ]
    assert seen == [(100, 119), (300, 339)]  # 7 frames are 0.08 s
    assert str(footage.figures.stalls) == "2 times, 0.67 s in all, first from 1.10 s to 1.32 s"
    (issue,) = footage.find_issues()
    assert (issue.kind, issue.is_refused) == ("stalled", False)


def test_many_short_stalls_together_are_a_frozen_picture(tmp_path, images):
    spans = [(first, first + 19) for first in range(110, 290, 30)]
    (doubt,) = encoded(tmp_path, stalling(images, spans)).find_issues()
    assert doubt.kind == "frozen"
    assert doubt.found == "the very same one 6 times, 1.33 s in all, first from 1.21 s to 1.43 s"
