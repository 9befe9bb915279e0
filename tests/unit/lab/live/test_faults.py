"""What goes wrong with sources is said, nothing reaches across it, nothing old passes as new."""

import math
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.lab.live import (
    Begin,
    Camera,
    CameraFrame,
    Pace,
    ReplayedSound,
    ReplayedVideo,
    Sound,
    Trouble,
    stream,
)
from afferents.lab.live.events import WAITING_FRAMES, WAITING_SOUNDS, Mailbox
from afferents.lab.live.pipeline import check_sources
from afferents.recordings.audio import WavFile
from afferents.recordings.data_sets import read_session
from afferents.store.recording import Frame

from .conftest import pipeline_of


@pytest.fixture
def pictures(session):
    video = read_session(session).recordings[5].video
    return list(ReplayedVideo(video, Pace(math.inf)).events())


@pytest.fixture
def chunks(sounds):
    audio = WavFile(read_session(sounds).recordings[5].audio.path)
    return list(ReplayedSound(audio, Pace(math.inf)).events())


@pytest.fixture
def seeing(models):
    return pipeline_of(models, "ra-ste")


def fed(pipeline, events):
    return [prediction for event in events for prediction in pipeline.feed(event)]


def frames_of(predictions):
    """Of frames with a touch: the rest frame itself is none."""
    return {round(p.time_s * 90) - 1 for p in predictions if p.state != "untouched"}


FIRST = 10 + 1 + 9
"""Rest frame, one before RA-I, nine before a run of ten is full."""

AHEAD_S = 3600
"""So far ahead pictures arrive that are to be late for their stamps alone: on a slow machine they
would soon have waited here as well."""


def test_evidence_begins_anew_where_rest_is_set_and_goes_on_where_it_is_refused(models, pictures):
    """The clip's first picture shows the skin at rest, its last ones sliding drums."""
    pipeline = pipeline_of(models, "sa-se")
    fed(pipeline, pictures[:30])
    assert pipeline.set_rest()
    sliding = fed(pipeline, pictures[30:41])
    assert [p.troubles[0][:16] for p in sliding if p.troubles] == ["rest was not set"]
    assert max(sliding[-1].evidence.values()) > 2 / len(sliding[-1].evidence)
    assert pipeline.set_rest()
    image = pictures[40].frame.image
    resting = fed(pipeline, [CameraFrame(Frame(i / 90, image), 0.0) for i in range(41, 61)])
    assert resting[9].troubles == ("rest was set: displacement counts from here",)
    assert {p.state for p in resting[9:]} == {"untouched"}
    assert len(set(resting[9].evidence.values())) == 1


@pytest.mark.parametrize("fault", ["dropped", "torn"])
def test_a_run_of_ten_never_spans_a_missing_or_torn_frame(seeing, pictures, fault):
    lost = 30
    between = [pictures[lost]._replace(torn=True)] if fault == "torn" else []
    predictions = fed(seeing, [*pictures[:lost], *between, *pictures[lost + 1 :]])
    assert frames_of(predictions) == {*range(FIRST, lost), *range(lost + 11, 45)}
    assert getattr(predictions[-1].counters, fault) == 1


@pytest.mark.parametrize(("slower", "stalled"), [(1.5, True), (1.05, False)])
def test_a_camera_that_is_too_slow_gives_nothing_fresh(models, pictures, slower, stalled):
    pipeline = pipeline_of(models, "sa-se")
    slow = [p._replace(frame=p.frame._replace(time_s=slower * p.time_s)) for p in pictures]
    last = fed(pipeline, slow)[-1]
    assert (last.state == "stalled", last.counters.dropped) == (stalled, 0)


def test_one_stamp_far_ahead_costs_a_run_and_no_more(models, pictures):
    pipeline = pipeline_of(models, "ra-ste", speed=1)
    now_s = time.monotonic() + AHEAD_S
    arrived = [p._replace(arrived_s=now_s + p.frame.time_s) for p in pictures]
    wrong = arrived[25]
    arrived[25] = wrong._replace(frame=wrong.frame._replace(time_s=wrong.frame.time_s + 20))
    last = fed(pipeline, arrived)[-1]
    assert (last.counters.doubled, last.counters.late, last.state) == (0, 0, "texture")


def test_doubled_frames_change_nothing(seeing, models, pictures):
    twice = [p for picture in pictures for p in (picture, picture._replace(arrived_s=1.0))]
    plain, doubled = fed(pipeline_of(models, "ra-ste"), pictures), fed(seeing, twice)
    assert [p.probabilities for p in plain] == [p.probabilities for p in doubled]
    assert doubled[-1].counters.doubled == len(pictures) - 1


