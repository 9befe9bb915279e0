"""Several lengths of window in one evaluation: ``--frames 1,2,5,10,20,50``.

Each length of a model is a model of its own, named by its length (`sa-ste-20`), so that results,
tables and figures hold it like any other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from afferents.core.errors import InputError
from afferents.core.model import MODELS, Model
from afferents.encodings import Encoding, Encodings
from afferents.pipeline.encode import sources_of

FIELD, FLAG = "frames", "--frames"
"""Of encodings whose samples are runs of images: their length."""


def lengths_in(given: object) -> tuple[int, ...]:
    """Return the lengths that are asked for, in frames, if there are several; else none.

    Parameters
    ----------
    given
        A number, several with commas between, or a list of them; None for nothing.

    Raises
    ------
    InputError
        If one of several is no positive whole number.
    """
    parts = given.split(",") if isinstance(given, str) else given
    if not isinstance(parts, Sequence) or len(parts) < 2:
        return ()
    try:
        lengths = tuple(dict.fromkeys(int(str(part)) for part in parts))
    except ValueError:
        lengths = (0,)
    if min(lengths) < 1:
        expected = "whole numbers of frames with commas between, such as 1,2,5,10"
        raise InputError(FLAG, expected, f"'{given}'")
    return lengths


def by_length(models: Sequence[Model], lengths: Sequence[int], encodings: Encodings) -> list[Model]:
    """Return a model of each length in place of each whose samples are runs of images.

    Raises
    ------
    InputError
        If none is.
    """
    found = [one for model in models for one in _variants(model, lengths, encodings)]
    if found == list(models):
        able = ", ".join(name for name, one in MODELS.items() if _encoding(one, encodings))
        names = ", ".join(model.name for model in models)
        raise InputError(FLAG, f"models that it is for ({able})", names, "leave it out")
    return found


def _variants(model: Model, lengths: Sequence[int], encodings: Encodings) -> list[Model]:
    encoding = _encoding(model, encodings)
    if encoding is None:
        return [model]
    return [
        replace(
            model,
            name=f"{model.name}-{n}",
            title=f"{model.title}, {n} frame{'s' if n > 1 else ''}",
            encoding=encoding.changed(**{FIELD: n}),
            variant_of=model.name,
        )
        for n in lengths
    ]


def _encoding(model: Model, encodings: Encodings) -> Encoding | None:
    """Return the encoding of a model whose samples are runs of images; None of any other."""
    sources = () if model.parts else sources_of(model, encodings)
    of_runs = (one.encoding for one in sources if FIELD in type(one.encoding).model_fields)
    return next(of_runs, None)


def lengths_kept(own_models: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, str]]:
    """Return the models by the name that they are lengths of, then by length, shortest first."""
    found: dict[str, dict[int, str]] = {}
    for name, described in own_models.items():
        if base := described.get("variant_of"):
            found.setdefault(base, {})[int(described["encoding"][FIELD])] = name
    return {base: {str(n): of[n] for n in sorted(of)} for base, of in found.items()}
