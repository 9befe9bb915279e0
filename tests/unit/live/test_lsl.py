"""Percepts over the Lab Streaming Layer, as another program gets them."""

import json
import math
import os
from pathlib import Path

os.environ.setdefault("LSLAPICFG", str(Path(__file__).with_name("lsl_api.cfg")))  # this machine

import pylsl

from afferents.live import Network, Prediction
from afferents.live.outlets import publish


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


def test_who_looks_without_a_model_gives_percepts_and_no_probabilities():
    looked = Prediction("camera", "looking", 1.0, markers_found=1.0)
    stream = publish(iter([looked, looked]), {"camera": ()})
    next(stream)
    (info,) = pylsl.resolve_byprop("source_id", "afferents-camera-json", timeout=60)
    inlet = pylsl.StreamInlet(info)
    inlet.open_stream(timeout=60)
    assert next(stream) is looked
    words, _ = inlet.pull_sample(timeout=60)
    assert json.loads(words[0])["markers_found"] == 1
    assert not pylsl.resolve_byprop("source_id", "afferents-camera", timeout=0.2)
