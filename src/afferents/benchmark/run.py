"""Models on a task: train and test them, ask them under controls, and write an entry of each."""

import hashlib
import platform
import shlex
from collections.abc import Sequence
from dataclasses import replace
from datetime import date
from importlib.metadata import version
from pathlib import Path
from statistics import fmean, median

import pandas as pd

from afferents import choices, doctor, files, plugins
from afferents.benchmark.entries import ENTRIES, Data, Entry, Own, Worst
from afferents.benchmark.tasks import Asked, Task, find_task
from afferents.errors import LeakageError
from afferents.evaluation import fold_files, metrics, plan
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.results import Results, load_results
from afferents.extraction.extract import extract
from afferents.folds.controls import CONTROLS, list_controls, stands_out
from afferents.models.model import MODELS, Model, choose_models, list_names
from afferents.progress import Progress
from afferents.rig.simulate import simulate
from afferents.store.zarr_store import holds_all
from afferents.version import __version__

TOUCHES_S = (0.1, 0.5, 1.0, 4.0)
_TRIED_S = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
_ENOUGH = 0.9


def run(
    task: str | Task,
    models: str | Model | Sequence[str | Model],
    out: files.Place = "benchmark",
    data: files.Place | None = None,
    preset: choices.Preset = choices.PRESET_ASKED,
    seeds: int | Sequence[int] = 1,
    workers: int | None = None,
    quiet: bool = False,
    device: choices.Device = "auto",
) -> list[Entry]:
    """Train and test models on a task, also under controls, and write a line for each.

    What is finished in the folder is kept. Each model is trained five times as often as folds are:
    on the recordings as they are, and under each control.

    Parameters
    ----------
    task
        Name of a task, or a TOML file of your own. In Python a `Task`.
    models
        Names, comma-separated, 'chance' and 'nearest' among them; FILE.py:NAME for one of your own.
    out
        Folder for results and entries.
    data
        Folder of the task's data set (default: data/NAME in the current folder).
    preset
        How networks are trained; see 'evaluate'.
    seeds
        How many seeds each model is trained with. In Python also which.
    workers
        Processes to run in parallel (default: one per core).
    quiet
        No progress bars; plain lines on stderr.
    device
        Where networks are trained; 'auto' takes a GPU if there is one.

    Returns
    -------
    The entries, in the order of the models.

    Raises
    ------
    InputError
        If the task is unknown, its data are missing (it says what to fetch), or the data don't
        support a model.
    LeakageError
        If a model sees anything of what is held out: samples, speeds, or, under permuted labels,
        the labels of the test.
    """
    plugins.import_extra("train", "benchmark", "torch", "sklearn")
    from afferents.evaluation.run import run_evaluation

    words = [task if isinstance(task, str) else task.name]
    words += [] if data is None else ["--data", str(data)]
    task = find_task(task) if isinstance(task, str) else task
    own = {choose_models(one)[0].name: one for one in list_names(models) if ":" in one}
    source = task.source(None if data is None else Path(data))
    with Progress(quiet) as progress:
        given = {"preset": preset, "seeds": seeds, "workers": workers, "device": device}
        options = EvaluationOptions(models=models, **{**task.options, **given})
        _simulate_data(task, Path(source), progress)
        plain = plan.open_evaluation(source, Path(out), options, progress)
        question = task.asked_of(plain.recordings, plain.data[0])
        folder = Path(out) / "results" / f"{task.name.replace('/', '-')}-{question.mark}"
        results = {}
        for control in ("none", *list_controls(plain.options.by)):
            progress.note(f"Control: {CONTROLS[control]}." if control in CONTROLS else task.title)
            chosen = options.model_copy(update={"control": control})
            evaluation = replace(plain, out=folder / control, options=chosen)
            run_evaluation(evaluation, progress, quick_controls=False)
            results[control] = load_results(folder / control)
    found, refused = [], []
    for model in plain.models:
        if model.name not in results["none"].found.models:
            continue
        entry = _make_entry(task, question, model, own.get(model.name, ""), words, results)
        if reason := _describe_leak(entry):
            refused.append(reason)
            continue
        entry.write(Path(out) / ENTRIES, question.mark)
        found.append(entry)
    if refused:
        raise LeakageError("\n".join(refused))
    return found


