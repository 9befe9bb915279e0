"""What functions of the package take, read from their source: nothing of it is imported for help.

Importing what computes takes seconds; a signature and its docstring stand in the source as text.
"""

import ast
import inspect
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from afferents import choices

PACKAGE = Path(__file__).parents[1]
REQUIRED = inspect.Parameter.empty
_KINDS: dict[str, Any] = {
    **{name: kind for name, kind in vars(choices).items() if not name.startswith("_")},
    "Path": Path, "Place": Path, "bool": bool, "int": int, "float": float,
}  # fmt: skip
"""By annotation, what a word of the command line is turned into; it stays text for all others."""


@dataclass(frozen=True)
class Argument:
    """An argument of a function, or a field of a model.

    Attributes
    ----------
    kind
        What a word of the command line is turned into.
    default
        `REQUIRED` for none; None also for what is computed when the function is called.
    """

    name: str
    kind: Any
    default: Any
    help: str = ""


@dataclass(frozen=True)
class Signature:
    """The arguments of a function, and the text of its docstring."""

    arguments: tuple[Argument, ...]
    text: str


def read_first_line(where: str) -> str:
    """Return the first line of a function's docstring, given ``package.module:function``."""
    module, _, name = where.partition(":")
    found = re.search(
        rf'^def {name}\(.*?"""(.*?)(\n|""")', _source(module), re.DOTALL | re.MULTILINE
    )
    assert found, where
    return _plain(found[1])


@cache
def read_signature(where: str) -> Signature:
    """Return what ``package.module:function`` takes."""
    from docstring_parser import DocstringStyle, parse

    module, _, name = where.partition(":")
    tree = ast.parse(_source(module))
    node = next(n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == name)
    doc = parse(ast.get_docstring(node) or "", DocstringStyle.NUMPYDOC)
    helps = {one.arg_name: _plain(one.description or "") for one in doc.params}
    every = [*node.args.args, *node.args.kwonlyargs]
    without = [None] * (len(node.args.args) - len(node.args.defaults))
    defaults = [*without, *node.args.defaults, *node.args.kw_defaults]
    arguments = tuple(
        Argument(one.arg, _kind(one.annotation, value), _value(value, tree), helps.get(one.arg, ""))
        for one, value in zip(every, defaults, strict=True)
    )
    text = "\n\n".join(filter(None, (doc.short_description, doc.long_description)))
    return Signature(arguments, _plain(text, keep_paragraphs=True))


@cache
def read_fields(where: str) -> tuple[Argument, ...]:
    """Return the fields of a pydantic model, ``package.module:Model``; its own come first."""
    module, _, name = where.partition(":")
    tree = ast.parse(_source(module))
    node = next(n for n in tree.body if isinstance(n, ast.ClassDef) and n.name == name)
    names = {n.name for n in tree.body if isinstance(n, ast.ClassDef)}
    found: list[Argument] = []
    for field, after in zip(node.body, [*node.body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name):
            about = after.value if isinstance(after, ast.Expr) else None
            text = str(about.value) if isinstance(about, ast.Constant) else ""
            first, *_ = text.split("\n\n")
            kind, default = _kind(field.annotation, field.value), _value(field.value, tree)
            found.append(Argument(field.target.id, kind, default, _plain(first)))
    for base in node.bases:
        if isinstance(base, ast.Name) and base.id in names:
            found += read_fields(f"{module}:{base.id}")
    return tuple(found)


def _file(module: str) -> Path:
    return PACKAGE.parent.joinpath(*module.split(".")).with_suffix(".py")


def _source(module: str) -> str:
    return _file(module).read_text(encoding="utf-8")


def _value(node: ast.expr | None, tree: ast.Module) -> Any:
    """Return a default of a module's function; None for what is empty or computed."""
    if node is None:
        return REQUIRED
    if isinstance(node, ast.Name | ast.Attribute):
        return _find_constant(ast.unparse(node), tree)
    try:
        found = ast.literal_eval(node)
    except ValueError:
        return None
    return None if found == () else found


def _find_constant(name: str, tree: ast.Module) -> Any:
    """Return the value of a name in a module, which it may import from another, or that module."""
    within, _, last = name.rpartition(".")
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and (within or name) in [n.name for n in node.names]:
            module = f"{node.module}.{within}" if within else str(node.module)
            if not _file(module).is_file():  # a field of an object that is imported
                return None
            return _find_constant(last, ast.parse(_source(module)))
        targets = node.targets if isinstance(node, ast.Assign) else []
        targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
        if isinstance(node, ast.Assign | ast.AnnAssign) and name in map(ast.unparse, targets):
            return _value(node.value, tree)
    return None


def _kind(annotation: ast.expr | None, default: ast.expr | None) -> Any:
    """Return what a word of the command line is turned into."""
    parts = ast.unparse(annotation).strip("'\"").split(" | ") if annotation else []
    kinds = [part.removeprefix("Sequence[").rstrip("]") for part in parts if part != "None"]
    usual = type(default.value) if isinstance(default, ast.Constant) else str
    usual = usual if usual in (int, float) else str
    return _KINDS.get(kinds[0].rpartition(".")[2], usual) if len(kinds) == 1 else usual


def _plain(text: str, keep_paragraphs: bool = False) -> str:
    """Return text of a docstring as a terminal shows it: no markup, nothing on Python alone."""
    text = re.sub(r"\s+In\s+Python\b.*", "", text, flags=re.DOTALL)
    text = re.sub(r"``(.*?)``", r"'\1'", text, flags=re.DOTALL)
    text = re.sub(r"`(?:afferents\.(?:\w+\.)*)?(.*?)`", r"\1", text, flags=re.DOTALL)
    paragraphs = [" ".join(one.split()) for one in text.split("\n\n")]
    return "\n\n".join(paragraphs) if keep_paragraphs else " ".join(paragraphs)
