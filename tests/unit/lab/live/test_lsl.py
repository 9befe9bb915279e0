"""Percepts and signals over the Lab Streaming Layer, as another program gets them."""

import json
import math
import time
from dataclasses import replace

import numpy as np
import pylsl
import pytest

from afferents.lab.live import Network, Prediction
from afferents.lab.live.fingertip import stream
from afferents.lab.live.outlets import publish
from afferents.lab.live.signals import UNITS, give_signals, prepare_places


def inlet_of(source):
    (info,) = pylsl.resolve_byprop("source_id", source, timeout=60)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=60)
    return inlet


def test_another_program_gets_probabilities_and_percepts(models):
    names = Network(models["sa-se"]).card.textures
    felt = dict(zip(names, (0.7, 0.2, 0.1), strict=True))
    even = dict.fromkeys(names, 1 / 3)
    predictions = [
        Prediction("sa-se", "texture", 1.0, texture="1", probabilities=felt, evidence=felt),
        Prediction("sa-se", "stalled", 1.0, evidence=even, troubles=("camera: lost",)),
    ]
    stream = publish(iter([predictions[0], *predictions]), {"sa-se": names})
    next(stream)  # opens the outlets
    inlets = {}
    for kind in ("Touch", "Markers"):
        (info,) = pylsl.resolve_byprop("type", kind, timeout=60)
        inlets[kind] = pylsl.StreamInlet(info)
        inlets[kind].open_stream(timeout=60)
    channel = inlets["Touch"].info(timeout=60).desc().child("channels").child("channel")
    assert channel.child_value("label") == "1"
    assert next(stream) is predictions[0]
    numbers, _ = inlets["Touch"].pull_sample(timeout=60)
    assert [round(n, 4) for n in numbers] == [0.7, 0.2, 0.1]
    words, _ = inlets["Markers"].pull_sample(timeout=60)
    assert json.loads(words[0])["texture"] == "1"
    assert next(stream) is predictions[1]
    numbers, _ = inlets["Touch"].pull_sample(timeout=60)
    assert all(math.isnan(n) for n in numbers)
    words, _ = inlets["Markers"].pull_sample(timeout=60)
    assert json.loads(words[0])["fresh"] is False


def test_what_was_taught_since_has_an_outlet_of_its_own():
    before = Prediction("lessons", "looking", 1.0)
    felt = {"cork": 0.2, "felt": 0.8}
    after = Prediction("lessons", "texture", 2.0, "felt", probabilities=felt, evidence=felt)
    stream = publish(iter([before, after, after]), {"lessons": ()})
    assert next(stream) is before
    assert not pylsl.resolve_byprop("source_id", "afferents-lessons", timeout=0.2)
    next(stream)
    inlet = inlet_of("afferents-lessons")
    assert next(stream) is after
    numbers, _ = inlet.pull_sample(timeout=60)
    assert [round(n, 4) for n in numbers] == [0.2, 0.8]


def test_who_looks_without_a_model_gives_percepts_and_no_probabilities():
    looked = Prediction("camera", "looking", 1.0, markers_found=1.0)
    stream = publish(iter([looked, looked]), {"camera": ()})
    next(stream)
    inlet = inlet_of("afferents-camera-json")
    assert next(stream) is looked
    words, _ = inlet.pull_sample(timeout=60)
    assert json.loads(words[0])["markers_found"] == 1
    assert not pylsl.resolve_byprop("source_id", "afferents-camera", timeout=0.2)


class Hears:
    """Opens inlets before the first touch is sent; keeps what was sent, and what comes of it."""

    def __init__(self, header, _):
        self.header, self.touches = header, []
        self.inlets = {name: inlet_of(f"afferents-tip_b-{name}") for name in header["units"]}
        self.infos = {name: inlet.info(timeout=60) for name, inlet in self.inlets.items()}
        self.begun_s = pylsl.local_clock()

    def write(self, touch, _):
        self.touches.append(touch)

    def close(self):
        """The streams are open until then."""
        self.found = {name: ([], []) for name in self.inlets}
        for name, (samples, stamps) in self.found.items():
            n = sum(len(touch.ra2) if name == "ra2" else 1 for touch in self.touches)
            while len(samples) < n:
                sample, stamp = self.inlets[name].pull_sample(timeout=60)
                samples.append(sample)
                stamps.append(stamp)


@pytest.fixture
def heard(session):
    """What a reader gets of a clip that is sent."""
    clip, readers = session / "1/20", []

    def reads(header, first):
        readers.append(Hears(header, first))
        return readers[0]

    tip = stream(clip, clip, sensor="tip_b")
    give_signals(tip, [*UNITS], [*prepare_places(["lsl"], ()), reads])
    return readers[0]


def test_a_reader_gets_every_signal(heard):
    for name, (samples, stamps) in heard.found.items():
        sent = [getattr(touch, name) for touch in heard.touches]
        sent = np.concatenate(sent) if name == "ra2" else np.stack(sent).reshape(len(sent), -1)
        np.testing.assert_array_equal(np.array(samples, np.float32), sent)
        assert heard.begun_s < stamps[-1] < pylsl.local_clock()  # of a recording: as it is sent


def test_streams_say_what_they_hold(heard):
    rest = heard.touches[0].now.rest
    for name, info in heard.infos.items():
        rate = "sample_rate_hz" if name == "ra2" else "fps_hz"
        assert info.nominal_srate() == heard.header[rate]
        assert set(info.get_channel_units()) == {UNITS[name]}
    assert heard.infos["shear"].get_channel_labels() == heard.header["shear"]
    assert heard.infos["position"].get_channel_labels()[:3] == ["0 x", "0 y", "1 x"]
    for name, per_marker in (("sa1", 1), ("position", 2)):
        channel, places = heard.infos[name].desc().child("channels").first_child(), []
        while not channel.empty():
            at = channel.child("location")
            places.append([float(at.child_value(axis)) for axis in "XY"])
            channel = channel.next_sibling()
        np.testing.assert_allclose(places, np.repeat(rest, per_marker, axis=0), atol=6e-5)


def test_a_device_s_frames_have_their_time_by_lsl_s_clock(heard):
    (opens,) = prepare_places(["lsl"], ())
    first = replace(heard.touches[0], time_s=time.monotonic() - 5)
    streams = opens(heard.header | {"unix_ahead_s": 1e9}, first)
    reader = Hears(heard.header, first)
    for touch in (first, replace(first, time_s=first.time_s + 0.5)):
        streams.write(touch, {})
        reader.write(touch, {})
    reader.close()
    _, stamps = reader.found["sa1"]
    now_s = pylsl.local_clock() - time.monotonic()
    np.testing.assert_allclose(stamps, [t.time_s + now_s for t in reader.touches], atol=0.05)
    streams.close()
