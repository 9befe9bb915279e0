"""What models learn from: data sets opened as responses, encodings that suit them, samples."""

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from pydantic import ConfigDict, Field, SkipValidation

from afferents import channels, choices, dims, filling, parallel, plugins
from afferents.encodings.base import Encoding, SignalInfo
from afferents.encodings.samples import Samples, concatenate
from afferents.encodings.settings import Encodings
from afferents.encodings.windows import add_distance
from afferents.errors import AfferentsError, InputError
from afferents.evaluation import intervals, results
from afferents.extraction import copies, extract
from afferents.folds.ablation import Ablation
from afferents.folds.corruption import Corruption, corrupted
from afferents.folds.held_out import condition_text
from afferents.models import card
from afferents.models.model import MODELS, Model
from afferents.progress import Progress
from afferents.recordings import check, data_sets
from afferents.recordings.data_set import Data, DataSet
from afferents.store import integrity, motion, responses as store, trimming, zarr_store
from afferents.store.recording import RecordingSet, require_distinct
from afferents.store.responses import Responses, read_whole

_FULL_SCALE = "full scale"
_EVERYTHING, _AS_THEY_ARE = Ablation(), Corruption()
_SAME_RATE = 0.05
"""Frame rates may differ by this share: clocks of cameras do, and frames are dropped."""


