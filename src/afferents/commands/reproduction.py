"""Command of the whole way: a session, its responses, the models, the report."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any

from afferents.commands.evaluation import evaluate, report
from afferents.commands.given import Place, models_in, names_in, sensor_in
from afferents.commands.in_words import options_in_words
from afferents.commands.recordings import extract
from afferents.core.choices import Like, Size
from afferents.core.cut import Cut
from afferents.core.errors import InputError
from afferents.core.like import CHOICES, NEUTRAL, choices_in_words, chosen, otherwise
from afferents.core.progress import Progress
from afferents.core.protocol import protocols
from afferents.core.results import Results, load_results
from afferents.core.split import SPEED, split_named
from afferents.core.steady import steady_in

if TYPE_CHECKING:
    from afferents.pipeline.begun import Places
    from afferents.pipeline.estimate.estimate import Estimate
    from afferents.recordings import Session

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
    from afferents.pipeline.begun import Places, require_same, write_begun
    from afferents.pipeline.estimate.amount import require_length
    from afferents.pipeline.estimate.words import in_words
    from afferents.recordings import read_session
    from afferents.reporting.discrepancies import discrepancies

    given = {name: value for name, value in options.items() if value is not None}
    choices = chosen(like, given)
    _require_sound(given, choices)
    everything = {**given, **choices}
    places = Places(Path(out))
    differs = otherwise(like, given, _others(given))
    remaining = discrepancies().remaining() if like == "published" else []
    require_same(places, like, choices)
    with Progress(quiet) as progress:
        for line in _said(like, given, differs, remaining):
            progress.note(line)
        if session is None:
            _require_simulated(choices["cut"], size, only_estimate)
        root = Path(session) if session else _simulated(places, size, given, progress)
        there = read_session(root, choices["fps_hz"])
        if not given.get("keep_going"):
            require_length(there, choices["cut"])
        estimate = _estimated(there, places, everything)
        for line in in_words(estimate):
            progress.note(line)
    if only_estimate:
        return estimate
    n = len(there.recordings)
    write_begun(places, like, choices, differs, remaining, n, estimate.total_s)
    extract(there.root, places.store, quiet=quiet, **_extracting(everything))
    evaluate(places.store, places.results, quiet=quiet, **_evaluating(everything))
    report(places.results, quiet=quiet, figures="paper" if like == "published" else "report")
    return load_results(places.results)


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


def _others(given: Options) -> list[str]:
    """Return the other options that change what is computed, as a shell has them."""
    from afferents.evaluation.ablation import Ablation

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
    from afferents.encodings import ENCODINGS, Encoding, Encodings
    from afferents.evaluation.disturbance import Disturbance

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
            raise InputError("options", expected, f"'{name}'")
    Encodings().changed(**encoding)


def _require_simulated(cut: Cut, size: Size, only_estimate: bool) -> None:
    """Refuse what makes no sense of a session that is yet to be simulated.

    Raises
    ------
    InputError
        Naming it.
    """
    if only_estimate:
        raise InputError("--estimate", "a session to measure (--session)", "none")
    if cut == "published" and size != "paper":
        expected = "recordings of a minute (--size paper), or --session"
        raise InputError("--cut published", expected, f"--size {size}", "or use --cut all")


def _simulated(places: "Places", size: Size, given: Options, progress: Progress) -> Path:
    from afferents.pipeline.reproduce import simulated

    sensor = sensor_in(given.get("sensor", "tip_b"))
    seed = next(iter(given.get("seeds", (0,))))
    return simulated(places, size, sensor, seed, given.get("workers"), progress)


def _estimated(session: "Session", places: "Places", everything: Options) -> "Estimate":
    """Return what is left to be done, and how long that takes."""
    from joblib import cpu_count

    from afferents.encodings import Encodings
    from afferents.evaluation.ablation import Ablation
    from afferents.execution.dask import workers_at
    from afferents.pipeline.estimate.whole import estimate_of
    from afferents.pipeline.recipe import Recipe
    from afferents.pipeline.sensors import sensors_of
    from afferents.training import Compute, Hyperparameters

    given = _defaults(evaluate) | dict(everything)
    split, models = split_named(given["split"]), given["models"]
    recipe = Recipe(
        places.results,
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
    estimate = estimate_of(
        session, sensors_of(session, sensor), given["method"], places.store, recipe,
        protocols(given["protocol"]), list(given["seeds"]),
        split.read(given["held_out"], "--held-out"), "best" in names_in(models),
    )  # fmt: skip
    cluster = given["cluster"]
    processes = workers_at(cluster) if cluster else given["workers"] or cpu_count()
    return replace(estimate, processes=processes, cluster=cluster is not None)


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
