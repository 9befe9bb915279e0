"""Looking without a model: markers, SA-I, RA-I, spectrum and quality against what was drawn."""

import io
import json
import math
from functools import partial

import cv2
import numpy as np
import pytest
import soundfile
from rich.console import Console

from afferents.channels import Skin
from afferents.dims import SA1
from afferents.errors import InputError
from afferents.lab.live import (
    CameraFrame,
    LivePipeline,
    Sound,
    Wanted,
    find_sensor,
    open_sources,
    run,
)
from afferents.lab.live.prediction import Counters, Newest, Prediction
from afferents.lab.live.terminal import Screen
from afferents.lab.live.touch import Filled, Touch
from afferents.lab.live.web.snapshot import LOST, Snapshots, draw_image
from afferents.markers.grid import Grid
from afferents.markers.places import covered, image_places
from afferents.markers.sensor import load_sensor
from afferents.store.recording import Frame

from ...markers.conftest import draw_discs

FPS = 90.0
draw = partial(draw_discs, shape=(480, 640), marker=255)
GRID = np.stack(np.meshgrid(*[(np.arange(19) - 9) * 22.0] * 2), axis=-1).reshape(-1, 2)
GRID += (320, 240)
REST, PULLED, SHAKEN = 12, 3.0, 1.0
RATE_HZ = 8000.0


def shifts(n=40):
    """Rest, then a pull to the right with a shake on it that changes by 2 px every frame."""
    i = np.arange(n)
    return np.where(i >= REST, PULLED + SHAKEN * (-1) ** i, 0.0)


def pictures(images, rate_hz=FPS, begin_s=0.0):
    for i, image in enumerate(images):
        yield CameraFrame(Frame(begin_s + i / rate_hz, image), 0.0)


class Played:
    """A source of what a test has drawn."""

    speed = math.inf

    def __init__(self, events, channel="video", rate_hz=FPS):
        self._events, self.channel, self.rate_hz = list(events), channel, rate_hz

    def events(self):
        return iter(self._events)

    def close(self):
        pass