def _simulate_data(task: Task, store: Path, progress: Progress) -> None:
    """Simulate what a task of the rig needs, and extract it, where it is not there whole."""
    if task.info is not None and task.info.made and not holds_all(store):
        session = store.with_name("session")
        progress.note(f"simulating {task.info.title}, once: {store.parent}")
        simulate(session, quiet=True, **task.info.made)
        extract(session, store, quiet=True)


def _make_entry(
    task: Task,
    question: Asked,
    model: Model,
    where: str,
    words: Sequence[str],
    results: dict[str, Results],
) -> Entry:
    """Return what came out for a model.

    Parameters
    ----------
    where
        ``FILE.py:NAME`` of a model of somebody's own; empty of the package's.
    words
        The task and where its data are, as they were asked for.
    """
    found = results["none"]
    outcome = found.found.models[model.name]["nested"]
    rows = found.predictions
    rows = rows[(rows["model"] == model.name) & (rows["protocol"] == "nested")]
    facts = [
        fold_files.load_fold(found.root, key)[0]
        for key in fold_files.finished_keys(found.root)
        if key.model == model.name and key.protocol == "nested"
    ]
    tried = ((s, _test_touches(rows, found, s)) for s in _TRIED_S)
    enough_s = (s for s, share in tried if share is not None and share >= _ENOUGH)
    spent_ms = [one.prediction_ms for one in facts if one.prediction_ms is not None]
    names = [MODELS[part].encoding for part in model.parts] or [model.encoding]
    path = Path(where.rpartition(":")[0])
    its = path.read_bytes() if path.is_file() else None
    command = ["afferents", "benchmark", "run", *words, "--models", where or model.name]
    command += ["--preset", found.found.preset]
    command += ["--seeds", f"{len(outcome.seeds)}"] if len(outcome.seeds) > 1 else []
    controls = {
        control: one.found.models[model.name]["nested"].mean_accuracy
        for control, one in results.items()
        if control != "none"
    }
    return Entry(
        task=question.name,
        task_title=task.title,
        folds=question.folds,
        model=model.name,
        title=model.title,
        own=None if its is None else Own(where=where, sha256=hashlib.sha256(its).hexdigest()),
        told_speed=model.speed_from,
        preset=found.found.preset,
        seeds=outcome.seeds,
        mean=outcome.mean_accuracy,
        ci95=outcome.ci95,
        replicate=found.found.intervals.bootstrap_unit,
        n_replicates=found.found.intervals.n,
        chance=found.found.chance,
        worst=Worst(group=outcome.worst, accuracy=outcome.by[outcome.worst]),
        by=outcome.by,
        by_touch={f"{s:g}": _test_touches(rows, found, s) for s in TOUCHES_S},
        whole=outcome.recordings.mean_accuracy,
        sample_s=float((rows["stop_s"] - rows["start_s"]).median()),
        encodings={
            name: found.config[name]
            for name in names
            if isinstance(name, str) and name in found.config
        },
        seconds_to_90=next(enough_s, None),
        ece=outcome.reliability.ece if outcome.reliability else None,
        train_samples=fmean(float((one.model_extra or {})["n_train"]) for one in facts),
        train_seconds=fmean(one.seconds for one in facts),
        prediction_ms=median(spent_ms) if spent_ms else None,
        controls=controls,
        data=Data(
            fingerprint=found.found.data[0].fingerprint,
            recordings=int(rows["recording"].nunique()),
            simulated=found.found.data[0].simulated,
        ),
        versions={
            "afferents": __version__,
            "python": platform.python_version(),
            **{package: version(package) for package in ("numpy", "torch", "scikit-learn")},
        },
        machine=doctor.processor(),
        date=f"{date.today()}",
        command=shlex.join(command),
    )


def _describe_leak(entry: Entry) -> str:
    """Return why a model is refused: it stays accurate where labels are exchanged. Or nothing."""
    permuted = entry.controls.get("permuted", entry.chance)
    is_known = stands_out(permuted, entry.mean, entry.chance, entry.data.recordings)
    if entry.mean <= entry.chance or not is_known:
        return ""
    return (
        f"{entry.model}: expected accuracy near chance ({entry.chance:.2f}) once textures are "
        f"exchanged among recordings, found {permuted:.2f}: it has learnt from the labels that "
        "are tested"
    )


def _test_touches(rows: pd.DataFrame, results: Results, seconds: float) -> float | None:
    """Return the accuracy of touches of one length; None where there are none."""
    found = metrics.name_touches(rows, results.textures, seconds)
    return None if found is None else fmean(metrics.accuracy_by_group(found.named).values())
