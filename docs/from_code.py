"""Pages' parts that are made from the code whenever the site is built: a Sphinx extension.

What a table lists can't then differ from what the package has. The parts lie in `docs/generated`,
and pages include them.
"""

import ast
import inspect
import re
import tomllib
from pathlib import Path
from typing import Any

from pydantic import BaseModel

import afferents
from afferents.evaluation.fold_files import Epoch, FoldFacts, FoldKey
from afferents.evaluation.job_status import Failed, Plan, Running
from afferents.evaluation.schemas import (
    Comparison,
    FirstEpoch,
    Intervals,
    Lost,
    OfTouches,
    Outcome,
    Reliability,
    RoughnessOutcome,
    RoughnessSummary,
    Summary,
    UnknownBySpeed,
    UnknownOutcome,
    UnknownSummary,
    UnknownTexture,
)

DOCS = Path(__file__).parent
OUT = DOCS / "generated"
SOURCE = Path(afferents.__file__).parent


def first_sentence(text: str | None) -> str:
    """Return a docstring's first line, without the full stop."""
    return (text or "").strip().split("\n\n")[0].replace("\n", " ").removesuffix(".")


def said_of(package: str) -> str:
    """Return what a package's docstring says first, without importing it."""
    place = SOURCE / package.removeprefix("afferents.")
    file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    return first_sentence(ast.get_docstring(ast.parse(file.read_text())))


def layers() -> list[list[str]]:
    """Return packages from the top layer down, as the import contract in pyproject.toml has it."""
    project = tomllib.loads((DOCS.parent / "pyproject.toml").read_text())
    contracts = project["tool"]["importlinter"]["contracts"]
    (contract,) = (each for each in contracts if each["type"] == "layers")
    return [re.split(r" [|:] ", layer) for layer in contract["layers"]]


def architecture() -> str:
    """Return the layers as rows of cards."""
    rows = []
    for layer in layers():
        columns = "1 2 2 2" if len(layer) > 1 else "1"
        rows.append(f"::::{{grid}} {columns}\n:gutter: 2\n:class-container: layer\n")
        for package in layer:
            name = package.removeprefix("afferents.")
            rows.append(f":::{{grid-item-card}} `{name}`\n{said_of(package)}.\n:::\n")
        rows.append("::::\n")
    return "\n".join(rows)


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ("---",) * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _code(*names: str) -> str:
    return ", ".join(f"`{name}`" for name in names)


def models() -> str:
    """Return the table of all models."""
    speed = {"nobody": "no", "robot": "yes, from the robot", "fingertip": "measured by itself"}
    rows = []
    for model in afferents.MODELS.values():
        parts = [afferents.MODELS[name] for name in model.parts] or [model]
        rows.append(
            (
                _code(model.name),
                model.title,
                _code(*dict.fromkeys(part.channel for part in parts)),
                _code(*dict.fromkeys(part.encoding for part in parts)),
                _code(model.classifier),
                speed[model.speed_from],
                "yes" if model.stretched else "",
                _code(*model.parts) if model.parts else "",
            )
        )
    head = ("model", "in tables", "channel", "encoding", "classifier", "told the speed?")
    return table((*head, "learns from stretched copies", "joins"), rows)


def things(named: dict[str, Any]) -> str:
    """Return the table of channels, encodings, or classifiers: a name, and what it is."""
    rows = []
    for name, thing in named.items():
        kind = thing if inspect.isclass(thing) else type(thing)
        rows.append((_code(name), f"{first_sentence(kind.__doc__)}."))
    return table(("name", "what it is"), rows)


def fields(*models: type[BaseModel]) -> str:
    """Return the tables of what stands in a file: the fields of models, and what each is.

    A field of several models stands in the first table alone.
    """
    tables, seen = [], set()
    for model in models:
        rows = [
            (_code(field.alias or name), (field.description or "").replace("\n", " "))
            for name, field in model.model_fields.items()
        ]
        new = [row for row in rows if row not in seen]
        seen.update(rows)
        tables.append(f"{first_sentence(model.__doc__)}.\n\n{table(('field', 'what it is'), new)}")
    return "\n".join(tables)


def schemas() -> dict[str, str]:
    """Return the tables of all files of a results folder, by name of the page's part."""
    return {
        "summary-fields.md": fields(
            Summary, Outcome, OfTouches, Reliability, FirstEpoch, Intervals, Lost, Comparison
        ),
        "unknown-fields.md": fields(UnknownSummary, UnknownOutcome, UnknownBySpeed, UnknownTexture),
        "roughness-fields.md": fields(RoughnessSummary, RoughnessOutcome),
        "fold-fields.md": fields(FoldFacts, Epoch),
        "plan-fields.md": fields(Plan, FoldKey, Running, Failed),
    }


def parts() -> dict[str, str]:
    """Return all parts of pages, by name of file."""
    return {
        "architecture.md": architecture(),
        "models.md": models(),
        "channels.md": things(dict(afferents.CHANNELS)),
        "encodings.md": things(dict(afferents.ENCODINGS)),
        "classifiers.md": things(dict(afferents.CLASSIFIERS)),
        "data-sets.md": things({each.name: each for each in afferents.DATA_SETS.values()}),
        **schemas(),
    }


def write(app: Any = None) -> None:
    """Write the parts, those alone that have changed."""
    OUT.mkdir(exist_ok=True)
    for name, text in parts().items():
        path = OUT / name
        if not path.is_file() or path.read_text() != text:
            path.write_text(text)


def setup(app: Any) -> dict[str, bool]:
    """Write the parts before pages are read."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
