"""Percepts as Lab Streaming Layer outlets, for recording beside everything else in a lab."""

import json
from collections.abc import Iterable, Iterator

from afferents.core.errors import InputError
from afferents.live.network import Network
from afferents.live.percept import Percept

PROBABILITIES, MESSAGES = "afferents probabilities", "afferents percepts"


def published(percepts: Iterable[Percept], networks: Iterable[Network]) -> Iterator[Percept]:
    """Pass percepts on, and give them out by LSL.

    Two outlets a model: its probabilities, one channel a texture (NaN where nothing fresh is
    known), and every percept as JSON.

    Raises
    ------
    InputError
        If pylsl or the LSL library is missing.
    """
    try:
        import pylsl
    except (ImportError, RuntimeError, OSError) as error:
        raise InputError(
            "--lsl", "pylsl and the LSL library", str(error).splitlines()[0],
            "pip install 'afferents[lsl]'",
        ) from error  # fmt: skip
    outlets = {}
    for network in networks:
        card, source = network.card, f"afferents-{network.card.model}"
        numbers = pylsl.StreamInfo(
            f"{PROBABILITIES} {card.model}", "Touch", len(card.textures), 0, "float32", source
        )
        channels = numbers.desc().append_child("channels")
        for texture in card.textures:
            channels.append_child("channel").append_child_value("label", texture)
        words = pylsl.StreamInfo(
            f"{MESSAGES} {card.model}", "Markers", 1, 0, "string", f"{source}-json"
        )
        outlets[card.model] = pylsl.StreamOutlet(numbers), pylsl.StreamOutlet(words)
    for percept in percepts:
        numbers_out, words_out = outlets[percept.model]
        nothing = float("nan")
        numbers_out.push_sample([percept.probabilities.get(t, nothing) for t in percept.evidence])
        words_out.push_sample([json.dumps(percept.to_dict())])
        yield percept
