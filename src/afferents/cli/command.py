"""A function as a command: options from its signature, help from its docstring, and one call."""

import inspect
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, get_args

from cyclopts import App, CycloptsError, Group, Parameter, exceptions

from afferents.choices import flag_of
from afferents.cli.signatures import REQUIRED, Argument, read_fields, read_signature
from afferents.errors import InputError, PartialFailureError

RARE = Group("Further options", sort_key=9)
ENCODINGS = Group("Options of encodings (how samples are cut from recordings)", sort_key=10)
OPTIONS = Group("Options", sort_key=1)
_OF_ALL = (
    Argument("as_json", bool, False, "Print the outcome as JSON on stdout; no progress bars."),
    Argument("config", Path, None, "Take options by name from this TOML file, or from the "
             "config.json of a results folder; flags overrule it."),
    Argument("help_all", bool, False, "Show all options and exit."),
)  # fmt: skip
"""What every command takes; the last two are listed where some options are not."""
_NUMBERS = {int: "a whole number", float: "a number"}


@dataclass(frozen=True)
class Output:
    """What a command prints.

    Attributes
    ----------
    content
        As JSON, for scripts.
    lines
        Sentences and tables, for people.
    skipped
        Recordings that were left out, and why: exit code 3.
    is_bad
        Whether what was looked at is not as it should be: exit code 2.
    """

    content: Any
    lines: Sequence[Any] = ()
    skipped: Mapping[str, str] = field(default_factory=dict)
    is_bad: bool = False