def test_no_window_spans_lost_sound(models, chunks):
    predictions = fed(pipeline_of(models, "vib-te-aug"), chunks[:120] + chunks[130:])
    assert [round(p.time_s, 3) for p in predictions] == [1.0, 2.3, 2.8]
    assert predictions[-1].counters.lost_samples == 800


@pytest.fixture
def arriving(models, pictures):
    """Feed pictures that arrive when a function of their number and time says."""

    def predictions(arrives_s):
        pipeline = pipeline_of(models, "ra-ste", speed=1)
        events = [p._replace(arrived_s=arrives_s(i, p.time_s)) for i, p in enumerate(pictures)]
        return fed(pipeline, events)

    return predictions


@pytest.mark.parametrize(
    ("late", "fresh"),
    [
        (lambda i: i >= 30, range(FIRST, 30)),
        (lambda i: i in (24, 25), [*range(FIRST, 24), *range(35, 45)]),
        (lambda i: 0.0004 * i / 90, range(FIRST, 45)),  # a clock that drifts
    ],
)
def test_what_comes_late_is_not_fresh_and_no_run_of_ten_spans_it(arriving, late, fresh):
    now_s = time.monotonic() + AHEAD_S
    predictions = arriving(lambda i, time_s: now_s + time_s + 0.5 * late(i))
    assert frames_of(p for p in predictions if p.fresh) == set(fresh)
    assert all(p.fresh or (p.state, p.probabilities) == ("stalled", {}) for p in predictions)


def test_what_has_waited_here_is_not_fresh(arriving):
    waited = arriving(lambda _, time_s: time.monotonic() - 0.2 + time_s / 1e6)
    assert {p.state for p in waited} == {"stalled"}


def test_a_picture_without_markers_is_said_until_they_are_there(seeing, pictures):
    black = Frame(0.0, np.zeros((480, 640), np.uint8))
    blind = [CameraFrame(black._replace(time_s=i / 90), 0.0) for i in range(40)]
    predictions = fed(seeing, blind)
    assert {p.state for p in predictions} == {"waiting"}
    assert "markers" in predictions[0].troubles[0]
    later = [p._replace(frame=p.frame._replace(time_s=p.time_s + 40 / 90)) for p in pictures]
    assert fed(seeing, later)[-1].fresh


def test_another_recording_begins_anew(seeing, pictures):
    first = fed(seeing, pictures)
    again = fed(seeing, [Begin("video", 0.0, "g at 50 mm/s"), *pictures])
    assert [p.probabilities for p in first] == [p.probabilities for p in again]
    assert [p.evidence for p in first] == [p.evidence for p in again]
    assert again[0].truth == "g at 50 mm/s"


def test_trouble_of_one_sense_leaves_the_other(models, pictures):
    both = pipeline_of(models, "sa-se", "vib-te-aug")
    said = both.feed(Trouble("audio", 0.0, "unplugged"))
    assert [(p.model, p.state, p.troubles) for p in said] == [
        ("vib-te-aug", "stalled", ("unplugged",))
    ]
    assert all(p.fresh for p in fed(both, pictures))


def test_sound_shorter_than_a_window_ends_with_a_word(models, tmp_path):
    soundfile.write(tmp_path / "short.wav", np.zeros((4000, 2)), 8000)
    source = ReplayedSound(WavFile(tmp_path / "short.wav"), Pace(math.inf))
    assert [p.state for p in stream([source], [models["vib-te-aug"]])] == ["waiting"]


@pytest.mark.parametrize("outlet", [["--json"], []])
def test_a_clip_that_fits_no_model_ends_with_what_was_wrong(
    fails, models, make_video, tmp_path, outlet
):
    bare = make_video(tmp_path / "bare.mp4", np.zeros(12), covered=[range(361)] * 12)
    asked = ("live", "--model", models["sa-se"], *outlet, "--speed", "max")
    assert "expected 361 markers of sensor" in fails(*asked, "--video", bare)
    soundfile.write(tmp_path / "short.wav", np.zeros((4000, 2)), 8000)
    asked = ("live", "--model", models["vib-te-aug"], *outlet, "--speed", "max")
    assert "long enough for a prediction" in fails(*asked, "--audio", tmp_path / "short.wav")


class Stopping:
    """A source that says nothing after 30 pictures until `go_on` is set."""

    channel, rate_hz, speed = "video", 90.0, 1.0

    def __init__(self, pictures, go_on):
        self.pictures, self.go_on = pictures, go_on

    def events(self):
        start = time.monotonic()
        for i, picture in enumerate(self.pictures):
            if i == 30:
                self.go_on.wait(60)
            time.sleep(max(0, start + picture.time_s - time.monotonic()))
            yield picture._replace(arrived_s=time.monotonic())

    def close(self):
        self.pictures = []


