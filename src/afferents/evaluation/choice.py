"""Refusing options that would do nothing for any of the models asked for."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from afferents import dims
from afferents.choices import Cut, Penalty
from afferents.encodings.base import SignalInfo
from afferents.encodings.settings import Encodings
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, recordings_in
from afferents.evaluation.encode import encode, sources_of
from afferents.folds.corruption import Corruptions
from afferents.models.base import Solved
from afferents.models.classifiers import classifier_of
from afferents.models.config import Hyperparameters
from afferents.models.fitted import require_buildable
from afferents.models.fitting import learns_in_a_loop, recipe_of
from afferents.models.model import MODELS, Model
from afferents.progress import Progress
from afferents.store.responses import Responses, speed_of, steady_s
from afferents.store.trimming import cut_audio


def require_options(
    models: Sequence[Model],
    encodings: Encodings,
    corruptions: Corruptions,
    hyperparameters: Hyperparameters,
    penalty: Penalty = "fixed",
) -> None:
    """Refuse what would do nothing, or tell a model what it must not know.

    Raises
    ------
    InputError
        Naming the option.
    """
    require_corrupted(models, encodings, corruptions)
    require_searched(models, penalty)
    check_speed_leak(models, encodings)
    require_trained_so(models, encodings, hyperparameters)


def require_corrupted(
    models: Sequence[Model], encodings: Encodings, corruptions: Corruptions
) -> None:
    """Refuse corruptions that none of the models asked for would notice.

    Raises
    ------
    InputError
        Naming the option.
    """
    sources = [source for model in models for source in sources_of(model, encodings)]
    hears = any(source.encoding.of_vibration for source in sources)
    sees = any(not source.encoding.of_vibration for source in sources)
    options = [("--disturb", one) for one in corruptions.tests]
    for option, one in [*options, ("--disturb-training", corruptions.training)]:
        if one and not ((one.sound and hears) or (one.of_markers and sees)):
            names = ", ".join(model.name for model in models)
            raise InputError(
                f"{option}: expected models that notice {one}, found {names}; leave it out"
            )


def require_searched(models: Sequence[Model], penalty: Penalty) -> None:
    """Refuse to choose penalties where no model has one to choose.

    Raises
    ------
    InputError
        Naming the models.
    """
    if penalty == "searched" and not any(_has_penalty(model) for model in models):
        able = ", ".join(name for name, model in MODELS.items() if _has_penalty(model))
        names = ", ".join(model.name for model in models)
        raise InputError(
            f"--penalty: expected models that have one ({able}), found {names}; leave it out"
        )


def _has_penalty(model: Model) -> bool:
    kind = classifier_of(model.classifier)
    if issubclass(kind, Solved):
        return bool(kind.searched) or len(kind.penalties) > 1
    return any(_has_penalty(MODELS[name]) for name in model.parts)


def require_trained_so(
    models: Sequence[Model], encodings: Encodings, hyperparameters: Hyperparameters
) -> None:
    """Refuse hyperparameters of networks that none of the models asked for is.

    Raises
    ------
    InputError
        Naming the models.
    """
    if not hyperparameters.changed:
        return
    parts = (p for model in models for p in ([model] if learns_in_a_loop(model) else _parts(model)))
    learnt = [part for part in parts if learns_in_a_loop(part)]
    used = {recipe_of(part, encodings.of(part.encoding)) for part in learnt}
    if not used & set(hyperparameters.changed):
        networks = ", ".join(hyperparameters.changed)
        names = ", ".join(model.name for model in models)
        raise InputError(
            f"--recipe: expected models that learn as {networks}, found {names}; leave it out"
        )


def check_speed_leak(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse lines that follow the speed where a model is not told it.

    They would be cut out where the recording's true speed puts them, and so tell it.

    Raises
    ------
    InputError
        Naming the model.
    """
    for model in models:
        for part in _parts(model):
            (source,) = sources_of(part, encodings)
            if source.encoding.needs_speed and part.speed_from != "robot":
                told = [name for name, one in MODELS.items() if one.speed_from == "robot"]
                raise InputError(
                    "--mask: expected lines in Hz alone, or models that are told the speed "
                    f"({', '.join(told)}), found lines in /mm for {model.name}, which would be "
                    "told by where they lie; leave out the lines in /mm"
                )


def _parts(model: Model) -> list[Model]:
    """Return the models that a fusion is made of, or the model itself."""
    return [part for name in model.parts for part in _parts(MODELS[name])] or [model]


# Encodings that suit data: chosen before anything is trained, said, and refused if they can't.

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


def known_of(recordings: Sequence[Responses], cut: Cut) -> SignalInfo | None:
    """Return what is known of the vibration of recordings; None if there is none to learn from."""
    lengths = dict(_lengths(recordings, cut))
    if not lengths:
        return None
    used = [r for r in recordings if r.attrs["name"] in lengths]
    slid = [(v, v * lengths[r.attrs["name"]]) for r in used if (v := speed_of(r)) is not None]
    # Where no speed is known, encodings that need one are refused, whatever is chosen for them.
    speeds, ways_mm = zip(*slid, strict=True) if slid else ((1.0,), (1.0,))
    vibration = used[0][dims.RA2]
    return SignalInfo(
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