@dataclass(frozen=True)
class Command:
    """A function of the package as a command.

    Attributes
    ----------
    name
        As it is typed.
    function
        Where it is: ``package.module:function``. What is printed of what it returns says the
        function of `cli.show` that has the command's name; one of `cli` returns an `Output` itself.
    words
        What is given without a flag, in this order; by default what is required.
    several
        What may be given more than once.
    flags
        By argument, how its flag is spelled, where not as its name.
    shown
        What ``--help`` lists; by default all. ``--help-all`` lists the rest, too.
    takes
        Functions, or pydantic models, whose arguments are this one's ``**options``; options of
        encodings are, too.
    """

    name: str
    function: str
    words: tuple[str, ...] | None = None
    several: tuple[str, ...] = ()
    flags: Mapping[str, str] = field(default_factory=dict)
    shown: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()

    @property
    def arguments(self) -> dict[str, Argument]:
        """All that it takes by name: its function's arguments first."""
        found: dict[str, Argument] = {}
        for where in (self.function, *self.takes):
            _, _, name = where.partition(":")
            own = read_fields(where) if name[0].isupper() else read_signature(where).arguments
            for one in own:
                if where == self.function or one.default is not REQUIRED:
                    found.setdefault(one.name, one)
        more = _OF_ALL if self.shown else _OF_ALL[:1]
        return found | {one.name: one for one in more if one.name not in found}

    @property
    def shows(self) -> str:
        """Where what prints the outcome is; empty where the function returns an `Output`."""
        name = "import_" if self.name == "import" else re.sub("[- ]", "_", self.name)
        return "" if self.function.startswith("afferents.cli.") else f"afferents.cli.show:{name}"

    def flag(self, name: str) -> str:
        """Return how an argument's flag is spelled."""
        return self.flags.get(name) or ("--json" if name == "as_json" else flag_of(name))

    @property
    def usage(self) -> str:
        """How it is called, in a line."""
        arguments, words = self.arguments, []
        for name in self._words():
            word = name.upper() + "..." * (name in self.several)
            words.append(word if arguments[name].default is REQUIRED else f"[{word}]")
        for name, one in arguments.items():
            if one.default is REQUIRED and name not in self._words():
                words.append(f"{self.flag(name)} {name.upper()}")
        return f"Usage: afferents {self.name} {' '.join([*words, '[OPTIONS]'])}"

    def app(self, group: Group, show_all: bool = False, from_file: bool = False) -> App:
        """Return the command as cyclopts reads it; called, it returns what it was given by name.

        Parameters
        ----------
        show_all
            Whether help lists all options, those of encodings too.
        from_file
            Whether a file may give what is required.
        """
        words = self._words()
        order = {one: place for place, one in enumerate((*words, *self.shown))}
        listed = sorted(self.arguments.values(), key=lambda one: order.get(one.name, len(order)))
        parameters = [self._parameter(one, show_all, from_file) for one in listed]
        if self.takes:
            parameters += _list_encoding_options() if show_all else [_OTHERS]
        parameters.sort(key=lambda one: (one.kind, one.default is not REQUIRED))

        def call(*given: Any, **options: Any) -> dict[str, Any]:
            if given and any(word in self.several for word in words):
                given = (list(given),)
            return {**dict(zip(words, given, strict=False)), **options}

        call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        call.__annotations__ = {one.name: one.annotation for one in parameters}
        last, text = self.name.split()[-1], read_signature(self.function).text
        return App(last, text, self.usage, default_command=call, group=group, version_flags=())

    def run(self, given: Mapping[str, Any]) -> None:
        """Call the function with what was given by name; print what comes of it.

        Raises
        ------
        InputError
            If something is missing, or no option.
        PartialFailureError
            If recordings were skipped.
        """
        from afferents.cli.printing import say

        options = {key.replace("-", "_"): value for key, value in given.items()}
        if path := options.pop("config", None):
            options = {**self._in_file(path), **options}
        arguments = self.arguments
        for one in arguments.values():
            if one.default is REQUIRED and one.name not in options:
                where = one.name.upper() if one.name in self._words() else self.flag(one.name)
                raise InputError(f"{where}: expected a value, found none; {_see(self.name)}")
        if others := set(options) - set(arguments):
            options = self._with_others(options, others)
        own = {one.name for one in read_signature(self.function).arguments}
        as_json = options.get("as_json", False)
        if "as_json" not in own:
            options.pop("as_json", None)
        if "quiet" in own and as_json:
            options["quiet"] = True
        output = _load(self.function)(**options)
        if self.shows:
            output = _load(self.shows)(output, options)
        if output is not None:  # it did not print as it went
            say(as_json, output.content, *output.lines)
            if output.skipped:
                reasons = "; ".join(f"{name} ({why})" for name, why in output.skipped.items())
                n = len(output.skipped)
                raise PartialFailureError(f"skipped {n} of the recordings: {reasons}")
            if output.is_bad:
                raise SystemExit(2)

    def _words(self) -> tuple[str, ...]:
        if self.words is not None:
            return self.words
        every = read_signature(self.function).arguments
        return tuple(one.name for one in every if one.default is REQUIRED)

    def _parameter(self, one: Argument, show_all: bool, from_file: bool) -> inspect.Parameter:
        is_word, is_several = one.name in self._words(), one.name in self.several
        is_common = is_word or not self.shown or one.name in self.shown or one in _OF_ALL
        about: dict[str, Any] = {"help": one.help, "show": is_common or show_all, "negative": ""}
        if not is_word:
            about |= {"name": self.flag(one.name), "group": OPTIONS if is_common else RARE}
        if one.default is True:
            about["negative"] = flag_of(f"no_{one.name}")
        if one.default is False or is_several:
            about["show_default"] = False
        if one.default == ("-",):  # stands for the terminal
            about["allow_leading_hyphen"] = True
        default = None if from_file and one.default is REQUIRED else one.default
        kind: Any = one.kind
        where: Any = inspect.Parameter.POSITIONAL_ONLY if is_word else _BY_NAME
        if is_word and is_several:
            where, default = inspect.Parameter.VAR_POSITIONAL, REQUIRED
        elif is_several:
            kind, default = list[kind], None
        kind = kind | None if default is None else kind
        annotation = Annotated[kind, Parameter(**about)]
        return inspect.Parameter(one.name, where, default=default, annotation=annotation)

    def _in_file(self, path: Path) -> dict[str, Any]:
        """Return the options that a file gives, by name, as the function takes them."""
        from pydantic import TypeAdapter, ValidationError

        from afferents.documents import reason_in

        arguments, found = self.arguments, {}
        names = {self.flag(one).removeprefix("--").replace("-", "_"): one for one in arguments}
        content = _read_content(path, f"options of 'afferents {self.name}' by name")
        for key, value in content.items():
            plain = key.strip().replace("-", "_")
            plain = plain if plain in arguments else names.get(plain, plain)
            if plain in self.several and not isinstance(value, list | dict):
                value = [value]
            kind = arguments[plain].kind if plain in arguments else str
            if kind is not str and not isinstance(value, list | dict):
                try:
                    value = TypeAdapter(kind).validate_python(value)
                except ValidationError as error:
                    reason = reason_in(error.errors()[0])
                    raise InputError(f"{path}: {key}: expected {reason}, found {value!r}") from None
            found[plain] = value
        return {name: value for name, value in found.items() if value is not None}

    def _with_others(self, options: Mapping[str, Any], others: Collection[str]) -> dict[str, Any]:
        """Return options with those of encodings by the names of their fields."""
        flags: dict[str, str] = {}
        texts: set[str] = set()
        if self.takes:
            from afferents.encodings.settings import options as of_encodings

            flags = {option.flag: field for field, option in of_encodings().items()}
            texts = {field for field, option in of_encodings().items() if option.kind is str}
        known = [*flags, *map(self.flag, self.arguments)]
        for flag in (flag_of(one) for one in others if one not in flags.values()):
            near = get_close_matches(flag, known, 1, 0.75)
            if flag not in flags and (near or not self.takes):
                did = f". Did you mean {near[0]}?" if near else f"; {_see(self.name)}"
                raise InputError(f"Unknown option: {flag}{did}")
        found = {name: value for name, value in options.items() if name not in others}
        for one in others:
            name = flags.get(flag_of(one), one)
            value = options[one]
            for kind in (float, int) if isinstance(value, str) and name not in texts else ():
                with suppress(ValueError):
                    value = kind(options[one])
            found[name] = value
        return found


