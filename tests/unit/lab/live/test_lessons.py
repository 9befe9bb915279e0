"""Teaching: textures are waves that slide under drawn markers; then drums of the rig."""

import io
import json
import math
import shutil
import sys
import threading
from collections import Counter

import numpy as np
import pytest
from rich.console import Console

import afferents
from afferents import dims
from afferents.errors import InputError
from afferents.evaluation.data import encode
from afferents.lab.live import Begin, LivePipeline, Pace, ReplayedVideo, Trouble, run
from afferents.lab.live.lessons import SOURCE
from afferents.lab.live.terminal import Screen
from afferents.lab.live.web.snapshot import Snapshots
from afferents.markers.sensor import load_sensor
from afferents.recordings.video import open_video

from ....kept import kept
from ...markers.conftest import draw_discs
from .test_looking import FPS, GRID, Played, pictures, sounds
from .test_page import Running, says, visit

SENSOR = load_sensor("tip_b")
REST_S, TOUCH_S = 0.4, 2.6
WAVES = {"felt": (0.016, 0.0), "cork": (0.0, 0.016), "silk": (0.011, 0.011)}
"""Cycles per px, in x and y."""


def slide(texture, px_s, seconds=TOUCH_S):
    """Pictures of a touch, after some of the skin at rest."""
    rng, kx_ky = np.random.default_rng(len(texture)), np.array(WAVES[texture])
    for i in range(round((REST_S + seconds) * FPS)):
        touched_s = i / FPS - REST_S
        phase = 2 * np.pi * (GRID @ kx_ky - touched_s * px_s * np.hypot(*kx_ky))
        moved = np.stack([3 + 2 * np.cos(phase), np.sin(phase)], axis=1) * (touched_s > 0)
        yield draw_discs(GRID + moved + rng.normal(0, 0.03, GRID.shape), (480, 640), marker=255)


@pytest.fixture(scope="module")
def touches():
    return {
        (texture, px_s): list(slide(texture, px_s))
        for texture, px_s in [
            ("felt", 400),
            ("felt", 600),
            ("cork", 400),
            ("cork", 600),
            ("silk", 600),
        ]
    }


def opened(folder, audio=None):
    sources = [Played([]), *([] if audio is None else [audio])]
    pipeline = LivePipeline.without_models(sources, SENSOR)
    pipeline.learn(folder)
    return pipeline


def play(pipeline, images, *others, name=None, speed=""):
    """What is predicted by a touch, which is taught where it has a name."""
    pipeline.video.begin(Begin("video", 0.0))
    if name is not None:
        pipeline.lessons.start(name, speed)
    predictions = list(run([Played(pictures(images)), *others], pipeline))
    return [one for one in predictions if one.model == "lessons"]


def named(predictions):
    (most, _), *_ = Counter(
        one.texture for one in predictions if one.state != "untouched"
    ).most_common()
    return most


def taught_twice(folder, touches):
    pipeline = opened(folder)
    for texture in ("felt", "cork"):
        play(pipeline, touches[texture, 400], name=texture)
    return pipeline


@pytest.fixture(scope="module")
def lessons(touches, tmp_path_factory):
    folder = tmp_path_factory.mktemp("taught") / "lessons"
    return folder, taught_twice(folder, touches)


def test_what_was_taught_is_recognised_at_another_speed_and_no_other_texture_is(lessons, touches):
    _, pipeline = lessons
    assert named(play(pipeline, touches["felt", 600])) == "felt"
    assert named(play(pipeline, touches["cork", 600])) == "cork"
    assert named(play(pipeline, touches["silk", 600])) is None


def test_one_texture_is_recognised_or_unknown(touches, tmp_path):
    pipeline = opened(tmp_path / "new")
    *before, last = play(pipeline, touches["felt", 400], name="felt")
    assert {one.state for one in before} == {"looking"}
    assert (last.state, last.troubles) == ("waiting", ("'felt' was learnt from 1.6 s",))
    again = play(pipeline, touches["felt", 600])
    assert named(again) == "felt"
    assert again[-1].evidence == {"felt": 1.0}
    assert all(one.sure_after_s is None for one in again)
    unknown = play(pipeline, touches["cork", 600])
    assert named(unknown) is None
    json.dumps([one.to_dict() for one in unknown], allow_nan=False)


