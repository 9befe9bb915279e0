"""A stream of touches says what `extract` stores, frame by frame, and counts what is missing."""

import math
import time

import numpy as np
import pytest

from afferents import dims, load_sensor, track
from afferents.channels import CHANNELS, marker_speed
from afferents.errors import InputError
from afferents.extraction.extract import responses_of
from afferents.lab.live.events import CameraFrame, Sound, Trouble
from afferents.lab.live.fingertip import MOST_SOUND_S, Fingertip, stream
from afferents.lab.live.follower import REST_FRAMES
from afferents.markers.rest import N_FIRST
from afferents.recordings.data_sets import read_session
from afferents.recordings.video import open_video

TIP = load_sensor("tip_b")
FIRST = TIP.rest_frame
"""Touches begin with the rest frame."""


def stacked(touches, name):
    return np.stack([getattr(touch, name) for touch in touches])


@pytest.fixture
def clip(make_video, tmp_path, rng):
    """Discs that move after a while, and some of them hidden now and then."""
    shift = 3 * np.sin(np.arange(60) / 4) * (np.arange(60) > 25)
    covered = [rng.choice(361, 12) if i > 27 else [] for i in range(60)]
    return make_video(tmp_path / "lost.mp4", shift, covered)


def test_touches_are_what_is_stored(clip):
    """Bit for bit but for shear, whose sums over one frame or all are ordered otherwise."""
    offline = track(clip)
    with stream(clip, sensor="tip_b") as fingertip:
        touches = list(fingertip)
    assert np.isnan(offline[dims.SA1].values).any()
    for name in (dims.POSITION, dims.SA1, dims.RA1):
        np.testing.assert_array_equal(stacked(touches, name), offline[name].values[FIRST:])
    np.testing.assert_array_equal([t.time_s for t in touches], offline[dims.TIME].values[FIRST:])
    shear = CHANNELS[dims.SHEAR].response(offline).values
    np.testing.assert_allclose(stacked(touches, "shear"), shear[FIRST:], rtol=0, atol=1e-4)
    speed = marker_speed(offline[dims.POSITION].astype(float)).values
    np.testing.assert_allclose(
        stacked(touches, "speed")[1:], speed[FIRST + 1 :], rtol=1e-3, atol=1e-2
    )
    assert [t.touching for t in touches] == [i > 25 for i in range(FIRST, 60)]
    assert touches[-1].lost == pytest.approx(np.isnan(offline[dims.SA1].values[-1]).mean())
    image = touches[-1].image("sa1")
    places = offline[dims.ROW].values, offline[dims.COLUMN].values
    np.testing.assert_array_equal(image[places], touches[-1].sa1)


def test_sound_comes_with_the_frames_that_it_came_between(session):
    recording = read_session(session).recordings[4]
    offline = responses_of(recording, TIP)
    folder = recording.video.path.parent
    with stream(folder, folder, "tip_b", audio_offset_s=0.01) as fingertip:
        touches = list(fingertip)
    heard = np.concatenate([touch.ra2 for touch in touches])
    np.testing.assert_array_equal(heard, offline[dims.RA2].values[: len(heard)])
    times = np.concatenate([touch.ra2_time_s for touch in touches])
    expected = np.arange(len(heard)) / fingertip.sample_rate_hz - 0.01
    np.testing.assert_allclose(times, expected, atol=1e-9)
    last = touches[-1].time_s
    assert last - 1 / fingertip.sample_rate_hz < times[-1] <= last
    assert all(t.ra2_time_s[-1] <= t.time_s for t in touches[1:])


class Given:
    """Frames as a camera would give them, without waiting."""

    speed = math.inf

    def __init__(self, events, channel="video", rate_hz=90.0):
        self._given, self.channel, self.rate_hz = events, channel, rate_hz
        self.closed = False

    def events(self):
        yield from self._given

    def close(self):
        self.closed = True


def frames_of(clip):
    return [
        CameraFrame(frame._replace(luma=frame.luma.copy()), 0.0)
        for frame in open_video(clip).frames()
    ]


def test_what_is_missing_is_a_gap_and_is_counted(clip):
    events = frames_of(clip)
    torn = events[50]._replace(torn=True)
    given = [
        *events[:30],
        *events[33:40],
        events[39],
        *events[40:50],
        torn,
        *events[51:55],
        Trouble("video", 0.0, "camera 0: gone"),
        *events[55:],
    ]
    tip = Fingertip([Given(given)], TIP)
    touches = {round(90 * t.time_s): t for t in tip}
    assert sorted(touches) == [i for i in range(FIRST, 60) if i not in (30, 31, 32, 50)]
    without = [i for i, t in touches.items() if np.isnan(t.ra1).all()]
    assert without == [FIRST, 33, 51, 55]
    counted = touches[59].quality
    assert (counted.dropped, counted.doubled, counted.torn, counted.troubles) == (3, 1, 1, 1)
    assert touches[55].events == ("camera 0: gone",)
    assert touches[33].step_s == pytest.approx(4 / 90)


