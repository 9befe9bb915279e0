"""One model to keep and run live: trained on all speeds but one, calibrated on it, with a card."""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import torch

from afferents import channels, choices, dims, files, plugins
from afferents.encodings.samples import list_textures
from afferents.encodings.settings import Encodings, describe_encoding
from afferents.errors import InputError, then
from afferents.evaluation import data as opening, plan
from afferents.evaluation.data import OpenedData, Source, encode_all, find_sources
from afferents.evaluation.options import TrainingOptions
from afferents.evaluation.results import load_results
from afferents.extraction import copies
from afferents.folds import held_out, splits
from afferents.models import calibrate, classifiers, fitted, fitting, folder
from afferents.models.card import Card, Score
from afferents.models.deployed import Deployed, Recogniser
from afferents.models.model import MODELS, Model, choose_models, list_names
from afferents.progress import Progress
from afferents.recordings.data_set import Data
from afferents.store.responses import Responses, named_by_spacing
from afferents.store.trimming import require_within, set_steady
from afferents.version import __version__


def train_model(
    data: OpenedData,
    model: Model,
    out: Path,
    options: TrainingOptions,
    progress: Progress,
    *,
    encodings: Encodings | None = None,
    seed: int = 0,
    results: Path | None = None,
    force: bool = False,
) -> Card:
    """Train a model and write its folder, whole or not at all; return its card.

    The weights learn from all speeds (or groups of another split) but the middle one, which stops
    the training, sets the temperature, how much evidence a second of touch is, and from where on a
    touch is unknown: what a speed never learnt from needs, not what was learnt by heart.

    Parameters
    ----------
    options
        What was chosen; of its split one group is not learnt from, and calibrates the model.
    encodings
        How samples are made; None for what suits the data.
    results
        Results folder whose scores the card is to carry; None for 'not evaluated'.
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
    encodings = encodings or data.encodings
    source, *_ = find_sources(model, encodings)
    recipe = fitting.choose_recipe(model, source.encoding)
    files.require_free(out, folder.is_model_folder, force=force, reads=[data.origin.data_set.path])
    recordings = set_steady(data.responses, options.steady)
    _require_live(model, encodings, recordings, options)
    scores = () if results is None else read_scores(results, model, data, source, options, recipe)
    # What can't be put down in the card is refused before anything is learnt.
    classifier = model.classifier
    if not isinstance(classifier, str):  # of an estimator its class
        classifier = plugins.reference_of(
            type(classifier) if hasattr(classifier, "fit") else classifier
        )
    channel, encoding = channels.name_of_channel(source.channel), describe_encoding(source.encoding)
    sensor = describe_sensor(data, source)
    samples = encode_all(
        recordings, source, options.cut, progress, corruption=options.disturb_training
    )
    samples = options.by.labelled(samples, recordings)
    fold, textures = splits.hold_out_the_middle(samples, options.by), list_textures(samples)
    torch.set_num_threads(1)
    config, part = options.training(recipe), fitted.Part(samples, fold, source.encoding)
    with progress.task("training", 1) as mark:
        network, learnt = fitting.fit_once(model, part, config, seed, mark)
        mark(1)
    deployed = Deployed(network.cpu(), len(textures), learnt.scale).eval()
    own = folder.find_own_types(deployed.network)
    calibration = calibrate.calibrate_model(deployed, learnt, fold, samples)
    learnt_with = ["torch"] if own is None else ["torch", "scikit-learn", "skops"]
    learnt_from = sorted(np.unique(fold.split.of(samples)[fold.train]).tolist(), key=held_out.order)
    groups = {"learnt_from_mm_s": tuple(learnt_from), "validated_on_mm_s": fold.validated_by}
    if fold.split != held_out.SPEED:
        groups = {"learnt_from": tuple(learnt_from), "validated_on": fold.validated_by}
        groups |= {"split": fold.split.name}
    card = Card(
        model=model.name,
        title=model.title,
        classifier=classifier,
        estimator=own,
        own=MODELS.get(model.name) is not model,
        sample_dims=tuple(map(str, samples.dims[1:])),
        textures=tuple(textures),
        named_by_spacing=bool(named_by_spacing(recordings)),
        shape=tuple(learnt.values.shape[1:]),
        scale=learnt.scale,
        preset=options.preset if fitting.learns_in_a_loop(model) else None,
        recipe=options.recipe.changed.get(recipe, {}),
        statistics=options.statistics,
        seed=seed,
        **groups,
        steady_s=options.steady,
        disturb_training=options.disturb_training,
        data=(data.origin.model_dump(),),
        scores=scores,
        versions={"afferents": __version__, **{name: version(name) for name in learnt_with}},
        **calibration._asdict(),
        channel=channel,
        encoding=encoding,
        **sensor,
    )
    folder.save_model(deployed, card, out)
    return card


def _require_live(
    model: Model, encodings: Encodings, recordings: Sequence[Responses], options: TrainingOptions
) -> None:
    """Refuse a model that can't be kept, data that don't support it, and options that don't fit."""
    if not can_run_live(model):
        able = ", ".join(name for name, other in MODELS.items() if can_run_live(other))
        raise InputError(
            f"--model: expected 'best' or one of {able} (others can be evaluated, not deployed), "
            f"found '{model.name}'"
        )
    plan.require_support([model], recordings, may_leave_out=False)
    plan.require_options([model], encodings, recordings, options)
    options.by.groups_of(recordings)
    ((channel, encoding),) = find_sources(model, encodings)
    if encoding.step != 1:
        raise InputError(
            f"encodings: expected every frame, as a live model takes, found one of {encoding.step}"
        )
    for responses in recordings:
        require_within(responses, channel.made_of, options.steady)
    plan.require_trainable([model], recordings, encodings, options.cut)


