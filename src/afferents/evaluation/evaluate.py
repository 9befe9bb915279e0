"""`afferents.evaluate`: models trained at some speeds and tested at others."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.choices import MODELS_ASKED
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.results import Results, load_results
from afferents.files import Place
from afferents.models.model import Model, choose_models, list_names
from afferents.plugins import import_extra
from afferents.progress import Progress
from afferents.recordings.data_set import Data, sources_in

if TYPE_CHECKING:
    from afferents.evaluation.recipe import Evaluation


def evaluate(
    data: Data | Sequence[Data],
    out: Place,
    models: str | Model | Sequence[str | Model] = MODELS_ASKED,
    quiet: bool = False,
    **options: Any,
) -> Results:
    """Train and test models on sliding speeds that they have not been trained on.

    Each speed is held out in turn (a fold): the model trains on the others and is tested on it.
    With another split it is each trial, or each value of another condition, instead of each speed.

    Parameters
    ----------
    data
        Stores that 'extract' wrote, a dataset.toml or fabricslide:PATH. In Python a `DataSet`.
    out
        Results folder to write; folds that are finished in it are kept.
    models
        Names, comma-separated: 'all' for the paper's Table 1 (without those that the data don't
        support), 'best' for what we recommend for such data, FILE.py:NAME for one of your own. In
        Python a `Model`.
    quiet
        No progress bars; plain lines on stderr.
    options
        What else is chosen: the fields of `afferents.evaluation.options.EvaluationOptions`, such
        as ``preset="quick"``, ``held_out=[20, 50]`` (mm/s) or ``split="trial"``, and options of
        the encodings, such as ``frames=20`` or ``window_s=2``. Several lengths,
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
    import_extra("train", "evaluate", "torch", "sklearn", "pyarrow")
    from afferents.evaluation.run import evaluate as run

    with Progress(quiet) as progress:
        run(
            open_evaluation(data, out, EvaluationOptions(models=models, **options), progress),
            progress,
        )
    return load_results(Path(out))


def open_evaluation(
    data: Data | Sequence[Data], out: Place, options: EvaluationOptions, progress: Progress
) -> "Evaluation":
    """Open the data, after checking what can be checked without them, and choose what suits them.

    Raises
    ------
    InputError
        If a model is unknown, or the data can't be read.
    """
    from afferents.evaluation.choice import encodings_for, say_choice
    from afferents.evaluation.data import open_data, recordings_in
    from afferents.evaluation.encode import best_of
    from afferents.evaluation.recipe import FIELD, Evaluation, Recipe, by_length, lengths_in
    from afferents.extraction.copies import warn

    models = choose_models(options.models)
    lengths = lengths_in(options.encoding.get(FIELD))
    wanted = {n: v for n, v in options.encoding.items() if not (lengths and n == FIELD)}
    opened = open_data(sources_in(data), options.without, options.keep_going, progress)
    warn(recordings_in(opened), progress)
    used = options.ablation.recordings(recordings_in(opened))
    if (settled := options.by.settled(used).name) != options.split:
        options = options.model_copy(update={"split": settled})
    encodings = encodings_for(opened, options.cut, wanted, options.steady, used)
    if "best" in list_names(options.models) or not models:
        best = best_of(recordings_in(opened))
        models = models if best in models else [*models, best]
    models = by_length(models, lengths, encodings) if lengths else models
    say_choice(opened, models, encodings, progress)
    origins = tuple(one.origin for one in opened)
    recipe = Recipe(Path(out), origins, models, encodings, options)
    return Evaluation(recipe, opened)