def test_sound_of_a_camera_that_gives_nothing_is_kept_for_seconds_and_then_counted(clip):
    frames = frames_of(clip)
    late = frames[-1]._replace(frame=frames[-1].frame._replace(time_s=20.0))
    pieces = [Sound(i / 10, np.full((100, 1), i, np.float32), 0.0) for i in range(201)]
    tip = Fingertip([Given([*frames, late]), Given(pieces, "audio", 1000.0)], TIP)
    *_, last = tip
    assert last.ra2[0] >= 199 - 10 * MOST_SOUND_S  # that came before the frame, or with it
    assert len(last.ra2) <= 1000 * MOST_SOUND_S + 200
    before = np.searchsorted(np.arange(20_000), 1000 * frames[-1].time_s, "right")
    assert last.quality.lost_samples == 20_000 - before - len(last.ra2)


def test_a_gap_among_the_first_frames_is_one_too(clip):
    given = [event for n, event in enumerate(frames_of(clip)) if n not in (14, 15)]
    touches = {round(90 * t.time_s): t for t in Fingertip([Given(given)], TIP)}
    assert [i for i, t in touches.items() if np.isnan(t.ra1).all()] == [FIRST, 16]


def test_rest_is_set_anew_where_nothing_moves_and_else_refused(make_video, tmp_path):
    shift = np.array([0.0] * 25 + [4.0] * 25 + [4 + 0.5 * i for i in range(1, 26)])
    clip = make_video(tmp_path / "rest.mp4", shift)
    with stream(clip, sensor="tip_b") as tip:
        told, touches = {}, {}
        for i, touch in enumerate(tip, FIRST):
            touches[i] = touch
            if touch.events:
                told[i] = touch.events[0]
            if i in (30, 52):
                tip.set_rest()
    assert np.nanmedian(touches[35].sa1) == pytest.approx(4, abs=0.05)
    assert np.nanmedian(touches[30 + REST_FRAMES].sa1) < 0.05
    assert not touches[45].touching
    assert told[30 + REST_FRAMES] == "rest was set: displacement counts from here"
    assert np.isnan(touches[30 + REST_FRAMES].ra1).all()
    assert "rest was not set: expected a skin that stands still" in told[52 + REST_FRAMES]
    assert np.isfinite(touches[52 + REST_FRAMES].ra1).all()
    assert np.nanmedian(touches[74].sa1) == pytest.approx(12.5, abs=0.1)


def test_a_clip_shorter_than_the_frames_at_rest_is_told_whole(make_video, tmp_path):
    clip = make_video(tmp_path / "short.mp4", np.zeros(N_FIRST - 5))
    with stream(clip) as tip:  # markers are found
        assert len(list(tip)) == N_FIRST - 5


class Bursting(Given):
    """A running camera whose first frames are waited for; the others come all at once."""

    speed, reader = 1.0, None

    def events(self):
        for n, event in enumerate(self._given):
            while n <= FIRST + N_FIRST and self.reader._follower.counters.frames < n:
                time.sleep(0.001)
            yield event


def test_a_running_source_may_be_read_slowly(clip):
    """What is not taken in time is dropped and counted, and what is taken is right."""
    camera = Bursting(frames_of(clip))
    with Fingertip([camera], TIP) as tip:
        camera.reader = tip
        touches = list(tip)
    assert camera.closed
    taken = [round(90 * t.time_s) for t in touches]
    assert taken == sorted(set(taken))
    assert touches[-1].quality.frames + touches[-1].quality.dropped == 60
    assert touches[-1].sa1 == pytest.approx(
        track(clip).sa1.values[taken[-1]], abs=0.02, nan_ok=True
    )


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"video": "camera:9"}, "expected a camera that is plugged in and free"),
        ({"video": "none.mp4"}, "expected camera:0, .* found 'none.mp4'"),
        ({"video": "rig", "audio_offset_s": math.nan}, "--audio-offset-ms: expected a number"),
        ({"video": "rig", "sensor": "none.toml"}, "none.toml"),
    ],
)
def test_what_can_not_be_read_is_refused(given, sentence):
    with pytest.raises(InputError, match=sentence):
        stream(**given)


def test_an_image_of_something_else_is_refused(clip):
    with stream(clip, sensor="tip_b") as tip:
        touch = next(iter(tip))
    with pytest.raises(InputError, match="expected sa1, ra1 or speed, found 'position'"):
        touch.image("position")


def test_a_turned_camera_has_the_directions_of_the_upright_picture(clip):
    turned = TIP.model_copy(update={"picture": TIP.picture.model_copy(update={"turn": 180})})
    with stream(clip, sensor=TIP) as upright, stream(clip, sensor=turned) as other:
        *_, one = upright
        *_, back = other
    np.testing.assert_allclose(back.shear[:2], -one.shear[:2], atol=1e-4)
    assert abs(one.shear[0]) > 0.1
