"""From data to accuracies, `afferents.evaluate`, or to samples alone, `afferents.samples`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from afferents import choices, dims, files, plugins
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.evaluation import data as opening
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.results import Results, load_results
from afferents.folds.held_out import split_named
from afferents.models.model import Model
from afferents.progress import Progress
from afferents.recordings.data_set import Data
from afferents.store.trimming import parse_steady, require_within, set_steady


def evaluate(
    data: Data | Sequence[Data],
    out: files.Place,
    models: str | Model | Sequence[str | Model] = choices.MODELS_ASKED,
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
    plugins.import_extra("train", "evaluate", "torch", "sklearn", "pyarrow")
    from afferents.evaluation.plan import open_evaluation
    from afferents.evaluation.run import run_evaluation

    chosen = EvaluationOptions(models=models, **options)
    with Progress(quiet) as progress:
        run_evaluation(open_evaluation(data, out, chosen, progress), progress)
    return load_results(Path(out))


def samples(
    data: Data,
    channel: Any,
    encoding: Any,
    cut: choices.Cut = "all",
    quiet: bool = False,
    split: str = "speed",
    steady: Sequence[float] | None = None,
    **options: Any,
) -> Samples:
    """Return what a classifier would learn from, of all recordings of a store.

    Parameters
    ----------
    data
        An extracted store, a ``dataset.toml``, ``fabricslide:PATH``, or a `DataSet` of your own.
    channel, encoding
        Names, or objects of your own, as of `Model`.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.
    split, steady
        As of `evaluate`.
    options
        Of the encoding, such as ``frames=20``.

    Returns
    -------
    xarray.DataArray
        Dims `sample` and those of the encoding; on `sample` stand `texture`, `speed_mm_s`,
        `recording`, `start_s`, `stop_s`, and `group`, of which one is held out at a time: the
        speed (NaN where it is not known), or the value of another split's condition. For
        scikit-learn's cross-validation take ``x.values.reshape(len(x), -1)``, ``x.texture`` and
        ``groups=x.group``. The attribute `channel` names what they are of.

    Raises
    ------
    InputError
        If there is no such channel or encoding, or the data lack what it is made of.

    Examples
    --------
    >>> x = samples("responses.zarr", "ra1", "spatial")
    >>> dict(x.sizes)
    {'sample': 261, 'row': 19, 'column': 19}
    """
    plugins.import_extra("train", "samples", "torch")
    from afferents.evaluation import plan

    what, steady_s = split_named(split), parse_steady(steady, cut)
    model = Model(
        "samples", channel=channel, encoding=encoding, classifier=None, speed_from="given"
    )
    with Progress(quiet) as progress:
        opened = opening.open_data([data], progress=progress)
        encodings = opening.choose_encodings(opened, cut, options, steady_s)
        (source,) = opening.find_sources(model, encodings)
        recordings = set_steady(opening.join_recordings(opened), steady_s)
        for responses in recordings:
            if not opening.has(responses, source):
                raise InputError(
                    f"{responses.attrs['name']}: expected {source.channel.made_of} that the "
                    f"encoding '{source.encoding.name}' can be made of, found none"
                )
            require_within(responses, source.channel.made_of, steady_s)
        plan.require_encodings([model], encodings, recordings)
        samples = opening.encode_all(recordings, source, cut, progress)
        found = what.labelled(samples, recordings)
        found = found.assign_coords({dims.GROUP: (dims.SAMPLE, what.of(found))})
        of_cells = {dims.CELLS: True} if any(map(dims.of_cells, recordings)) else {}
        return found.assign_attrs({dims.CHANNEL: source.channel.name, **of_cells})
