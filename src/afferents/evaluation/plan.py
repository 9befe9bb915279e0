"""What is evaluated: models and options that the data support; all trainings share `Evaluation`."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from afferents import choices, dims, files
from afferents.encodings.settings import Encodings, options as encoding_options
from afferents.errors import InputError
from afferents.evaluation import data, results
from afferents.evaluation.data import OpenedData, Origin
from afferents.evaluation.fold_files import FRAMES, config_digest
from afferents.evaluation.options import IN_SUMMARY, EvaluationOptions, TrainingOptions
from afferents.extraction import copies
from afferents.folds.controls import apply_control
from afferents.folds.corruption import Corruption
from afferents.models import base, fitted, fitting, fusion, model as rows
from afferents.models.classifiers import get_classifier
from afferents.models.config import RECIPES
from afferents.models.model import BEST, MODELS, OF_CELLS, Model
from afferents.progress import Progress
from afferents.recordings.data_set import Data, list_data_sets
from afferents.store import motion, trimming
from afferents.store.responses import Responses, named_by_spacing
from afferents.version import __version__


def find_lack(model: Model, recordings: Sequence[Responses]) -> str:
    """Return what the first recording lacks that a model can't learn from; empty if all can do."""
    learning = [get_classifier(one.classifier) for one in (model, *data.list_parts(model))]
    sources = data.find_sources(model, Encodings())
    between_channels = model.speed_from == "measured"
    needed = f"{' and '.join(source.channel.name for source in sources)} in the form it needs"
    if between_channels:
        needed = "several vibration channels to measure the speed between"
    moved = [source.channel.name for source in sources if source.channel.made_of == dims.POSITION]
    for responses in recordings:
        name = responses.attrs["name"]
        if moved and dims.of_cells(responses):
            return f"{name} lacks {moved[0]}: cells have no displacement"
        if any(kind.needs_speed for kind in learning) and not motion.has_speed(responses):
            return f"{name} lacks a speed"
        if not all(data.has(responses, source) for source in sources) or (
            between_channels and responses[dims.RA2].sizes[dims.CHANNEL] < 2
        ):
            return f"{name} lacks {needed}"
    return ""


def require_support(
    wanted: Sequence[Model], recordings: Sequence[Responses], may_leave_out: bool
) -> list[Model]:
    """Return the models that every recording supports.

    Parameters
    ----------
    may_leave_out
        Whether models that are not supported are left out instead of refused.

    Raises
    ------
    InputError
        If a model, or all of them, can't learn from these data; names a recording that
        lacks what it needs, and the models that are possible. If one of a user's own has a name
        that is taken, or parts that can't be joined.
    """
    for model in rows.pick_own(wanted):
        _require_joinable(model)
    able = [model for model in wanted if not find_lack(model, recordings)]
    if len(able) < len(wanted) and not (may_leave_out and able):
        refused = next(model for model in wanted if model not in able)
        possible = [name for name, model in MODELS.items() if not find_lack(model, recordings)]
        raise InputError(
            f"--models: expected some that these data support ({', '.join(possible) or 'none'}), "
            f"found {refused.name}, for which {find_lack(refused, recordings)}"
        )
    return able


def _require_joinable(model: Model) -> None:
    """Refuse a model with parts that can't be joined, or without what joins them."""
    kind, expected = get_classifier(model.classifier), ""
    able = [
        n for n, one in MODELS.items() if issubclass(get_classifier(one.classifier), base.Solved)
    ]
    if bool(model.parts) != (kind is fusion.LateFusion):
        expected = "parts where the classifier is late-fusion, and only there"
        found = f"{len(model.parts)} parts with {kind.name}"
    elif unable := [part for part in model.parts if part not in able]:
        expected = f"parts that are models solved at once ({', '.join(able)})"
        found = unable[0]
    if expected:
        raise InputError(f"model '{model.name}': expected {expected}, found {found}")


def find_best(recordings: Sequence[Responses]) -> Model:
    """Return the model that is recommended for such recordings; see `BEST`.

    Raises
    ------
    InputError
        If they support none.
    """
    if name := recommended(recordings):
        return MODELS[name]
    return require_support([MODELS[BEST[0]]], recordings, may_leave_out=False)[0]


