"""Encodings that suit data: chosen before anything is trained, said, and refused if they can't."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from afferents.core import dims
from afferents.core.cut import Cut, cut_audio
from afferents.core.errors import InputError
from afferents.core.model import Model
from afferents.core.progress import Progress
from afferents.core.responses import Responses, speed_of, steady_s
from afferents.encodings import Encodings, Known
from afferents.pipeline.data import OpenedData, recordings_in
from afferents.pipeline.encode import encode, sources_of
from afferents.training import require_buildable

_FULL_SCALE = "full scale"


def encodings_for(data: Sequence[OpenedData], cut: Cut, wanted: Mapping[str, Any]) -> Encodings:
    """Return how samples are made of data, with what a user wants.

    Options that nobody gives are chosen where the data set leaves that to us.

    Raises
    ------
    InputError
        If an encoding can't have an option.
    """
    first = data[0].origin
    known = known_of(recordings_in(data), cut) if first.data_set.chooses_encodings else None
    suited = Encodings.suiting(first.data_set.encodings, first.source, known, wanted)
    return suited.changed(**wanted)


def known_of(recordings: Sequence[Responses], cut: Cut) -> Known | None:
    """Return what is known of the vibration of recordings; None if there is none to learn from."""
    lengths = dict(_lengths(recordings, cut))
    if not lengths:
        return None
    used = [r for r in recordings if r.attrs["name"] in lengths]
    slid = [(v, v * lengths[r.attrs["name"]]) for r in used if (v := speed_of(r)) is not None]
    # Where no speed is known, encodings that need one are refused, whatever is chosen for them.
    speeds, ways_mm = zip(*slid, strict=True) if slid else ((1.0,), (1.0,))
    vibration = used[0][dims.RA2]
    return Known(
        float(vibration.attrs[dims.SAMPLE_RATE]),
        min(lengths.values()),
        max(lengths.values()),
        min(speeds),
        max(speeds),
        min(ways_mm),
        vibration.sizes[dims.CHANNEL],
        vibration.attrs.get(dims.UNITS) == _FULL_SCALE,
    )


def _lengths(recordings: Sequence[Responses], cut: Cut) -> Iterator[tuple[str, float]]:
    """Yield what the cut leaves of each recording, s; those too short for it are refused later."""
    for responses in recordings:
        name = responses.attrs["name"]
        if dims.RA2 not in responses:
            continue
        vibration = responses[dims.RA2]
        rate = float(vibration.attrs[dims.SAMPLE_RATE])
        try:
            n = vibration.sizes[dims.AUDIO_TIME]
            kept = cut_audio(n, rate, cut, steady_s(responses), name)
        except InputError:
            continue
        yield name, (kept.stop - kept.start) / rate


def say_choice(
    data: Sequence[OpenedData], models: Sequence[Model], encodings: Encodings, progress: Progress
) -> None:
    """Say what clocks rest on, and which options of encodings were chosen where we choose."""
    for data_set in (one.origin.data_set for one in data if one.origin.data_set.chooses_encodings):
        for sentence in data_set.describe(data_set.recordings()):
            progress.note(sentence)
    if not data[0].origin.data_set.chooses_encodings:
        return
    sources = (source for model in models for source in sources_of(model, encodings))
    for encoding in dict.fromkeys(source.encoding for source in sources):
        default = type(encoding)()
        own = {n: v for n, v in encoding if v != getattr(default, n)}
        said = ", ".join(f"{name} = {_said(value)}" for name, value in own.items())
        progress.note(f"{encoding.name}: {said or 'the usual options'}")


def _said(value: Any) -> str:
    if value is None:
        return "whole recordings"
    return f"{value:.4g}" if isinstance(value, float) else str(value).lower()


def require_trainable(
    models: Sequence[Model], recordings: Sequence[Responses], encodings: Encodings, cut: Cut
) -> None:
    """Refuse models of vibration that can't be built for the samples there will be.

    Raises
    ------
    InputError
        Naming what is too few or too many, before anything is trained.
    """
    for model in models:
        sources = sources_of(model, encodings)
        if len(sources) == 1 and sources[0].encoding.of_vibration and recordings:
            samples = encode(recordings[0], sources[0], cut)
            require_buildable(model, samples, sources[0].encoding)
