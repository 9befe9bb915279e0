"""Percepts over the Lab Streaming Layer, as another program gets them."""

import json
import math
import os
from pathlib import Path

os.environ.setdefault("LSLAPICFG", str(Path(__file__).with_name("lsl_api.cfg")))  # this machine

import pylsl

from afferents.live import Network, Percept
from afferents.live.lsl import published


def test_another_program_gets_probabilities_and_percepts(models):
    network = Network(models["sa-se"])
    names = network.card.textures
    felt = dict(zip(names, (0.7, 0.2, 0.1), strict=True))
    even = dict.fromkeys(names, 1 / 3)
    percepts = [
        Percept("sa-se", "texture", 1.0, texture="1", probabilities=felt, evidence=felt),
        Percept("sa-se", "stalled", 1.0, evidence=even, troubles=("camera: lost",)),
    ]
    stream = published(iter([percepts[0], *percepts]), [network])
    next(stream)  # opens the outlets
    inlets = {}
    for kind in ("Touch", "Markers"):
        (info,) = pylsl.resolve_byprop("type", kind, timeout=10)
        inlets[kind] = pylsl.StreamInlet(info)
        inlets[kind].open_stream(timeout=10)
    channel = inlets["Touch"].info(timeout=10).desc().child("channels").child("channel")
    assert channel.child_value("label") == "1"
    assert next(stream) is percepts[0]
    numbers, _ = inlets["Touch"].pull_sample(timeout=10)
    assert [round(n, 4) for n in numbers] == [0.7, 0.2, 0.1]
    words, _ = inlets["Markers"].pull_sample(timeout=10)
    assert json.loads(words[0])["texture"] == "1"
    assert next(stream) is percepts[1]
    numbers, _ = inlets["Touch"].pull_sample(timeout=10)
    assert all(math.isnan(n) for n in numbers)
    words, _ = inlets["Markers"].pull_sample(timeout=10)
    assert json.loads(words[0])["fresh"] is False