@pytest.mark.system  # in real time
def test_a_silent_source_is_stalled(models, pictures):
    go_on, predictions = threading.Event(), []
    n_stalled = 0
    for prediction in stream([Stopping(pictures, go_on)], [models["sa-se"]]):
        predictions.append(prediction)
        n_stalled += prediction.state == "stalled"
        if n_stalled == 3:
            go_on.set()
    stalled = [p for p in predictions if not p.fresh]
    assert go_on.is_set()
    # One silence is one trouble; none is a source that has not begun yet.
    named = {t for p in predictions for t in p.troubles if "nothing for" in t}
    assert (len(named), predictions[-1].counters.troubles) == (1, 1)
    assert all(p.texture is None and p.probabilities == {} for p in stalled)


def test_who_went_silent_has_no_figures(seeing):
    long_ago_s = time.monotonic() - 10
    seeing.video.reported_s, seeing.video.quality.numbers = long_ago_s, {"fps_hz": 90.0}
    (said,) = seeing.video.break_silence(long_ago_s)
    assert (said.state, said.quality) == ("stalled", {})


@pytest.mark.system  # in real time
def test_a_slow_listener_is_no_silent_source(models, pictures):
    """Who takes half a second over a prediction drops frames; the source was never silent."""
    never, said = threading.Event(), []
    never.set()
    source = Stopping(pictures, never)
    for prediction in stream([source], [models["sa-se"]]):
        said.append(prediction)
        time.sleep(0.6)
    assert not any("nothing for" in trouble for p in said for trouble in p.troubles)


def test_who_is_too_slow_skips_the_oldest_pictures(pictures):
    mailbox = Mailbox()
    silence = np.zeros((1, 1), np.float32)
    given = [
        event
        for i in range(WAITING_SOUNDS + 20)
        for event in (pictures[i % 40], Sound(i, silence, 0.0))
    ]
    mailbox._pump(SimpleNamespace(events=lambda: given))
    kept = list(mailbox._events)
    newest = [pictures[i % 40] for i in range(WAITING_SOUNDS + 20)][-WAITING_FRAMES:]
    assert [e for e in kept if isinstance(e, CameraFrame)] == newest
    assert [e.time_s for e in kept if isinstance(e, Sound)] == list(range(20, WAITING_SOUNDS + 20))


def test_an_error_of_a_source_reaches_who_takes_its_events():
    class Breaking:
        channel = "video"

        def events(self):
            raise ValueError("broken")
            yield

    mailbox = Mailbox()
    mailbox.take_from(Breaking())
    with pytest.raises(ValueError, match="broken"):
        next(mailbox.take(60))


def test_a_camera_that_does_not_take_the_model_s_rate_is_refused(seeing):
    camera = Camera("testsrc2=size=640x480:rate=60", 90, 640, 480, driver="lavfi")
    with pytest.raises(InputError, match=r"expected 90 frames/s, as the model .* found 60"):
        check_sources([camera], seeing)
    camera.close()


def test_a_camera_that_is_slow_vanishes_and_comes_back():
    """Through FFmpeg's own virtual camera: 15 frames a second for 1.4 s, again and again."""
    device = "testsrc2=size=640x480:rate=15:duration=1.4,realtime"
    camera = Camera(device, 90, 640, 480, driver="lavfi")
    pictures, said = [], []
    for event in camera.events():
        (pictures if isinstance(event, CameraFrame) else said).append(event)
        if len(said) == 3:
            camera.close()
    assert (
        "expected 90 frames/s, found 1" in said[0].what
    )  # 15, or nearly so when it comes unevenly
    assert "no more frames" in said[1].what
    assert len(pictures) > 30
    steps = np.diff([p.time_s for p in pictures[:15]])
    assert np.median(steps) == pytest.approx(1 / 15, abs=0.03)  # single ones may come late
    assert pictures[-1].frame.luma.shape == (480, 640)


def test_nothing_is_recognised_while_the_skin_is_at_rest(models, pictures):
    pipeline = pipeline_of(models, "sa-se")
    still, n = pictures[10], len(pictures)
    at = [still.frame._replace(time_s=(n + i) / 90) for i in range(30)]
    touched = fed(pipeline, pictures)
    assert touched[-1].probabilities
    rested = fed(pipeline, [still._replace(frame=frame) for frame in at])
    assert {p.state for p in rested[-10:]} == {"untouched"}
    assert rested[-1].fresh
    assert not rested[-1].probabilities
    even = [1 / len(rested[-1].evidence)] * len(rested[-1].evidence)
    assert list(rested[-1].evidence.values()) == pytest.approx(even)
