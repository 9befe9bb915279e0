"""Docstrings end with the names that stand beside theirs on the page of the API: for Sphinx."""

import re
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parent / "api.md"


def see_also(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """End a docstring with the names beside it in its section of `api.md`, the next ones first."""
    for section in PAGE.read_text().split("\n## "):
        listed = re.findall(r"^   (afferents\.[\w.]+)$", section, re.M)
        if name in listed and len(listed) > 1:
            at = listed.index(name)
            near = sorted(set(listed) - {name}, key=lambda one: abs(listed.index(one) - at))
            lines += ["", f".. seealso:: {', '.join(f':obj:`{one}`' for one in near[:5])}", ""]


def setup(app: Any) -> dict[str, bool]:
    """Add the names to each docstring that is read."""
    app.connect("autodoc-process-docstring", see_also)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