def test_a_folder_of_lessons_is_a_session_with_the_samples_that_were_taught(lessons, tmp_path):
    folder, pipeline = lessons
    store = afferents.extract(folder, tmp_path / "S.zarr", workers=1, quiet=True)
    assert [one.attrs["name"] for one in store] == ["cork/touch-1", "felt/touch-1"]
    taught = {str(one[dims.TEXTURE].values[0]): one for one in pipeline.lessons._samples}
    for responses in store:
        found = encode(responses, SOURCE, "all")
        there = taught[responses.attrs[dims.TEXTURE]]
        assert found.shape == there.shape == (14, 2, 19, 10)
        # JPEGs move markers a little.
        np.testing.assert_allclose(found.values, there.values, atol=0.4)
        assert np.corrcoef(found.values.ravel(), there.values.ravel())[0, 1] > 0.999


def test_lessons_are_read_again_and_gone_on_with(lessons, touches, tmp_path):
    folder = shutil.copytree(lessons[0], tmp_path / "copy")
    pipeline = opened(folder)
    assert pipeline.lessons.network.textures == ("cork", "felt")
    assert named(play(pipeline, touches["felt", 600])) == "felt"
    play(pipeline, touches["felt", 600], name="felt", speed="12,5")
    *sentences, last = pipeline.lessons.state()["sentences"]
    assert "felt: 3.1 s in 2 touches at 12.5 mm/s." in sentences
    assert last.startswith("Nothing is known of other speeds: teach each at a second one")
    listed = json.loads((folder / "session.json").read_text())["recordings"][-1]
    assert (listed["video"], listed["speed_mm_s"]) == ("felt/touch-2/video.mp4", 12.5)
    with pytest.raises(InputError, match="expected each speed under one name"):
        pipeline.lessons.start("felt", "12.50001")


def test_two_speeds_of_each_say_what_is_known_of_speeds(lessons, touches, tmp_path):
    pipeline = opened(tmp_path / "new")
    for (texture, px_s), images in touches.items():
        if texture != "silk":
            play(pipeline, images, name=texture, speed=px_s / 10)
    told = pipeline.lessons.state()["sentences"]
    assert told[2:] == ["By the other speeds, 100% of the samples at 60 mm/s are recognised."]
    store = tmp_path / "S.zarr"
    afferents.extract(tmp_path / "new", store, workers=1, quiet=True)
    card = afferents.train(store, tmp_path / "model", "sa-wave-vector", quiet=True)
    assert card.textures == ("cork", "felt")
    assert (card.learnt_from_mm_s, card.validation_accuracy) == ((40.0,), 1.0)


def test_sound_lies_beside_the_frames_it_came_with(touches, tmp_path):
    heard = np.sin(np.arange(24000) / 5)
    pipeline = opened(tmp_path / "new", sounds(heard))
    play(pipeline, touches["felt", 400], sounds(heard), name="felt")
    (responses,) = afferents.extract(tmp_path / "new", tmp_path / "S.zarr", workers=1, quiet=True)
    kept = responses[dims.RA2].values[:, 0]
    begun = round((37 - 20) / FPS * 8000)  # 20 frames at rest stand before the 37th, a touch
    first = int(np.flatnonzero(kept)[0])
    assert abs(first - 20 / FPS * 8000) < 500
    np.testing.assert_allclose(kept[first:], heard[begun + first :][: len(kept) - first], atol=1e-3)
    with pytest.raises(InputError, match="expected --audio, as its lessons have sound, found none"):
        opened(tmp_path / "new")


def told(pipeline):
    return pipeline.lessons.state()["last"]