def recommended(recordings: Sequence[Responses]) -> str:
    """Return the name of the first of `BEST` that recordings support; empty where they do none."""
    able = (*BEST, OF_CELLS) if any(map(dims.of_cells, recordings)) else BEST
    return next((name for name in able if not find_lack(MODELS[name], recordings)), "")


def _require_use(option: str, is_for: Callable[[Model], bool], models: Sequence[Model]) -> None:
    """Refuse an option that does nothing for any of the models, naming those that it is for."""
    if not any(map(is_for, models)):
        able = ", ".join(name for name, model in MODELS.items() if is_for(model))
        if not able:
            expected = "an option, or a field of an encoding of these models"
            raise InputError(f"{option}: expected {expected}, found neither; is it misspelt?")
        names = ", ".join(model.name for model in models)
        raise InputError(
            f"{option}: expected models that it is for ({able}), found {names}; leave it out"
        )


def require_encodings(
    models: Sequence[Model], encodings: Encodings, recordings: Sequence[Responses]
) -> None:
    """Refuse options of encodings that do nothing, and encodings that lack a recording's speed.

    And lines that follow the speed where a model does not know it: they would be cut out where the
    recording's true speed puts them, and so give it away.

    Raises
    ------
    InputError
        Naming the option; or the model and the recording.
    """
    every = encoding_options() if encodings.wanted else {}
    for name, _ in encodings.wanted:

        def has_field(model: Model, name: str = name) -> bool:
            sources = data.find_sources(model, encodings)
            return any(name in type(source.encoding).model_fields for source in sources)

        _require_use(every[name].flag if name in every else name, has_field, models)
    unknown = [str(r.attrs["name"]) for r in recordings if not motion.has_speed(r)]
    for model in models:
        sources = data.find_sources(model, encodings)
        for part, (_, encoding) in zip(data.list_parts(model), sources, strict=True):
            if encoding.needs_speed and part.speed_from != "given":
                told = [name for name, one in MODELS.items() if one.speed_from == "given"]
                raise InputError(
                    "--mask: expected lines in Hz alone, or models that are told the speed "
                    f"({', '.join(told)}), found lines in /mm for {model.name}, which would be "
                    "told by where they lie; leave out the lines in /mm"
                )
            if encoding.needs_speed and unknown:
                raise InputError(
                    f"{model.name}: expected the speed of every recording, which its encoding "
                    f"needs, found none of {unknown[0]}; leave the model out, or lines in /mm of "
                    "its --mask"
                )


def require_options(
    models: Sequence[Model],
    encodings: Encodings,
    recordings: Sequence[Responses],
    options: TrainingOptions,
) -> None:
    """Refuse what would do nothing for any of the models, or what one must not know.

    Raises
    ------
    InputError
        Naming the option.
    """

    def is_changed(corruption: Corruption, model: Model) -> bool:
        sounds = [source.encoding.of_vibration for source in data.find_sources(model, encodings)]
        of_sound = bool(corruption.sound and any(sounds))
        return of_sound or (corruption.of_markers and not all(sounds))

    def has_penalty(model: Model) -> bool:
        kinds = [get_classifier(part.classifier) for part in data.list_parts(model)]
        solved = [kind for kind in kinds if issubclass(kind, base.Solved)]
        return any(kind.searched or len(kind.penalties) > 1 for kind in solved)

    def goes_by_recipe(model: Model) -> bool:
        recipe = fitting.choose_recipe(model, encodings.of(model.encoding))
        return fitting.learns_in_a_loop(model) and recipe in options.recipe.changed

    require_encodings(models, encodings, recordings)
    corruptions: dict[str, Corruption] = {}
    if isinstance(options, EvaluationOptions):
        corruptions["--disturb"] = options.disturb
        if options.penalty == "searched":
            _require_use("--penalty", has_penalty, models)
        if options.markers != 1:
            _require_images(models, encodings)
    corruptions["--disturb-training"] = options.disturb_training
    for option, corruption in corruptions.items():
        if corruption:
            _require_use(f"{option} {corruption}", partial(is_changed, corruption), models)
    if changed := options.recipe.changed:
        _require_use(f"--recipe for {', '.join(changed)}", goes_by_recipe, models)


