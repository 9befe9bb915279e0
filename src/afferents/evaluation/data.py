"""Opening what `evaluate` learns from: data sets, as the responses of their recordings."""

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, Field, SkipValidation

from afferents import dims
from afferents.encodings.settings import Encodings
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.intervals import numbered
from afferents.extraction.copies import with_fingerprint
from afferents.extraction.extract import responses_of
from afferents.folds.held_out import text_of
from afferents.models.card import Source
from afferents.plugins import in_a_sentence
from afferents.progress import Progress
from afferents.recordings.check import require_own_files
from afferents.recordings.data_set import DataSet
from afferents.recordings.data_sets import data_set_of, source_of
from afferents.store.integrity import DIGEST, sealed, values_digest
from afferents.store.recording import Recording, RecordingSet, require_distinct
from afferents.store.responses import Responses, check_responses, conditions, speed_of
from afferents.store.zarr_store import missing_from, require_all

Data = str | Path | DataSet
"""A path, a name and a path, or an object of one's own: what `data_set_of` takes."""


class Origin(Source):
    """Where data come from and what tells them from others, light enough to be sent with a job.

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
    """Open all sources; recordings of several are told apart by their source's number.

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
        _require_declared(without, recordings_in(opened))
        opened = [_leave_out(data, without) for data in opened]
    if len(opened) > 1:
        opened = [_numbered(data, number) for number, data in enumerate(opened, start=1)]
    require_one_of_each(recordings_in(opened))
    return opened


def _open(given: Data, keep_going: bool, progress: Progress) -> OpenedData:
    source, data_set = source_of(given), data_set_of(given)
    if data_set.extracted_first:
        wanted = "a store written by 'afferents extract'"
        raise InputError(f"{data_set.path}: expected {wanted}, found none; extract first")
    with in_a_sentence(source):
        config, found = dict(data_set.config()), data_set.responses()
        if found is not None:
            responses, failed = _whole(data_set, config, found, keep_going)
            digests = [str(r.attrs[DIGEST]) for r in responses]
            fingerprint = hashlib.sha256(json.dumps([config, digests]).encode()).hexdigest()
        else:
            session = data_set.scan()
            require_own_files(session)
            responses, failed = _read(session, data_set.title, keep_going, progress)
            fingerprint = session.checksum
            if config:  # the same files may be read in another way
                fingerprint = hashlib.sha256(json.dumps([config, fingerprint]).encode()).hexdigest()
    names = Counter(str(r.attrs["name"]) for r in responses)
    if twice := [name for name, n in names.items() if n > 1]:
        raise InputError(
            f"{source}: expected recordings of different names, found several '{twice[0]}'"
        )
    simulated = bool(config.get("declared", {}).get("simulated"))
    origin = Origin(
        source=source,
        kind=data_set.name,
        fingerprint=fingerprint,
        n_recordings=len(responses),
        simulated=simulated,
        data_set=data_set.located(),
    )
    return OpenedData(origin, tuple(responses), failed)


Read = tuple[list[Responses], dict[str, str]]  # and the recordings that failed and why


def _whole(
    data_set: DataSet, config: Mapping[str, Any], found: Sequence[Responses], keep_going: bool
) -> Read:
    """Return responses that are there, all that should be (without `keep_going`)."""
    responses = [one if DIGEST in one.attrs else _checked(one) for one in found]
    if not keep_going:
        require_all(data_set.path, config, responses, ", or use --keep-going")
    why = "not in the store: its extraction failed or was stopped"
    return responses, dict.fromkeys(missing_from(config, responses), why)


def _read(session: RecordingSet, title: str, keep_going: bool, progress: Progress) -> Read:
    """Return responses to recordings, read whole."""
    responses: list[Responses] = []
    failed: dict[str, str] = {}
    recordings = session.recordings
    for recording in progress.track(recordings, f"reading {title}", len(recordings)):
        try:
            with in_a_sentence(recording.name):
                responses.append(_checked(_heard(recording)))
        except AfferentsError as error:
            if not keep_going:
                raise
            failed[recording.name] = str(error)
    return responses, failed


def _heard(recording: Recording) -> Responses:
    """Return the response to a recording's vibration; a video is followed by `extract` alone."""
    if recording.video is not None or recording.audio is None:
        raise InputError(
            f"{recording.name}: expected vibration alone, or responses, found a video or nothing"
        )
    return responses_of(recording)