def test_what_teaches_nothing_is_refused_in_a_sentence_and_nothing_is_lost(
    lessons, touches, tmp_path
):
    folder = shutil.copytree(lessons[0], tmp_path / "copy")
    pipeline = opened(folder)
    start = pipeline.lessons.start
    for name, speed, what in [
        ("a/b", "", "the name: expected a label without '/'"),
        ("", "", "the name: expected a label"),
        ("FELT", "", "expected each texture under one name"),
        ("wool", "fast", "the speed: expected a number of mm/s, found 'fast'"),
        ("wool", "nan", "the speed: expected a number of mm/s, found 'nan'"),
    ]:
        with pytest.raises(InputError, match=what):
            start(name, speed)
    with pytest.raises(InputError, match="expected one that runs, found none"):
        pipeline.lessons.stop()
    said = play(pipeline, touches["felt", 400][: round(1.2 * FPS)], name="wool")
    assert told(pipeline).startswith("'wool' was not learnt: expected 9 runs of frames in a touch")
    at_rest = touches["felt", 400][:30]
    play(pipeline, at_rest, name="wool")
    with pytest.raises(InputError, match="expected an end of 'wool' first"):
        start("felt")
    pipeline.lessons.stop()
    said = play(pipeline, at_rest)
    assert told(pipeline).startswith("'wool' was not learnt: expected a touch, found none")
    assert [told(pipeline)] == [what for one in said for what in one.troubles]
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        path.name for path in lessons[0].iterdir()
    )
    assert opened(folder).lessons.network.textures == ("cork", "felt")


def test_a_disk_that_fills_ends_the_lesson_and_the_stream_goes_on(touches, tmp_path, monkeypatch):
    pipeline = opened(tmp_path / "new")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("afferents.lab.writers.VideoWriter.write", full)
    said = play(pipeline, touches["felt", 400], name="felt")
    assert len(said) == len(touches["felt", 400]) - SENSOR.rest_frame  # all that came
    assert "'felt' was not learnt: " in told(pipeline)
    assert "no space left on the disk" in told(pipeline)
    assert not any((tmp_path / "new").iterdir())


def test_a_camera_that_goes_and_comes_back_leaves_a_gap_in_a_lesson(touches, tmp_path):
    pipeline = opened(tmp_path / "new")
    pipeline.lessons.start("felt")
    came = list(pictures(touches["felt", 400]))
    trouble = Trouble("video", came[120].time_s, "it was pulled out")
    for event in [*came[:120], trouble, *came[150:]]:
        list(pipeline.feed(event))
    pipeline.lessons.stop()
    list(pipeline.feed(next(pictures(touches["felt", 400], begin_s=3.1))))
    assert told(pipeline).startswith("'felt' was learnt from 1.")
    (responses,) = afferents.extract(tmp_path / "new", tmp_path / "S.zarr", workers=1, quiet=True)
    assert np.diff(responses[dims.TIME].values).max() == pytest.approx(31 / FPS, abs=1e-3)


def test_a_folder_of_something_else_or_of_another_sensor_is_refused(lessons, session, tmp_path):
    with pytest.raises(
        InputError, match="expected a folder of lessons, or a new one, found another"
    ):
        opened(session)
    sources = [Played([])]
    pipeline = LivePipeline.without_models(sources, load_sensor("hex127"))
    with pytest.raises(InputError, match="expected the sensor of its lessons, 'tip_b', found"):
        pipeline.learn(lessons[0])
    pipeline = LivePipeline.without_models([Played([], rate_hz=30.0)], SENSOR)
    with pytest.raises(InputError, match="expected 90 frames/s, as its lessons have, found 30"):
        pipeline.learn(lessons[0])
    pipeline = LivePipeline.without_models([sounds(np.zeros(800))])
    with pytest.raises(InputError, match="expected a source of images"):
        pipeline.learn(tmp_path / "new")


def test_page_and_terminal_are_told(touches, tmp_path):
    pipeline = opened(tmp_path / "new")
    page, screen = Snapshots(pipeline), Screen(pipeline)
    assert [one["textures"] for one in page.hello()["models"]] == [()]
    assert page.state()["lessons"] == {
        "name": None, "lasts_s": None, "sentences": [], "last": ""
    }  # fmt: skip
    play(pipeline, touches["felt", 400], name="felt")
    for prediction in play(pipeline, touches["felt", 600]):
        page.take(prediction)
        screen.take(prediction)
    assert [one["textures"] for one in page.hello()["models"]] == [("felt",)]
    assert page.state()["lessons"]["last"] == "'felt' was learnt from 1.6 s"
    console = Console(record=True, width=80, file=io.StringIO())
    console.print(screen.draw(console))
    assert "lessons: " in console.export_text()


