"""Models and sources that do not go together: one sentence each."""

import json
import math

import numpy as np
import onnx
import pytest
import soundfile

from afferents.errors import InputError
from afferents.lab.devices import SampleClock
from afferents.lab.live import (
    LivePipeline,
    Microphone,
    Network,
    Pace,
    ReplayedSound,
    ReplayedVideo,
    open_sources,
    stream,
)
from afferents.lab.live.streams import JUMP_S
from afferents.models.card import METADATA
from afferents.recordings.audio import WavFile
from afferents.recordings.data_sets import read_session

from .conftest import pipeline_of


def changed(path, out, **fields):
    """The model with other fields in its card; a field that is None is left out."""
    model = onnx.load(str(path))
    card = json.loads(next(p.value for p in model.metadata_props if p.key == METADATA))
    card = {k: v for k, v in {**card, **fields}.items() if v is not None}
    onnx.helper.set_model_props(model, {METADATA: json.dumps(card)})
    onnx.save(model, str(out))
    return out


def by_hand(out, metadata=None):
    """A graph that somebody made: one input, passed on."""
    x, y = (
        onnx.helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1, 3])
        for name in ("x", "y")
    )
    graph = onnx.helper.make_graph([onnx.helper.make_node("Identity", ["x"], ["y"])], "g", [x], [y])
    model = onnx.helper.make_model(graph, opset_imports=[onnx.helper.make_opsetid("", 18)])
    model.ir_version = 9
    if metadata:
        onnx.helper.set_model_props(model, metadata)
    onnx.save(model, str(out))
    return out


def refused(path, sentence):
    with pytest.raises(InputError, match=sentence):
        Network(path)


def test_files_that_are_no_models(tmp_path, models):
    refused(tmp_path / "none.onnx", "none.onnx: expected a model's ONNX file, found no such file")
    refused(models["ra-ste"].with_suffix(""), "found a folder; run 'afferents export' on it first")
    (tmp_path / "cut.onnx").write_bytes(models["ra-ste"].read_bytes()[:9000])
    refused(tmp_path / "cut.onnx", "a model's ONNX file, found .*protobuf")
    refused(by_hand(tmp_path / "hand.onnx"), "with the metadata 'afferents', found one without")


def test_models_whose_card_is_not_theirs(tmp_path, models):
    good, out = models["ra-ste"], tmp_path / "m.onnx"
    card = Network(good).card.model_dump_json()
    refused(by_hand(out, {METADATA: card}), r"the input sample \(1, 10, 19, 19\) and the outputs")
    refused(by_hand(out, {METADATA: "{"}), "the card of a model as 'afferents train' writes it")
    refused(changed(good, out, shape=[10, 9, 9]), r"the input image \(1, 9, 9\)")
    refused(changed(good, out, textures=["1", "2"]), r"probabilities \(1, 2\), as its card says")
    mine = {"model": "mine", "own": True}
    refused(changed(good, out, **mine, encoding={"name": "tea"}), "one of the encodings spatial")
    refused(changed(good, out, **mine, channel="sa9"), "a Channel, or one of sa1, ")


def test_models_that_do_not_go_together(tmp_path, models):
    with pytest.raises(InputError, match="--model: expected at least one model, found none"):
        LivePipeline.with_models([])
    with pytest.raises(InputError, match="expected each model once, found several of sa-se"):
        LivePipeline.with_models([Network(models["sa-se"]), Network(models["sa-se"])])
    sensor = {**Network(models["ra-ste"]).card.sensor, "name": "another"}
    other = Network(changed(models["ra-ste"], tmp_path / "o.onnx", sensor=sensor))
    with pytest.raises(InputError, match=r"o.onnx: expected the sensor and frame rate of .*sa-se"):
        LivePipeline.with_models([Network(models["sa-se"]), other])
    fields = {"sample_rate_hz": 4000, "model": "vib-te"}
    slower = Network(changed(models["vib-te-aug"], tmp_path / "s.onnx", **fields))
    with pytest.raises(InputError, match=r"s.onnx: expected the sample rate and spectra of"):
        LivePipeline.with_models([Network(models["vib-te-aug"]), slower])
    free = {**sensor, "layout": "free", "rows": None, "columns": None}
    with pytest.raises(InputError, match="where the markers are, found a free layout without"):
        LivePipeline.with_models(
            [Network(changed(models["ra-ste"], tmp_path / "f.onnx", sensor=free))]
        )


