"""The six model families of the paper's Table 1 and what each is made of."""

from dataclasses import dataclass
from typing import Literal

from afferents.core.dims import RA1, RA2, SA1
from afferents.core.errors import InputError

Encoding = Literal["spatial", "spatiotemporal", "spectral"]


@dataclass(frozen=True)
class Family:
    """One row of Table 1: an afferent, its encoding, and whether spectra are stretched."""

    name: str
    title: str
    afferent: str
    encoding: Encoding
    augmented: bool = False


FAMILIES: dict[str, Family] = {
    family.name: family
    for family in (
        Family("sa-se", "SA-SE", SA1, "spatial"),
        Family("ra-se", "RA-SE", RA1, "spatial"),
        Family("sa-ste", "SA-STE", SA1, "spatiotemporal"),
        Family("ra-ste", "RA-STE", RA1, "spatiotemporal"),
        Family("vib-te", "vib-TE", RA2, "spectral"),
        Family("vib-te-aug", "vib-TE augmented", RA2, "spectral", augmented=True),
    )
}


def families(names: str) -> list[Family]:
    """Read a comma-separated list of families, in the order of Table 1; `all` for the six.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    chosen = list(FAMILIES) if names == "all" else [name.strip() for name in names.split(",")]
    for name in chosen:
        if name not in FAMILIES:
            raise InputError("--models", f"'all' or some of {', '.join(FAMILIES)}", f"'{name}'")
    return [family for name, family in FAMILIES.items() if name in chosen]
