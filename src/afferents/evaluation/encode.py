"""From the responses of all recordings to the samples of one encoding."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr

from afferents import dims
from afferents.channels import Channel, channel_of
from afferents.choices import Cut
from afferents.encodings.base import Encoding
from afferents.encodings.samples import Samples, concatenate
from afferents.encodings.settings import Encodings, options
from afferents.encodings.windows import add_distance
from afferents.errors import InputError, then
from afferents.filling import fill
from afferents.folds.ablation import Ablation
from afferents.folds.corruption import Corruption, corrupted
from afferents.models.base import Solved
from afferents.models.classifiers import get_classifier
from afferents.models.fusion import LateFusion
from afferents.models.model import BEST, MODELS, OF_CELLS, Model, pick_own
from afferents.parallel import side_by_side_numbered
from afferents.progress import Progress
from afferents.store.motion import Series, has_speed, speed_along
from afferents.store.responses import Responses, labelled, read_whole

_SAME_RATE = 0.05
"""Frame rates may differ by this share: clocks of cameras do, and frames are dropped."""


class Source(NamedTuple):
    """What samples are made of, and how."""

    channel: Channel
    encoding: Encoding


def parts_of(model: Model) -> list[Model]:
    """Return the models that a fusion is made of, or the model itself."""
    return [MODELS[name] for name in model.parts] or [model]


def sources_of(model: Model, encodings: Encodings) -> tuple[Source, ...]:
    """Return what a model's samples are made of; a fusion has several kinds."""
    return tuple(
        Source(channel_of(part.channel), encodings.of(part.encoding)) for part in parts_of(model)
    )


def has(responses: Responses, source: Source) -> bool:
    """Tell whether a recording has what samples are made of, and in a form that can be encoded.

    Encodings are for sound, for markers, or for the skin as a whole.
    """
    channel, encoding = source
    if channel.made_of not in responses:
        return False
    is_sound = dims.AUDIO_TIME in responses[channel.made_of].dims
    if is_sound != encoding.of_vibration:
        return False
    if not is_sound and channel.parts and getattr(encoding, "of_pixels", False):
        return False
    return encoding.suits(responses)


def lacking(model: Model, recordings: Sequence[Responses]) -> str:
    """Return what the first recording lacks that a model can't learn from; empty if all can do."""
    sources = sources_of(model, Encodings())
    between_channels = model.speed_from == "fingertip"
    needed = f"{' and '.join(source.channel.name for source in sources)} in the form it needs"
    if between_channels:
        needed = "several vibration channels to measure the speed between"
    moved = [source.channel.name for source in sources if source.channel.made_of == dims.POSITION]
    for responses in recordings:
        name = responses.attrs["name"]
        if moved and dims.of_cells(responses):
            return f"{name} lacks {moved[0]}: cells have no displacement"
        if _learns_speeds(model) and not has_speed(responses):
            return f"{name} lacks a speed"
        if not all(has(responses, source) for source in sources) or (
            between_channels and responses[dims.RA2].sizes[dims.CHANNEL] < 2
        ):
            return f"{name} lacks {needed}"
    return ""


def _learns_speeds(model: Model) -> bool:
    """Tell whether a model, or a part of it that learns on its own, needs to be told speeds."""
    kind = get_classifier(model.classifier)
    return kind.needs_speed or any(_learns_speeds(MODELS[name]) for name in model.parts)


def require_support(
    wanted: Sequence[Model], recordings: Sequence[Responses], may_leave_out: bool
) -> list[Model]:
    """Return the models that every recording supports.

    Parameters
    ----------
    may_leave_out
        Whether models that are not supported are left out instead of refused.

    Raises
    ------
    InputError
        If a model, or all of them, can't learn from these data; names a recording that
        lacks what it needs, and the models that are possible. If one of a user's own has a name
        that is taken, or parts that can't be joined.
    """
    for model in pick_own(wanted):
        _require_joinable(model)
    able = [model for model in wanted if not lacking(model, recordings)]
    if len(able) < len(wanted) and not (may_leave_out and able):
        refused = next(model for model in wanted if model not in able)
        possible = [name for name, model in MODELS.items() if not lacking(model, recordings)]
        raise InputError(
            f"--models: expected some that these data support ({', '.join(possible) or 'none'}), "
            f"found {refused.name}, for which {lacking(refused, recordings)}"
        )
    return able


