"""What `reproduce` simulates where it is given no session, and the demo's models.

What comes out of a simulated session, or of another sensor's, stands beside the paper's table and
reproduces nothing; the report says so.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.choices import Cut, Like, Size
from afferents.errors import InputError
from afferents.evaluation.data import open_data
from afferents.evaluation.evaluate import evaluate, options_in_words
from afferents.evaluation.results import Results, load_results
from afferents.evaluation.train import Training, train_model
from afferents.extraction.extract import extract, extract_session
from afferents.extraction.options import Extraction
from afferents.files import Place
from afferents.folds.held_out import SPEED, split_named
from afferents.folds.protocol import protocols
from afferents.markers.sensor import Sensor, load_sensor, sensor_in, sensors_of
from afferents.models.card import Card
from afferents.models.export import export_model
from afferents.models.model import BEST, MODELS, models_in, names_in
from afferents.progress import Progress
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
from afferents.store.trimming import steady_in
from afferents.store.zarr_store import open_responses

if TYPE_CHECKING:
    from afferents.recordings.session import Session
    from afferents.reproduction.estimate import Estimate

DEMO_STORE = Path("out/demo/session.zarr")
"""Where `afferents reproduce` leaves the demo's responses."""


def simulated(
    run: RunFolder,
    size: Size,
    sensor: Sensor,
    seed: int,
    workers: int | None,
    progress: Progress,
) -> Path:
    """Simulate the session of a reproduction that is given none; keep what is there of it."""
    session = run.out / "session"
    simulation = simulation_of(session, size, seed=seed, rig=rig_of(sensor), sensor=sensor.name)
    return simulate_session(simulation, workers, progress)


def demo_models(folder: Path, progress: Progress, demo: Path = DEMO_STORE) -> list[Path]:
    """Return exported models of the simulated rig; kept where both are there.

    Parameters
    ----------
    folder
        Where they are, or are to be.
    demo
        A store to learn from, if it is there; else a small session is simulated.
    """
    exported = [folder / f"{name}.onnx" for name in BEST]
    if all(path.is_file() for path in exported):
        return exported
    store = demo if demo.is_dir() and open_responses(demo) else _simulated_store(folder, progress)
    data = open_data([str(store)], progress=progress)
    for name, path in zip(BEST, exported, strict=True):
        progress.note(f"training {MODELS[name].title} on {store}")
        training = Training(data, MODELS[name], "fast", "all", data[0].encodings)
        card: Card = train_model(training, folder / name, progress, force=True)
        export_model(folder / name, path, force=True)
        for sentence in card.describe():
            progress.note(sentence)
    return exported


def _simulated_store(folder: Path, progress: Progress) -> Path:
    progress.note(f"simulating a small session to learn from, some minutes, once: {folder}")
    simulation = simulation_of(folder / "session", "quick")
    simulate_session(simulation, None, progress)
    progress.note("following the markers in its videos")
    store = folder / "session.zarr"
    extract_session(
        Extraction(folder / "session", store, load_sensor("tip_b"), "windowed"), progress
    )
    return store


# Command of the whole way: a session, its responses, the models, the report.

Options = Mapping[str, Any]
_OURS = ("session", "data", "out", "quiet")
"""Arguments of the stages that the whole way sets itself."""


