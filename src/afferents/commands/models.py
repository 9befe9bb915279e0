"""Commands of single models: train, explain, export, and the samples that they learn from."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.commands.given import Data, Place, models_in, names_in
from afferents.core import dims
from afferents.core.card import Card
from afferents.core.choices import PRESET_ASKED, Device, Precision, Preset, Statistics
from afferents.core.cut import Cut
from afferents.core.errors import InputError
from afferents.core.model import Model
from afferents.core.progress import Progress
from afferents.core.samples import Samples
from afferents.core.split import split_named
from afferents.core.steady import require_within, steady_in, with_steady

if TYPE_CHECKING:
    from afferents.evaluation.disturbance import Disturbance
    from afferents.pipeline.explain import Explanation
    from afferents.training.recogniser import Recogniser


def train(
    data: Data,
    out: Place,
    model: str | Model = "best",
    preset: Preset = PRESET_ASKED,
    cut: Cut = "all",
    seed: int = 0,
    results: Place | None = None,
    force: bool = False,
    device: Device = "auto",
    precision: Precision = "auto",
    quiet: bool = False,
    split: str = "speed",
    steady: Sequence[float] | None = None,
    disturb_training: "str | Mapping[str, float | str] | Disturbance | None" = None,
    recipe: str | Path | Mapping[str, Any] | None = None,
    statistics: Statistics = "warmed-up",
    **encoding: Any,
) -> Card:
    """Train one model to feel with, on all speeds but the one that calibrates it.

    Parameters
    ----------
    data
        An extracted store.
    out
        Folder of the model to write.
    model
        A name, a `Model` of your own, or ``best``.
    preset, cut, seed, encoding
        As of `evaluate`.
    results
        Results folder whose scores the model's card is to carry.
    force
        Whether a model that was written there before may be replaced.
    device, precision
        What networks learn on, and in which numbers.
    quiet
        Whether no progress is shown.
    split
        Of what one group calibrates it instead of a speed, such as ``trial``.
    steady, disturb_training, recipe, statistics
        As of `evaluate`.

    Returns
    -------
    Card
        What the model is, what it learnt from, and how far it was tested.

    Raises
    ------
    InputError
        If something given is not what it should be, or the data don't support the model.

    Examples
    --------
    >>> card = train("responses.zarr", "model", "sa-wave-vector")
    >>> card.textures
    ('1', '2', '3')
    """
    from afferents.evaluation.disturbance import Disturbance
    from afferents.pipeline.choice import encodings_for, say_choice
    from afferents.pipeline.copies import warn_of_copies
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import best_of
    from afferents.pipeline.train import Training
    from afferents.pipeline.train import train as run
    from afferents.training import Compute, Hyperparameters

    hyperparameters = Hyperparameters.of(recipe, preset)
    asked, what, steady_s = models_in(model), split_named(split), steady_in(steady, cut)
    if len(asked) + ("best" in names_in(model)) > 1:
        raise InputError("--model", "'best' or one model", f"'{model}'")
    with Progress(quiet) as progress:
        opened = open_data([data], progress=progress)
        warn_of_copies(recordings_in(opened), progress)
        (chosen,) = asked or [best_of(recordings_in(opened))]
        encodings = encodings_for(opened, cut, encoding)
        say_choice(opened, [chosen], encodings, progress)
        wanted = Training(
            opened, chosen, preset, cut, encodings, seed,
            None if results is None else Path(results), Compute(device, precision),
            what, steady_s, Disturbance.of(disturb_training, "--disturb-training"),
            hyperparameters, statistics,
        )  # fmt: skip
        return run(wanted, Path(out), progress, force)


def load_model(model: Place) -> "Recogniser":
    """Read a trained model, to ask it about samples.

    Parameters
    ----------
    model
        Folder of a trained model.

    Returns
    -------
    Recogniser
        Its `predict` takes what `samples` returns, and gives probabilities; its `card` says what
        the model is.

    Raises
    ------
    InputError
        If the folder is no model's, or its files are damaged.

    Examples
    --------
    >>> model = load_model("model")
    >>> x = samples("responses.zarr", model.card.channel, "wavenumbers")
    >>> model.predict(x).probability.dims
    ('sample', 'texture')
    """
    from afferents.training.recogniser import Recogniser

    return Recogniser.of_folder(Path(model))


def explain(
    model: Place, data: Data, out: Place, cut: Cut = "all", quiet: bool = False
) -> "Explanation":
    """Show what decides: the markers, waves, or frequencies without which a model fails.

    Parameters
    ----------
    model
        Folder of a trained model.
    data
        An extracted store.
    out
        Folder for the pictures.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Explanation
        Sentences, pictures, and numbers.

    Raises
    ------
    InputError
        If the model is none, knows none of the textures, or the data don't go with it.

    Examples
    --------
    >>> [picture.name for picture in explain("model", "responses.zarr", "why").pictures]
    ['markers.png', 'waves.png']
    """
    from afferents.pipeline.data import open_data
    from afferents.pipeline.explain import explain as run

    with Progress(quiet) as progress:
        (opened,) = open_data([data], progress=progress)
        return run(Path(model), opened, Path(out), cut, progress)


def explain_shear(data: Data, out: Place, cut: Cut = "all", quiet: bool = False) -> "Explanation":
    """Say whether texture is in the global shear of the skin, or in the images without it.

    No model is needed: small ones are learnt, at all speeds but one in turn. It is what
    ``explain --shear`` does at the command line.

    Parameters
    ----------
    data
        An extracted store.
    out
        Folder for the picture and ``shear.json``.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Explanation
        Sentences, a picture, tables, and numbers.

    Raises
    ------
    InputError
        If the data have no markers, unknown speeds, or fewer than two textures or speeds.

    Examples
    --------
    >>> explain_shear("responses.zarr", "shear").pictures
    [PosixPath('shear/shear.png')]
    """
    from afferents.pipeline.data import open_data
    from afferents.pipeline.shear import explain_shear as run

    with Progress(quiet) as progress:
        (opened,) = open_data([data], progress=progress)
        return run(opened, Path(out), cut, progress)


def export(model: Place, out: Place, force: bool = False) -> Path:
    """Write a trained model as one ONNX file, with its card, to be felt live with.

    Parameters
    ----------
    model
        Folder of a trained model.
    out
        File to write, ending in ``.onnx``.
    force
        Whether a model that was exported there before may be replaced.

    Returns
    -------
    Path
        Of the file.

    Raises
    ------
    InputError
        If the model is none, can't be exported, or another file is there already.

    Examples
    --------
    >>> export("model", "model.onnx")
    PosixPath('model.onnx')
    """
    from afferents.pipeline.export import export_model

    export_model(Path(model), Path(out), force)
    return Path(out)


def samples(
    data: Data,
    channel: Any,
    encoding: Any,
    cut: Cut = "all",
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
        ``groups=x.group``.

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
    from afferents.pipeline.data import open_data, recordings_in
    from afferents.pipeline.encode import (
        encode_all,
        require_speeds_known,
        require_used,
        sources_of,
    )

    what, steady_s = split_named(split), steady_in(steady, cut)
    asked = Model("samples", channel=channel, encoding=encoding, classifier=None)
    with Progress(quiet) as progress:
        opened = open_data([data], progress=progress)
        encodings = opened[0].encodings.changed(**options)
        (source,) = sources_of(asked, encodings)
        require_used([asked], encodings)
        recordings = with_steady(recordings_in(opened), steady_s)
        for responses in recordings:
            require_within(responses, source.channel.made_of, steady_s)
        require_speeds_known([asked], encodings, recordings)
        found = what.labelled(encode_all(recordings, source, cut, progress), recordings)
        return found.assign_coords({dims.GROUP: (dims.SAMPLE, what.of(found))})