class Origin(card.Source):
    """Where data come from and what identifies them, light enough to be sent with a job.

    Attributes
    ----------
    data_set
        With a path that any process finds, wherever it was started; no file keeps it.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    data_set: SkipValidation[DataSet] = Field(exclude=True)


@dataclass(frozen=True)
class OpenedData:
    """Responses of the recordings of one source, opened lazily.

    `failed` are the recordings that could not be read, and why.
    """

    origin: Origin
    responses: tuple[Responses, ...]
    failed: Mapping[str, str]

    @property
    def encodings(self) -> Encodings:
        """How samples are made of such data."""
        return Encodings.suiting(self.origin.data_set.encodings, self.origin.source)


def open_data(
    sources: Sequence[Data],
    without: Mapping[str, str] | None = None,
    keep_going: bool = False,
    progress: Progress | None = None,
) -> list[OpenedData]:
    """Open all sources; recordings of several are named by their source's number as well.

    Parameters
    ----------
    sources
        Extracted stores, or other data sets; see `recordings.data_sets.data_set_of`.
    without
        Recordings with one of these conditions (such as pressure F250) are left out.
    keep_going
        Whether recordings that can't be read are skipped instead of refused.

    Raises
    ------
    InputError
        If a source or (without `keep_going`) a recording can't be read, if kinds are mixed, a
        source is given twice, or nothing is left.
    """
    opened = [_open(source, keep_going, progress or Progress(quiet=True)) for source in sources]
    kinds = {data.origin.data_set.name for data in opened}
    if len(kinds) > 1:
        raise InputError(f"DATA: expected data of one kind, found {' and '.join(sorted(kinds))}")
    if len({data.origin.fingerprint for data in opened}) < len(opened):
        raise InputError("DATA: expected each repetition once, found the same recordings twice")
    if without:
        opened = _leave_out(opened, without)
    if len(opened) > 1:
        opened = [
            replace(
                data,
                responses=tuple(
                    r.assign_attrs(name=intervals.numbered(str(r.attrs["name"]), number))
                    for r in data.responses
                ),
                failed={intervals.numbered(name, number): why for name, why in data.failed.items()},
            )
            for number, data in enumerate(opened, start=1)
        ]
    _require_distinct(join_recordings(opened))
    return opened


def _open(given: Data, keep_going: bool, progress: Progress) -> OpenedData:
    """Open one source; responses that lie in a store are opened, all else is read whole."""
    source, data_set = data_sets.source_of(given), data_sets.data_set_of(given)
    if data_set.extracted_first:
        wanted = "a store written by 'afferents extract'"
        raise InputError(f"{data_set.path}: expected {wanted}, found none; extract first")
    with plugins.in_a_sentence(source):
        config, found = dict(data_set.config()), data_set.responses()
        content: Any
        if found is not None:
            responses = [one if integrity.DIGEST in one.attrs else _check(one) for one in found]
            if not keep_going:
                zarr_store.require_all(data_set.path, config, responses, ", or use --keep-going")
            why = "not in the store: its extraction failed or was stopped"
            failed = dict.fromkeys(zarr_store.missing_from(config, responses), why)
            content = [str(one.attrs[integrity.DIGEST]) for one in responses]
        else:
            session = data_set.scan()
            check.require_own_files(session)
            responses, failed = _read(session, data_set.title, keep_going, progress)
            content = session.checksum
    fingerprint = content
    if found is not None or config:  # the same files may be read in another way
        fingerprint = hashlib.sha256(json.dumps([config, content]).encode()).hexdigest()
    names = Counter(str(one.attrs["name"]) for one in responses)
    if twice := [name for name, n in names.items() if n > 1]:
        raise InputError(
            f"{source}: expected recordings of different names, found several '{twice[0]}'"
        )
    origin = Origin(
        source=source,
        kind=data_set.name,
        fingerprint=fingerprint,
        n_recordings=len(responses),
        simulated=bool(config.get("declared", {}).get("simulated")),
        data_set=data_set.located(),
    )
    return OpenedData(origin, tuple(responses), failed)


def _read(
    session: RecordingSet, title: str, keep_going: bool, progress: Progress
) -> tuple[list[Responses], dict[str, str]]:
    """Return responses to the vibration of recordings, and which recordings failed and why.

    A video is followed by `extract` alone.
    """
    responses: list[Responses] = []
    failed: dict[str, str] = {}
    recordings = session.recordings
    for recording in progress.track(recordings, f"reading {title}", len(recordings)):
        try:
            with plugins.in_a_sentence(recording.name):
                if recording.video is not None or recording.audio is None:
                    raise InputError(
                        f"{recording.name}: expected vibration alone, or responses, found a video "
                        "or nothing"
                    )
                responses.append(_check(extract.responses_of(recording)))
        except AfferentsError as error:
            if not keep_going:
                raise
            failed[recording.name] = str(error)
    return responses, failed


def _check(responses: Responses) -> Responses:
    """Return responses of the form that a store would hold, with their fingerprint and digest."""
    checked = store.check_responses(responses, str(responses.attrs.get("name", "a recording")))
    return integrity.sealed(copies.add_fingerprint(checked))


def _leave_out(opened: Sequence[OpenedData], without: Mapping[str, str]) -> list[OpenedData]:
    """Return data without the recordings that have one of these conditions."""

    def declared(responses: Responses) -> dict[str, str]:
        return {name: condition_text(value) for name, value in store.conditions(responses).items()}

    known: dict[str, set[str]] = {}
    for responses in join_recordings(opened):
        for name, value in declared(responses).items():
            known.setdefault(name, set()).add(value)
    for name, value in without.items():
        if value not in known.get(name, ()):
            among = f"{name}= one of" if name in known else "one of"
            there = ", ".join(sorted(known.get(name, known))) or "none"
            found = value if name in known else name
            raise InputError(f"--without: expected {among} {there}, found {found}")
    names = "".join(f"{name}={value};" for name, value in sorted(without.items()))
    left = []
    for data in opened:
        kept = tuple(r for r in data.responses if declared(r).items().isdisjoint(without.items()))
        if not kept:
            raise InputError("--without: expected to leave some recordings, found none left")
        digest = hashlib.sha256(f"{data.origin.fingerprint} without {names}".encode()).hexdigest()
        changed = {"fingerprint": digest, "n_recordings": len(kept)}
        left.append(replace(data, origin=data.origin.model_copy(update=changed), responses=kept))
    return left


def _require_distinct(recordings: Sequence[Responses]) -> None:
    """Refuse a recording that is there twice, a texture or speed under two names, or two units.

    A model would be tested on what it learnt from.

    Raises
    ------
    InputError
        Naming two recordings of the same files or the same values, or both names; or one of cells
        among others of markers.
    """
    units = {dims.of_cells(one): one for one in recordings if dims.SA1 in one}
    if len(units) > 1:
        raise InputError(
            f"DATA: expected SA-I in one unit, found px in {units[False].attrs['name']} and grey "
            f"levels, of cells, in {units[True].attrs['name']}; evaluate them separately"
        )
    seen: dict[str, str] = {}
    for responses in recordings:
        name = str(responses.attrs["name"])
        of_skin = dims.SA1 if dims.of_cells(responses) else dims.POSITION  # cells never move
        digests = {"checksum": responses.attrs.get("checksum")} | {
            variable: integrity.values_digest(responses, variable)
            for variable in (of_skin, dims.RA2)
            if variable in responses
        }
        for variable, digest in digests.items():
            other = seen.setdefault(digest, name) if digest else name
            # Silence is the same in many recordings.
            if other != name and (variable != dims.RA2 or responses[dims.RA2].values.any()):
                raise InputError(
                    f"recording {name}: expected a recording of its own, found a copy of {other}; "
                    "remove one from its session and extract again"
                )
    speeds = [(f"{v:.10g}", v) for r in recordings if (v := store.speed_of(r)) is not None]
    require_distinct("DATA", (str(r.attrs[dims.TEXTURE]) for r in recordings), speeds)


def join_recordings(data: Sequence[OpenedData]) -> list[Responses]:
    """Return the recordings of several sources, one after the other."""
    return [responses for one in data for responses in one.responses]


def data_quality(recordings: Sequence[Responses]) -> dict[str, Any]:
    """Return what a reader of the numbers must know of the recordings, for a summary.

    Returns
    -------
    dict
        `issues`, of each recording that was kept though something is wrong with it, what;
        `lost`, the share of marker positions (time, marker) that were lost, from 0 to 1: median
        over recordings, worst, and in which. Each is left out where there is none.

    Raises
    ------
    InputError
        If what a store holds of lost markers can't be read.
    """
    issues = [
        results.WithIssues(recording=str(r.attrs["name"]), found=tuple(found))
        for r in recordings
        if (found := store.issues_in(r.attrs))
    ]
    lost = summarise_lost({
        str(r.attrs["name"]): share_lost(read_whole(r, dims.DETECTED), r.attrs)
        for r in recordings
        if dims.DETECTED in r
    })  # fmt: skip
    return ({"issues": issues} if issues else {}) | ({"lost": lost} if lost else {})


def share_lost(detected: xr.DataArray, about: Mapping[Any, Any]) -> float:
    """Return the share of marker positions lost from the rest frame on; before, none is looked for.

    Parameters
    ----------
    detected
        `(time, marker)`.
    about
        Attributes of the responses, which name the rest frame.
    """
    return 1 - float(detected[int(about.get("rest_frame", 0)) :].mean())


def summarise_lost(shares: Mapping[str, float]) -> results.Lost | None:
    """Summarise each recording's share of lost markers; None of no recordings."""
    if not shares:
        return None
    worst = max(shares, key=lambda name: shares[name])
    median = float(np.median(list(shares.values())))
    return results.Lost(median=median, worst=shares[worst], recording=worst, n=len(shares))


