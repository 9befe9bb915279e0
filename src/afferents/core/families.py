"""The model families: the six of the paper's Table 1, and our own beyond it."""

from dataclasses import dataclass
from typing import Literal

from afferents.core.dims import (
    RA1,
    RA1_CIRCUMFERENTIAL,
    RA1_SIGNED,
    RA1_VECTOR,
    RA2,
    SA1,
    SA1_VECTOR,
)
from afferents.core.errors import InputError

Learner = Literal["network", "ridge", "orders", "late fusion", "joint fusion"]
SpeedFrom = Literal["nobody", "robot", "fingertip"]
"""Who tells a model the sliding speed of a sample that it names: the fingertip measures it."""


@dataclass(frozen=True)
class Family:
    """A way from an afferent to textures.

    Attributes
    ----------
    channel
        What it feels with, a name in `channels.CHANNELS`; of a fusion that of its first part.
    encoding
        How samples are made of it, a name in `encodings.ENCODINGS`.
    augmented
        Whether spectra are stretched to stand in for speeds never seen.
    learner
        What learns: a network of the paper, or one of `models` that is solved in one step.
    speed_from
        Who tells it the speed of what is tested.
    parts
        Names of the families that a fusion joins; its decisions are timed by the first.
    """

    name: str
    title: str
    channel: str
    encoding: str
    augmented: bool = False
    learner: Learner = "network"
    speed_from: SpeedFrom = "nobody"
    parts: tuple[str, ...] = ()

    @property
    def deployable(self) -> bool:
        """Whether it can be trained to feel live with."""
        if self.learner == "network":
            return True
        return self.encoding == "wavenumbers"


TABLE1: dict[str, Family] = {
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
"""The paper's."""

BEYOND: dict[str, Family] = {
    family.name: family
    for family in (
        Family("ridge-te", "ridge on log spectra", RA2, "orders", learner="ridge"),
        Family("order-te", "orders", RA2, "orders", learner="orders"),
        Family(
            "order-te-measured", "orders, speed measured", RA2, "orders",
            learner="orders", speed_from="fingertip",
        ),
        Family(
            "order-te-told", "orders, speed told", RA2, "orders",
            learner="orders", speed_from="robot",
        ),
        Family("rocket-te", "random kernels", RA2, "kernels", learner="ridge"),
        Family("sa-wave", "SA-I waves", SA1, "wavenumbers", learner="ridge"),
        Family("sa-wave-vector", "SA-I vector waves", SA1_VECTOR, "wavenumbers", learner="ridge"),
        Family("ra-wave", "RA-I waves", RA1, "wavenumbers", learner="ridge"),
        Family("ra-wave-signed", "RA-I signed waves", RA1_SIGNED, "wavenumbers", learner="ridge"),
        Family(
            "ra-wave-around", "RA-I circumferential waves", RA1_CIRCUMFERENTIAL, "wavenumbers",
            learner="ridge",
        ),
        Family("ra-wave-vector", "RA-I vector waves", RA1_VECTOR, "wavenumbers", learner="ridge"),
        Family(
            "fusion", "fusion, late", RA2, "orders",
            learner="late fusion", parts=("order-te", "sa-wave-vector"),
        ),
        Family(
            "fusion-told", "fusion, late, speed told", RA2, "orders",
            learner="late fusion", speed_from="robot", parts=("order-te-told", "sa-wave-vector"),
        ),
        Family(
            "fusion-joint", "fusion, one ridge", RA2, "orders",
            learner="joint fusion", parts=("order-te", "sa-wave-vector"),
        ),
    )
}  # fmt: skip
"""Our own: docs/beyond.md says what they are and how far they go."""

FAMILIES: dict[str, Family] = TABLE1 | BEYOND


BEST = ("ra-wave-vector", "vib-te-aug")
"""What is recommended: the first that the data support, to be trained and felt with.

By the kind of data, not by scores at held-out speeds, so that nothing is picked on a test.
"""


def families(names: str) -> list[Family]:
    """Read a comma-separated list of families, in the order of Table 1; `all` for its six.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    chosen = list(TABLE1) if names == "all" else [name.strip() for name in names.split(",")]
    for name in chosen:
        if name not in FAMILIES:
            raise InputError(
                "--models", f"'all', 'best' or some of {', '.join(FAMILIES)}", f"'{name}'"
            )
    return [family for name, family in FAMILIES.items() if name in chosen]
