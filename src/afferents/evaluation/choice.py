"""Refusing options that would do nothing for any of the models asked for."""

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from typing import Any

from afferents import dims
from afferents.choices import Cut
from afferents.encodings.base import SignalInfo
from afferents.encodings.settings import Encodings
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, recordings_in
from afferents.evaluation.encode import (
    encode,
    parts_of,
    require_for,
    require_speeds_known,
    require_used,
    sources_of,
)
from afferents.evaluation.options import EvaluationOptions, TrainingOptions
from afferents.folds.corruption import Corruption
from afferents.models.base import Solved
from afferents.models.classifiers import get_classifier
from afferents.models.fitted import require_buildable
from afferents.models.fitting import choose_recipe, learns_in_a_loop
from afferents.models.model import MODELS, Model
from afferents.progress import Progress
from afferents.store.responses import Responses, speed_of, steady_s
from afferents.store.trimming import cut_audio, with_steady


def require_options(
    models: Sequence[Model],
    encodings: Encodings,
    recordings: Sequence[Responses],
    options: TrainingOptions,
) -> None:
    """Refuse what would do nothing for any of the models, or tell one what it must not know.

    Raises
    ------
    InputError
        Naming the option.
    """
    require_used(models, encodings)
    corruptions = {"--disturb-training": options.disturb_training}
    if isinstance(options, EvaluationOptions):
        corruptions = {"--disturb": options.disturb} | corruptions
        if options.penalty == "searched":
            require_for("--penalty", _has_penalty, models)
    for option, one in corruptions.items():
        if one:
            require_for(f"{option} {one}", partial(_notices, one, encodings), models)
    if changed := options.recipe.changed:
        require_for(
            f"--recipe for {', '.join(changed)}", partial(_learns_as, changed, encodings), models
        )
    check_speed_leak(models, encodings)
    require_speeds_known(models, encodings, recordings)


def _notices(corruption: Corruption, encodings: Encodings, model: Model) -> bool:
    hears = [source.encoding.of_vibration for source in sources_of(model, encodings)]
    return bool(corruption.sound and any(hears)) or (corruption.of_markers and not all(hears))


def _has_penalty(model: Model) -> bool:
    kind = get_classifier(model.classifier)
    if issubclass(kind, Solved):
        return bool(kind.searched) or len(kind.penalties) > 1
    return any(_has_penalty(MODELS[name]) for name in model.parts)


def _learns_as(networks: Collection[str], encodings: Encodings, model: Model) -> bool:
    of_network = learns_in_a_loop(model)
    return of_network and choose_recipe(model, encodings.of(model.encoding)) in networks


def check_speed_leak(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse lines that follow the speed where a model is not told it.

    They would be cut out where the recording's true speed puts them, and so tell it.

    Raises
    ------
    InputError
        Naming the model.
    """
    for model in models:
        for part, source in zip(parts_of(model), sources_of(model, encodings), strict=True):
            if source.encoding.needs_speed and part.speed_from != "robot":
                told = [name for name, one in MODELS.items() if one.speed_from == "robot"]
                raise InputError(
                    "--mask: expected lines in Hz alone, or models that are told the speed "
                    f"({', '.join(told)}), found lines in /mm for {model.name}, which would be "
                    "told by where they lie; leave out the lines in /mm"
                )


# Encodings that suit data: chosen before anything is trained, said, and refused if they can't.

_FULL_SCALE = "full scale"


def encodings_for(
    data: Sequence[OpenedData],
    cut: Cut,
    wanted: Mapping[str, Any],
    steady: tuple[float, float] | None = None,
    recordings: Sequence[Responses] | None = None,
) -> Encodings:
    """Return how samples are made of data, with what a user wants.

    Options that nobody gives are chosen where the data set leaves that to us: by the speeds and
    lengths of `recordings`, those of the data that are used (None for all).

    Raises
    ------
    InputError
        If an encoding can't have an option.
    """
    first = data[0].origin
    used = with_steady(recordings_in(data) if recordings is None else recordings, steady)
    known = known_of(used, cut) if first.data_set.chooses_encodings else None
    suited = Encodings.suiting(first.data_set.encodings, first.source, known, wanted)
    return suited.changed(**wanted)


def known_of(recordings: Sequence[Responses], cut: Cut) -> SignalInfo | None:
    """Return what is known of the vibration of recordings; None if there is none to learn from."""
    used = [(r, length_s) for r in recordings if (length_s := _seconds_kept(r, cut))]
    if not used:
        return None
    lengths_s = [length_s for _, length_s in used]
    slid = [(v, v * length_s) for r, length_s in used if (v := speed_of(r)) is not None]
    # Where no speed is known, encodings that need one are refused, whatever is chosen for them.
    speeds, ways_mm = zip(*slid, strict=True) if slid else ((1.0,), (1.0,))
    vibration = used[0][0][dims.RA2]
    return SignalInfo(
        float(vibration.attrs[dims.SAMPLE_RATE]),
        min(lengths_s),
        max(lengths_s),
        min(speeds),
        max(speeds),
        min(ways_mm),
        vibration.sizes[dims.CHANNEL],
        vibration.attrs.get(dims.UNITS) == _FULL_SCALE,
    )


def _seconds_kept(responses: Responses, cut: Cut) -> float:
    """Return what the cut leaves of a recording's vibration, s; 0 of none.

    One that is too short for the cut is refused later.
    """
    if dims.RA2 not in responses:
        return 0.0
    vibration = responses[dims.RA2]
    n, rate = vibration.sizes[dims.AUDIO_TIME], float(vibration.attrs[dims.SAMPLE_RATE])
    try:
        kept = cut_audio(n, rate, cut, steady_s(responses), responses.attrs["name"])
    except InputError:
        return 0.0
    return float(kept.stop - kept.start) / rate


def say_choice(
    data: Sequence[OpenedData], models: Sequence[Model], encodings: Encodings, progress: Progress
) -> None:
    """Say what clocks rest on, and which options of encodings were chosen where we choose."""
    for data_set in (one.origin.data_set for one in data if one.origin.data_set.chooses_encodings):
        for sentence in data_set.describe(data_set.scan()):
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