def choose_encodings(
    data: Sequence[OpenedData],
    cut: choices.Cut,
    wanted: Mapping[str, Any],
    steady: tuple[float, float] | None = None,
    recordings: Sequence[Responses] | None = None,
) -> Encodings:
    """Return how samples are made of data, with what a user wants.

    Options that are not given are chosen where the data set leaves that to us: by the speeds and
    lengths of `recordings`, those of the data that are used (None for all).

    Raises
    ------
    InputError
        If an encoding can't have an option.
    """
    first = data[0].origin
    used = trimming.set_steady(join_recordings(data) if recordings is None else recordings, steady)
    signal = _describe_vibration(used, cut) if first.data_set.chooses_encodings else None
    suited = Encodings.suiting(first.data_set.encodings, first.source, signal, wanted)
    return suited.changed(**wanted)


def _describe_vibration(recordings: Sequence[Responses], cut: choices.Cut) -> SignalInfo | None:
    """Return what is known of the vibration of recordings; None if there is none to learn from."""
    lengths_s, speeds, ways_mm, vibrations = [], [], [], []
    for responses in recordings:
        if dims.RA2 not in responses:
            continue
        vibration = responses[dims.RA2]
        n, rate = vibration.sizes[dims.AUDIO_TIME], float(vibration.attrs[dims.SAMPLE_RATE])
        try:
            kept = trimming.cut_audio(
                n, rate, cut, store.steady_s(responses), responses.attrs["name"]
            )
        except InputError:  # too short for the cut, which is refused later
            continue
        if length_s := float(kept.stop - kept.start) / rate:
            vibrations.append(vibration)
            lengths_s.append(length_s)
            if (speed := store.speed_of(responses)) is not None:
                speeds.append(speed)
                ways_mm.append(speed * length_s)
    if not vibrations:
        return None
    # Where no speed is known, encodings that need one are refused, whatever is chosen for them.
    speeds, ways_mm = speeds or [1.0], ways_mm or [1.0]
    return SignalInfo(
        float(vibrations[0].attrs[dims.SAMPLE_RATE]),
        min(lengths_s),
        max(lengths_s),
        min(speeds),
        max(speeds),
        min(ways_mm),
        vibrations[0].sizes[dims.CHANNEL],
        vibrations[0].attrs.get(dims.UNITS) == _FULL_SCALE,
    )


