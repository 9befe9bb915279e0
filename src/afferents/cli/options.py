"""Options of commands that are made from what holds them: fields of a model, or an encoding.

A command that ends in ``**options`` is given them when it is called, not when commands are listed:
what holds them takes a second to import. `Commands` also gives every command whose options fill
more than a screen ``--config``, ``--set`` and ``--help-all``, and hides those that few need.
"""

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy
from functools import wraps
from itertools import pairwise
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Union, get_args, get_origin

import typer
from typer.core import TyperGroup
from typer.models import OptionInfo

from afferents.choices import flag_of
from afferents.documents import read_json, read_toml
from afferents.errors import InputError

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

Command = Callable[..., None]
Options = Mapping[str, tuple[Any, OptionInfo]]
"""By parameter: how an option is read, and what help says of it."""
Source = Callable[[Sequence[str]], Options]
"""Gives options when a command is called with some arguments."""
PANEL = "Options of encodings (how samples are cut from recordings)"
RARE = "Further options"

_SOURCES: dict[str, tuple[Source, ...]] = {}
"""By name of a command: what gives it options once it is called."""
_WRITTEN: dict[str, Command] = {}
"""Such commands, as they are written."""
_SHOWN: dict[str, tuple[str, ...]] = {}
"""By name of a command: the options that ``--help`` lists, where it has more."""


def text(value: Any) -> Any:
    """Return text as it is typed, or what a file has in its place: a list, a table, a number."""
    return value


def shows(*names: str) -> Callable[[Command], Command]:
    """Let ``--help`` list these options of a command alone, and ``--help-all`` all."""

    def register(command: Command) -> Command:
        _SHOWN[command.__name__] = names
        _WRITTEN.setdefault(command.__name__, command)
        return command

    return register


def takes(*sources: Source) -> Callable[[Command], Command]:
    """Give a command that ends in ``**options`` what sources have for it, None if not given."""

    def register(command: Command) -> Command:
        _SOURCES[command.__name__] = sources
        _WRITTEN[command.__name__] = command
        return _closed(command)

    return register


def fields_of(
    model: Literal["EvaluationOptions", "TrainingOptions"], values: Mapping[str, str] = {}
) -> Source:
    """Return a source of all that is chosen by fields of a model of `evaluation.options`.

    Parameters
    ----------
    values
        By field: what it is unless given, for its help.
    """

    def options(arguments: Sequence[str]) -> Options:
        from afferents.evaluation import options

        fields = getattr(options, model).model_fields.items()
        return {name: _option_of(name, field, values.get(name)) for name, field in fields}

    return options


def of_encodings(arguments: Sequence[str]) -> Options:
    """Return the options of all encodings, and of one's own that the arguments name models of."""
    from afferents.encodings.base import Encoding
    from afferents.encodings.settings import options

    found = options()
    for encoding in (model.encoding for model in _own_models(arguments)):
        if isinstance(encoding, Encoding):
            found = encoding.options() | found
    return {
        name: (
            text if option.kind is str else option.kind,
            typer.Option(option.flag, help=option.help, rich_help_panel=PANEL),
        )
        for name, option in found.items()
    }


def options_of(stage: Command, own: tuple[str, ...], values: Mapping[str, str]) -> Source:
    """Return a source of the options of another command.

    Parameters
    ----------
    own
        Parameters of the other that the command sets itself, arguments among them.
    values
        By parameter: what the option is unless given, for its help.
    """

    def options(arguments: Sequence[str]) -> Options:
        found = {}
        for name, parameter in inspect.signature(stage).parameters.items():
            if name not in own:
                kind, *about = get_args(parameter.annotation)
                option = copy(next(one for one in about if isinstance(one, OptionInfo)))
                if name in values:
                    option.help = f"{option.help} (default: {values[name]})"
                found[name] = kind, option
        return found

    return options


class Commands(TyperGroup):
    """The commands; one that takes options from elsewhere gets them when it is called."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the name, command and arguments of a call."""
        name, command, rest = super().resolve_command(ctx, args)
        if name in _WRITTEN:
            function = _WRITTEN[name]
            for options in _SOURCES.get(name, ()):
                function = _with_options(function, options(rest))
            function = _closed(function)
            if name in _SHOWN:
                function = _with_configuration(function, _SHOWN[name])
            alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
            alone.command()(function)
            command = typer.main.get_command(alone)
        return name, command, rest


# Options as typer reads them.


def _option_of(name: str, field: "FieldInfo", value: str | None) -> tuple[Any, OptionInfo]:
    """Return how an option is read that stands for a field, and what help says of it."""
    first, *_ = (field.description or "").split("\n\n")
    said, usual = " ".join(first.split()), value or field.default
    if isinstance(usual, str | int | float) and usual is not False and "(default" not in said:
        said = f"{said} (default: {usual})"
    return _kind(field.annotation), typer.Option(flag_of(name), help=said)


def _kind(annotation: Any) -> Any:
    """Return the type by which typer reads a field: a plain one, a list of texts, or `text`."""
    if get_origin(annotation) in (Union, UnionType):
        kinds = [one for one in get_args(annotation) if one is not NoneType]
        return _kind(kinds[0]) if len(kinds) == 1 else text
    if get_origin(annotation) is Literal or annotation in (int, float, bool):
        return annotation
    return list[str] if get_origin(annotation) is dict else text


