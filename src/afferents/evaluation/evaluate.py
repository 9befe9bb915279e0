"""What was asked of `evaluate`, in the words of a command line, for the report."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.choices import (
    MODELS_ASKED,
    PRESET_ASKED,
    Cut,
    Device,
    Penalty,
    Precision,
    Preset,
    Statistics,
)
from afferents.evaluation.results import Results, load_results
from afferents.files import Place
from afferents.folds.corruption import Corruption, Corruptions
from afferents.folds.held_out import OPTION as SPLIT_OPTION
from afferents.folds.held_out import SPEED, Group, key_of, split_named
from afferents.folds.protocol import protocols
from afferents.models.model import Model, models_in, names_in
from afferents.progress import Progress
from afferents.recordings.data_set import Data, sources_in
from afferents.store.trimming import OPTION as STEADY_OPTION
from afferents.store.trimming import steady_in, written

if TYPE_CHECKING:
    from afferents.encodings.settings import Encodings
    from afferents.evaluation.recipe import Recipe
    from afferents.evaluation.run import Evaluation
    from afferents.folds.ablation import Ablation


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
    from afferents.evaluation.encode import sources_of

    used = [source.encoding for model in models for source in sources_of(model, encodings)]
    flags = {name: option.flag for one in used for name, option in one.options().items()}
    given = {flags.get(name, name): value for name, value in encodings.wanted}
    return [word for flag, value in given.items() for word in (flag, _written(value))]


def _listed(numbers: Iterable[float]) -> str:
    return ",".join(f"{number:g}" for number in numbers)


def _written(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


Corrupted = str | Mapping[str, float | str] | Corruption | None
Changed = str | Path | Mapping[str, Any] | None


def evaluate(
    data: Data | Sequence[Data],
    out: Place,
    models: str | Model | Sequence[str | Model] = MODELS_ASKED,
    protocol: str = "nested",
    preset: Preset = PRESET_ASKED,
    cut: Cut = "all",
    seeds: Iterable[int] = (0,),
    held_out: Sequence[float | str] = (),
    without: Mapping[str, str] | None = None,
    only: "Ablation | None" = None,
    keep_going: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    device: Device = "auto",
    precision: Precision = "auto",
    quiet: bool = False,
    split: str = "speed",
    steady: Sequence[float] | None = None,
    disturb: "Corrupted" = None,
    disturb_training: "Corrupted" = None,
    penalty: Penalty = "fixed",
    recipe: "Changed" = None,
    statistics: Statistics = "warmed-up",
    **encoding: Any,
) -> Results:
    """Train and test models, one speed, or group of another split, held out at a time.

    Parameters
    ----------
    data
        Extracted stores, a ``dataset.toml``, ``fabricslide:PATH``, or a `DataSet` of your own.
    out
        Results folder; finished folds in it are kept.
    models
        Names, `Model` objects of your own, or both; ``all`` for the six of the paper's Table 1,
        without those that the data don't support, ``best`` for what we recommend for such data,
        ``all,best`` for these and that.
    protocol
        ``nested``, ``published`` or ``both``: whether anything of the held-out speed may be seen
        before the test; see docs/protocols.md.
    preset
        Training recipe of networks: ``paper`` as published, ``fast`` a shorter road, ``quick`` to
        see that it runs.
    cut
        Part of the recordings that is used.
    seeds
        Each model is trained with each.
    held_out
        Speeds, mm/s, or groups of the split that are held out in turn; none for all.
    without
        Conditions of recordings that are left out, such as ``{"pressure": "F250"}``.
    only
        Which textures, speeds and markers are used, an `afferents.folds.ablation.Ablation`;
        None for all.
    keep_going
        Whether recordings that can't be used are skipped; ``summary["skipped"]`` names them.
    workers, cluster
        Processes here (None for one a core), or the address of a Dask scheduler.
    device, precision
        What networks learn on, and in which numbers.
    quiet
        Whether no progress is shown.
    split
        What is held out: ``speed``, or a condition that all recordings carry, such as ``trial``.
    steady
        Start and end in s of the part of each recording that is used, such as ``(0.2, 2.8)``; None
        for what the data say.
    disturb, disturb_training
        What corrupts the recordings that are tested, and those that are learnt from, such as
        ``"markers=0.1,sound=-20dB"`` or ``{"markers": 0.1}``; None for nothing. What there is
        says `afferents.folds.corruption.Corruption`.
    penalty
        ``searched`` chooses that of every ridge inside each fold, by leaving out its training
        speeds in turn; ``fixed`` takes the usual one where there is one.
    recipe
        Hyperparameters of networks that are not to be the preset's: a TOML file, or the same as a
        mapping, such as ``{"spatial-net": {"max_epochs": 40}}``; see
        `afferents.models.config.TrainingConfig`.
    statistics
        ``keras`` starts the running statistics of batch normalisation at 0 and 1, as the paper's
        networks did; ``warmed-up`` as plain averages.
    encoding
        Options of the encodings by name, such as ``frames=20`` or ``window_s=2``. Several lengths,
        ``frames=[1, 2, 5, 10]``, make a model of each, named by its length (``sa-ste-5``).

    Returns
    -------
    Results
        `accuracy` is a table by speed, `predictions` one of all test samples.

    Raises
    ------
    InputError
        If something given is not what it should be, or the data don't support the models.
    LeakageError
        If anything of what is held out is seen under the nested protocol.

    Examples
    --------
    >>> results = evaluate("responses.zarr", "results", models="ra-wave-vector")
    >>> results.summary["speeds_mm_s"]
    [20.0, 40.0, 60.0]
    """
    from afferents.evaluation.run import evaluate as run

    with Progress(quiet) as progress:
        wanted = _evaluation(
            progress, data, out, models, protocol, preset, cut, seeds, held_out, without, only,
            keep_going, workers, cluster, device, precision, split, steady, disturb,
            disturb_training, penalty, recipe, statistics, **encoding,
        )  # fmt: skip
        run(wanted, progress)
    return load_results(Path(out))


def evaluate_textures(
    data: Data | Sequence[Data],
    out: Place,
    models: str | Model | Sequence[str | Model] = MODELS_ASKED,
    quiet: bool = False,
    **options: Any,
) -> dict[str, dict[str, Any]]:
    """Ask models about textures held out as well as speeds: ``evaluate --split texture``.

    Two questions: is such a texture recognised as unknown, and how coarse is it (in mm, where
    textures are named by their bump spacing)?

    Parameters
    ----------
    data, out, models, quiet, options
        As of `evaluate`.

    Returns
    -------
    dict
        A summary for each question that the data can answer: ``unknown``, ``roughness``.

    Raises
    ------
    InputError
        If something given is not what it should be, or an option makes no sense here.
    """
    from afferents.evaluation.textures import evaluate_textures as run

    with Progress(quiet) as progress:
        return run(_evaluation(progress, data, out, models, **options), progress)


def _evaluation(
    progress: Progress,
    data: Data | Sequence[Data],
    out: Place,
    models: str | Model | Sequence[str | Model],
    protocol: str = "nested",
    preset: Preset = PRESET_ASKED,
    cut: Cut = "all",
    seeds: Iterable[int] = (0,),
    held_out: Sequence[float | str] = (),
    without: Mapping[str, str] | None = None,
    only: "Ablation | None" = None,
    keep_going: bool = False,
    workers: int | None = None,
    cluster: str | None = None,
    device: Device = "auto",
    precision: Precision = "auto",
    split: str = "speed",
    steady: Sequence[float] | None = None,
    disturb: "Corrupted" = None,
    disturb_training: "Corrupted" = None,
    penalty: Penalty = "fixed",
    recipe: "Changed" = None,
    statistics: Statistics = "warmed-up",
    **encoding: Any,
) -> "Evaluation":
    """Open the data, after checking what can be checked without them; see `evaluate`."""
    from afferents.evaluation.choice import encodings_for, say_choice
    from afferents.evaluation.data import open_data, origins_of, recordings_in
    from afferents.evaluation.encode import best_of
    from afferents.evaluation.recipe import FIELD, Recipe, by_length, lengths_in
    from afferents.evaluation.run import Evaluation
    from afferents.extraction.copies import warn_of_copies
    from afferents.folds.ablation import Ablation
    from afferents.models.config import Compute, Hyperparameters

    asked, under = models_in(models), protocols(protocol)
    lengths = lengths_in(encoding.get(FIELD))
    encoding = {name: v for name, v in encoding.items() if not (lengths and name == FIELD)}
    named = names_in(models)
    what, steady_s = split_named(split), steady_in(steady, cut)
    wanted = what.read(held_out, "--held-out")
    at_test = Corruption.of(disturb, "--disturb")
    in_training = Corruption.of(disturb_training, "--disturb-training")
    corruptions = Corruptions((at_test,), in_training)
    hyperparameters = Hyperparameters.of(recipe, preset)
    opened = open_data(sources_in(data), without, keep_going, progress)
    warn_of_copies(recordings_in(opened), progress)
    used, left_out = only or Ablation(), without or {}
    encodings = encodings_for(opened, cut, encoding)
    chosen = asked
    if "best" in named or not asked:
        best = best_of(recordings_in(opened))
        chosen = asked if best in asked else [*asked, best]
    chosen = by_length(chosen, lengths, encodings) if lengths else chosen
    say_choice(opened, chosen, encodings, progress)
    whole = Recipe(
        out=Path(out),
        data=origins_of(opened),
        models=chosen,
        preset=preset,
        cut=cut,
        encodings=encodings,
        without=left_out,
        ablation=used,
        corruptions=corruptions,
        split=what,
        steady_s=steady_s,
        penalty=penalty,
        statistics=statistics,
        compute=Compute(device, precision),
        hyperparameters=hyperparameters,
    )
    return Evaluation(
        whole,
        opened,
        protocols=under,
        seeds=list(seeds),
        may_leave_out="all" in named,
        keep_going=keep_going,
        held_out=wanted,
        options=[
            *options_in_words(used, wanted, left_out),
            *choices_in_words(whole),
            *hyperparameters.words(),
            *corruptions.words(),
            *encodings_in_words(chosen, encodings),
        ],
        workers=workers,
        cluster=cluster,
    )
