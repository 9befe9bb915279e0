"""Opening what `evaluate` learns from: extracted stores, or data sets that an adapter reads."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from afferents.core import dims
from afferents.core.digest import DIGEST, sealed, values_digest
from afferents.core.errors import AfferentsError, InputError
from afferents.core.progress import Progress
from afferents.core.recording import require_distinct
from afferents.core.responses import Responses, conditions
from afferents.core.store import open_responses, store_config
from afferents.encodings import Encodings, KernelEncoding, OrderEncoding, SpectralEncoding
from afferents.pipeline.copies import with_fingerprint
from afferents.pipeline.extract import responses_of
from afferents.recordings import read_fabricslide

Kind = Literal["store", "fabricslide"]

_SUITED: dict[Kind, Encodings] = {
    "store": Encodings(),
    # Three windows of 128 samples a slide, whatever its speed and so its length, zero-padded to
    # 400 so that 200 bins reach Nyquist. Taxels have offsets that differ from day to day. Orders
    # are of whole slides: their waves are centimetres long, a second sees few of them. The axis of
    # cycles per mm is what is heard at all of the set's speeds. Random kernels need windows of one
    # length.
    "fabricslide": Encodings(
        (
            SpectralEncoding(
                window_s=128 * 0.028,
                windows=3,
                fft_points=400,
                kept_bins=200,
                remove_mean=True,
            ),
            OrderEncoding(
                window_s=None,
                windows=3,
                lowest_hz=0.03,
                highest_hz=17.0,
                bins_per_octave=8,
                lowest_per_mm=0.004,
                highest_per_mm=0.11,
            ),
            KernelEncoding(window_s=128 * 0.028, windows=3, highest_hz=17.0),
        )
    ),
}
"""How samples are made of each kind of data."""


@dataclass(frozen=True)
class DataSet:
    """Responses of the recordings of one source, opened lazily.

    `failed` are the recordings that could not be read, and why.
    """

    source: str
    kind: Kind
    responses: tuple[Responses, ...]
    failed: Mapping[str, str]
    fingerprint: str
    simulated: bool

    @property
    def encodings(self) -> Encodings:
        """How samples are made of such data."""
        return _SUITED[self.kind]

    @property
    def located(self) -> str:
        """The source as any process finds it, wherever it was started."""
        kind, colon, path = self.source.partition(":")
        if self.kind == "fabricslide" and colon:
            return f"{kind}:{Path(path).resolve()}"
        return str(Path(self.source).resolve())

    def describe(self) -> dict[str, Any]:
        """Return what a results folder keeps of it."""
        return {
            "source": self.source,
            "kind": self.kind,
            "fingerprint": self.fingerprint,
            "n_recordings": len(self.responses),
            "simulated": self.simulated,
        }


def open_data(
    sources: Sequence[str],
    without: Mapping[str, str] | None = None,
    keep_going: bool = False,
    progress: Progress | None = None,
) -> list[DataSet]:
    """Open all sources; recordings of several are digests apart by their source's number.

    Parameters
    ----------
    sources
        Paths of extracted stores, or ``fabricslide:PATH``.
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
    kinds = {data.kind for data in opened}
    if len(kinds) > 1:
        raise InputError("DATA", "data of one kind", " and ".join(sorted(kinds)))
    if len({data.fingerprint for data in opened}) < len(opened):
        raise InputError("DATA", "each repetition once", "the same recordings twice")
    if without:
        _require_declared(without, recordings_in(opened))
        opened = [_leave_out(data, without) for data in opened]
    if len(opened) > 1:
        opened = [_numbered(data, number) for number, data in enumerate(opened, start=1)]
    require_one_of_each(recordings_in(opened))
    return opened


def _open(source: str, keep_going: bool, progress: Progress) -> DataSet:
    kind, colon, path = source.partition(":")
    if colon and kind == "fabricslide":
        return _open_fabricslide(source, Path(path), keep_going, progress)
    store = Path(source)
    config, responses = store_config(store), tuple(open_responses(store))
    there = {r.attrs["name"] for r in responses}
    missing = [name for name in config.get("recordings", []) if name not in there]
    if missing and not keep_going:
        raise InputError(
            store,
            f"the {len(missing) + len(there)} recordings of its session",
            f"{len(there)} ({', '.join(missing[:5])} missing)",
            "extract again, or use --keep-going",
        )
    digests = [str(r.attrs[DIGEST]) for r in responses]
    digest = hashlib.sha256(json.dumps([config, digests]).encode()).hexdigest()
    simulated = bool(config.get("declared", {}).get("simulated"))
    failed = dict.fromkeys(missing, "not in the store: its extraction failed or was stopped")
    return DataSet(source, "store", responses, failed, digest, simulated)


