"""Pages' parts that are made from the code whenever the site is built: a Sphinx extension.

What a table lists can't then differ from what the package has. The parts lie in `docs/generated`,
and pages include them. Docstrings end with the names that stand beside theirs on the page of the
API.
"""

import inspect
import re
from pathlib import Path
from typing import Any

import afferents

DOCS = Path(__file__).parent
OUT = DOCS / "generated"


def first_sentence(text: str | None) -> str:
    """Return a docstring's first line, without the full stop."""
    return (text or "").strip().split("\n\n")[0].replace("\n", " ").removesuffix(".")


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _code(*names: str) -> str:
    return ", ".join(f"`{name}`" for name in names)


def models() -> str:
    """Return the table of all models."""
    rows = []
    for model in afferents.MODELS.values():
        parts = [afferents.MODELS[name] for name in model.parts] or [model]
        given = {"robot": "given", "fingertip": "measured"}.get(model.speed_from, "")
        channels = _code(*dict.fromkeys(part.channel for part in parts))
        encodings = _code(*dict.fromkeys(part.encoding for part in parts))
        rows.append(
            (_code(model.name), model.title, channels, encodings, _code(model.classifier), given)
        )
    return table(("model", "in tables", "channel", "encoding", "classifier", "speed"), rows)


def things(named: dict[str, Any]) -> str:
    """Return the table of channels, encodings, or classifiers: a name, and what it is."""
    rows = []
    for name, thing in named.items():
        kind = thing if inspect.isclass(thing) else type(thing)
        rows.append((_code(name), f"{first_sentence(kind.__doc__)}."))
    return table(("name", "what it is"), rows)


def parts() -> dict[str, str]:
    """Return all parts of pages, by name of file."""
    return {
        "models.md": models(),
        "channels.md": things(dict(afferents.CHANNELS)),
        "encodings.md": things(dict(afferents.ENCODINGS)),
        "classifiers.md": things(dict(afferents.CLASSIFIERS)),
    }


def write(app: Any = None) -> None:
    """Write the parts, those alone that have changed."""
    OUT.mkdir(exist_ok=True)
    for name, text in parts().items():
        path = OUT / name
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)


def see_also(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """End a docstring with the names beside it in its section of `api.md`, the next ones first."""
    for section in (DOCS / "api.md").read_text().split("\n## "):
        listed = re.findall(r"^   (afferents\.[\w.]+)$", section, re.M)
        if name in listed and len(listed) > 1:
            at = listed.index(name)
            near = sorted(set(listed) - {name}, key=lambda one: abs(listed.index(one) - at))
            lines += ["", f".. seealso:: {', '.join(f':obj:`{one}`' for one in near[:5])}", ""]


def setup(app: Any) -> dict[str, bool]:
    """Write the parts before pages are read."""
    app.connect("builder-inited", write)
    app.connect("autodoc-process-docstring", see_also)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