def _require_joinable(model: Model) -> None:
    """Refuse a model with parts that can't be joined, or without what joins them."""
    kind, expected = get_classifier(model.classifier), ""
    able = [n for n, one in MODELS.items() if issubclass(get_classifier(one.classifier), Solved)]
    if bool(model.parts) != (kind is LateFusion):
        expected = "parts where the classifier is late-fusion, and only there"
        found = f"{len(model.parts)} parts with {kind.name}"
    elif unable := [part for part in model.parts if part not in able]:
        expected = f"parts that are models solved at once ({', '.join(able)})"
        found = unable[0]
    if expected:
        raise InputError(f"model '{model.name}': expected {expected}, found {found}")


def require_for(option: str, is_for: Callable[[Model], bool], models: Sequence[Model]) -> None:
    """Refuse an option that does nothing for any of the models asked for.

    Raises
    ------
    InputError
        Naming the option, and the models that it is for.
    """
    if not any(map(is_for, models)):
        able = ", ".join(name for name, model in MODELS.items() if is_for(model))
        if not able:
            expected = "an option, or a field of an encoding of the models asked for"
            raise InputError(f"{option}: expected {expected}, found neither; is it misspelt?")
        names = ", ".join(model.name for model in models)
        raise InputError(
            f"{option}: expected models that it is for ({able}), found {names}; leave it out"
        )


