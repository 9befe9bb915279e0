"""Options of encodings: made from what the encodings say of themselves, listed nowhere else.

A command that takes them ends in ``**encoding`` and stands under `takes_encodings`. Encodings take
a second to import, so its options are made when it is called, not when commands are listed.
"""

import inspect
from collections.abc import Callable, Iterator, Sequence
from functools import wraps
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

if TYPE_CHECKING:
    from afferents.encodings import Option

Command = Callable[..., None]
PANEL = "Options of encodings (how samples are cut from recordings)"

_TAKING: dict[str, Command] = {}
"""Commands that take options of encodings, by name, as they are written."""


def takes_encodings(command: Command) -> Command:
    """Return a command without its ``**encoding``; a call of it by `Commands` has the options."""
    _TAKING[command.__name__] = command
    return _with_options(command, {})


class Commands(TyperGroup):
    """The commands; one that takes options of encodings gets them when it is called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, command and arguments of a call."""
        name, command, rest = super().resolve_command(ctx, args)
        if name in _TAKING:
            command = _made(_with_options(_TAKING[name], _options(rest)))
        return name, command, rest


def _options(arguments: Sequence[str]) -> dict[str, "Option"]:
    """Return the options of all encodings, and of one's own that the arguments name models of."""
    from afferents.encodings import Encoding, options

    own = (model.encoding for model in _own_models(arguments))
    extra = [encoding.options() for encoding in own if isinstance(encoding, Encoding)]
    found = options()
    for more in extra:
        found |= {name: option for name, option in more.items() if name not in found}
    return found


def _own_models(arguments: Sequence[str]) -> Iterator[Any]:
    """Return models from outside the package that arguments name, as in ``--models x.py:NAME``."""
    from afferents.core.model import models_named

    texts = [part for text in arguments for part in text.split("=", 1)]
    for flag, names in pairwise(texts):
        if flag in ("--models", "--model"):
            own = [name for name in names.split(",") if ":" in name]
            yield from models_named(",".join(own)) if own else []


def _with_options(command: Command, options: dict[str, "Option"]) -> Command:
    """Return a command with a keyword for each option instead of its ``**encoding``."""
    signature = inspect.signature(command)
    own = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
    keyword = inspect.Parameter.KEYWORD_ONLY
    added = [
        inspect.Parameter(name, keyword, default=None, annotation=_annotation(option))
        for name, option in options.items()
    ]

    @wraps(command)
    def call(**given: Any) -> None:
        command(**given)

    call.__signature__ = signature.replace(parameters=own + added)  # type: ignore[attr-defined]
    call.__annotations__ = {p.name: p.annotation for p in own + added} | {"return": None}
    return call


def _annotation(option: "Option") -> Any:
    """Return the annotation by which typer reads an option."""
    stated = typer.Option(option.flag, help=option.help, rich_help_panel=PANEL)
    return Annotated[option.kind | None, stated]


def _made(command: Command) -> Any:
    """Return a function as a command of click."""
    alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    alone.command()(command)
    return typer.main.get_command(alone)
