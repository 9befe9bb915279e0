"""What `reproduce` simulates where it is given no session, and the demo's models.

What comes out of a simulated session, or of another sensor's, stands beside the paper's table and
reproduces nothing; the report says so.
"""

from collections.abc import Iterator, Mapping, Sequence
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from afferents.choices import Cut, Like, Size, flag_of
from afferents.encodings.base import Encoding
from afferents.encodings.settings import ENCODINGS, Encodings
from afferents.encodings.settings import options as options_of_encodings
from afferents.errors import InputError
from afferents.evaluation.data import open_data
from afferents.evaluation.evaluate import evaluate
from afferents.evaluation.fold_files import FoldKey, finished
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import FIELD, lengths_in
from afferents.evaluation.results import Results, load_results
from afferents.evaluation.train import Training, train_model
from afferents.extraction.extract import extract, extract_session
from afferents.extraction.options import Extraction
from afferents.files import Place
from afferents.markers.sensor import load_sensor, sensor_in
from afferents.models.card import Card
from afferents.models.export import export
from afferents.models.model import BEST, MODELS, models_in, names_in
from afferents.progress import Progress
from afferents.recordings.check import ClipFile
from afferents.recordings.session import Session, read_session
from afferents.reporting.report import report
from afferents.reproduction.presets import (
    CHOICES,
    NEUTRAL,
    choices_in_words,
    choose,
    format_choice,
    list_changes,
)
from afferents.reproduction.run_folder import RunFolder, RunState
from afferents.rig.sensor_rig import rig_of
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import simulation_of
from afferents.store.responses import label
from afferents.store.trimming import cut_audio, cut_frames
from afferents.store.zarr_store import holds_all, is_whole

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""
_FEW_SPEEDS = (10, 20, 40, 70, 100)
"""For a model to try live, which is not to be waited for; mm/s."""


def demo_models(folder: Path, progress: Progress) -> list[Path]:
    """Return exported models of the simulated rig, in a folder; kept where both are there.

    They learn from `DEMO_STORE`, if it is there; else a small session is simulated.
    """
    exported = [folder / f"{name}.onnx" for name in BEST]
    if all(path.is_file() for path in exported):
        return exported
    # a demo that was stopped leaves a part
    store = DEMO_STORE if holds_all(DEMO_STORE) else _simulated_store(folder, progress)
    (data,) = open_data([str(store)], progress=progress)
    for name, path in zip(BEST, exported, strict=True):
        progress.note(f"training {MODELS[name].title} on {store}")
        training = Training(data, MODELS[name], data.encodings)
        card: Card = train_model(training, folder / name, progress, force=True)
        export(folder / name, path, force=True)
        for sentence in card.describe():
            progress.note(sentence)
    return exported


def _simulated_store(folder: Path, progress: Progress) -> Path:
    progress.note(f"simulating a small session to learn from, some minutes, once: {folder}")
    simulation = simulation_of(folder / "session", "quick", speeds_mm_s=_FEW_SPEEDS)
    simulate_session(simulation, None, progress)
    progress.note("following the markers in its videos")
    store = folder / "session.zarr"
    extract_session(
        Extraction(session=folder / "session", out=store, sensor=load_sensor("tip_b")),
        progress,
    )
    return store


# The whole way: a session, its responses, the models, the report.

Options = Mapping[str, Any]
EXTRACTING = tuple(
    name for name in signature(extract).parameters if name not in ("session", "out", "quiet")
)
"""Options of `extract`, by name."""


def reproduce(
    out: Place,
    session: Place | None = None,
    like: Like = "recommended",
    size: Size = "quick",
    quiet: bool = False,
    **options: Any,
) -> Results:
    """Go the whole way, keeping what is finished already: extract, evaluate, report.

    It first says what is chosen, where that differs from the authors' code (``published``), and
    how much there is to do.

    Parameters
    ----------
    out
        Folder that holds `session.zarr`, `results` and the report afterwards.
    session
        Recordings in the published layout, or with a ``session.toml``; None to simulate some.
    like
        ``published``: tracker, cut, protocol and training as in the paper's code. ``recommended``:
        as we would do it.
    size
        Of a simulated session.
    quiet
        Whether no progress is shown.
    options
        Options of `extract` and `evaluate`, under their names there. One that contradicts `like`
        overrules it, which is said.

    Returns
    -------
    Results
        As of `evaluate`.

    Raises
    ------
    InputError
        If something given is not what it should be, or the folder holds other results.

    Examples
    --------
    >>> results = reproduce("out", "session", models="ra-wave-vector")
    >>> results.summary["speeds_mm_s"]
    [20.0, 40.0, 60.0]
    """
    from afferents.reporting.published import remaining_discrepancies

    given = {name: value for name, value in options.items() if value is not None}
    choices = choose(like, given)
    everything = {**given, **choices}
    extracting = {name: v for name, v in everything.items() if name in EXTRACTING}
    evaluating = _evaluating(everything)
    _require_known(evaluating)
    run = RunFolder(Path(out))
    differs = list_changes(like, given, _others(given))
    remaining = remaining_discrepancies() if like == "published" else []
    run.require_same(like, choices)
    with Progress(quiet) as progress:
        for line in _said(like, given, differs, remaining):
            progress.note(line)
        if session is None:
            _require_simulated(choices["cut"], size)
        seed = evaluating.seeds[0]
        root = Path(session) if session else _simulated(run, size, given, seed, progress)
        there = read_session(root, choices["fps_hz"])
        if not given.get("keep_going"):
            _require_length(there, choices["cut"])
        progress.note(_to_do(there, run, evaluating))
    said = {name: format_choice(value) for name, value in choices.items()}
    run.write_state(
        RunState(
            like=like, choices=said, otherwise=tuple(differs), differs=tuple(remaining),
            recordings=len(there.recordings),
        )
    )  # fmt: skip
    extract(there.root, run.store, quiet=quiet, **extracting)
    evaluate(run.store, run.results, quiet=quiet, **evaluating.chosen())
    report(run.results, quiet=quiet, figures="paper" if like == "published" else "report")
    return load_results(run.results)


