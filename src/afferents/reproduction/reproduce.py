"""The whole way in one command: simulate or take a session, extract, evaluate, report.

What comes out of a simulated session, or of another sensor's, stands next to the paper's table and
reproduces nothing; the report says so.
"""

from collections.abc import Iterator, Mapping
from inspect import signature
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from afferents import documents, files
from afferents.choices import Cut, Like, Size
from afferents.encodings.base import Encoding
from afferents.encodings.settings import ENCODINGS, Encodings
from afferents.errors import InputError
from afferents.evaluation import evaluate, plan, results
from afferents.evaluation.fold_files import FRAMES, FoldKey, finished
from afferents.evaluation.options import EvaluationOptions
from afferents.extraction.extract import extract
from afferents.markers.sensor import resolve_sensor
from afferents.models.model import BEST, choose_models, list_names
from afferents.progress import Progress
from afferents.recordings import check, data_sets
from afferents.recordings.session import Session
from afferents.reporting import published, report
from afferents.reproduction.status import RunFolder, RunState
from afferents.rig.sensor_rig import make_rig
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import make_simulation
from afferents.store import responses, trimming, zarr_store

Options = Mapping[str, Any]
EXTRACTING = frozenset(signature(extract).parameters) - {"session", "out", "quiet"}
"""Options of `extract`, by name."""
NEUTRAL = frozenset({"workers", "cluster", "device", "keep_going", "accept", "seed", "seeds"})
"""Options that leave the experiment as it is: where it is computed, and from which seeds."""
_HERE = Path(__file__).parent


def read_preset(like: Like) -> dict[str, Any]:
    """Return the options of `extract` and `evaluate` in `published.toml` or `recommended.toml`."""
    return documents.read_toml(_HERE / f"{like}.toml", "options of extract and evaluate")


def format_option(value: Any) -> str:
    """Return an option's value as a shell has it: several separated by commas."""
    several = value if isinstance(value, list | tuple) else [value]
    return ",".join(
        f"{one:g}" if isinstance(one, float) else str(getattr(one, "name", one)) for one in several
    )


def list_changes(like: Like, given: Options) -> list[str]:
    """Return a sentence for each option that changes what is computed and is not the preset's."""
    usual = {name: format_option(value) for name, value in read_preset(like).items()}
    wanted = {n: format_option(value) for n, value in given.items() if n not in NEUTRAL}
    return [
        f"{name} = {value}" + (f" ({like}: {usual[name]})" if name in usual else "")
        for name, value in wanted.items()
        if value != usual.get(name)
    ]


def reproduce(
    out: files.Place,
    session: files.Place | None = None,
    like: Like = "recommended",
    size: Size = "quick",
    quiet: bool = False,
    **options: Any,
) -> results.Results:
    """Run the paper's experiment from start to end: extract, evaluate, report.

    Prints first what is chosen, where that differs from the authors' code, and how much is to do.
    What is finished is kept. Unless told otherwise it evaluates the six models of Table 1 as we
    recommend, and ours alongside.

    Parameters
    ----------
    out
        Folder to write session, store, results and report to.
    session
        Session folder of your own (default: one is simulated).
    like
        'published': tracker, cut, protocol and training as in the paper's code; 'recommended': as
        we would do it, with the defaults that are listed here. Any option given overrules it.
    size
        Length of the 130 simulated recordings: 8 s (quick), or the paper's 65 s (paper).
    quiet
        No progress bars; plain lines on stderr.
    options
        Options of `extract` and `evaluate`, under their names there. One that contradicts `like`
        overrules it, and is named.

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
    given = {name: value for name, value in options.items() if value is not None}
    everything = {**read_preset(like), **given}
    extracting = {name: v for name, v in everything.items() if name in EXTRACTING}
    only_extracting = set(EXTRACTING) - EvaluationOptions.model_fields.keys()
    evaluating = EvaluationOptions(
        **{name: v for name, v in everything.items() if name not in only_extracting}
    )
    _require_known(evaluating)
    run = RunFolder(Path(out))
    changes = list_changes(like, given)
    names = read_preset("published")
    choices = {n: format_option(everything.get(n, "as recordings say")) for n in names}
    remaining = published.remaining_discrepancies() if like == "published" else []
    run.require_same(like, choices)
    with Progress(quiet) as progress:
        for line in _describe(like, changes, remaining):
            progress.note(line)
        if session is None:
            session = _simulate(run, size, everything, evaluating.seeds[0], progress)
        root = Path(session)
        there = data_sets.read_session(root, everything.get("fps_hz"))
        if not given.get("keep_going"):
            _require_length(there, everything["cut"])
        progress.note(_count_jobs(there, run, evaluating))
    run.write_state(
        RunState(
            like=like, choices=choices, otherwise=tuple(changes), differs=tuple(remaining),
            recordings=len(there.recordings),
        )
    )  # fmt: skip
    extract(there.root, run.store, quiet=quiet, **extracting)
    evaluate.evaluate(run.store, run.results, quiet=quiet, **evaluating.chosen())
    report.report(run.results, quiet=quiet, figures="paper" if like == "published" else "report")
    return results.load_results(run.results)


def _describe(like: Like, changes: list[str], remaining: list[str]) -> Iterator[str]:
    """Yield what is chosen, and where that still differs from the authors' code."""
    whose = "as the authors' code has it" if like == "published" else "as we recommend"
    yield f"Chosen {whose} (--like {like}):"
    _, *lines = (_HERE / f"{like}.toml").read_text(encoding="utf-8").splitlines()
    yield from (f"  {line}" for line in lines)
    if changes:
        yield "Given otherwise:"
        yield from (f"  {line}" for line in changes)
    if remaining:
        yield f"Where this still differs from the authors' code ({len(remaining)} places):"
        yield from (f"  {line}" for line in remaining)
        yield "All discrepancies of paper and code: afferents discrepancies"