_BY_NAME = inspect.Parameter.KEYWORD_ONLY
_OTHERS = inspect.Parameter(
    "options",
    inspect.Parameter.VAR_KEYWORD,
    annotation=Annotated[str, Parameter(show=False)],
)


def describe_error(error: CycloptsError, name: str) -> str:
    """Return what is wrong with what was typed: what was expected, and what was found."""
    argument = getattr(error, "argument", None)
    flag = argument.name if argument is not None else ""
    if isinstance(error, exceptions.MissingArgumentError):
        return f"{flag}: expected a value, found none; {_see(name)}"
    if isinstance(error, exceptions.CoercionError) and error.token is not None:
        kind: Any = error.target_type
        wanted = _NUMBERS.get(kind) or " or ".join(map(str, get_args(kind))) or kind
        return f"{flag}: expected {wanted}, found '{error.token.value}'"
    if isinstance(error, exceptions.UnusedCliTokensError):
        return f"'{' '.join(error.unused_tokens or ())}': expected no further word; {_see(name)}"
    if isinstance(error, exceptions.UnknownOptionError):
        word = error.token.keyword or error.token.value
        if any(word in one.names for one in error.argument_collection):
            return f"{word}: expected options before '--', found this one after it"
    return " ".join(str(error).split())


def _see(name: str) -> str:
    return f"'afferents {name} --help' lists what it takes"


def _load(where: str) -> Any:
    module, _, name = where.partition(":")
    return getattr(import_module(module), name)


def _list_encoding_options() -> Iterator[inspect.Parameter]:
    """Yield the options of all encodings, for help."""
    from afferents.encodings.settings import options

    for name, option in options().items():
        about = Parameter(name=option.flag, help=option.help, group=ENCODINGS, negative="")
        kind: Any = option.kind
        annotation = Annotated[kind | None, about]
        yield inspect.Parameter(name, _BY_NAME, default=None, annotation=annotation)


def _read_content(path: Path, what: str) -> Mapping[str, Any]:
    """Return the options that a TOML file gives, or JSON, such as a results folder's."""
    from afferents.documents import read_json, read_toml

    if path.suffix != ".json":
        return read_toml(path, what)
    content = read_json(path, what)
    data = content.get("data")
    given = data if isinstance(data, list) else []
    sources = [one["source"] for one in given if isinstance(one, dict) and "source" in one]
    if not sources or len(sources) < len(given):  # no results folder's
        return content
    return {"data": sources, **content.get("options", {})}
