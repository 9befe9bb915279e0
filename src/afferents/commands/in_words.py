"""What was asked of `evaluate`, in the words of a command line, for the report."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from afferents.core.model import Model
from afferents.core.split import OPTION as SPLIT_OPTION
from afferents.core.split import SPEED, Group, key_of
from afferents.core.steady import OPTION as STEADY_OPTION
from afferents.core.steady import written

if TYPE_CHECKING:
    from afferents.encodings import Encodings
    from afferents.evaluation.ablation import Ablation
    from afferents.pipeline.recipe import Recipe


def options_in_words(
    only: "Ablation", held_out: Sequence[Group], without: Mapping[str, str]
) -> list[str]:
    """Return the words of a command line that uses the same part of the data, for the report."""
    given = {
        "--textures": ",".join(only.textures),
        "--speeds": _listed(only.speeds_mm_s),
        "--markers": "" if only.markers == 1 else f"{only.markers:g}",
        "--train-speeds": f"{only.train_speeds or ''}",
        "--test-only": "=".join(only.test_only or ()),
        "--held-out": ",".join(map(key_of, held_out)),
    }
    words = [word for flag, text in given.items() if text for word in (flag, text)]
    return words + [w for name, value in without.items() for w in ("--without", f"{name}={value}")]


def choices_in_words(recipe: "Recipe") -> list[str]:
    """Return the words that hold out the same, of the same part of recordings, as strictly."""
    split = [] if recipe.split == SPEED else [SPLIT_OPTION, recipe.split.name]
    steady = [] if recipe.steady_s is None else [STEADY_OPTION, written(recipe.steady_s)]
    penalty = [] if recipe.penalty == "fixed" else ["--penalty", recipe.penalty]
    kept = [] if recipe.statistics == "warmed-up" else ["--statistics", recipe.statistics]
    return split + steady + penalty + kept


def encodings_in_words(models: Iterable[Model], encodings: "Encodings") -> list[str]:
    """Return the words that ask for the same samples; a field without a flag by its name."""
    from afferents.pipeline.encode import sources_of

    used = [source.encoding for model in models for source in sources_of(model, encodings)]
    flags = {name: option.flag for one in used for name, option in one.options().items()}
    given = {flags.get(name, name): value for name, value in encodings.wanted}
    return [word for flag, value in given.items() for word in (flag, _written(value))]


def _listed(numbers: Iterable[float]) -> str:
    return ",".join(f"{number:g}" for number in numbers)


def _written(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)
