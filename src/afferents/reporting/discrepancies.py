"""Where the paper's text and the authors' code differ, and what is done about each here.

The list is `published/discrepancies.toml`. `afferents reproduce` prints it, and
docs/discrepancies.md is `to_page()`; a test keeps the two alike.
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

    def whole(self) -> list[str]:
        """Return the whole list as lines of plain text."""
        lines = [self.source, ""]
        for one in self.discrepancy:
            lines += [
                f"{one.number}. {one.topic} [{one.weight}, {one.part}]",
                f"   paper: {one.paper}",
                f"   code: {one.code}",
                f"   --like published: {one.published}",
                f"   recommended: {one.recommended or 'the same.'}",
                *([f"   still different: {one.differs}"] if one.differs else []),
                "",
            ]
        lines += ["Differences of the software alone:", ""]
        return lines + [f"- {one.topic}: {one.differs}" for one in self.software]


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
    """Return the list as docs/discrepancies.md."""
    found = discrepancies()
    parts = dict.fromkeys(one.part for one in found.discrepancy)
    weights = "; ".join(f"**{letter}** {meaning}" for letter, meaning in _WEIGHTS.items())
    sections = [f"## {part}\n\n{_table(found, part)}" for part in parts]
    software, figures = (
        "\n".join(f"- **{one.topic}.** {one.differs}" for one in listed)
        for listed in (found.software, found.figure)
    )
    remaining = "\n".join(f"- {one}" for one in found.remaining()[: -len(found.software)])
    return _PAGE.format(
        n=len(found.discrepancy),
        source=found.source,
        weights=weights,
        sections="\n".join(sections),
        remaining=remaining,
        software=software,
        figures=figures,
    )


def _table(found: Discrepancies, part: str) -> str:
    """Return what is of one part of the work, as a table in Markdown."""
    rows = [_HEAD, ("---",) * len(_HEAD)]
    rows += [
        (f"{one.number} {one.weight}", one.topic, one.paper, one.code,
         "" if one.published == AS_THE_CODE else one.published, one.recommended)
        for one in found.discrepancy
        if one.part == part
    ]  # fmt: skip
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


_HEAD = ("", "topic", "paper's text", "authors' code", "`--like published`", "recommended")
_PAGE = """# Where the paper and its code differ

The paper's text and the authors' code disagree in {n} places, or one of them slips. `afferents
reproduce --like published` goes with the code. In the last two columns an empty cell says "as the
code" and "the same". The letter after the number says how much it matters: {weights}.

`afferents reproduce --discrepancies` prints the list. This page is made of it by `make
results-pages`; the list is `src/afferents/reporting/published/discrepancies.toml`.

Source: {source}.

{sections}
## Where --like published still differs from the code

By the numbers above:

{remaining}

In the software alone:

{software}

## Where --figures paper differs from the print

`afferents report RESULTS --figures paper` draws the figures as they are printed, but for this:

{figures}
"""
