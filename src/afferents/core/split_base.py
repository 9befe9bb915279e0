"""What a split is: what groups are called, how they are printed, and which samples are of which."""

from abc import ABC, abstractmethod
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from afferents.core.errors import InputError
from afferents.core.recording import natural_order
from afferents.core.responses import Responses
from afferents.core.samples import Samples

Group = float | str
"""A speed, mm/s, the value of a condition as text, or the number of an arc as text."""

OPTION = "--split"


@dataclass(frozen=True)
class Split(ABC):
    """By what recordings form groups.

    Attributes
    ----------
    name
        In commands and files.
    ordered
        Whether groups lie on a scale, so that some are between others.
    whole
        Whether a recording is of one group; else its samples are of several, or of none.
    coordinate
        Of samples, on `sample`: their groups.
    column
        Of tables of predictions: the group held out.
    held_out, validation, groups, by, worst, validations
        Keys of the same in `fold.json` (the first two) and `summary.json`.
    leaks
        What a leak is counted by, in the names of leaks.
    """

    name: str

    ordered: ClassVar[bool]
    whole: ClassVar[bool] = True
    coordinate: ClassVar[str]
    column: ClassVar[str]
    held_out: ClassVar[str]
    validation: ClassVar[str]
    groups: ClassVar[str]
    by: ClassVar[str]
    worst: ClassVar[str]
    validations: ClassVar[str]
    leaks: ClassVar[str]

    @property
    def ci95_by(self) -> str:
        """Key of the intervals of what `by` holds."""
        return f"ci95_{self.by}"

    @property
    @abstractmethod
    def one(self) -> str:
        """A group, in words, with its article."""

    @property
    @abstractmethod
    def many(self) -> str:
        """Groups, in words."""

    @property
    def axis(self) -> str:
        """What groups are, with their unit, as an axis says it."""
        return self.name

    @property
    def unit(self) -> str:
        """Unit of the groups, with a space before it; none where they have none."""
        return ""

    @abstractmethod
    def at(self, groups: Sequence[Group]) -> str:
        """Return where something was, in words: `at 10, 20 mm/s`, `with trial 1`."""

    @abstractmethod
    def printed(self, group: Group) -> str:
        """Return a group in words."""

    def named(self, group: Group) -> str:
        """Return a group with the name of what it is: `speed 10 mm/s`, `trial 1`."""
        return f"{self.name} {key_of(group)}{self.unit}"

    @abstractmethod
    def groups_of(self, recordings: Iterable[Responses]) -> list[Group]:
        """Return the groups that recordings are of, each once, in order.

        Raises
        ------
        InputError
            If there is a recording that is of none.
        """

    @abstractmethod
    def labelled(self, samples: Samples, recordings: Iterable[Responses]) -> Samples:
        """Return samples of these recordings with their groups on `coordinate`."""

    @abstractmethod
    def read(self, wanted: Iterable[Any], option: str) -> tuple[Group, ...]:
        """Return groups as somebody names them.

        Raises
        ------
        InputError
            Naming the option, if one can't be one.
        """

    def of(self, samples: Samples) -> NDArray[Any]:
        """Return the groups of samples, (n_samples,)."""
        return np.asarray(samples[self.coordinate].values)

    def require(self, wanted: Iterable[Group], there: Collection[Group], option: str) -> None:
        """Refuse groups that an option asks for and no recording is of.

        Raises
        ------
        InputError
            If there is one.
        """
        for group in wanted:
            if group not in there:
                known = ", ".join(map(key_of, there))
                raise InputError(option, f"some of {known}{self.unit}", key_of(group))


def key_of(group: Group) -> str:
    """Return a group as the key of a table: ``10``, ``12.5``, ``F250``."""
    return group if isinstance(group, str) else f"{group:g}"


def group_in(value: object) -> Group:
    """Return a group as a cell or a key of a pandas table holds it."""
    return value if isinstance(value, str) else float(str(value))


def order(group: Group) -> tuple[float, str]:
    """Sort key: numbers by value, then words alphabetically."""
    if not isinstance(group, str):
        return (float(group), "")
    value, _ = natural_order(group)
    return (value, group)