def _require_images(models: Sequence[Model], encodings: Encodings) -> None:
    """Refuse models whose samples hide where each marker is, as waves do: none can be left out."""
    for model in models:
        for _, encoding in data.find_sources(model, encodings):
            if not encoding.of_vibration and not {dims.ROW, dims.MARKER} & {*encoding.sample_dims}:
                found = f"{model.name}, which learns from their {encoding.name}"
                raise InputError(
                    f"--markers: expected models of tactile images or of vibration, found {found}"
                )


def require_trainable(
    models: Sequence[Model], recordings: Sequence[Responses], encodings: Encodings, cut: choices.Cut
) -> None:
    """Refuse models of vibration that can't be built for the samples there will be.

    A user's own network is not tried.

    Raises
    ------
    InputError
        Naming what is too few or too many, before anything is trained.
    """
    for model in models:
        source, *others = data.find_sources(model, encodings)
        if not source.encoding.of_vibration or others or not recordings:
            continue
        samples = data.encode(recordings[0], source, cut)
        if isinstance(model.classifier, str) and fitting.learns_in_a_loop(model):
            shape = source.encoding.seen(samples.values[:1]).shape[1:]
            fitted.new_classifier(model, samples, source.encoding, shape, n_classes=2)


def read_lengths(given: object) -> tuple[int, ...]:
    """Return the lengths of window that ``--frames`` lists, in frames; none where it is one.

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
        raise InputError(f"--frames: expected {expected}, found '{given}'")
    return lengths


def vary_length(
    models: Sequence[Model], lengths: Sequence[int], encodings: Encodings
) -> list[Model]:
    """Return a model of each length in place of each whose samples are runs of images.

    Each is a model of its own, named by its length (`sa-ste-20`), so that results, tables and
    figures hold it like any other.

    Raises
    ------
    InputError
        If none is.
    """

    def find_encoding(model: Model) -> Any:
        """Return the encoding of a model whose samples are runs of images; None of any other."""
        sources = () if model.parts else data.find_sources(model, encodings)
        of_runs = (one.encoding for one in sources if FRAMES in type(one.encoding).model_fields)
        return next(of_runs, None)

    _require_use("--frames", lambda model: find_encoding(model) is not None, models)
    found = []
    for model in models:
        if (encoding := find_encoding(model)) is None:
            found.append(model)
            continue
        for n in lengths:
            title = f"{model.title}, {n} frame{'s' if n > 1 else ''}"
            changed, name = encoding.changed(**{FRAMES: n}), f"{model.name}-{n}"
            found.append(
                replace(model, name=name, title=title, encoding=changed, variant_of=model.name)
            )
    return found


@dataclass(frozen=True, eq=False)
class Evaluation:
    """What every training of an evaluation goes by; sent along with each, without the data.

    Two are the same if they are one object: what they hold (a user's own model) may not compare.

    Attributes
    ----------
    out
        The results folder.
    data
        Where the data come from, for processes that read them themselves.
    models
        The requested ones, ``best`` and the like resolved.
    encodings
        How samples are made, as suits the data and as chosen.
    options
        What was chosen.
    opened
        The data, opened; nothing in a process that trains on samples that were sent.
    skipped
        Recordings that no model uses, and why; found out when the evaluation begins.
    tested
        Recordings that alone are tested, and never learnt from; none for all alike. As `skipped`.
    """

    out: Path
    data: tuple[Origin, ...]
    models: Sequence[Model]
    encodings: Encodings
    options: EvaluationOptions = field(default_factory=EvaluationOptions)
    opened: Sequence[OpenedData] = ()
    skipped: Mapping[str, str] = field(default_factory=dict)
    tested: frozenset[str] = frozenset()

    @property
    def config(self) -> dict[str, Any]:
        """Return what must agree for folds to stand in one results folder, and what was chosen.

        `config.json` holds it. The last entry, `options`, may differ from run to run.
        """
        training = {name: self.options.training(name).model_dump(mode="json") for name in RECIPES}
        ablation = self.options.ablation.describe()
        return {
            **self._describe_data(),
            "skipped": sorted(self.skipped),
            **self.encodings.describe(),
            "training": training,
            **({"ablation": ablation} if ablation else {}),
            results.OPTIONS: self.options.given(),
        }

    def about(self, recordings: Sequence[Responses]) -> dict[str, Any]:
        """Return what a summary holds of the whole; see `results.Summary`."""
        n_used = len(recordings)
        some = n_used < sum(origin.n_recordings for origin in self.data)
        return {
            **self._describe_data(),
            "afferents": __version__,
            **({"n_used": n_used} if some else {}),
            results.OPTIONS: {k: v for k, v in self.options.given().items() if k not in IN_SUMMARY},
            "skipped": [{"recording": n, "reason": why} for n, why in self.skipped.items()],
            **data.data_quality(recordings),
            **named_by_spacing(recordings),
        }

    def _describe_data(self) -> dict[str, Any]:
        """Return what configuration and summary share: the data, and what is not as usual."""
        options, given = self.options, self.options.given()
        names = "split", "control", "penalty", "statistics", "disturb", "disturb_training"
        chosen = {name: given.get(name) for name in names}
        chosen |= {"recipe": options.recipe.changed}
        chosen |= {"steady_s": options.steady and list(options.steady)}
        return {
            "schema": results.SCHEMA,
            "data": [origin.model_dump() for origin in self.data],
            "without": dict(options.without),
            "cut": options.cut,
            "preset": options.preset,
            **{name: value for name, value in chosen.items() if value},
        }

    @property
    def recordings(self) -> list[Responses]:
        """Return the recordings that are used, with the part of them that is."""
        options = self.options
        used = options.ablation.recordings(data.join_recordings(self.opened))
        return apply_control(trimming.set_steady(used, options.steady), options.control, options.by)

    def to_json(self) -> str:
        """Return what a worker makes it from again, reading the same files; see `run.run_far_job`.

        Raises
        ------
        InputError
            If a model is an object of this process, which no other one can find.
        """
        wanted = rows.list_wanted(self.options.models)
        if objects := [model.name for model in wanted if isinstance(model, Model)]:
            raise InputError(
                f"--cluster: expected models by name, or as FILE.py:NAME, which workers can read, "
                f"found the object {objects[0]}; give the file that it is made in"
            )
        return json.dumps(
            {
                "folder": str(Path.cwd()),
                "data": [origin.source for origin in self.data],
                "out": str(self.out),
                "options": self.options.given(),
                "skipped": dict(self.skipped),
                "tested": sorted(self.tested),
                "digest": config_digest(self.config),
            }
        )

    def model(self, name: str) -> Model:
        """Return the model of that name."""
        return next(model for model in self.models if model.name == name)


def open_evaluation(
    sources: Data | Sequence[Data], out: files.Place, options: EvaluationOptions, progress: Progress
) -> Evaluation:
    """Open the data, after checking what can be checked without them, and choose what suits them.

    Raises
    ------
    InputError
        If a model is unknown, or the data can't be read.
    """
    models = rows.choose_models(options.models)
    lengths = read_lengths(options.encoding.get(FRAMES))
    wanted = {n: v for n, v in options.encoding.items() if not (lengths and n == FRAMES)}
    opened = data.open_data(list_data_sets(sources), options.without, options.keep_going, progress)
    recordings = data.join_recordings(opened)
    copies.warn(recordings, progress)
    used = options.ablation.recordings(recordings)
    if (settled := options.by.settled(used).name) != options.split:
        options = options.model_copy(update={"split": settled})
    encodings = data.choose_encodings(opened, options.cut, wanted, options.steady, used)
    if "best" in rows.list_names(options.models) or not models:
        best = find_best(recordings)
        models = models if best in models else [*models, best]
    models = vary_length(models, lengths, encodings) if lengths else models
    data.note_choice(opened, models, encodings, progress)
    origins = tuple(one.origin for one in opened)
    return Evaluation(Path(out), origins, models, encodings, options, opened)