def note_choice(
    data: Sequence[OpenedData], models: Sequence[Model], encodings: Encodings, progress: Progress
) -> None:
    """Note what clocks rest on, and which options of encodings were chosen where we choose."""
    if not data[0].origin.data_set.chooses_encodings:  # all are of one kind
        return
    for data_set in (one.origin.data_set for one in data):
        for sentence in data_set.describe(data_set.scan()):
            progress.note(sentence)
    sources = (source for model in models for source in find_sources(model, encodings))
    for encoding in dict.fromkeys(source.encoding for source in sources):
        default, chosen = type(encoding)(), []
        for name, value in encoding:
            if value != getattr(default, name):
                text = f"{value:.4g}" if isinstance(value, float) else str(value).lower()
                chosen.append(f"{name} = {'whole recordings' if value is None else text}")
        progress.note(f"{encoding.name}: {', '.join(chosen) or 'the usual options'}")


class Source(NamedTuple):
    """What samples are made of, and how."""

    channel: channels.Channel
    encoding: Encoding


def list_parts(model: Model) -> list[Model]:
    """Return the models that a fusion is made of, or the model itself."""
    return [MODELS[name] for name in model.parts] or [model]


def find_sources(model: Model, encodings: Encodings) -> tuple[Source, ...]:
    """Return what a model's samples are made of; a fusion has several kinds."""
    return tuple(
        Source(channels.find_channel(part.channel), encodings.of(part.encoding))
        for part in list_parts(model)
    )


def has(responses: Responses, source: Source) -> bool:
    """Return whether a recording has what samples are made of, in a form that can be encoded.

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


def encode(
    responses: Responses,
    source: Source,
    cut: choices.Cut,
    ablation: Ablation = _EVERYTHING,
    corruption: Corruption = _AS_THEY_ARE,
) -> Samples:
    """Encode one recording.

    Windows never cross recordings, since each is encoded alone. Where a recording has a series of
    speeds, samples have the mean speed and the change of each, and those of which the series holds
    nothing are left out.

    Parameters
    ----------
    ablation
        Which markers are used.
    corruption
        What corrupts the recording first.

    Raises
    ------
    InputError
        If the recording is too short for the cut, a window or a run of frames.
    """
    channel, encoding = source
    if corruption:
        responses = corrupted(responses, encoding.of_vibration, corruption)
    kept = encoding.kept(responses, channel.made_of, channel.lookback, cut)
    response = ablation.shown(make_response(responses, source))
    series = motion.speed_along(responses)
    if series is not None and encoding.by_distance:
        response = add_distance(response, series)
    samples = encoding.samples(response, kept, channel.lookback)
    if series is None:
        return samples
    mean, low, high = series.over(samples[dims.START].values, samples[dims.STOP].values)
    own = {dims.MEAN_SPEED: mean, dims.SPEED_CHANGE: (high - low) / mean}
    found = samples.assign_coords({name: (dims.SAMPLE, its) for name, its in own.items()})
    return found.isel({dims.SAMPLE: np.flatnonzero(mean > 0)})


def make_response(responses: Responses, source: Source) -> xr.DataArray:
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
        response = store.labelled(channel.response(used), responses)
    return filling.fill(response) if dims.TIME in response.dims else response


def encode_all(
    recordings: Sequence[Responses],
    source: Source,
    cut: choices.Cut,
    progress: Progress,
    ablation: Ablation = _EVERYTHING,
    corruption: Corruption = _AS_THEY_ARE,
    workers: int | None = 1,
) -> Samples:
    """Encode every recording, in this many processes, and join the samples; see `encode`.

    Raises
    ------
    InputError
        As `encode`; if frames of one recording follow each other faster than those of another,
        or the speed changes too much in all samples of a recording.
    """
    _require_one_frame_rate(recordings, source)
    label = f"encoding {source.channel.name} {source.encoding.name}"
    jobs = ((responses, source, cut, ablation, corruption) for responses in recordings)
    found = parallel.side_by_side_numbered(encode, jobs, workers, progress.note)
    by_number = dict(progress.track(found, label, len(recordings)))
    in_order = [by_number[number] for number in range(len(recordings))]
    most = ablation.speed_change
    if most is not None or any(dims.MEAN_SPEED in samples.coords for samples in in_order):
        # Samples of constant slides have the recording's speed.
        in_order = [
            samples
            if dims.MEAN_SPEED in samples.coords
            else samples.assign_coords({
                dims.MEAN_SPEED: (dims.SAMPLE, samples[dims.SPEED].values),
                dims.SPEED_CHANGE: (dims.SAMPLE, np.zeros(len(samples))),
            })
            for samples in in_order
        ]  # fmt: skip
    if most is not None:
        in_order = [_keep_steady(samples, most) for samples in in_order]
    return concatenate(in_order)


def _keep_steady(samples: Samples, most: float) -> Samples:
    """Return the samples whose speed changes by no more than this share of its mean."""
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
    """Refuse to mix frame rates: changes from frame to frame, and runs of frames, would differ."""
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
