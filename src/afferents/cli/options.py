"""Options of commands that are made from what stages and encodings say of themselves."""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import wraps
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from typer.core import TyperGroup
from typer.models import OptionInfo

if TYPE_CHECKING:
    from afferents.encodings.base import Option

# Options of encodings: made from what the encodings say of themselves, listed nowhere else.
#
# A command that takes them ends in ``**encoding`` and stands under `takes_encodings`. Encodings
# take a second to import, so its options are made when it is called, not when commands are listed.

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
    from afferents.encodings.base import Encoding
    from afferents.encodings.settings import options

    own = (model.encoding for model in _own_models(arguments))
    extra = [encoding.options() for encoding in own if isinstance(encoding, Encoding)]
    found = options()
    for more in extra:
        found |= {name: option for name, option in more.items() if name not in found}
    return found


def _own_models(arguments: Sequence[str]) -> Iterator[Any]:
    """Return models from outside the package that arguments name, as in ``--models x.py:NAME``."""
    from afferents.models.model import models_in

    texts = [part for text in arguments for part in text.split("=", 1)]
    for flag, names in pairwise(texts):
        if flag in ("--models", "--model"):
            own = [name for name in names.split(",") if ":" in name]
            yield from models_in(",".join(own)) if own else []


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


# Options of the stages for a command that goes through several: theirs, listed nowhere else.


def takes_options_of(
    stages: Mapping[str, Command], own: tuple[str, ...], values: Mapping[str, str]
) -> Callable[[Command], Command]:
    """Give a command that ends in ``**options`` those of other commands, None where not given.

    Parameters
    ----------
    stages
        The commands, by the heading under which help lists their options. What two have is listed
        once.
    own
        Parameters of theirs that the command sets itself, arguments among them.
    values
        By parameter: what the option is unless given, for its help.
    """

    def with_options(command: Command) -> Command:
        signature = inspect.signature(command)
        mine = [p for p in signature.parameters.values() if p.kind is not p.VAR_KEYWORD]
        taken = {*own, *(p.name for p in mine)}
        added: list[inspect.Parameter] = []
        for heading, stage in stages.items():
            for parameter in inspect.signature(stage).parameters.values():
                if parameter.name not in taken:
                    taken.add(parameter.name)
                    added.append(_optional(parameter, heading, values))
        rest = inspect.Parameter("options", inspect.Parameter.VAR_KEYWORD, annotation=Any)

        @wraps(command)
        def call(**given: Any) -> None:
            command(**given)

        parameters = [*mine, *added]
        call.__signature__ = signature.replace(parameters=[*parameters, rest])  # type: ignore[attr-defined]
        call.__annotations__ = {p.name: p.annotation for p in parameters} | {"return": None}
        return call

    return with_options


def _optional(
    parameter: inspect.Parameter, heading: str, values: Mapping[str, str]
) -> inspect.Parameter:
    """Return an option that is None unless it is given."""
    kind, *about = get_args(parameter.annotation)
    option = copy(next(one for one in about if isinstance(one, OptionInfo)))
    option.rich_help_panel = option.rich_help_panel or heading
    if parameter.name in values:
        option.help = f"{option.help} Default: {values[parameter.name]}."
    return parameter.replace(
        default=None,
        annotation=Annotated[kind | None, option],
        kind=inspect.Parameter.KEYWORD_ONLY,
    )
