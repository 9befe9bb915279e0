"""The encodings by name, and how those of an evaluation are set."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from afferents.documents import as_form
from afferents.encodings.base import Encoding, Option, SignalInfo
from afferents.encodings.images import (
    MarkersEncoding,
    MomentEncoding,
    SpatialEncoding,
    SpatiotemporalEncoding,
)
from afferents.encodings.orders import OrderEncoding
from afferents.encodings.spectra import SpectralEncoding
from afferents.encodings.wavenumbers import WavenumberEncoding
from afferents.errors import InputError
from afferents.plugins import imported, reference_of

ENCODINGS: dict[str, type[Encoding]] = {
    kind.name: kind
    for kind in (
        SpatialEncoding, SpatiotemporalEncoding, SpectralEncoding,
        OrderEncoding, WavenumberEncoding, MarkersEncoding, MomentEncoding,
    )
}  # fmt: skip
"""The paper's three, then ours."""


def options() -> dict[str, Option]:
    """Return the options that the command line offers for encodings, by name of the field."""
    return {name: option for kind in ENCODINGS.values() for name, option in kind.options().items()}


@dataclass(frozen=True)
class Encodings:
    """How samples are made, where models name their encodings.

    Attributes
    ----------
    suited
        Those that differ from their class's defaults, as they suit a kind of data.
    wanted
        Values of options that a user asked for, by name of the field.
    """

    suited: tuple[Encoding, ...] = ()
    wanted: tuple[tuple[str, Any], ...] = ()

    @classmethod
    def suiting(
        cls,
        options: Mapping[str, Mapping[str, Any]],
        where: object,
        signal: SignalInfo | None = None,
        wanted: Mapping[str, Any] | None = None,
    ) -> "Encodings":
        """Return encodings with options that suit some data, by name of the encoding.

        Parameters
        ----------
        options
            Options that are given for these data.
        where
            The data, for the error.
        signal
            By which options that are not given are chosen; None to leave them as they are.
        wanted
            What a user asks for beside, by name of the field; others are chosen to go with it.

        Raises
        ------
        InputError
            If there is no encoding of a name, or it can't have such options.
        """
        if unknown := sorted(set(options) - set(ENCODINGS)):
            raise InputError(
                f"{where}: expected options of {', '.join(ENCODINGS)}, found of {unknown[0]}"
            )
        words = "options of the encoding '{}'"
        suited = {n: as_form(o, ENCODINGS[n], where, words.format(n)) for n, o in options.items()}
        if signal is not None:
            for name, kind in ENCODINGS.items():
                suited[name] = _completed(suited.get(name) or kind(), signal, wanted or {})
        return cls(tuple(suited.values()))

    def changed(self, **wanted: Any) -> "Encodings":
        """Return them with options set to the values given; None for what is not.

        Raises
        ------
        InputError
            If an encoding can't have a value.
        """
        given = tuple((name, value) for name, value in wanted.items() if value is not None)
        changed = Encodings(self.suited, self.wanted + given)
        for name in ENCODINGS:
            changed.of(name)
        return changed

    def of(self, encoding: str | Encoding) -> Encoding:
        """Return an encoding, by name or as given, with the options asked for.

        Raises
        ------
        InputError
            If there is none of that name, or it can't have the values asked for.
        """
        return self._plain(encoding).changed(**dict(self.wanted))

    def _plain(self, encoding: str | Encoding) -> Encoding:
        if isinstance(encoding, Encoding):
            return encoding
        for suited in self.suited:
            if suited.name == encoding:
                return suited
        if encoding not in ENCODINGS:
            known = f"an Encoding, or one of {', '.join(ENCODINGS)}"
            raise InputError(f"encoding: expected {known}, found {encoding!r}")
        return ENCODINGS[encoding]()

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return all of them by name, as a results folder keeps them."""
        return {name: self.of(name).model_dump(mode="json") for name in ENCODINGS}


def _completed(given: Encoding, signal: SignalInfo, wanted: Mapping[str, Any]) -> Encoding:
    """Return an encoding whose options that nobody gave are chosen."""
    given.changed(**wanted)  # what makes no sense is refused as ever
    said = {name: getattr(given, name) for name in given.model_fields_set}
    decided = said | {name: value for name, value in wanted.items() if value is not None}
    return type(given)(**{**type(given).suiting(signal, decided), **said})


def encoding_of(described: Mapping[str, Any], where: object) -> Encoding:
    """Return the encoding that a card describes by its name and fields.

    Raises
    ------
    InputError
        If there is none of that name, or its fields are others in this version.
    """
    name = str(described.get("name"))
    kind = imported(name) if ":" in name else ENCODINGS.get(name)
    if not (isinstance(kind, type) and issubclass(kind, Encoding)):
        raise InputError(
            f"{where}: expected one of the encodings {', '.join(ENCODINGS)}, found '{name}'"
        )
    fields = {field: value for field, value in described.items() if field != "name"}
    wanted = f"the encoding '{name}' of this version"
    return as_form(fields, kind, where, wanted, "train the model again")


def described(encoding: Encoding) -> dict[str, Any]:
    """Return an encoding's name, or ``module:NAME`` of one's own, and fields, for `encoding_of`.

    Raises
    ------
    InputError
        If it is somebody's own and can't be imported.
    """
    ours = ENCODINGS.get(encoding.name) is type(encoding)
    name = encoding.name if ours else reference_of(type(encoding), "encoding")
    return {**encoding.describe(), "name": name}
