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
_NUMBERED = re.compile(r"^(\d+\.) \*\*(.*)\*\*")
_DIFFERENT = "    - still different: "
_OF_SOFTWARE = "## Where the software alone differs"


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


def remaining_discrepancies() -> list[str]:
    """Return, in a sentence each, where ``--like published`` still differs from the code."""
    of_code, _, rest = discrepancies().partition(_OF_SOFTWARE)
    of_software, _, _ = rest.partition("\n## ")
    found, number = [], ""
    for line in of_code.splitlines():
        if numbered := _NUMBERED.match(line):
            number = numbered[1]
        elif line.startswith(_DIFFERENT):
            found.append(f"{number} {line.removeprefix(_DIFFERENT)}")
    software = re.findall(r"^- \*\*(.*?)\.\*\* (.*)", of_software, re.MULTILINE)
    return [*found, *(f"{topic}: {text}" for topic, text in software)]
