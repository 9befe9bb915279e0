"""Opening what `evaluate` learns from: extracted stores, or data sets that an adapter reads."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from afferents.core.errors import InputError
from afferents.core.responses import Responses, conditions
from afferents.core.store import open_responses, store_config
from afferents.encodings import SpectralEncoding
from afferents.pipeline.extract import responses_of
from afferents.recordings import read_fabricslide

Kind = Literal["store", "fabricslide"]

SPECTRAL: dict[Kind, SpectralEncoding] = {
    "store": SpectralEncoding(),
    # Three windows of 128 samples a slide, whatever its speed and so its length, zero-padded to
    # 400 so that 200 bins reach Nyquist. Taxels have offsets that differ from day to day.
    "fabricslide": SpectralEncoding(
        window_s=128 * 0.028,
        windows=3,
        fft_points=400,
        kept_bins=200,
        remove_mean=True,
    ),
}
"""How spectra are made of each kind of data."""


@dataclass(frozen=True)
class DataSet:
    """Responses of the recordings of one source, opened lazily."""

    source: str
    kind: Kind
    responses: tuple[Responses, ...]
    fingerprint: str
    simulated: bool

    def describe(self) -> dict[str, str | int | bool]:
        """Return what a results folder keeps of it."""
        return {
            "source": self.source,
            "kind": self.kind,
            "fingerprint": self.fingerprint,
            "n_recordings": len(self.responses),
            "simulated": self.simulated,
        }


def open_data(sources: Sequence[str], without: Mapping[str, str] | None = None) -> list[DataSet]:
    """Open all sources; recordings of several are told apart by their source's name.

    Parameters
    ----------
    sources
        Paths of extracted stores, or ``fabricslide:PATH``.
    without
        Recordings with one of these conditions (such as pressure F250) are left out.

    Raises
    ------
    InputError
        If a source can't be read, if kinds are mixed, or if nothing is left.
    """
    opened = [_open(source) for source in sources]
    kinds = {data.kind for data in opened}
    if len(kinds) > 1:
        raise InputError("DATA", "data of one kind", " and ".join(sorted(kinds)))
    if without:
        opened = [_leave_out(data, without) for data in opened]
    if len(opened) > 1:
        opened = [_named_by_source(data, number) for number, data in enumerate(opened)]
    return opened


def _open(source: str) -> DataSet:
    kind, colon, path = source.partition(":")
    if colon and kind == "fabricslide":
        return _open_fabricslide(source, Path(path))
    store = Path(source)
    responses = tuple(open_responses(store))
    checksums = [str(r.attrs.get("checksum")) for r in responses]
    config = store_config(store)
    digest = hashlib.sha256(json.dumps([config, checksums]).encode()).hexdigest()
    return DataSet(source, "store", responses, digest, bool(config.get("simulated")))


def _open_fabricslide(source: str, path: Path) -> DataSet:
    session = read_fabricslide(path)
    responses = [responses_of(recording) for recording in session.recordings]
    return DataSet(source, "fabricslide", tuple(responses), session.checksum, simulated=False)


def _leave_out(data: DataSet, without: Mapping[str, str]) -> DataSet:
    kept: list[Responses] = []
    known: set[str] = set()
    for responses in data.responses:
        declared = conditions(responses)
        known.update(declared)
        if not any(str(declared.get(name)) == value for name, value in without.items()):
            kept.append(responses)
    for name in without:
        if name not in known:
            raise InputError("--without", f"one of {', '.join(sorted(known)) or 'none'}", name)
    if not kept:
        raise InputError("--without", "to leave some recordings", "none left")
    names = "".join(f"{name}={value};" for name, value in sorted(without.items()))
    digest = hashlib.sha256(f"{data.fingerprint} without {names}".encode()).hexdigest()
    return DataSet(data.source, data.kind, tuple(kept), digest, data.simulated)


def _named_by_source(data: DataSet, number: int) -> DataSet:
    renamed = tuple(r.assign_attrs(name=f"{number + 1}:{r.attrs['name']}") for r in data.responses)
    return DataSet(data.source, data.kind, renamed, data.fingerprint, data.simulated)
