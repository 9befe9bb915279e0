"""Where the paper's text and the authors' code differ, and what is done about each here.

The list is `published/discrepancies.toml`. `afferents reproduce --discrepancies` prints its page,
which is docs/discrepancies.md; a test keeps the two alike.
"""

from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from afferents.documents import as_form, read_toml

Text = Annotated[str, Field(min_length=1)]
AS_THE_CODE = "As the code."
_FILE = Path(str(files("afferents.reporting"))) / "published" / "discrepancies.toml"
_WEIGHTS = {
    "A": "changes numbers, or what they mean",
    "B": "changes a reproduction",
    "C": "wording or labels",
}


class _Form(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Discrepancy(_Form):
    """One place where the paper's text and its code say different things, or one of them slips.

    Attributes
    ----------
    number
        From 1, in the order of the list.
    part
        Of the work: training, data, features, figures and text, repository.
    weight
        ``A`` changes numbers or their meaning, ``B`` a reproduction, ``C`` is wording or labels.
    topic
        What it is about.
    paper, code
        What each says.
    published, recommended
        What ``--like published``, and what we recommend, do.
    differs
        How ``--like published`` still differs from the code; empty where it does not.
    """

    number: int = Field(ge=1)
    part: Text
    weight: Literal["A", "B", "C"]
    topic: Text
    paper: Text
    code: Text
    published: Text = AS_THE_CODE
    recommended: str = ""
    differs: str = ""


class Software(_Form):
    """A difference that is of the software alone: other libraries, other arithmetic."""

    topic: Text
    differs: Text


class Discrepancies(_Form):
    """All of them, and where they were found; `figure` is what ``--figures paper`` draws otherwise.

    Each figure has its number or numbers as the topic.
    """

    source: Text
    discrepancy: tuple[Discrepancy, ...]
    figure: tuple[Software, ...]
    software: tuple[Software, ...]

    def remaining(self) -> list[str]:
        """Return, in a sentence each, where ``--like published`` still differs from the code."""
        numbered = [f"{d.number}. {d.differs}" for d in self.discrepancy if d.differs]
        return [*numbered, *(f"{one.topic}: {one.differs}" for one in self.software)]


@cache
def discrepancies() -> Discrepancies:
    """Return the list.

    Raises
    ------
    InputError
        If the file that was installed is damaged.
    """
    what = "the list of discrepancies"
    return as_form(read_toml(_FILE, what), Discrepancies, _FILE, what, "install the package again")


def to_page() -> str:
    """Return the whole list as docs/discrepancies.md, which reads as text too."""
    found = discrepancies()
    listed = []
    for one in found.discrepancy:
        said = {
            "paper": one.paper,
            "code": one.code,
            "`--like published`": "" if one.published == AS_THE_CODE else one.published,
            "recommended": one.recommended,
            "still different": one.differs,
        }
        listed.append(f"{one.number}. **{one.topic}** [{one.weight}, {one.part}]")
        listed += [f"    - {name}: {text}" for name, text in said.items() if text]
    software, figures = (
        "\n".join(f"- **{one.topic}.** {one.differs}" for one in of)
        for of in (found.software, found.figure)
    )
    return _PAGE.format(
        n=len(found.discrepancy),
        source=found.source,
        weights="; ".join(f"**{letter}** {meaning}" for letter, meaning in _WEIGHTS.items()),
        listed="\n".join(listed),
        software=software,
        figures=figures,
    )


_PAGE = """# Where the paper and its code differ

The paper's text and the authors' code disagree in {n} places, or one of them slips. `afferents
reproduce --like published` goes with the code, and so do we, where no line says otherwise. The
letter in brackets says how much it matters: {weights}.

`afferents reproduce --discrepancies` prints this page. It is made by `make results-pages` of the
list in `src/afferents/reporting/published/discrepancies.toml`.

Source: {source}.

{listed}

## Where the software alone differs

{software}

## Where --figures paper differs from the print

`afferents report RESULTS --figures paper` draws the figures as they are printed, but for this:

{figures}
"""
