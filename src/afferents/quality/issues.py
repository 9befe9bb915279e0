"""What is wrong with a recording that decodes well: refused, or kept where the user says so."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal, get_args

from afferents.errors import InputError, then

Kind = Literal["length", "dark", "frozen", "repeated", "loud"]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""What `--accept` takes."""


@dataclass(frozen=True)
class QualityIssue:
    """One thing that is wrong.

    Attributes
    ----------
    kind
        By which it can be accepted.
    where, expected, found
        As of an `InputError`.
    cause
        What may be the reason, and then to be done, in a clause; empty where nothing suggests one.
    """

    kind: Kind
    where: object
    expected: str
    found: str
    cause: str = ""

    @property
    def error(self) -> InputError:
        """The refusal, which says how to accept it."""
        do = f"record it again, or keep it as it is with --accept {self.kind}"
        if self.cause:
            do = f"{self.cause}; else {do}"
        return InputError(f"{self.where}: expected {self.expected}, found {self.found}{then(do)}")

    @property
    def what(self) -> str:
        """What is wrong, without where."""
        return f"expected {self.expected}, found {self.found}"

    def __str__(self) -> str:
        """Say it of a recording that is kept."""
        return f"{self.where}: {self.what}"


def parse_kinds(names: Collection[str]) -> frozenset[Kind]:
    """Return what `--accept` names.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    for name in names:
        if name not in KINDS:
            raise InputError(f"--accept: expected one of {', '.join(KINDS)}, found '{name}'")
    return frozenset(kind for kind in KINDS if kind in names)


def require_accepted(
    issues: Iterable[QualityIssue], accept: Collection[Kind]
) -> list[QualityIssue]:
    """Return the issues, if all are of kinds that are accepted.

    Raises
    ------
    InputError
        The first that is not.
    """
    kept = list(issues)
    for issue in kept:
        if issue.kind not in accept:
            raise issue.error
    return kept
