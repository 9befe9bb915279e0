"""Reading JSON and TOML that others wrote: in bounds, checked, or refused in one sentence."""

import json
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from afferents.errors import InputError, then

LARGEST = {"JSON": 64 << 20, "TOML": 1 << 20}
"""Bytes that are read of a file; what people write by hand is small."""
_SHOWN = 60
_MOST_PARTS = 100
"""Of a key in TOML; with many thousands, reading it would take all memory there is."""

Form = TypeVar("Form", bound=BaseModel)


def read_json(path: Path, what: str, do: str = "") -> dict[str, Any]:
    """Read a JSON object.

    Parameters
    ----------
    what, do
        What the file should hold, and what to do if it does not, for the error.

    Raises
    ------
    InputError
        If the file is missing, damaged, too large, or holds something other than an object.
    """
    content = _parse("JSON", _read("JSON", path, what, do), path, what, do)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected {what}, found JSON that is no object{then(do)}")
    return content


def read_toml(path: Path, what: str, do: str = "") -> dict[str, Any]:
    """Read a TOML file; see `read_json`."""
    content: dict[str, Any] = _parse("TOML", _read("TOML", path, what, do), path, what, do)
    return content


def parse_json(text: object, where: object, what: str, do: str = "") -> Any:
    """Read JSON of any kind from its text, which stands at `where`; see `read_json`."""
    return _parse("JSON", text, where, what, do)


def as_form(
    content: Mapping[str, Any], form: type[Form], where: object, what: str, do: str = ""
) -> Form:
    """Return a document's content as what it should be.

    Nothing is taken for something else: no text or boolean for a number.

    Raises
    ------
    InputError
        Naming the first key that is missing, unknown or wrong.
    """
    # As JSON, where lists may stand for tuples however strict one is. Names of files need not be
    # text: what can't be encoded is of no account here.
    text = json.dumps(content, ensure_ascii=False, default=str).encode("utf-8", "replace")
    try:
        return form.model_validate_json(text, strict=True)
    except ValidationError as error:
        raise _describe_fault(error, content, form, where, what, do) from error


def read_checked(path: Path, form: type[BaseModel], what: str, do: str = "") -> dict[str, Any]:
    """Read a JSON object that must be of a form; return it as it stands in the file."""
    content = read_json(path, what, do)
    as_form(content, form, path, what, do)
    return content


def _read(kind: str, path: Path, what: str, do: str) -> bytes:
    """Return what is in a file of bounded size; nothing waits for what is no file."""
    try:
        if not path.is_file():
            found = "something that is no file" if path.exists() else "no such file"
            raise InputError(f"{path}: expected {what}, found {found}{then(do)}")
        with path.open("rb") as file:
            content = file.read(LARGEST[kind] + 1)
    except (OSError, ValueError) as error:
        found = f"one that can't be read ({getattr(error, 'strerror', None) or error})"
        raise InputError(f"{path}: expected {what}, found {found}{then(do)}") from error
    if len(content) > LARGEST[kind]:
        raise InputError(
            f"{path}: expected {what}, found more than {LARGEST[kind] >> 20} MiB{then(do)}"
        )
    return content


def _parse(kind: str, text: object, where: object, what: str, do: str) -> Any:
    """Return what a text says."""
    try:
        return _PARSERS[kind](text.decode("utf-8-sig") if isinstance(text, bytes) else text)
    except (TypeError, ValueError) as error:
        found = f"a damaged file, no {kind} ({error})"
    except RecursionError:
        found = "lists and tables that lie too deep in one another"
    raise InputError(f"{where}: expected {what}, found {found}{then(do)}")


def _parse_number(text: str, may_be_infinite: bool) -> float:
    """Return a number that is one; a sensor file in TOML may say ``inf`` of a radius."""
    number = float(text)
    if math.isnan(number) or (math.isinf(number) and not may_be_infinite):
        raise ValueError(f"{text}, no finite number")
    return number


def _parse_toml(text: str) -> dict[str, Any]:
    """Return what TOML says; a key of very many parts counts as too deep, as lists do."""
    keys = (re.split("[=\"'#]", line, maxsplit=1)[0] for line in text.splitlines())
    if any(key.count(".") > _MOST_PARTS for key in keys):
        raise RecursionError
    return tomllib.loads(text, parse_float=partial(_parse_number, may_be_infinite=True))


_finite = partial(_parse_number, may_be_infinite=False)
_PARSERS: dict[str, Callable[[Any], Any]] = {
    "JSON": partial(json.loads, parse_float=_finite, parse_constant=_finite),
    "TOML": _parse_toml,
}


def quoted(text: str) -> str:
    """Return a text as a TOML file has it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _describe_fault(
    error: ValidationError,
    content: object,
    form: type[BaseModel],
    where: object,
    what: str,
    do: str,
) -> InputError:
    """Say in one sentence which key is at fault and why."""
    fault = error.errors()[0]
    key, reason = ".".join(_find_keys(fault["loc"], content)), reason_in(fault)
    if fault["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        schema = form.model_json_schema()
        tables = [schema, *schema.get("$defs", {}).values()]
        known = {key for table in tables for key in table.get("properties", ())}
        meant = get_close_matches(str(fault["loc"][-1]), known, n=1)
        hint = f" (did you mean {meant[0]}?)" if meant else ""
        expected, found = f"keys of {what}", f"the unknown key '{key}'{hint}"
    elif fault["type"] == "missing":
        expected, found = f"{what} with the key '{key}'", "none"
    elif isinstance(fault["input"], dict) and fault["type"] == "value_error":
        expected, found = what, f"a fault{f' in {key}' if key else ''}: {reason}"
    else:
        expected, found = f"{what} with {key}: {reason}" if key else reason, repr(fault["input"])
        found = found if len(found) <= _SHOWN else f"{found[:_SHOWN]}..."
    return InputError(f"{where}: expected {expected}, found {found}{then(do)}")


def reason_in(fault: Mapping[str, Any]) -> str:
    """Return what was expected, in words, by one of the errors of pydantic's `ValidationError`."""
    return str(fault["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")


def _find_keys(loc: tuple[int | str, ...], content: Any) -> Iterator[str]:
    """Yield the keys that lead to a fault, without the names that alternatives of a form have."""
    for part in loc[:-1]:
        if isinstance(part, int) or (isinstance(content, dict) and part in content):
            yield str(part)
            content = content[part]
    yield from map(str, loc[-1:])
