"""Dark, frozen and repeated pictures, put into videos and found again."""

from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from afferents.quality.frames import describe_repeats
from afferents.recordings.footage import Footage
from afferents.recordings.video import open_video
from afferents.store.recording import Frame

FPS, N_FRAMES, SIZE = 90, 400, (160, 120)
CODECS = {
    "mjpeg": ("avi", "mjpeg", "yuvj420p", {}),
    "crf 18": ("mp4", "libx264", "yuv420p", {"crf": "18"}),
    "crf 35": ("mp4", "libx264", "yuv420p", {"crf": "35"}),
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


@pytest.fixture(params=list(CODECS))
def film(request, tmp_path):
    """Encode images; return the footage, decoded."""
    suffix, codec, pixels, options = CODECS[request.param]

    def encode(images):
        return encoded(tmp_path / f"v.{suffix}", codec, images, options, pixels)

    return encode


def encoded(path, codec, images, options=None, pixels=None):
    """Encode images; return the footage, decoded."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=FPS, options=options or {})
        stream.width, stream.height = SIZE
        stream.pix_fmt = pixels or ("yuvj420p" if codec == "mjpeg" else "yuv420p")
        for image in images:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(image, "gray")))
        container.mux(stream.encode())
    footage = Footage(open_video(path))
    assert sum(1 for _ in footage.frames()) == len(images)
    return footage


def test_a_moving_skin_is_sound(film, images):
    assert film(images).find_issues() == []


def test_a_frozen_picture_is_found_with_its_beginning(film, images):
    (doubt,) = film(images[:130] + [images[130]] * 270).find_issues()
    assert doubt.kind == "frozen"
    began = float(doubt.found.split("from ")[1].split(" s")[0])
    assert began == pytest.approx(130 / FPS, abs=0.15)
    assert doubt.found.endswith("to the end")


def test_a_picture_that_is_frozen_from_the_start_is_found(film, images):
    (doubt,) = film(images[:20] + [images[20]] * 380).find_issues()
    assert doubt.kind == "frozen"
    assert "from 0.2" in doubt.found


def test_a_skin_that_rests_before_it_slides_is_sound(film, images):
    footage = film(images[:40] + [images[40]] * 140 + images[180:])
    assert footage.find_issues((2.1, 4.4)) == []
    assert [doubt.kind for doubt in footage.find_issues((0.5, 4.4))] == ["frozen"]


@pytest.mark.parametrize("times", [2, 4])
def test_frames_that_come_several_times_are_found(film, images, times):
    repeated = [image for image in images[::times] for _ in range(times)][: len(images)]
    (doubt,) = film(repeated).find_issues()
    assert doubt.kind == "repeated"
    assert doubt.found.startswith("each about ")
    assert doubt.found.endswith(" times from 1.11 s on")


def test_darkness_is_found_and_not_taken_for_a_frozen_picture(film, images):
    (doubt,) = film(images[:150] + [image // 12 for image in images[150:]]).find_issues()
    assert doubt.kind == "dark"
    assert "from 1.67 s to the end" in doubt.found


def test_a_picture_that_never_changes_is_frozen(film, images):
    (doubt,) = film([images[0]] * 400).find_issues()
    assert doubt.kind == "frozen"


def test_without_noise_a_smooth_drum_is_not_taken_for_a_frozen_picture(images):
    """Simulated without nuisances: still, then a pull, then still."""
    quiet = [images[0]] * 60 + images[60:90] + [images[90]] * 310
    footage = Footage(Drawn(quiet, np.arange(400) / FPS))
    list(footage.frames())
    assert footage.find_issues() == []


def test_without_noise_a_picture_that_moved_while_the_drum_slid_is_frozen(images):
    """As a fast encoder leaves it, which takes all noise away."""
    quiet = [images[0]] * 40 + images[40:240] + [images[240]] * 160
    footage = Footage(Drawn(quiet, np.arange(400) / FPS))
    list(footage.frames())
    (doubt,) = footage.find_issues((0.6, 4.4))
    assert doubt.kind == "frozen"
    assert doubt.found == "the same one from 2.67 s to the end"


def test_a_short_break_is_no_doubt(film, images):
    frozen = images[:150] + [images[150]] * 40 + images[190:]
    assert film(frozen).find_issues() == []


class Drawn:
    """A video of frames at given times."""

    path, fps_hz, width, height = Path("v.mp4"), 90.0, *SIZE

    def __init__(self, images, time_s):
        self._frames = [Frame(t, i) for t, i in zip(time_s, images, strict=True)]

    def frames(self):
        return iter(self._frames)


@pytest.mark.parametrize("n", [0, 1, 2, 20])
def test_few_frames_give_no_doubt(images, n):
    footage = Footage(Drawn(images[:n], np.arange(n) / FPS))
    list(footage.frames())
    assert footage.find_issues() == []
    assert footage.figures.changes.shape == (n, 6)


def test_uneven_and_equal_times_do_no_harm(images):
    rng = np.random.default_rng(0)
    uneven = np.cumsum(rng.choice([0.0, 1 / 90, 1 / 30], len(images)))
    footage = Footage(Drawn(images, uneven))
    list(footage.frames())
    assert footage.find_issues() == []
    same = Footage(Drawn(images, np.zeros(len(images))))
    list(same.frames())
    assert same.find_issues() == []


def test_decoding_again_measures_anew(images):
    footage = Footage(Drawn(images[:50], np.arange(50) / FPS))
    list(footage.frames())
    first = footage.figures.changes
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
    footage = encoded(tmp_path / "v.avi", "mjpeg", stalling(images, spans))
    seen = [
        (round(FPS * begin) + 1, round(FPS * end)) for begin, end in footage.stalls.spans if begin
    ]
    assert seen == [(100, 119), (300, 339)]  # 7 frames are 0.08 s
    assert str(footage.stalls) == "2 times, 0.67 s in all, first from 1.10 s to 1.32 s"
    assert footage.find_issues() == []


def test_many_short_stalls_together_are_a_frozen_picture(tmp_path, images):
    spans = [(first, first + 19) for first in range(110, 290, 30)]
    (doubt,) = encoded(tmp_path / "v.avi", "mjpeg", stalling(images, spans)).find_issues()
    assert doubt.kind == "frozen"
    assert doubt.found == "the very same one 6 times, 1.33 s in all, first from 1.21 s to 1.43 s"


def test_a_frozen_picture_between_many_key_frames_is_found(tmp_path, images):
    """As the authors' kind of writer has it (mp4v, every 12th frame anew)."""
    footage = encoded(
        tmp_path / "v.mp4", "mpeg4", stalling(images, [(130, 330)]), {"qscale": "5", "g": "12"}
    )
    (doubt,) = footage.find_issues()
    assert doubt.kind == "frozen"
    began = float(doubt.found.split("from ")[1].split(" s")[0])
    assert began == pytest.approx(130 / FPS, abs=0.25)


def test_a_genuine_skin_never_stalls(film, images):
    assert film(images).stalls.spans == ()


def test_without_noise_nothing_is_a_stall(images):
    footage = Footage(Drawn([images[0]] * 400, np.arange(400) / FPS))
    list(footage.frames())
    assert str(footage.stalls) == "never"