def test_lines_on_standard_input_begin_and_end_a_lesson(monkeypatch, capsys):
    from afferents.lab.live import control

    asked = []

    class Heard:
        def start(self, name, speed):
            asked.append((name, speed))

        def stop(self):
            raise InputError("a lesson: expected one that runs, found none")

    def lines():
        yield from ("learn felt at night at 30\n", "learn two words\n", "learn\n")
        yield from ("rest\n", "lean\n")
        read.set()

    read = threading.Event()
    monkeypatch.setattr(sys, "stdin", lines())
    with control.set_rest_on_request(lambda: asked.append("rest"), True, Heard()):
        assert read.wait(60)
    assert asked == [("felt at night", "30"), ("two words", ""), "rest"]
    assert capsys.readouterr().err.splitlines() == [
        "--control: a lesson: expected one that runs, found none",
        "--control: expected a line 'rest', 'learn NAME' or 'learn', found 'lean'",
    ]


DRUMS = [("1", 40), ("5", 40), ("1", 60), ("5", 60), ("3", 60)]


@pytest.fixture(scope="module")
def drums():
    """Clips of three drums, the skin at rest for 0.8 s."""
    from afferents.rig.config import Rig
    from afferents.rig.record import record
    from afferents.rig.surface import bumped_surface

    def simulate(root):
        rig = Rig().printed(5)
        for drum, speed in DRUMS:
            surface = bumped_surface(float(drum), rig.drum)
            record(rig, root / drum / str(speed), drum, surface, speed, 3.5, 5)

    with kept("drums", simulate, ("afferents.rig.record",)) as root:
        yield root


def test_drums_of_the_rig_are_taught_at_one_speed_and_asked_at_another(drums, tmp_path):
    pipeline = opened(tmp_path / "new")

    def turn(drum, speed, **how):
        clip = open_video(drums / drum / f"{speed}" / "video.mp4")
        pipeline.video.begin(Begin("video", 0.0))
        if how:
            pipeline.lessons.start(**how)
        found = run([ReplayedVideo(clip, Pace(math.inf))], pipeline)
        return [one for one in found if one.state in ("texture", "unknown")]

    for drum in ("1", "5"):
        turn(drum, 40, name=drum)
    asked = {drum: [one.texture for one in turn(drum, 60)] for drum in ("1", "5", "3")}
    for drum in ("1", "5"):
        assert asked[drum].count(drum) > 0.5 * len(asked[drum])
    assert asked["3"].count(None) > 0.5 * len(asked["3"])


@pytest.mark.system
def test_a_texture_is_taught_on_the_page(launch, browser, drums, tmp_path):
    slowly = "--speed", "0.2"  # which a busy machine, too, keeps up with
    running = Running(launch, drums / "1" / "40", *slowly, "--learn", tmp_path / "new")
    try:
        page = visit(browser, running.url)
        page.locator("#teach [name=name]").press_sequentially("my felt, mz")
        page.fill("#teach [name=speed]", "40")
        page.keyboard.press("Enter")
        says(page, "#teach [role=status]", "my felt, mz: ")
        says(page, "#teach [role=status]", "'my felt, mz' was learnt from")
        says(page, "#teach ul", "in one touch at 40 mm/s.", "Nothing is known of other speeds")
        assert page.get_attribute("#mark", "aria-pressed") == "true"
        page.click("#again")
        page.wait_for_selector(".felt[data-felt='my felt, mz']")
        assert page.faults == []
        page.fill("#teach [name=name]", "My felt, mz")
        page.click("#teach button")
        says(page, "#teach .trouble", "expected each texture under one name")
        page.close()
    finally:
        running.stop()
    assert (tmp_path / "new" / "my felt, mz" / "touch-1" / "video.mp4").is_file()