def _with_options(command: Command, options: Options) -> Command:
    """Return a command with a keyword for each option that it has not, None unless given."""
    signature, keyword = inspect.signature(command), inspect.Parameter.KEYWORD_ONLY
    parameters = list(signature.parameters.values())
    for name, (kind, option) in options.items():
        if name not in signature.parameters:
            if kind is text:
                option.parser = text
            read: Any = str if kind is text else kind
            annotation = Annotated[read | None, option]
            new = inspect.Parameter(name, keyword, default=None, annotation=annotation)
            parameters.append(new)
    parameters.sort(key=lambda one: one.kind)  # the ** that takes them comes last
    return _called_with(command, parameters)


def _closed(command: Command) -> Command:
    """Return a command without its ``**options``, which typer can't read."""
    parameters = inspect.signature(command).parameters.values()
    return _called_with(command, [one for one in parameters if one.kind is not one.VAR_KEYWORD])


def _called_with(command: Command, parameters: Sequence[inspect.Parameter]) -> Command:
    @wraps(command)
    def call(**given: Any) -> None:
        command(**given)

    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {one.name: one.annotation for one in parameters} | {"return": None}
    return call


def _own_models(arguments: Sequence[str]) -> Iterator[Any]:
    """Return models from outside the package that arguments name, as in ``--models x.py:NAME``."""
    from afferents.models.model import models_in

    texts = [part for text in arguments for part in text.split("=", 1)]
    for flag, names in pairwise(texts):
        if flag == "--config":
            try:
                content = _configured(Path(names), "options by name")
            except InputError:  # which reading the options says in better words
                continue
            listed = content.get("models", content.get("model", ""))
            names = ",".join(map(str, listed)) if isinstance(listed, list) else str(listed)
        elif flag.removeprefix("--") not in ("models", "model"):  # --set models=FILE.py:NAME
            continue
        own = [name for name in names.split(",") if ":" in name]
        yield from models_in(",".join(own)) if own else []


# Options by name: from a file, or one by one; and help with all of them.


def _with_configuration(command: Command, shown: Sequence[str]) -> Command:
    """Return a command with ``--config``, ``--set`` and ``--help-all``, rare options hidden."""
    parameters = []
    for one in inspect.signature(command).parameters.values():
        kind, about = get_args(one.annotation)
        if isinstance(about, OptionInfo) and one.name not in shown:
            about = copy(about)
            about.hidden, about.rich_help_panel = True, about.rich_help_panel or RARE
        parameters.append(one.replace(annotation=Annotated[kind, about]))
    keyword = inspect.Parameter.KEYWORD_ONLY
    added = [
        inspect.Parameter(name, keyword, default=default, annotation=annotation)
        for name, default, annotation in _CONFIGURATION
    ]

    def call(**given: Any) -> None:
        command(**{name: v for name, v in given.items() if name not in _ADDED})

    rank = {name: place for place, name in enumerate(shown)}
    needed = inspect.Parameter.empty
    parameters.sort(key=lambda p: (p.kind, p.default is not needed, rank.get(p.name, len(rank))))
    return _called_with(wraps(command)(call), [*parameters, *added])


def _help_all(ctx: typer.Context, wanted: bool) -> None:
    if wanted:
        for one in ctx.command.params:
            if hasattr(one, "hidden"):
                one.hidden = False
        typer.echo(ctx.get_help())
        raise typer.Exit


def _read_config(ctx: typer.Context, path: Path | None) -> None:
    if path is not None:
        what = f"options of 'afferents {ctx.info_name}' by name"
        _take(ctx, _configured(path, what), path, replace=False)


def _configured(path: Path, what: str) -> Mapping[str, Any]:
    """Return the options that a file gives, by name."""
    if path.suffix != ".json":
        return read_toml(path, what)
    content = read_json(path, what)
    data = content.get("data")
    given = data if isinstance(data, list) else []
    sources = [one["source"] for one in given if isinstance(one, dict) and "source" in one]
    if not sources or len(sources) < len(given):  # no results folder's
        return content
    return {"data": sources, **content.get("options", {})}


def _read_set(ctx: typer.Context, pairs: list[str] | None) -> None:
    for pair in pairs or ():
        name, found, value = pair.partition("=")
        if not found:
            raise InputError(f"--set: expected NAME=VALUE, such as seed=3, found '{pair}'")
        _take(ctx, {name: value}, "--set", replace=True)


_CONFIGURATION = (
    ("config", None, Annotated[Path | None, typer.Option(
        callback=_read_config, is_eager=True, metavar="FILE",
        help="Options by name from a TOML file, or from the config.json of a results folder.",
    )]),
    ("set_", None, Annotated[list[str] | None, typer.Option(
        "--set", callback=_read_set, is_eager=True, metavar="NAME=VALUE",
        help="One option by name, before what a file says; may be repeated.",
    )]),
    ("help_all", False, Annotated[bool, typer.Option(
        "--help-all", callback=_help_all, is_eager=True, help="Show all options and exit.",
    )]),
)  # fmt: skip
_ADDED = frozenset(name for name, *_ in _CONFIGURATION)


def _take(ctx: typer.Context, given: Mapping[str, Any], where: object, replace: bool) -> None:
    """Make values those that options have unless they are given as flags."""
    known = {one.name: one for one in ctx.command.params if one.name not in _ADDED}
    values: dict[str, Any] = {}
    for key, value in given.items():
        name = key.strip().replace("-", "_")
        if name not in known:
            expected = f"options of 'afferents {ctx.info_name}', as --help-all lists them"
            raise InputError(f"{where}: expected {expected}, found '{key}'")
        if getattr(known[name], "multiple", False) or known[name].nargs == -1:
            pairs = value.items() if isinstance(value, Mapping) else ()
            value = [f"{k}={v}" for k, v in pairs] or ([value] if isinstance(value, str) else value)
        values[name] = value
    before = dict(ctx.default_map or {})
    ctx.default_map = {**before, **values} if replace else {**values, **before}