def reproduce(
    out: Place,
    session: Place | None = None,
    like: Like = "recommended",
    size: Size = "quick",
    only_estimate: bool = False,
    quiet: bool = False,
    **options: Any,
) -> "Results | Estimate":
    """Go the whole way, keeping what is finished already: extract, evaluate, report.

    It first says what is chosen, where that differs from the authors' code (``published``), and
    how long it will take on this machine.

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
    only_estimate
        Whether nothing is begun, and it is only said how long it would take.
    quiet
        Whether no progress is shown.
    options
        Options of `extract` and `evaluate`, under their names there. One that contradicts `like`
        overrules it, which is said.

    Returns
    -------
    Results
        As of `evaluate`; an `Estimate` if only that was wanted, whose `total_s` is its sum.

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
    from afferents.recordings.session import read_session
    from afferents.reporting.discrepancies import discrepancies
    from afferents.reproduction.estimate import require_length

    given = {name: value for name, value in options.items() if value is not None}
    choices = choose(like, given)
    _require_sound(given, choices)
    everything = {**given, **choices}
    run = RunFolder(Path(out))
    differs = list_changes(like, given, _others(given))
    remaining = discrepancies().remaining() if like == "published" else []
    run.require_same(like, choices)
    with Progress(quiet) as progress:
        for line in _said(like, given, differs, remaining):
            progress.note(line)
        if session is None:
            _require_simulated(choices["cut"], size, only_estimate)
        root = Path(session) if session else _simulated(run, size, given, progress)
        there = read_session(root, choices["fps_hz"])
        if not given.get("keep_going"):
            require_length(there, choices["cut"])
        estimate = _estimated(there, run, everything)
        progress.note(estimate.sentence())
    if only_estimate:
        return estimate
    n = len(there.recordings)
    said = {name: format_choice(value) for name, value in choices.items()}
    run.write_state(
        RunState(
            like=like, choices=said, otherwise=tuple(differs), differs=tuple(remaining),
            recordings=n, estimated_s=estimate.total_s,
        )
    )  # fmt: skip
    extract(there.root, run.store, quiet=quiet, **_extracting(everything))
    evaluate(run.store, run.results, quiet=quiet, **_evaluating(everything))
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
        yield f"Where this still differs from the authors' code ({len(remaining)} run):"
        yield from (f"  {line}" for line in remaining)
        yield "All discrepancies of paper and code: afferents reproduce --discrepancies"


def _others(given: Options) -> list[str]:
    """Return the other options that change what is computed, as a shell has them."""
    from afferents.folds.ablation import Ablation

    held_out = given.get("held_out") or ()
    only, without = given.get("only") or Ablation(), given.get("without") or {}
    words = options_in_words(only, held_out, without)
    said = [f"{flag} {value}" for flag, value in zip(words[::2], words[1::2], strict=True)]
    known = {choice.name for choice in CHOICES} | NEUTRAL | {"held_out", "only", "without"}
    usual = _defaults(evaluate) | _defaults(extract)
    for name, value in given.items():
        if name not in known and value != usual.get(name):
            said.append(f"--{name.replace('_', '-')} {_written(value)}")
    return said


def _written(value: Any) -> str:
    return ":".join(f"{v:g}" for v in value) if isinstance(value, list | tuple) else str(value)


def _require_sound(given: Options, choices: Options) -> None:
    """Refuse what can be refused without the data, before hours are spent on extracting them.

    Raises
    ------
    InputError
        Naming what is wrong.
    """
    from afferents.encodings.base import Encoding
    from afferents.encodings.settings import ENCODINGS, Encodings
    from afferents.folds.corruption import Disturbance

    models, _ = models_in(choices["models"]), protocols(choices["protocol"])
    split_named(given.get("split", SPEED.name)).read(given.get("held_out", ()), "--held-out")
    steady_in(given.get("steady"), choices["cut"])
    for name in ("disturb", "disturb_training"):
        Disturbance.of(given.get(name), f"--{name.replace('_', '-')}")
    encoding = _encoding(given)
    own = (type(m.encoding) for m in models if isinstance(m.encoding, Encoding))
    known = {name for kind in (*ENCODINGS.values(), *own) for name in kind.model_fields}
    for name in encoding:
        if name not in known:
            expected = "options of extract, of evaluate, or of encodings"
            raise InputError(f"options: expected {expected}, found '{name}'")
    Encodings().changed(**encoding)


def _require_simulated(cut: Cut, size: Size, only_estimate: bool) -> None:
    """Refuse what makes no sense of a session that is yet to be simulated.

    Raises
    ------
    InputError
        Naming it.
    """
    if only_estimate:
        raise InputError("--estimate: expected a session to measure (--session), found none")
    if cut == "published" and size != "paper":
        expected = "recordings of a minute (--size paper), or --session"
        raise InputError(
            f"--cut published: expected {expected}, found --size {size}; or use --cut all"
        )


def _simulated(run: "RunFolder", size: Size, given: Options, progress: Progress) -> Path:

    sensor = sensor_in(given.get("sensor", "tip_b"))
    seed = next(iter(given.get("seeds", (0,))))
    return simulated(run, size, sensor, seed, given.get("workers"), progress)


def _estimated(session: "Session", run: "RunFolder", everything: Options) -> "Estimate":
    """Return what is left to be done, and how long that takes."""
    from joblib import cpu_count

    from afferents.encodings.settings import Encodings
    from afferents.evaluation.recipe import Recipe
    from afferents.folds.ablation import Ablation
    from afferents.models.config import Compute, Hyperparameters
    from afferents.parallel import workers_at
    from afferents.reproduction.estimate import estimate

    given = _defaults(evaluate) | dict(everything)
    split, models = split_named(given["split"]), given["models"]
    recipe = Recipe(
        run.results,
        (),
        models_in(models),
        given["preset"],
        given["cut"],
        Encodings().changed(**_encoding(everything)),
        ablation=given["only"] or Ablation(),
        split=split,
        steady_s=steady_in(given["steady"], given["cut"]),
        statistics=given["statistics"],
        compute=Compute(given["device"], given["precision"]),
        hyperparameters=Hyperparameters.of(given["recipe"], given["preset"]),
    )
    sensor = sensor_in(given["sensor"]) if given.get("sensor") else None
    found = estimate(
        session, sensors_of(session, sensor), given["method"], run.store, recipe,
        protocols(given["protocol"]), list(given["seeds"]),
        split.read(given["held_out"], "--held-out"), "best" in names_in(models),
    )  # fmt: skip
    cluster = given["cluster"]
    processes = workers_at(cluster) if cluster else given["workers"] or cpu_count()
    return replace(found, processes=processes, cluster=cluster is not None)


def _defaults(stage: Callable[..., Any]) -> dict[str, Any]:
    """Return the options of a stage and what they are unless given."""
    found = signature(stage).parameters.values()
    return {p.name: p.default for p in found if p.default is not p.empty and p.name not in _OURS}


def _encoding(everything: Options) -> dict[str, Any]:
    """Return options that are of no stage: those of encodings."""
    stages = _defaults(extract).keys() | _defaults(evaluate).keys()
    return {name: value for name, value in everything.items() if name not in stages}


def _extracting(everything: Options) -> dict[str, Any]:
    return {name: value for name, value in everything.items() if name in _defaults(extract)}


def _evaluating(everything: Options) -> dict[str, Any]:
    others = _defaults(extract).keys() - _defaults(evaluate).keys()
    return {name: value for name, value in everything.items() if name not in others}