def _open_fabricslide(source: str, path: Path, keep_going: bool, progress: Progress) -> DataSet:
    session = read_fabricslide(path)
    responses: list[Responses] = []
    failed: dict[str, str] = {}
    recordings = session.recordings
    for recording in progress.track(recordings, "reading FabricSlide", len(recordings)):
        try:
            responses.append(sealed(with_fingerprint(responses_of(recording))))
        except AfferentsError as error:
            if not keep_going:
                raise
            failed[recording.name] = str(error)
    checksum = session.checksum
    return DataSet(source, "fabricslide", tuple(responses), failed, checksum, simulated=False)


def require_one_of_each(recordings: Sequence[Responses]) -> None:
    """Refuse a recording that is there twice, or a texture or speed under two names.

    A model would be tested on what it learnt from.

    Raises
    ------
    InputError
        Naming two recordings of the same files or the same values, or both names.
    """
    seen: dict[str, str] = {}
    for responses in recordings:
        name = str(responses.attrs["name"])
        for variable, digest in _what_tells(responses).items():
            other = seen.setdefault(digest, name)
            if other != name and not _is_silent(responses, variable):
                raise InputError(
                    f"recording {name}", "a recording of its own", f"a copy of {other}",
                    "remove one from its session and extract again",
                )  # fmt: skip
    speeds = [(f"{v:.10g}", v) for v in (float(r.attrs[dims.SPEED]) for r in recordings)]
    require_distinct("DATA", (str(r.attrs[dims.TEXTURE]) for r in recordings), speeds)


def _what_tells(responses: Responses) -> dict[str, str]:
    """Return what no other recording has: the checksum of its files, the digests of its arrays."""
    there = [name for name in (dims.POSITION, dims.RA2) if name in responses]
    digests = {"checksum": responses.attrs.get("checksum")}
    digests |= {name: values_digest(responses, name) for name in there}
    return {name: digest for name, digest in digests.items() if digest}


def _is_silent(responses: Responses, variable: str) -> bool:
    """Tell whether it is sound without any: that is the same in many recordings."""
    return variable == dims.RA2 and not responses[dims.RA2].values.any()


def recordings_in(data: Sequence[DataSet]) -> list[Responses]:
    """Return the recordings of several sources, one after the other."""
    return [responses for one in data for responses in one.responses]


def _require_declared(without: Mapping[str, str], recordings: Sequence[Responses]) -> None:
    """Refuse a condition, or a value of one, that no recording has."""
    known: dict[str, set[str]] = {}
    for responses in recordings:
        for name, value in conditions(responses).items():
            known.setdefault(name, set()).add(str(value))
    for name, value in without.items():
        if name not in known:
            raise InputError("--without", f"one of {', '.join(sorted(known)) or 'none'}", name)
        if value not in known[name]:
            values = ", ".join(sorted(known[name]))
            raise InputError("--without", f"{name}= one of {values}", value)


def _leave_out(data: DataSet, without: Mapping[str, str]) -> DataSet:
    kept = []
    for responses in data.responses:
        declared = conditions(responses)
        if not any(str(declared.get(name)) == value for name, value in without.items()):
            kept.append(responses)
    if not kept:
        raise InputError("--without", "to leave some recordings", "none left")
    names = "".join(f"{name}={value};" for name, value in sorted(without.items()))
    digest = hashlib.sha256(f"{data.fingerprint} without {names}".encode()).hexdigest()
    return replace(data, responses=tuple(kept), fingerprint=digest)


def _numbered(data: DataSet, number: int) -> DataSet:
    renamed = tuple(r.assign_attrs(name=f"{number}:{r.attrs['name']}") for r in data.responses)
    failed = {f"{number}:{name}": why for name, why in data.failed.items()}
    return replace(data, responses=renamed, failed=failed)