def test_sources_that_do_not_go_with_the_models(session, tmp_path, models):
    recording = read_session(session).recordings[0]
    with pytest.raises(InputError, match="--video: expected one source for sa-se, found none"):
        next(stream([], [models["sa-se"]]))
    soundfile.write(tmp_path / "a.wav", np.zeros((9000, 2)), 16_000)
    sound = ReplayedSound(WavFile(tmp_path / "a.wav"), Pace(math.inf))
    with pytest.raises(InputError, match="--audio: expected 8000 Hz, as the model learnt from"):
        next(stream([sound], [models["vib-te-aug"]]))
    fast = changed(models["sa-se"], tmp_path / "fast.onnx", fps_hz=120)
    video = ReplayedVideo(recording.video, Pace(math.inf))
    with pytest.raises(InputError, match=r"--video: expected 120 frames/s, as .* found 90"):
        next(stream([video], [fast]))
    soundfile.write(tmp_path / "mono.wav", np.zeros(9000), 8000)
    with pytest.raises(InputError, match="the sensor on channel 2, found 1 channel"):
        ReplayedSound(WavFile(tmp_path / "mono.wav"), Pace(1))


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (
            {"video": "film:x"},
            "--video: expected camera:0, replay:SESSION/3/50, a video file, rig or rig:g/50",
        ),
        ({"audio": "ear:0"}, "--audio: expected mic:default"),
        ({"video": "camera:99"}, "camera /dev/video99: expected a camera that is plugged in"),
        ({"video": "camera:0", "exposure_ms": math.nan}, "exposure_ms: less than or equal to"),
        ({"video": "replay:nowhere"}, "nowhere: expected a recording to replay"),
        ({"video": "rig:z"}, "a letter from a to m"),
        ({"video": "rig:g/fast"}, "rig:TEXTURE/SPEED"),
        ({"video": "rig:g/900"}, "a speed above 0 and up to 500 mm/s"),
        ({"video": "replay:x", "speed": 0}, "--speed: expected a factor above 0"),
    ],
)
def test_sources_that_are_not_there(models, asked, sentence):
    pipeline = pipeline_of(models, "sa-se", "vib-te-aug")
    with pytest.raises(InputError, match=sentence):
        open_sources(**{"video": None, "audio": None, **asked}, wanted=pipeline.wanted)


def test_a_microphone_that_is_not_there():
    """Without the PortAudio library, or with it but no device: either is one sentence."""
    with pytest.raises(InputError, match="microphone"):
        Microphone("nobody's microphone", 44_100)
    with pytest.raises(InputError, match=r"rate_hz: greater than or equal to 1000, found 200\.0"):
        Microphone("default", 200.0)  # as of a model of taxels


def test_samples_are_counted_after_the_converter_s_clock(rng):
    """A converter that stamps to 2 ms only, and is fast by 5e-5: times stay even and follow."""
    clock, n, rate = SampleClock(44_100), 441, 44_100 * (1 + 5e-5)
    true = np.arange(6000) * n / rate
    stamps = true + rng.uniform(-1e-3, 1e-3, len(true))
    read = np.array([clock.read(n, s) for s in stamps])
    steps = np.diff(read)
    np.testing.assert_allclose(steps[100:], 0.01, atol=5e-5)
    off = read - true
    assert np.ptp(off[500:]) < 1e-3


def test_a_sound_server_s_stamps_are_no_loss(rng):
    """The first comes 0.14 s early, and one in five up to 60 ms late."""
    clock = SampleClock(44_100)
    late = np.where(rng.random(600) < 0.2, rng.uniform(0, 0.06, 600), 0)
    late[0] = -0.14
    steps = np.diff([clock.read(441, t) for t in 0.01 * np.arange(600) + late])
    np.testing.assert_allclose(steps, 0.01, atol=JUMP_S)


def test_samples_that_were_lost_without_a_word_are_a_gap():
    clock, n = SampleClock(44_100), 441
    times = [0.01 * i + (0.25 if i >= 30 else 0) for i in range(60)]
    steps = np.diff([clock.read(n, t) for t in times])
    assert steps[29] == pytest.approx(0.26, abs=2e-3)
    np.testing.assert_allclose(np.delete(steps, 29), 0.01, atol=1e-3)
