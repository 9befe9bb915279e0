"""One model to keep and run live: trained on all speeds but one, calibrated on it, with a card."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import name_of_channel
from afferents.choices import LARGEST_SEED, Cut, require_number
from afferents.encodings.samples import Samples, list_textures
from afferents.encodings.settings import Encodings, describe_encoding
from afferents.errors import InputError, then
from afferents.evaluation.choice import (
    encodings_for,
    require_options,
    require_trainable,
    say_choice,
)
from afferents.evaluation.data import OpenedData, open_data, recordings_in
from afferents.evaluation.encode import (
    Source,
    best_of,
    encode_all,
    has,
    require_speeds_known,
    require_support,
    require_used,
    sources_of,
)
from afferents.evaluation.options import TrainingOptions
from afferents.evaluation.results import load_results
from afferents.files import Place, require_free
from afferents.folds.held_out import SPEED, Split, order, split_named
from afferents.folds.protocol import Fold
from afferents.models import folder
from afferents.models.calibrate import calibrate_model
from afferents.models.card import Card, Score
from afferents.models.classifiers import get_classifier
from afferents.models.deployed import Deployed, Recogniser
from afferents.models.fitted import Part
from afferents.models.fitting import choose_recipe, fit_once, learns_in_a_loop
from afferents.models.folder import find_own_types, is_model_folder, save_model
from afferents.models.learning_set import LearningSet
from afferents.models.model import MODELS, Model, choose_models, list_names
from afferents.plugins import reference_of
from afferents.progress import Mark, Progress
from afferents.recordings.data_set import Data
from afferents.store.responses import named_by_spacing
from afferents.store.trimming import require_within, steady_in, with_steady
from afferents.version import __version__

Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Training:
    """What is trained and how.

    Attributes
    ----------
    options
        What was chosen; of its split one group is not learnt from, and calibrates the model.
    results
        Results folder whose scores the card is to carry; None for 'not evaluated'.
    """

    data: OpenedData
    model: Model
    encodings: Encodings
    options: TrainingOptions = field(default_factory=TrainingOptions)
    seed: int = 0
    results: Path | None = None


def train_model(training: Training, out: Path, progress: Progress, force: bool = False) -> Card:
    """Train a model and write its folder, whole or not at all; return its card.

    The weights learn from all speeds (or groups of another split) but the middle one, which stops
    the training, sets the temperature, how much evidence a second of touch is, and from where on a
    touch is unknown: what a speed never learnt from needs, not what was learnt by heart.

    Parameters
    ----------
    force
        Whether a model that was written there before may be replaced.

    Raises
    ------
    InputError
        If something else stands at `out`, the data don't support the model or have fewer than
        two speeds, or the results folder holds no finished evaluation of the model.
    AfferentsError
        If the loss is no longer a number.
    """
    options = training.options
    _require_deployable(training.model)
    reads = [training.data.origin.data_set.path]
    require_free(out, is_model_folder, force=force, reads=reads)
    recordings = with_steady(training.data.responses, training.options.steady)
    require_support([training.model], recordings, may_leave_out=False)
    require_options([training.model], training.encodings, recordings, options)
    options.by.groups_of(recordings)
    source = sources_of(training.model, training.encodings)[0]
    if source.encoding.step != 1:
        found = f"one of {source.encoding.step}"
        raise InputError(f"encodings: expected every frame, as live feels them, found {found}")
    for responses in recordings:
        require_within(responses, source.channel.made_of, training.options.steady)
    require_trainable([training.model], recordings, training.encodings, options.cut)
    scores = scores_of(training) if training.results else ()
    model = training.model
    # What can't be put down in the card is refused before anything is learnt.
    classifier = _reference(model.classifier)
    channel, encoding = name_of_channel(source.channel), describe_encoding(source.encoding)
    felt = felt_with(training.data, source)
    samples = encode_all(
        recordings, source, options.cut, progress, corruption=options.disturb_training
    )
    samples = options.by.labelled(samples, recordings)
    fold = all_but_the_middle(samples, options.by)
    with progress.task("training", 1) as mark:
        deployed, learnt = trained_on(training, Part(samples, fold, source.encoding), mark)
        mark(1)
    own = find_own_types(deployed.network)
    calibration = calibrate_model(deployed, learnt, fold, samples)
    learnt_with = ["torch"] if own is None else ["torch", "scikit-learn", "skops"]
    card = Card(
        model=model.name,
        title=model.title,
        classifier=classifier,
        estimator=own,
        own=MODELS.get(model.name) is not model,
        sample_dims=tuple(map(str, samples.dims[1:])),
        textures=tuple(list_textures(samples)),
        named_by_spacing=bool(named_by_spacing(recordings)),
        shape=tuple(learnt.values.shape[1:]),
        scale=learnt.scale,
        preset=options.preset if learns_in_a_loop(model) else None,
        recipe=dict(options.recipe.of_network(_recipe_of(training))),
        statistics=options.statistics,
        seed=training.seed,
        **_groups_of(samples, fold),
        steady_s=training.options.steady,
        disturb_training=options.disturb_training,
        data=(training.data.origin.model_dump(),),
        scores=scores,
        versions={"afferents": __version__, **{name: version(name) for name in learnt_with}},
        **calibration._asdict(),
        channel=channel,
        encoding=encoding,
        **felt,
    )
    save_model(deployed, card, out)
    return card


def _reference(classifier: Any) -> str:
    """Return the name of a classifier; of an estimator that of its class."""
    if isinstance(classifier, str):
        return classifier
    return reference_of(type(classifier) if hasattr(classifier, "fit") else classifier)


def can_run_live(model: Model) -> bool:
    """Tell whether a model can be trained to be kept: its channel, encoding and classifier can."""
    if model.parts or not get_classifier(model.classifier).deployable:
        return False
    channel, encoding = sources_of(model, Encodings())[0]
    return channel.runs_live and encoding.runs_live


def _require_deployable(model: Model) -> None:
    if not can_run_live(model):
        able = ", ".join(name for name, other in MODELS.items() if can_run_live(other))
        raise InputError(
            f"--model: expected 'best' or one of {able} (others can be evaluated, not deployed), "
            f"found '{model.name}'"
        )


def trained_on(training: Training, part: Part, mark: Mark) -> tuple[Deployed, LearningSet]:
    """Train on a fold; return the classifier to be deployed, and what it learnt from."""
    torch.set_num_threads(1)
    recipe = choose_recipe(training.model, part.encoding)
    config = training.options.training(recipe)
    network, learnt = fit_once(training.model, part, config, training.seed, mark)
    return Deployed(network.cpu(), len(list_textures(part.samples)), learnt.scale).eval(), learnt


def all_but_the_middle(samples: Samples, split: Split = SPEED) -> Fold:
    """Return the fold that trains on all groups, by default speeds, but the middle one.

    It tests nothing.

    Raises
    ------
    InputError
        If there is one group only, or a texture in the middle one alone.
    """
    group = split.of(samples)
    groups = sorted(np.unique(group).tolist(), key=order)
    if len(groups) < 2:
        expected = f"at least 2 {split.many}, one of them to validate with"
        raise InputError(f"the data: expected {expected}, found {len(groups)}")
    middle = groups[len(groups) // 2]
    learnt = np.flatnonzero(~split.sharing(group, middle))
    validation = np.flatnonzero(group == middle)
    texture = samples[dims.TEXTURE].values
    only_there = sorted(set(texture[validation]) - set(texture[learnt]))
    if only_there:
        found = f"none of {', '.join(map(str, only_there))}"
        expected = f"every texture at another {split.title} than {split.printed(middle)}"
        raise InputError(f"the data: expected {expected}, found {found}")
    return Fold(middle, middle, learnt, validation, np.empty(0, dtype=np.int64), split)


def _groups_of(samples: Samples, fold: Fold) -> dict[str, Any]:
    """Return what the card says of the groups learnt from, and of the one that calibrates."""
    split = fold.split
    learnt = tuple(sorted(np.unique(split.of(samples)[fold.train]).tolist(), key=order))
    if split == SPEED:
        return {"learnt_from_mm_s": learnt, "validated_on_mm_s": fold.validated_by}
    return {"split": split.name, "learnt_from": learnt, "validated_on": fold.validated_by}


def scores_of(training: Training) -> tuple[Score, ...]:
    """Return what a results folder says of the model, `nested` first.

    Raises
    ------
    InputError
        If it says nothing of it.
    """
    assert training.results is not None
    results = load_results(training.results)
    summary = results.found
    found = summary.models.get(training.model.name, {})
    if not found:
        raise InputError(
            f"{training.results}: expected a finished evaluation of {training.model.name}, found "
            f"of {', '.join(summary.models) or 'nothing'}; evaluate it there, or leave out "
            "--results"
        )
    same = _same_data(training, results.config)
    return tuple(
        Score(
            protocol=protocol,
            preset=summary.preset,
            seeds=entry.seeds,
            mean_accuracy=entry.mean_accuracy,
            ci95=entry.ci95,
            worst_accuracy=entry.by[entry.worst],
            same_data=same,
            disturb=summary.disturb,
            disturb_training=summary.disturb_training,
            recipe=summary.recipe.get(_recipe_of(training), {}),
            **_worst(summary.split, entry.worst),
        )
        for protocol, entry in sorted(found.items())
    )


def _recipe_of(training: Training) -> str:
    """Return the name of the recipe that the model's network is trained by."""
    return choose_recipe(training.model, training.encodings.of(training.model.encoding))