def sounds(samples, n=400):
    pieces = np.split(np.asarray(samples, np.float32)[:, None], len(samples) // n)
    return Played(
        (Sound(i * n / RATE_HZ, piece, 0.0) for i, piece in enumerate(pieces)), "audio", RATE_HZ
    )


def looked_at(images=(), samples=None, sensor=None, rate_hz=FPS):
    sources = [Played(pictures(images, rate_hz))] if len(images) else []
    sources += [] if samples is None else [sounds(samples)]
    pipeline = LivePipeline.without_models(sources, sensor)
    return pipeline, list(run(sources, pipeline))


def filled(markers, places, detected, grid):
    """What a frame shows of markers, some of which are lost."""
    seen = np.where(detected[:, None], places, np.nan)
    touch = Touch(0.0, seen, Skin(seen, places), None, 0.01, grid, False, Counters())
    return Filled(touch, markers)


@pytest.fixture(scope="module")
def squares():
    return {shift: draw(GRID + np.array([shift, 0])) for shift in np.unique(shifts())}


@pytest.fixture
def moving(squares):
    return [squares[shift] for shift in shifts()]


@pytest.mark.parametrize("name", ["hex127", "hex331", "radial127"])
def test_every_marker_of_a_layout_without_rows_shows_what_was_done_to_it(name):
    sensor = load_sensor(name)
    places = np.array(sensor.markers)
    drawn = {shift: draw(places + np.array([shift, 0])) for shift in np.unique(shifts())}
    pipeline, predictions = looked_at([drawn[s] for s in shifts()], sensor=sensor)
    seen = pipeline.video.newest
    assert seen.touch.detected.all()
    inside = seen.image("sa1") > 0
    assert inside.mean() > 0.5
    assert np.median(seen.image("sa1")[inside]) == pytest.approx(shifts()[-1], abs=0.1)
    assert np.median(seen.image("ra1")[inside]) == pytest.approx(2 * SHAKEN, abs=0.1)
    assert {p.state for p in predictions} == {"looking"}
    assert predictions[-1].markers_found == 1
    assert (
        pipeline.video.follower.describe()
        == f"Sensor '{name}': {sensor.layout} layout, {len(places)} markers."
    )


def test_markers_that_nobody_has_described_are_found_at_rest(moving):
    pipeline, predictions = looked_at(moving)
    assert pipeline.video.follower.describe().startswith(
        "No sensor file (--sensor): 361 bright markers were found, in a square layout"
    )
    np.testing.assert_allclose(pipeline.video.newest.image("sa1"), shifts()[-1], atol=0.15)
    assert len(predictions) == len(moving)


def test_a_camera_that_shows_nothing_yet_is_looked_at_again(moving):
    """The reason is told, the picture is there meanwhile, and then all is as ever."""
    black = [np.zeros((480, 640), np.uint8)] * 120
    pipeline, predictions = looked_at([*black, *[moving[0]] * 90, *moving])
    told = [p for p in predictions if p.troubles]
    assert {p.state for p in told} == {"waiting"}
    assert 1 <= len(told) <= 3
    assert "blobs of like size, found 0 in a picture that is black" in told[0].troubles[0]
    assert predictions[-1].state == "looking"
    assert pipeline.video.newest.touch.detected.all()


def test_what_a_source_said_is_shown_longer_than_one_frame(monkeypatch):
    newest = Newest()
    newest.take(Prediction("camera", "stalled", 1.0, troubles=("unplugged",)))
    newest.take(Prediction("camera", "looking", 1.1))
    ((shown, _),) = newest.predictions.values()
    assert (shown.state, shown.troubles) == ("looking", ("unplugged",))
    monkeypatch.setattr("afferents.lab.live.prediction.SHOWN_S", 0.0)
    newest.take(Prediction("camera", "looking", 1.2))
    assert not newest.predictions["camera"][0].troubles


def figures(stream):
    return {figure.name: figure for figure in stream.quality.figures()}


def test_quality_of_good_pictures_is_not_doubted(moving):
    pipeline, predictions = looked_at([*moving, *moving, *moving, *moving, *moving])
    numbers = predictions[-1].quality
    assert numbers["fps_hz"] == pytest.approx(FPS)
    assert (numbers["n_markers"], numbers["lost"], numbers["repeated"]) == (361, 0, 0)
    assert numbers["disc_grey"] == 255
    assert numbers["skin_grey"] == 20
    said = figures(pipeline.video)
    assert said["markers"].value == "361 of 361"
    assert said.pop("overexposed").issue.startswith("most of them overexposed")
    assert not any(figure.issue for figure in said.values())


def test_quality_says_what_is_wrong_with_pictures(squares):
    """Two of three frames repeat the one before, slowly; a fifth of the markers goes; no light."""
    still, shaken = squares[0.0], [squares[shift] for shift in (2.0, 4.0)]
    tripled = [shaken[i // 3 % 2] for i in range(240)]
    covered = draw(GRID[80:])
    pipeline, predictions = looked_at([*[still] * 12, *tripled], rate_hz=50.0)
    assert predictions[-1].quality["repeated"] == pytest.approx(2 / 3, abs=0.02)
    issues = [figure.issue for figure in figures(pipeline.video).values() if figure.issue]
    assert any(issue.startswith("Frames seem to repeat the one before") for issue in issues)
    slow = Played(pictures([still] * 120, 50.0))
    pipeline = LivePipeline.without_models([slow])
    pipeline.video.quality._rate_hz = FPS  # what the camera was asked for
    list(run([slow], pipeline))
    assert "more slowly than the 90 a second" in figures(pipeline.video)["frame rate"].issue
    pipeline, predictions = looked_at([*[still] * 12, *[covered] * 150])
    assert predictions[-1].quality["n_lost"] == 80
    assert "80 of 361" in figures(pipeline.video)["lost"].issue
    faint = draw(GRID, marker=60, skin=30)
    pipeline, _ = looked_at([cv2.GaussianBlur(faint, (0, 0), 3)] * 90)
    said = figures(pipeline.video)
    assert said["grey levels"].issue.startswith("faint markers, at grey level 5")
    assert said["edges"].issue.endswith("focus the camera")


def test_markers_that_stand_still_off_rest_are_named_until_rest_is_set(squares):
    crept = [draw(GRID + np.array([0.4, 0]))] * 360
    pipeline, predictions = looked_at([*[squares[0.0]] * 12, *crept])
    assert predictions[-1].quality["rest_off_px"] == pytest.approx(0.4, abs=0.05)
    issue = "Markers stand still 0.4 px off rest: if nothing touches the skin, set rest again (z)."
    assert figures(pipeline.video)["off rest"].issue == issue
    assert pipeline.set_rest()
    said = [p.troubles for event in pictures(crept, begin_s=4.2) for p in pipeline.feed(event)]
    assert [told for told in said if told] == [("rest was set: displacement counts from here",)]
    assert "off rest" not in figures(pipeline.video)
    assert np.abs(pipeline.video.newest.markers[SA1]).max() < 0.05


def test_quality_and_spectrum_of_sound():
    time_s = np.arange(2 * int(RATE_HZ)) / RATE_HZ
    tone = 0.5 * np.sin(2 * np.pi * 40 * time_s)
    pipeline, predictions = looked_at(samples=tone)
    assert [p.model for p in predictions] == ["microphone"] * 3
    assert predictions[-1].quality["rms"] == pytest.approx(0.5 / 2**0.5, rel=0.01)
    assert predictions[-1].quality["clipped"] == 0
    said = figures(pipeline.audio)
    assert (said["sound level"].value, said["loudest"].value) == ("-9 dBFS", "-6 dBFS")
    amplitude, step_hz = pipeline.audio.spectrum()
    assert np.argmax(amplitude) * step_hz == pytest.approx(40)
    noise = 0.01 * np.random.default_rng(0).normal(size=len(tone))
    pipeline, predictions = looked_at(samples=np.clip(4 * tone + noise, -1, 1))
    assert predictions[-1].quality["clipped"] > 0.5
    assert "lower the gain" in figures(pipeline.audio)["clipped"].issue
    pipeline, _ = looked_at(samples=0 * tone)
    assert "silent" in figures(pipeline.audio)["sound level"].issue


def test_the_page_is_given_all_of_it_as_json(moving):
    tone = np.sin(2 * np.pi * 40 * np.arange(16000) / RATE_HZ)
    pipeline, predictions = looked_at(moving * 2, tone)
    page = Snapshots(pipeline)
    for prediction in predictions:
        page.take(prediction)
    named = [(one["model"], one["textures"]) for one in page.hello()["models"]]
    assert named == [("camera", []), ("microphone", [])]
    assert page.state()["video"]["rate_hz"] == pytest.approx(FPS)
    assert page.state()["audio"]["rate_hz"] == RATE_HZ

    def refuse(constant):
        raise AssertionError(f"{constant} is no JSON")

    text, jpeg = page.newest()
    state = json.loads(text, parse_constant=refuse)
    assert np.array(state["video"]["sa1"]).shape == (19, 19)
    assert len(state["video"]["markers"]) == 361
    assert state["video"]["ring_px"] == pytest.approx(0.41 * 22, abs=0.1)
    assert {f["name"] for f in state["video"]["quality"]} >= {"frame rate", "markers", "edges"}
    assert {f["name"] for f in state["audio"]["quality"]} >= {"sound level", "clipped"}
    assert len(state["audio"]["amplitude"]) == 200
    assert cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE).shape == (480, 640)


@pytest.mark.parametrize("size", [(80, 24), (140, 50), (30, 10)])
def test_the_terminal_shows_pictures_and_words(moving, size):
    tone = np.sin(2 * np.pi * 40 * np.arange(16000) / RATE_HZ)
    pipeline, predictions = looked_at(moving * 2, tone)
    screen = Screen(pipeline)
    for prediction in predictions:
        screen.take(prediction)
    width, height = size
    given = {"width": width, "height": height, "file": io.StringIO()}
    for colours in ("truecolor", None):
        console = Console(**given, color_system=colours, force_terminal=colours is not None)
        with console.capture() as captured:
            console.print(screen.draw(console))
        said = " ".join(captured.get().split())
        assert ("▀" in said) == (colours is not None)
        assert "361 of 361" in said
        assert "microphone: looking" in said


def test_a_file_from_the_command_line(does, session, sounds, tmp_path):
    asked = ("live", "--json", "--speed", "max")
    video, audio = session / "2" / "40" / "video.mp4", sounds / "2" / "40" / "audio.wav"
    lines = does(*asked, "--video", video, "--audio", audio).splitlines()
    predictions = [json.loads(line) for line in lines]
    said = [p["model"] for p in predictions]
    assert (said.count("camera"), said.count("microphone")) == (45, 5)
    assert not any(p["texture"] or p["probabilities"] for p in predictions)
    soundfile.write(tmp_path / "one.wav", 0.1 * np.sin(np.arange(16000)), 8000)  # of one channel
    assert len(does(*asked, "--audio", tmp_path / "one.wav").splitlines()) == 3
    said = does("live", "--video", video, "--speed", "max", "--sensor", "tip_b")
    assert "Sensor 'tip_b': square layout" in " ".join(said.split())


def test_sound_without_a_spectrum_is_refused_by_the_option_that_live_has():
    with pytest.raises(InputError, match="--audio: expected sound of at least 400 Hz, found 300"):
        LivePipeline.without_models([Played([], "audio", 300.0)])


@pytest.mark.parametrize(("declared", "heard"), [({"sensor_channel": 0}, 0), (None, 2)])
def test_a_replay_is_heard_on_the_channel_that_its_session_names(tmp_path, declared, heard):
    """Of three; where nothing is named it is the last."""
    folder = tmp_path / "S" / "3" / "50"
    folder.mkdir(parents=True)
    samples = np.full((800, 3), (0.0, 0.25, 0.5))
    soundfile.write(folder / "audio.wav", samples, 8000, "FLOAT")
    if declared is not None:
        (tmp_path / "S" / "session.json").write_text(json.dumps(declared | {"audio_channels": 3}))
    wanted = Wanted(frozenset({"audio"}))
    (source,) = open_sources(None, f"replay:{folder}", wanted, speed=math.inf)
    pieces = np.concatenate([event.samples for event in source.events()])
    np.testing.assert_array_equal(pieces, samples[:, [heard]])


@pytest.mark.parametrize(
    ("name", "declared", "rate_hz"),
    [
        ("3/50/video.mkv", "fps_hz = 45.0\nfps_overrules = true\n", 45),
        ("clip.mkv", '[[recordings]]\nvideo = "clip.mkv"\ntexture = "silk"\nfps_hz = 120.0\n', 120),
    ],
)
def test_a_replay_has_the_rate_that_its_session_declares(
    tmp_path, make_video, name, declared, rate_hz
):
    clip = tmp_path / "S" / name
    clip.parent.mkdir(parents=True)
    make_video(clip, np.zeros(12))
    (tmp_path / "S" / "session.toml").write_text(declared)
    replayed = clip.parent if clip.name == "video.mkv" else clip
    wanted = Wanted(frozenset({"video"}))
    (source,) = open_sources(f"replay:{replayed}", None, wanted, speed=math.inf)
    times_s = [event.time_s for event in source.events()]
    np.testing.assert_allclose(np.diff(times_s), 1 / rate_hz, atol=1e-6)
    assert (len(times_s), source.rate_hz) == (12, rate_hz)


def test_what_can_t_be_looked_at_is_said_in_a_sentence(fails, session, make_video, tmp_path):
    clip = session / "2" / "40" / "video.mp4"
    small = tmp_path / "small.toml"
    small.write_text(f"width = 320\nheight = 240\n{SENSOR}")
    bare = make_video(tmp_path / "bare.mp4", np.zeros(12), covered=[range(361)] * 12)
    for asked, sentence in (
        ((), "--video: expected a source to look at"),
        (("--video", "no.avi"), "camera:0, replay:SESSION/3/50, a video file, rig or rig:g/50"),
        (("--video", clip, "--sensor", "hex331"), "331 markers of the sensor's layout"),
        (("--video", clip, "--sensor", small), "320 x 240 px, as sensor 'small' says, found 640 x"),
        (("--video", clip, "--sensor", "no.toml"), "no.toml"),
        (("--video", bare), "bare.mp4: expected at least 6 bright or dark blobs"),
        (("--video", clip, "--fps", -1), "--fps: expected frames a second, above 0"),
        (
            ("--video", clip, "--sensor", "tip_b", "--model", "m.onnx"),
            "--sensor: expected none with --model, which carries its own",
        ),
        (("--video", clip, "--model", "demo"), "sources of the simulated rig"),
    ):
        assert sentence in fails("live", *asked)


SENSOR = """
name = "small"
layout = "square"
rows = 19
columns = 19
n_markers = 361
[detector]
radius_px = 6.5
"""


def test_the_rig_s_own_fingertip_is_known():
    assert find_sensor("rig:g/50") == load_sensor("tip_b")
    assert find_sensor("rig", load_sensor("hex127")) == load_sensor("hex127")
    assert find_sensor("camera:0") is None
    assert find_sensor(None) is None


def test_the_page_tells_what_is_lost_from_what_was_never_there():
    """On a grid of nine one is lost and one was never there; of a hexagon the middle is lost."""
    detected = np.arange(8) != 3
    row, column = np.delete(np.indices((3, 3)).reshape(2, -1), 8, axis=1)
    values = np.arange(8, dtype=np.float32)[np.newaxis]
    grid = Grid(row, column, 0.0)
    felt = filled({SA1: values}, np.zeros((8, 2)), detected, grid)
    assert draw_image(felt, SA1) == [[0, 1, 2], [LOST, 4, 5], [6, 7, None]]
    places = np.array(load_sensor("hex127").markers, float)
    row, column = image_places(places)
    middle = np.argmin(np.hypot(*(places - places.mean(axis=0)).T))
    detected = np.arange(len(places)) != middle
    markers = {SA1: np.ones((1, len(places)), np.float32)}
    felt = filled(markers, places, detected, Grid(row, column, 0.0))
    drawn = np.array(draw_image(felt, SA1), float)
    assert np.array_equal(np.isnan(drawn), ~covered(row, column))
    n_lost = np.count_nonzero(drawn == LOST)
    assert n_lost == 1
    assert np.count_nonzero(drawn == 1) == covered(row, column).sum() - n_lost


@pytest.mark.parametrize("rate_hz", [FPS, FPS * 140 / 180])  # or the average of what is left
@pytest.mark.parametrize("lost", ["singles", "bursts"])
def test_lost_frames_are_counted_by_the_times_of_the_others(squares, lost, rate_hz):
    missing = {
        "singles": set(np.random.default_rng(1).choice(range(20, 179), 40, False).tolist()),
        "bursts": {first + n for first in (40, 70, 100, 140) for n in range(10)},
    }[lost]
    still = squares[0.0]
    seen = [CameraFrame(Frame(n / FPS, still), 0.0) for n in range(180) if n not in missing]
    pipeline = LivePipeline.without_models([Played(seen, rate_hz=rate_hz)])
    last = list(run([Played(seen, rate_hz=rate_hz)], pipeline))[-1]
    assert (last.counters.frames, last.counters.dropped) == (140, 40)


@pytest.mark.parametrize("offset_s", [math.inf, -math.inf, math.nan])
def test_an_offset_of_the_clocks_that_is_no_number_is_refused(moving, offset_s):
    with pytest.raises(InputError, match="--audio-offset-ms: expected a number of ms, found"):
        LivePipeline.without_models([Played(pictures(moving))], audio_offset_s=offset_s)


def test_images_are_played_at_the_rate_that_is_given(moving, tmp_path):
    for number, image in enumerate(moving[:12]):
        cv2.imwrite(str(tmp_path / f"{number:03}.png"), image)
    with pytest.raises(InputError, match="the rate at which the images were taken, found neither"):
        find_sensor(str(tmp_path))
    sensor = find_sensor(str(tmp_path), fps_hz=10.0)
    (source,) = open_sources(str(tmp_path), None, Wanted(), math.inf, fps_hz=10.0)
    assert source.rate_hz == 10
    pipeline = LivePipeline.without_models([source], sensor)
    assert [p.time_s for p in run([source], pipeline)][-1] == pytest.approx(12 / 10)