def can_run_live(model: Model) -> bool:
    """Return whether a model can be trained to be kept: its channel, encoding, classifier can."""
    if model.parts or not classifiers.get_classifier(model.classifier).deployable:
        return False
    channel, encoding = find_sources(model, Encodings())[0]
    return channel.runs_live and encoding.runs_live


def read_scores(
    results: Path,
    model: Model,
    data: OpenedData,
    source: Source,
    options: TrainingOptions,
    recipe: str,
) -> tuple[Score, ...]:
    """Return what a results folder holds of the model, `nested` first.

    Raises
    ------
    InputError
        If it holds nothing of it.
    """
    evaluated, encoding = load_results(results), source.encoding
    summary, config = evaluated.found, evaluated.config
    found = summary.models.get(model.name, {})
    if not found:
        raise InputError(
            f"{results}: expected a finished evaluation of {model.name}, found of "
            f"{', '.join(summary.models) or 'nothing'}; evaluate it there, or leave out --results"
        )
    same_data = (
        [one["fingerprint"] for one in config["data"]] == [data.origin.fingerprint]
        and not {"ablation", "control", "penalty", "statistics"} & config.keys()
        and config["cut"] == options.cut
        and config.get("disturb_training", {}) == options.disturb_training.describe()
        and config.get("steady_s") == (options.steady and list(options.steady))
        and config.get(encoding.name) == encoding.model_dump(mode="json")
    )
    scores = []
    for protocol, entry in sorted(found.items()):
        worst: dict[str, Any] = {"split": summary.split.name, "worst_group": entry.worst}
        if summary.split == held_out.SPEED:
            worst = {"worst_mm_s": float(entry.worst)}
        score = Score(
            protocol=protocol,
            preset=summary.preset,
            seeds=entry.seeds,
            mean_accuracy=entry.mean_accuracy,
            ci95=entry.ci95,
            worst_accuracy=entry.by[entry.worst],
            same_data=same_data,
            disturb=summary.disturb,
            disturb_training=summary.disturb_training,
            recipe=summary.recipe.get(recipe, {}),
            **worst,
        )
        scores.append(score)
    return tuple(scores)


def describe_sensor(data: OpenedData, source: Source) -> dict[str, Any]:
    """Return what the card holds of the sensor: of camera and markers, or of the microphone.

    Where the data were made otherwise than live makes them, `unlike_live` names how.

    Raises
    ------
    InputError
        If the recordings are of several sensors, or the data set does not name the sensor.
    """
    first, config = data.responses[0], data.origin.data_set.config()
    unlike: tuple[str, ...] = ()
    if source.encoding.of_vibration:
        declared = config.get("declared", {})
        taken, n = declared.get("sensor_channel"), declared.get("audio_channels")
        if taken is not None and (n is None or taken != n - 1):
            of = "" if n is None else f" of {n}"
            unlike = (f"channel {taken}{of}, counted from 0, where live hears the last",)
        rate_hz = float(first[source.channel.made_of].attrs[dims.SAMPLE_RATE])
        return {"sample_rate_hz": rate_hz, "unlike_live": unlike}
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
    options = {f"--tracker {config.get('method', 'windowed')}"}
    options |= {f"--rest {config.get('rest', 'own')}"}
    unlike = tuple(sorted(options - {"--tracker windowed", "--rest own"}))
    step_s = float(np.median(np.diff(first[dims.TIME].values)))
    attributes = [responses.attrs for responses in data.responses]
    rests = {int(its["rest_frame"]) for its in attributes if "rest_frame" in its}
    if len(rests) == 1:
        sensor = sensor | {"rest_frame": min(rests)}
    elif rests:
        unlike = (*unlike, "several rest frames")
    return {"sensor": sensor, "fps_hz": round(1 / step_s, 3), "unlike_live": unlike}


def train(
    data: Data,
    out: files.Place,
    model: str | Model = "best",
    seed: int = 0,
    results: files.Place | None = None,
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
    choices.require_number("--seed", seed, 0, choices.LARGEST_SEED)
    chosen, models = TrainingOptions(**options), choose_models(model)
    if len(models) + ("best" in list_names(model)) > 1:
        raise InputError(f"--model: expected 'best' or one model, found '{model}'")
    with Progress(quiet) as progress:
        opened = opening.open_data([data], progress=progress)
        recordings = opening.join_recordings(opened)
        copies.warn(recordings, progress)
        (one,) = models or [plan.find_best(recordings)]
        encodings = opening.choose_encodings(opened, chosen.cut, chosen.encoding, chosen.steady)
        opening.note_choice(opened, [one], encodings, progress)
        place = None if results is None else Path(results)
        return train_model(
            opened[0], one, Path(out), chosen, progress,
            encodings=encodings, seed=seed, results=place, force=force,
        )  # fmt: skip


def load_model(model: files.Place) -> Recogniser:
    """Read a trained model, which recognises samples.

    Parameters
    ----------
    model
        Folder of a trained model.

    Returns
    -------
    Recogniser
        Its `predict` takes what `samples` returns, and gives probabilities; its `card` holds
        what the model is.

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
