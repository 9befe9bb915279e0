"""Reading what a command is given: names, numbers and conditions, as text or as objects."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Union

from afferents.core.errors import InputError
from afferents.core.model import Model, models_named

if TYPE_CHECKING:
    from afferents.markers import Sensor
    from afferents.recordings import DataSet

Place = str | Path
Data = Union[str, Path, "DataSet"]
"""A path, ``NAME:PATH``, where a data set of one's own is, or the data set itself."""


def sources_in(data: Data | Sequence[Data]) -> list[Data]:
    """Return the sources of data, of which there may be one or several."""
    return list(data) if isinstance(data, Sequence) and not isinstance(data, str) else [data]


def models_in(wanted: str | Model | Sequence[str | Model]) -> list[Model]:
    """Return the models asked for; none for ``best``, which depends on the data.

    Raises
    ------
    InputError
        If a name is unknown.
    """
    if isinstance(wanted, Model):
        return [wanted]
    names = [name for name in names_in(wanted) if name != "best"]
    found = models_named(",".join(names)) if names else []
    own = [] if isinstance(wanted, str) else [one for one in wanted if isinstance(one, Model)]
    return found + own


def names_in(wanted: str | Model | Sequence[str | Model]) -> list[str]:
    """Return the names among the models asked for, ``all`` and ``best`` with them."""
    if isinstance(wanted, Model):
        return []
    texts = [wanted] if isinstance(wanted, str) else [t for t in wanted if isinstance(t, str)]
    return [name.strip() for text in texts for name in text.split(",")]


def sensor_in(wanted: "str | Path | Sensor") -> "Sensor":
    """Return the sensor, which may be given by its file or by the name of a packaged one.

    Raises
    ------
    InputError
        If there is none, or the file is damaged.
    """
    from afferents.markers import Sensor, load_sensor

    return wanted if isinstance(wanted, Sensor) else load_sensor(str(wanted))


def conditions_in(pairs: Iterable[str], option: str) -> dict[str, str]:
    """Return conditions of recordings, each given as ``NAME=VALUE``.

    Raises
    ------
    InputError
        Naming the option, if one is not.
    """
    found = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not equals:
            raise InputError(option, "NAME=VALUE, such as pressure=F250", f"'{pair}'")
        found[name] = value
    return found


def numbers_in(text: str | None, option: str) -> list[float] | None:
    """Return numbers separated by commas; None for none given.

    Raises
    ------
    InputError
        Naming the option, if one is none.
    """
    try:
        return [float(number) for number in text.split(",")] if text else None
    except ValueError:
        raise InputError(option, "numbers separated by commas", f"'{text}'") from None


def speed_factor(text: str) -> float:
    """Return how much faster than recorded a replay runs; infinite for ``max``.

    Raises
    ------
    InputError
        If it is no number.
    """
    try:
        return float("inf") if text == "max" else float(text)
    except ValueError:
        raise InputError("--speed", "a factor above 0, or 'max'", f"'{text}'") from None