def _worst(split: Split, group: str) -> dict[str, Any]:
    """Return what a score says of the worst group."""
    if split == SPEED:
        return {"worst_mm_s": float(group)}
    return {"split": split.name, "worst_group": group}


def _same_data(training: Training, config: dict[str, Any]) -> bool:
    """Say whether an evaluation of that configuration learnt from what the training learns from."""
    fingerprints = [data["fingerprint"] for data in config["data"]]
    encoding = training.encodings.of(training.model.encoding)
    return (
        fingerprints == [training.data.origin.fingerprint]
        and not {"ablation", "control", "penalty", "statistics"} & config.keys()
        and config["cut"] == training.options.cut
        and config.get("disturb_training", {}) == training.options.disturb_training.describe()
        and config.get("steady_s") == (training.options.steady and list(training.options.steady))
        and config.get(encoding.name) == encoding.model_dump(mode="json")
    )


def felt_with(data: OpenedData, source: Source) -> dict[str, Any]:
    """Return what the card says of the sensor: of camera and markers, or of the microphone.

    Raises
    ------
    InputError
        If the recordings are of several sensors, or the data set does not say what its markers
        were followed with.
    """
    first, config = data.responses[0], data.origin.data_set.config()
    if source.encoding.of_vibration:
        rate_hz = float(first[source.channel.made_of].attrs[dims.SAMPLE_RATE])
        return {"sample_rate_hz": rate_hz, "unlike_live": _unlike_heard(config)}
    if (sensor := config.get("sensor")) is None:
        raise InputError(
            f"{data.origin.source}: expected data that name their sensor, found none named"
        )
    several = config.get("sensors", [])
    if len(several) > 1:
        do = "make a session and a store of each sensor"
        raise InputError(
            f"STORE: expected recordings of one sensor, found of {', '.join(several)}{then(do)}"
        )
    step_s = float(np.median(np.diff(first[dims.TIME].values)))
    attributes = [responses.attrs for responses in data.responses]
    rests = {int(said["rest_frame"]) for said in attributes if "rest_frame" in said}
    sensor = sensor | ({"rest_frame": min(rests)} if len(rests) == 1 else {})
    unlike = _unlike_live(config) + (("several rest frames",) if len(rests) > 1 else ())
    return {"sensor": sensor, "fps_hz": round(1 / step_s, 3), "unlike_live": unlike}