def _checked(responses: Responses) -> Responses:
    """Return responses of the form that a store would hold, with what tells them from others."""
    checked = check_responses(responses, str(responses.attrs.get("name", "a recording")))
    return sealed(with_fingerprint(checked))


def require_one_of_each(recordings: Sequence[Responses]) -> None:
    """Refuse a recording that is there twice, or a texture or speed under two names.

    A model would be tested on what it learnt from.

    Raises
    ------
    InputError
        Naming two recordings of the same files or the same values, or both names; or one of cells
        among others of markers.
    """
    _require_one_unit(recordings)
    seen: dict[str, str] = {}
    for responses in recordings:
        name = str(responses.attrs["name"])
        for variable, digest in _what_tells(responses).items():
            other = seen.setdefault(digest, name)
            if other != name and not _is_silent(responses, variable):
                raise InputError(
                    f"recording {name}: expected a recording of its own, found a copy of {other}; "
                    "remove one from its session and extract again"
                )
    speeds = [(f"{v:.10g}", v) for r in recordings if (v := speed_of(r)) is not None]
    require_distinct("DATA", (str(r.attrs[dims.TEXTURE]) for r in recordings), speeds)


def _require_one_unit(recordings: Sequence[Responses]) -> None:
    """Refuse to mix markers with cells: px and grey levels are not to be compared."""
    of = {dims.of_cells(one): one for one in recordings if dims.SA1 in one}
    if len(of) > 1:
        raise InputError(
            f"DATA: expected SA-I in one unit, found px in {of[False].attrs['name']} and grey "
            f"levels, of cells, in {of[True].attrs['name']}; evaluate them apart"
        )


def _what_tells(responses: Responses) -> dict[str, str]:
    """Return what no other recording has: the checksum of its files, the digests of its arrays."""
    felt = dims.SA1 if dims.of_cells(responses) else dims.POSITION  # cells never move
    there = [name for name in (felt, dims.RA2) if name in responses]
    digests = {"checksum": responses.attrs.get("checksum")}
    digests |= {name: values_digest(responses, name) for name in there}
    return {name: digest for name, digest in digests.items() if digest}


def _is_silent(responses: Responses, variable: str) -> bool:
    """Tell whether it is sound without any: that is the same in many recordings."""
    return variable == dims.RA2 and not responses[dims.RA2].values.any()


def recordings_in(data: Sequence[OpenedData]) -> list[Responses]:
    """Return the recordings of several sources, one after the other."""
    return [responses for one in data for responses in one.responses]


def _require_declared(without: Mapping[str, str], recordings: Sequence[Responses]) -> None:
    """Refuse a condition, or a value of one, that no recording has."""
    known: dict[str, set[str]] = {}
    for responses in recordings:
        for name, value in _declared(responses).items():
            known.setdefault(name, set()).add(value)
    for name, value in without.items():
        if name not in known:
            raise InputError(
                f"--without: expected one of {', '.join(sorted(known)) or 'none'}, found {name}"
            )
        if value not in known[name]:
            values = ", ".join(sorted(known[name]))
            raise InputError(f"--without: expected {name}= one of {values}, found {value}")


def _declared(responses: Responses) -> dict[str, str]:
    """Return a recording's conditions, their values as text."""
    return {name: text_of(value) for name, value in conditions(responses).items()}


def _leave_out(data: OpenedData, without: Mapping[str, str]) -> OpenedData:
    kept = [r for r in data.responses if _declared(r).items().isdisjoint(without.items())]
    if not kept:
        raise InputError("--without: expected to leave some recordings, found none left")
    names = "".join(f"{name}={value};" for name, value in sorted(without.items()))
    digest = hashlib.sha256(f"{data.origin.fingerprint} without {names}".encode()).hexdigest()
    changed = {"fingerprint": digest, "n_recordings": len(kept)}
    origin = data.origin.model_copy(update=changed)
    return replace(data, origin=origin, responses=tuple(kept))


def _numbered(data: OpenedData, number: int) -> OpenedData:
    renamed = tuple(
        r.assign_attrs(name=numbered(str(r.attrs["name"]), number)) for r in data.responses
    )
    failed = {numbered(name, number): why for name, why in data.failed.items()}
    return replace(data, responses=renamed, failed=failed)
