"""Commands of evaluations: train and test all folds, and report what came of it."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.commands.given import Data, Place, models_in, names_in, sources_in
from afferents.commands.in_words import choices_in_words, encodings_in_words, options_in_words
from afferents.core.choices import (
    MODELS_ASKED,
    PRESET_ASKED,
    Device,
    Figures,
    Penalty,
    Precision,
    Preset,
    Statistics,
)
from afferents.core.cut import Cut
from afferents.core.model import Model
from afferents.core.progress import Progress
from afferents.core.protocol import protocols
from afferents.core.results import Results, load_results
from afferents.core.split import split_named
from afferents.core.steady import steady_in

if TYPE_CHECKING:
    from afferents.evaluation.ablation import Ablation
    from afferents.evaluation.disturbance import Disturbance
    from afferents.pipeline.evaluate import Evaluation

    Disturbed = str | Mapping[str, float | str] | Disturbance | None
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
    disturb: "Disturbed" = None,
    disturb_training: "Disturbed" = None,
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
        Which textures, speeds and markers are used, an `afferents.evaluation.ablation.Ablation`;
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
        What spoils the recordings that are tested, and those that are learnt from, such as
        ``"markers=0.1,sound=-20dB"`` or ``{"markers": 0.1}``; None for nothing. What there is
        says `afferents.evaluation.disturbance.Disturbance`.
    penalty
        ``searched`` chooses that of every ridge inside each fold, by leaving out its training
        speeds in turn; ``fixed`` takes the usual one where there is one.
    recipe
        Hyperparameters of networks that are not to be the preset's: a TOML file, or the same as a
        mapping, such as ``{"spatial-net": {"max_epochs": 40}}``; see
        `afferents.training.TrainingConfig`.
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
    from afferents.pipeline.evaluate import evaluate as run

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
    from afferents.pipeline.held_out_texture.evaluate import evaluate_textures as run

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
    disturb: "Disturbed" = None,
    disturb_training: "Disturbed" = None,
    penalty: Penalty = "fixed",
    recipe: "Changed" = None,
    statistics: Statistics = "warmed-up",
    **encoding: Any,
) -> "Evaluation":
    """Open the data, after checking what can be checked without them; see `evaluate`."""
    from afferents.evaluation.ablation import Ablation
    from afferents.evaluation.disturbance import Disturbance, Disturbances
    from afferents.pipeline.choice import encodings_for, say_choice
    from afferents.pipeline.copies import warn_of_copies
    from afferents.pipeline.data import open_data, origins_of, recordings_in
    from afferents.pipeline.encode import best_of
    from afferents.pipeline.evaluate import Evaluation
    from afferents.pipeline.lengths import FIELD, by_length, lengths_in
    from afferents.pipeline.recipe import Recipe
    from afferents.training import Compute, Hyperparameters

    asked, under = models_in(models), protocols(protocol)
    lengths = lengths_in(encoding.get(FIELD))
    encoding = {name: v for name, v in encoding.items() if not (lengths and name == FIELD)}
    named = names_in(models)
    what, steady_s = split_named(split), steady_in(steady, cut)
    wanted = what.read(held_out, "--held-out")
    at_test = Disturbance.of(disturb, "--disturb")
    in_training = Disturbance.of(disturb_training, "--disturb-training")
    disturbances = Disturbances((at_test,), in_training)
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
        disturbances=disturbances,
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
            *disturbances.words(),
            *encodings_in_words(chosen, encodings),
        ],
        workers=workers,
        cluster=cluster,
    )


def report(results: Place, quiet: bool = False, figures: Figures = "report") -> Path:
    """Write Table 1, figures and a self-contained page from a results folder.

    Parameters
    ----------
    results
        As `evaluate` leaves it.
    figures
        ``paper`` to draw the paper's figures as they are printed (3, 5 to 13), each saying where
        it departs from that; ``report`` for those that suit what was evaluated.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the page, ``report.html``.

    Raises
    ------
    InputError
        If the folder holds no finished evaluation.

    Examples
    --------
    >>> report("results").name
    'report.html'
    """
    from afferents.pipeline.report import write_report

    with Progress(quiet) as progress:
        return write_report(Path(results), progress, figures)
