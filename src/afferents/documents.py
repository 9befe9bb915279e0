"""Reading JSON and TOML that others wrote: in bounds, checked, or refused in one sentence."""

import json
import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from afferents.errors import InputError, then

LARGEST = {"JSON": 64 << 20, "TOML": 1 << 20}
"""Bytes that are read of a file; what people write by hand is small."""
DEEPEST = 64
"""Levels of lists and tables: far more than anybody writes, far fewer than Python can follow."""

_DIGITS = 300
"""Of an integer, so that it can be taken for a float as well."""
_DECIMAL = re.compile(r"[0-9]\.[0-9]|\"[^\"]*\"|'[^']*'")
"""Where a dot stands that parts no key: in numbers and in quotes."""
_SHOWN = 60

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
    content = _read("JSON", path, what, do)
    if not isinstance(content, dict):
        raise InputError(f"{path}: expected {what}, found {_named(content)}, no object{then(do)}")
    return content


def read_toml(path: Path, what: str, do: str = "") -> dict[str, Any]:
    """Read a TOML file; see `read_json`."""
    content: dict[str, Any] = _read("TOML", path, what, do)
    return content


def parse_json(text: object, where: object, what: str, do: str = "") -> Any:
    """Read JSON of any kind from its text, which stands at `where`; see `read_json`."""
    return _parsed("JSON", text, where, what, do)


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
        raise _first_fault(error, content, where, what, do) from error


def read_checked(path: Path, form: type[BaseModel], what: str, do: str = "") -> dict[str, Any]:
    """Read a JSON object that must be of a form; return it as it stands in the file."""
    content = read_json(path, what, do)
    as_form(content, form, path, what, do)
    return content


def _read(kind: str, path: Path, what: str, do: str) -> Any:
    return _parsed(kind, _content(kind, path, what, do), path, what, do)


def _content(kind: str, path: Path, what: str, do: str) -> bytes:
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


def _parsed(kind: str, text: object, where: object, what: str, do: str) -> Any:
    """Return what a text says that is in bounds."""
    try:
        content = _PARSERS[kind](text.decode("utf-8-sig") if isinstance(text, bytes) else text)
        fault = next(_faults(kind, content), None)
    except UnicodeDecodeError as error:
        fault = f"text that is not UTF-8, at byte {error.start}"
    except RecursionError:
        fault = f"more than {DEEPEST} levels of lists and tables"
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{where}: expected {what}, found a damaged file, no {kind} ({error}){then(do)}"
        ) from error
    if fault:
        raise InputError(f"{where}: expected {what}, found {fault}{then(do)}")
    return content


def _json(text: Any) -> Any:
    return json.loads(text, parse_int=_integer)


def _toml(text: Any) -> Any:
    if any(map(_has_deep_key, text.split("\n"))):
        raise RecursionError
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # of what looks like a number or a date
        raise ValueError("a number or date that makes no sense") from None


_PARSERS = {"JSON": _json, "TOML": _toml}


def quoted(text: str) -> str:
    """Return a text as a TOML file has it."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _has_deep_key(line: str) -> bool:
    """Tell whether a line has a dotted key of very many parts, which takes tomllib hours."""
    return _DECIMAL.sub("", line).count(".") > DEEPEST and not line.lstrip().startswith("#")


def _integer(digits: str) -> int:
    if len(digits) > _DIGITS:
        raise ValueError(f"an integer of {len(digits)} digits")
    return int(digits)


def _named(content: object) -> str:
    """Return what stands where an object should."""
    kinds = {list: "a list", str: "a text", bool: "true or false", type(None): "null"}
    return kinds.get(type(content), "a number")


def _faults(kind: str, content: object) -> Iterator[str]:
    """Yield what no document of ours holds: numbers that are none, and endless nesting.

    A TOML file may say ``inf``, as a sensor file does of a radius; what it may be is its form's.
    """
    may_be = math.isinf if kind == "TOML" else (lambda _: False)
    todo: list[tuple[str, int, object]] = [("", 0, content)]
    while todo:
        key, depth, value = todo.pop()
        if depth > DEEPEST:
            yield f"more than {DEEPEST} levels of lists and tables"
        elif isinstance(value, dict):
            todo += [(f"{key}.{name}" if key else name, depth + 1, v) for name, v in value.items()]
        elif isinstance(value, list):
            todo += [(f"{key}.{number}", depth + 1, v) for number, v in enumerate(value)]
        elif isinstance(value, float) and not math.isfinite(value) and not may_be(value):
            yield f"{key} = {value:g}, no finite number"
        elif isinstance(value, int) and abs(value) > 10**_DIGITS:
            yield f"an integer of more than {_DIGITS} digits, {key}"


def _first_fault(
    error: ValidationError, content: object, where: object, what: str, do: str
) -> InputError:
    """Say in one sentence which key is at fault and why."""
    fault = error.errors()[0]
    key = ".".join(_keys(fault["loc"], content))
    if fault["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
        return InputError(
            f"{where}: expected keys of {what}, found the unknown key '{key}'{then(do)}"
        )
    if fault["type"] == "missing":
        return InputError(f"{where}: expected {what} with the key '{key}', found none{then(do)}")
    reason = reason_in(fault)
    if isinstance(fault["input"], dict) and fault["type"] == "value_error":
        return InputError(
            f"{where}: expected {what}, found a fault{f' in {key}' if key else ''}: "
            f"{reason}{then(do)}"
        )
    found = repr(fault["input"])
    found = found if len(found) <= _SHOWN else f"{found[:_SHOWN]}..."
    return InputError(
        f"{where}: expected {f'{what} with {key}: {reason}' if key else reason}, found "
        f"{found}{then(do)}"
    )


def reason_in(fault: Mapping[str, Any]) -> str:
    """Return what was expected, in words, by one of the errors of pydantic's `ValidationError`."""
    return str(fault["msg"]).removeprefix("Value error, ").removeprefix("Input should be ")


def _keys(loc: tuple[int | str, ...], content: Any) -> Iterator[str]:
    """Yield the keys that lead to a fault, without the names that alternatives of a form have."""
    for part in loc[:-1]:
        if isinstance(part, int) or (isinstance(content, dict) and part in content):
            yield str(part)
            content = content[part]
    yield from map(str, loc[-1:])
