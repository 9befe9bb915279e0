"""Options of the stages for a command that goes through several: theirs, listed nowhere else."""

import inspect
from collections.abc import Callable, Mapping
from copy import copy
from functools import wraps
from typing import Annotated, Any, get_args

from typer.models import OptionInfo

Command = Callable[..., None]


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