def _said(
    like: Like, given: Options, differs: Sequence[str], remaining: Sequence[str]
) -> Iterator[str]:
    """Yield what is chosen, and where that still differs from the authors' code."""
    whose = "as the authors' code has it" if like == "published" else "as we recommend"
    yield f"Chosen {whose} (--like {like}):"
    yield from (f"  {line}" for line in choices_in_words(like, given))
    if differs:
        yield "Asked for otherwise:"
        yield from (f"  {line}" for line in differs)
    if remaining:
        yield f"Where this still differs from the authors' code ({len(remaining)} places):"
        yield from (f"  {line}" for line in remaining)
        yield "All discrepancies of paper and code: afferents reproduce --discrepancies"


def _evaluating(everything: Options) -> EvaluationOptions:
    """Return the options of `evaluate` among all."""
    only_extracting = set(EXTRACTING) - EvaluationOptions.model_fields.keys()
    named = {name: v for name, v in everything.items() if name not in only_extracting}
    return EvaluationOptions(**named)


def _others(given: Options) -> list[str]:
    """Return the other options that change what is computed, as a shell has them."""
    known = {choice.name for choice in CHOICES} | NEUTRAL
    others = {name: value for name, value in given.items() if name not in known}
    flags = {name: option.flag for name, option in options_of_encodings().items()}
    words = _evaluating(others).words(flags)
    said = [f"{flag} {value}" for flag, value in zip(words[::2], words[1::2], strict=True)]
    usual = signature(extract).parameters
    for name, value in others.items():
        if name in EXTRACTING and value != usual[name].default:
            said.append(f"{flag_of(name)} {value}")
    return said


def _require_known(options: EvaluationOptions) -> None:
    """Refuse unknown options and models, before hours are spent on extracting.

    Raises
    ------
    InputError
        Naming what is wrong.
    """
    own = (type(m.encoding) for m in models_in(options.models) if isinstance(m.encoding, Encoding))
    known = {name for kind in (*ENCODINGS.values(), *own) for name in kind.model_fields}
    for name in options.encoding:
        if name not in known:
            expected = "options of extract, of evaluate, or of encodings"
            raise InputError(f"options: expected {expected}, found '{name}'")
    several = lengths_in(options.encoding.get(FIELD))
    Encodings().changed(**{n: v for n, v in options.encoding.items() if not several or n != FIELD})


def _require_simulated(cut: Cut, size: Size) -> None:
    """Refuse what makes no sense of a session that is yet to be simulated.

    Raises
    ------
    InputError
        Naming it.
    """
    if cut == "published" and size != "paper":
        expected = "recordings of 65 s (--size paper), or --session"
        raise InputError(
            f"--cut published: expected {expected}, found --size {size}; or use --cut all"
        )


def _simulated(run: RunFolder, size: Size, given: Options, seed: int, progress: Progress) -> Path:
    """Simulate the session of a reproduction that is given none; keep what is there of it."""
    sensor = sensor_in(given.get("sensor", "tip_b"))
    wanted = simulation_of(run.session, size, seed=seed, rig=rig_of(sensor), sensor=sensor.name)
    return simulate_session(wanted, given.get("workers"), progress)


def _require_length(session: Session, cut: Cut) -> None:
    """Refuse recordings that are too short for the cut, before any is tracked.

    Raises
    ------
    InputError
        Naming the first.
    """
    for recording in session.recordings if cut == "published" else ():
        name, video, audio = recording.name, recording.video, recording.audio
        if isinstance(video, ClipFile):
            cut_frames(np.zeros(video.n_frames), cut, None, name)
        if audio is not None:
            cut_audio(audio.n_samples, audio.sample_rate_hz, cut, None, name)


def _to_do(session: Session, run: RunFolder, options: EvaluationOptions) -> str:
    """Say how many recordings and trainings are left to be done.

    Raises
    ------
    InputError
        If a group or texture asked for is not there.
    """
    named = [label(xr.Dataset(), recording) for recording in session.recordings]
    asked = options.ablation.recordings(named)
    # Arcs are asked of no recording: the drum's way is not extracted yet.
    groups = options.by.groups_of(asked if options.by.whole else [])
    options.by.require(options.held_out, groups, "--held-out")
    models: list[tuple[str, ...]] = [(model.name,) for model in models_in(options.models)]
    if "best" in names_in(options.models) or not models:
        models.append(BEST)  # which of them, the responses tell
    trainings = sum(
        not any(
            finished(run.results, FoldKey.of(name, protocol.name, seed, group, options.by))
            for name in names
        )
        for names in models
        for protocol in options.protocols
        for seed in options.seeds
        for group in options.held_out or groups
    )
    recordings = sum(not is_whole(run.store, r.name) for r in session.recordings)
    return (
        f"To do: {recordings} recordings to extract, and at most {trainings} trainings. "
        f"'afferents status {run.out}' says how long they still take."
    )