def _unlike_heard(config: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the channel of the sound that was taken, where it is not the last, as live hears."""
    declared = config.get("declared", {})
    taken, n = declared.get("sensor_channel"), declared.get("audio_channels")
    if taken is None or (n is not None and taken == n - 1):
        return ()
    of = "" if n is None else f" of {n}"
    return (f"channel {taken}{of}, counted from 0, where live hears the last",)


def _unlike_live(config: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the options with which a store was extracted and that live lacks."""
    said = {f"--tracker {config.get('method', 'windowed')}", f"--rest {config.get('rest', 'own')}"}
    return tuple(sorted(said - {"--tracker windowed", "--rest own"}))


def train(
    data: Data,
    out: Place,
    model: str | Model = "best",
    seed: int = 0,
    results: Place | None = None,
    force: bool = False,
    quiet: bool = False,
    **options: Any,
) -> Card:
    """Train one model for use, not for a test.

    It learns from all speeds but one, which calibrates its probabilities. With another split a
    trial calibrates it, or a value of another condition, instead of a speed.

    Parameters
    ----------
    data
        A store that 'extract' wrote, a dataset.toml or fabricslide:PATH. In Python a `DataSet`.
    out
        Folder to write the model to.
    model
        Its name; 'best' is what we recommend for such data; FILE.py:NAME is one of your own. In
        Python a `Model`.
    seed
        Random seed of the training.
    results
        Results of 'evaluate', whose accuracy the model's card is to state.
    force
        Overwrite what this command wrote there before (nothing else).
    quiet
        No progress bars; plain lines on stderr.
    options
        What else is chosen: the fields of `afferents.evaluation.options.TrainingOptions`, such as
        ``preset="quick"``, and options of the encoding. With ``split="trial"`` a trial calibrates
        the model instead of a speed.

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
    from afferents.extraction.copies import warn

    require_number("--seed", seed, 0, LARGEST_SEED)
    chosen, asked = TrainingOptions(**options), choose_models(model)
    if len(asked) + ("best" in list_names(model)) > 1:
        raise InputError(f"--model: expected 'best' or one model, found '{model}'")
    with Progress(quiet) as progress:
        opened = open_data([data], progress=progress)
        warn(recordings_in(opened), progress)
        (one,) = asked or [best_of(recordings_in(opened))]
        encodings = encodings_for(opened, chosen.cut, chosen.encoding, chosen.steady)
        say_choice(opened, [one], encodings, progress)
        place = None if results is None else Path(results)
        training = Training(opened[0], one, encodings, chosen, seed, place)
        return train_model(training, Path(out), progress, force)


def load_model(model: Place) -> Recogniser:
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
    return folder.load_model(Path(model))


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
    what, steady_s = split_named(split), steady_in(steady, cut)
    asked = Model("samples", channel=channel, encoding=encoding, classifier=None)
    with Progress(quiet) as progress:
        opened = open_data([data], progress=progress)
        encodings = encodings_for(opened, cut, options, steady_s)
        (source,) = sources_of(asked, encodings)
        require_used([asked], encodings)
        recordings = with_steady(recordings_in(opened), steady_s)
        for responses in recordings:
            if not has(responses, source):
                raise InputError(
                    f"{responses.attrs['name']}: expected {source.channel.made_of} that the "
                    f"encoding '{source.encoding.name}' can be made of, found none"
                )
            require_within(responses, source.channel.made_of, steady_s)
        require_speeds_known([asked], encodings, recordings)
        found = what.labelled(encode_all(recordings, source, cut, progress), recordings)
        found = found.assign_coords({dims.GROUP: (dims.SAMPLE, what.of(found))})
        of_cells = {dims.CELLS: True} if any(map(dims.of_cells, recordings)) else {}
        return found.assign_attrs({dims.CHANNEL: source.channel.name, **of_cells})