def require_used(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse options of encodings that do nothing for any of the models asked for."""
    every = options()
    for field, _ in encodings.wanted:
        flag = every[field].flag if field in every else field
        require_for(flag, partial(_has_field, field, encodings), models)


def _has_field(field: str, encodings: Encodings, model: Model) -> bool:
    sources = sources_of(model, encodings)
    return any(field in type(source.encoding).model_fields for source in sources)


def require_speeds_known(
    models: Sequence[Model], encodings: Encodings, recordings: Sequence[Responses]
) -> None:
    """Refuse encodings that need a speed where a recording has none.

    Raises
    ------
    InputError
        Naming the model and the recording.
    """
    unknown = [str(r.attrs["name"]) for r in recordings if not has_speed(r)]
    for model in models if unknown else ():
        if any(source.encoding.needs_speed for source in sources_of(model, encodings)):
            do = "leave the model out, or lines in /mm of its --mask"
            raise InputError(
                f"{model.name}: expected the speed of every recording, which its encoding needs, "
                f"found none of {unknown[0]}{then(do)}"
            )


def best_of(recordings: Sequence[Responses]) -> Model:
    """Return the model that is recommended for such recordings; see `BEST`.

    Raises
    ------
    InputError
        If they support none.
    """
    if name := recommended(recordings):
        return MODELS[name]
    return require_support([MODELS[BEST[0]]], recordings, may_leave_out=False)[0]


def recommended(recordings: Sequence[Responses]) -> str:
    """Return the name of the first of `BEST` that recordings support; empty where they do none."""
    able = (*BEST, OF_CELLS) if any(map(dims.of_cells, recordings)) else BEST
    return next((name for name in able if not lacking(MODELS[name], recordings)), "")


def kept_part(responses: Responses, source: Source, cut: Cut) -> slice:
    """Return what the cut keeps of a recording, after checking that it can be encoded.

    Raises
    ------
    InputError
        If the recording is too short for the cut, a window or a run of frames.
    """
    channel, encoding = source
    return encoding.kept(responses, channel.made_of, channel.lookback, cut)


def encode(
    responses: Responses,
    source: Source,
    cut: Cut,
    ablation: Ablation | None = None,
    corruption: Corruption | None = None,
) -> Samples:
    """Encode one recording; see `kept_part` for what it refuses.

    Windows never cross recordings, since each is encoded alone.

    Parameters
    ----------
    ablation
        Says which markers are used; None for all.
    corruption
        What corrupts the recording first; None for nothing.
    """
    if corruption is not None:
        responses = corrupted(responses, source.encoding.of_vibration, corruption)
    kept = kept_part(responses, source, cut)
    response = response_of(responses, source)
    if ablation is not None:
        response = ablation.shown(response)
    series = speed_along(responses)
    if series is not None and source.encoding.by_distance:
        response = add_distance(response, series)
    samples = source.encoding.samples(response, kept, source.channel.lookback)
    return samples if series is None else with_speeds(samples, series)


def response_of(responses: Responses, source: Source) -> xr.DataArray:
    """Return what is encoded, of the frames that the encoding uses, with the recording's labels.

    A response that was stored is taken as it is, if all frames are used; else it is worked out.
    Lost markers are filled from their neighbours before they become images; see `fill`.
    """
    channel, encoding = source
    if encoding.step == 1 and channel.name in responses:
        response = read_whole(responses, channel.name)
    else:
        whole = responses.assign({channel.made_of: read_whole(responses, channel.made_of)})
        used = whole.isel({dims.TIME: slice(None, None, encoding.step)}, missing_dims="ignore")
        response = labelled(channel.response(used), responses)
    return fill(response) if dims.TIME in response.dims else response


def encode_all(
    recordings: Sequence[Responses],
    source: Source,
    cut: Cut,
    progress: Progress,
    ablation: Ablation | None = None,
    corruption: Corruption | None = None,
    workers: int | None = 1,
) -> Samples:
    """Encode every recording, in so many processes, and join the samples; see `encode`.

    Raises
    ------
    InputError
        As `kept_part`; if frames of one recording follow each other faster than those of another.
    """
    _require_one_frame_rate(recordings, source)
    label = f"encoding {source.channel.name} {source.encoding.name}"
    jobs = ((responses, source, cut, ablation, corruption) for responses in recordings)
    found = side_by_side_numbered(encode, jobs, workers, progress.note)
    by_number = dict(progress.track(found, label, len(recordings)))
    in_order = [by_number[number] for number in range(len(recordings))]
    most = None if ablation is None else ablation.speed_change
    if most is not None or any(dims.MEAN_SPEED in samples.coords for samples in in_order):
        in_order = [with_own_speed(samples) for samples in in_order]
    return concatenate([steady_enough(samples, most) for samples in in_order])


def with_speeds(samples: Samples, series: Series) -> Samples:
    """Return the samples of a recording with the mean speed and the change of each.

    Those of which its series of speeds says nothing are left out.
    """
    mean, low, high = series.over(samples[dims.START].values, samples[dims.STOP].values)
    own = {dims.MEAN_SPEED: mean, dims.SPEED_CHANGE: (high - low) / mean}
    found = samples.assign_coords({name: (dims.SAMPLE, its) for name, its in own.items()})
    return found.isel({dims.SAMPLE: np.flatnonzero(mean > 0)})


def with_own_speed(samples: Samples) -> Samples:
    """Return samples that say their own speed, which of constant slides is the recording's."""
    if dims.MEAN_SPEED in samples.coords:
        return samples
    own = {dims.MEAN_SPEED: samples[dims.SPEED].values, dims.SPEED_CHANGE: np.zeros(len(samples))}
    return samples.assign_coords({name: (dims.SAMPLE, its) for name, its in own.items()})


def steady_enough(samples: Samples, most: float | None) -> Samples:
    """Return the samples whose speed changes by no more than this share of its mean.

    Raises
    ------
    InputError
        If none is left.
    """
    if most is None:
        return samples
    changes = samples[dims.SPEED_CHANGE].values
    kept = np.flatnonzero(changes <= most)
    if not len(kept):
        found = f"{changes.min():.2g} or more" if len(changes) else "none at all"
        name = samples[dims.RECORDING].values[:1]
        raise InputError(
            f"--speed-change: expected samples whose speed changes by {most:g} of its mean or less "
            f"in every recording, found {found} in {', '.join(map(str, name))}; allow more, or "
            "take shorter windows (--window-s)"
        )
    return samples.isel({dims.SAMPLE: kept})


def _require_one_frame_rate(recordings: Sequence[Responses], source: Source) -> None:
    """Refuse to mix frame rates: a change from frame to frame, or so many frames, mean others."""
    first_s: float | None = None
    for responses in recordings:
        made_of = responses[source.channel.made_of]
        if dims.TIME not in made_of.dims or len(made_of[dims.TIME]) < 2:
            continue
        period_s = float(np.median(np.diff(made_of[dims.TIME].values)))
        first_s = first_s or period_s
        if abs(period_s / first_s - 1) > _SAME_RATE:
            raise InputError(
                f"recording {responses.attrs['name']}: expected {1 / first_s:.4g} frames/s, as in "
                f"the other recordings, found {1 / period_s:.4g}; evaluate those of one frame rate "
                "together"
            )
