"""What the paper printed: Table 1, accuracy at each held-out speed, mean confusion matrices.

The figures are carried in `published/*.json`, each with its source. They were measured on the
published recordings with the published protocol; next to other recordings they are a landmark,
no target that has or has not been reproduced. Where its text and the authors' code differ, and what
is done about each here, stands in `published/discrepancies.md`, which `afferents discrepancies`
prints and the docs include.
"""

import json
import re
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

CITATION = (
    "Pestell & Lepora 2022, Artificial SA-I, RA-I and RA-II/Vibrotactile Afferents for "
    "Tactile Sensing of Texture, J. R. Soc. Interface"
)
_FOLDER = files("afferents.reporting") / "published"
_POINT = re.compile(r"^(\d+)\. \*\*(.*)\*\* \[(.), (.*)\]$")
_SIDE = re.compile(r"^    - (.*?): (.*)$")
_DIFFERENT = "still different"
_OF_SOFTWARE = "Where the software alone differs"


class PublishedFold(NamedTuple):
    """One training of the paper: how it went, and what its test gave.

    Attributes
    ----------
    percent
        Accuracy at the held-out speed, to one decimal from the colours of the printed matrix; the
        titles print it rounded.
    best_epoch
        Number, from 1, of the epoch whose weights were kept.
    first_training_percent, first_validation_percent
        Accuracies of the first epoch, from the training log.
    """

    percent: float
    best_epoch: int
    first_training_percent: float
    first_validation_percent: float


@dataclass(frozen=True)
class PublishedFamily:
    """One row of the paper's Table 1 and the figure behind it.

    Attributes
    ----------
    mean_percent
        Table 1: accuracy, mean over the ten held-out speeds, percent.
    folds
        The trainings, by held-out speed (mm/s).
    """

    mean_percent: int
    folds: dict[float, PublishedFold]

    @property
    def by_speed(self) -> dict[float, float]:
        """Accuracy in percent at each held-out speed (mm/s), from the colours of the matrices."""
        return {speed: fold.percent for speed, fold in self.folds.items()}


@cache
def published_families() -> dict[str, PublishedFamily]:
    """Return the paper's six families by the names that the commands use."""
    names = ("digitised_percent", "best_epoch", "first_training_percent",
             "first_validation_percent")  # fmt: skip
    return {
        family: PublishedFamily(
            content["table1_percent"],
            {
                float(speed): PublishedFold(*(fold[name] for name in names))
                for speed, fold in content["by_speed"].items()
            },
        )
        for family, content in _read("accuracy.json")["families"].items()
    }


def published_confusion(name: str) -> NDArray[np.float64]:
    """Return a family's confusion matrix, mean over held-out speeds.

    Returns
    -------
    Shape (13, 13), percent[true, predicted]; every row sums to 100 within rounding. True
    percentages also for vib-TE, where Figure 13 shows twice the percentage.

    Raises
    ------
    KeyError
        If the paper has no such family.
    """
    return np.array(_read("confusion.json")["families"][name], dtype=np.float64)


@cache
def published_textures() -> tuple[str, ...]:
    """Return the 13 published textures a to m by folder name, which is the bump spacing in mm."""
    return tuple(_read("confusion.json")["textures"])


def published_speeds() -> tuple[float, ...]:
    """Return the ten published speeds, mm/s."""
    return tuple(published_families()["sa-se"].by_speed)


def _read(name: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((_FOLDER / name).read_text(encoding="utf-8"))
    return content


def discrepancies() -> str:
    """Return the page of discrepancies of paper and code, in Markdown."""
    return (_FOLDER / "discrepancies.md").read_text(encoding="utf-8")


class Discrepancy(NamedTuple):
    """A point in which paper and code differ.

    Attributes
    ----------
    number, topic, matters, area
        As the page has them; `matters` is A, B or C.
    sides
        What is done, by who does it: `paper`, `code`, and where they differ from the code
        `--like published`, `recommended` and `still different`.
    """

    number: str
    topic: str
    matters: str
    area: str
    sides: dict[str, str]

    @property
    def columns(self) -> tuple[str, str, str]:
        """What the paper says, what its code does, and what is done here."""
        here = [f"{who}: {text}" for who, text in [*self.sides.items()][2:]]
        return self.sides["paper"], self.sides["code"], "\n".join(here)


def list_discrepancies() -> list[Discrepancy]:
    """Return the page's points."""
    found: list[Discrepancy] = []
    for line in discrepancies().splitlines():
        if head := _POINT.match(line):
            found.append(Discrepancy(head[1], head[2], head[3], head[4], {}))
        elif side := _SIDE.match(line):
            found[-1].sides[side[1].strip("`")] = side[2].replace("`", "")
    return found


def list_sections() -> dict[str, list[tuple[str, str]]]:
    """Return topics and texts of the page's other sections, by title."""
    _, *sections = discrepancies().split("\n## ")
    return {
        one.partition("\n")[0]: re.findall(r"^- \*\*(.*?)\.\*\* (.*)", one, re.MULTILINE)
        for one in sections
    }


def remaining_discrepancies() -> list[str]:
    """Return, in a sentence each, where ``--like published`` still differs from the code."""
    of_code = (
        f"{one.number}. {one.sides[_DIFFERENT]}"
        for one in list_discrepancies()
        if _DIFFERENT in one.sides
    )
    return [*of_code, *(f"{topic}: {text}" for topic, text in list_sections()[_OF_SOFTWARE])]