def _require_known(options: EvaluationOptions) -> None:
    """Refuse unknown options and models, before hours are spent on extracting.

    Raises
    ------
    InputError
        Naming what is wrong.
    """
    own = (
        type(m.encoding) for m in choose_models(options.models) if isinstance(m.encoding, Encoding)
    )
    known = {name for kind in (*ENCODINGS.values(), *own) for name in kind.model_fields}
    for name in options.encoding:
        if name not in known:
            expected = "options of extract, of evaluate, or of encodings"
            raise InputError(f"options: expected {expected}, found '{name}'")
    several = plan.read_lengths(options.encoding.get(FRAMES))
    Encodings().changed(**{n: v for n, v in options.encoding.items() if not several or n != FRAMES})


def _simulate(run: RunFolder, size: Size, options: Options, seed: int, progress: Progress) -> Path:
    """Simulate the session of a reproduction that is given none; keep what is there of it.

    Raises
    ------
    InputError
        If the recordings would be too short for the cut.
    """
    if options["cut"] == "published" and size != "paper":
        expected = "recordings of 65 s (--size paper), or --session"
        raise InputError(
            f"--cut published: expected {expected}, found --size {size}; or use --cut all"
        )
    sensor = resolve_sensor(options.get("sensor", "tip_b"))
    wanted = make_simulation(run.session, size, seed=seed, rig=make_rig(sensor), sensor=sensor.name)
    return simulate_session(wanted, options.get("workers"), progress)


def _require_length(session: Session, cut: Cut) -> None:
    """Refuse recordings that are too short for the cut, before any is tracked.

    Raises
    ------
    InputError
        Naming the first.
    """
    for recording in session.recordings if cut == "published" else ():
        name, video, audio = recording.name, recording.video, recording.audio
        if isinstance(video, check.ClipFile):
            trimming.cut_frames(np.zeros(video.n_frames), cut, None, name)
        if audio is not None:
            trimming.cut_audio(audio.n_samples, audio.sample_rate_hz, cut, None, name)


def _count_jobs(session: Session, run: RunFolder, options: EvaluationOptions) -> str:
    """Return how many recordings and trainings are left to be done.

    Raises
    ------
    InputError
        If a group or texture that was given is not there.
    """
    named = [responses.label(xr.Dataset(), recording) for recording in session.recordings]
    used = options.ablation.recordings(named)
    # Arcs are known of no recording: the drum's way is not extracted yet.
    groups = options.by.groups_of(used if options.by.whole else [])
    options.by.require(options.held_out, groups, "--held-out")
    models: list[tuple[str, ...]] = [(model.name,) for model in choose_models(options.models)]
    if "best" in list_names(options.models) or not models:
        models.append(BEST)  # which of them depends on the responses
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
    recordings = sum(not zarr_store.is_whole(run.store, r.name) for r in session.recordings)
    return (
        f"To do: {recordings} recordings to extract, and at most {trainings} trainings. "
        f"'afferents status {run.out}' says how long they still take."
    )
