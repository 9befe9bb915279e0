"""Where the paper's text and the authors' code differ, and what is done about each here.

The page is `published/discrepancies.md`, which `afferents reproduce --discrepancies` prints and the
docs include.
"""

import re
from importlib.resources import files

_NUMBERED = re.compile(r"^(\d+\.) \*\*(.*)\*\*")
_DIFFERENT = "    - still different: "
_OF_SOFTWARE = "## Where the software alone differs"


def discrepancies() -> str:
    """Return the page, in Markdown."""
    page = files("afferents.reporting") / "published" / "discrepancies.md"
    return page.read_text(encoding="utf-8")


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
