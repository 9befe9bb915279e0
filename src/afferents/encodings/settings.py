"""The encodings by name, and how those of an evaluation are set."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from afferents.documents import as_form
from afferents.encodings import images, orders, spectra, wavenumbers
from afferents.encodings.base import Encoding, Option, SignalInfo
from afferents.errors import InputError
from afferents.plugins import imported, reference_of

ENCODINGS: dict[str, type[Encoding]] = {
    kind.name: kind
    for kind in (
        images.SpatialEncoding, images.SpatiotemporalEncoding, spectra.SpectralEncoding,
        orders.OrderEncoding, wavenumbers.WavenumberEncoding,
        images.MarkersEncoding, images.MomentEncoding,
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
        Values of options that a user set, by name of the field.
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
            What a user sets besides, by name of the field; others are chosen to go with it.

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
                encoding = suited.get(name) or kind()
                encoding.changed(**wanted or {})  # what makes no sense is refused as ever
                given = {field: getattr(encoding, field) for field in encoding.model_fields_set}
                more = {k: v for k, v in (wanted or {}).items() if v is not None}
                suited[name] = kind(**{**kind.suiting(signal, given | more), **given})
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
        """Return an encoding, by name or as given, with the options that a user set.

        Raises
        ------
        InputError
            If there is none of that name, or it can't have the values set.
        """
        if not isinstance(encoding, Encoding):
            if encoding not in ENCODINGS:
                known = f"an Encoding, or one of {', '.join(ENCODINGS)}"
                raise InputError(f"encoding: expected {known}, found {encoding!r}")
            suited = {one.name: one for one in self.suited}
            encoding = suited.get(encoding) or ENCODINGS[encoding]()
        return encoding.changed(**dict(self.wanted))

    def describe(self) -> dict[str, dict[str, Any]]:
        """Return all of them by name, as a results folder keeps them."""
        return {name: self.of(name).model_dump(mode="json") for name in ENCODINGS}


def read_encoding(described: Mapping[str, Any], where: object) -> Encoding:
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


def describe_encoding(encoding: Encoding) -> dict[str, Any]:
    """Return an encoding's name, or ``module:NAME``, and its fields; see `read_encoding`.

    Raises
    ------
    InputError
        If it is a user's own and can't be imported.
    """
    ours = ENCODINGS.get(encoding.name) is type(encoding)
    name = encoding.name if ours else reference_of(type(encoding), "encoding")
    return {**encoding.describe(), "name": name}
