"""Make the numbers of the simulated rig in `docs/results` from seeds: ``make results``.

    python scripts/make_results.py                 all parts, in order
    python scripts/make_results.py PART [PART ...] these alone; `list` names them

A part takes an hour at most on two cores. It leaves what it found in `docs/results/rig/PART.json`
(with commit, day, machine and commands) and commits that file. A part whose file is there is not
run again; one that was stopped goes on where it was, since `evaluate` does. Sessions, stores and
results lie in `out/results`, what the commands print in `out/results/log.txt`.

All parts must be of one rig and one way of training: the first writes down which sources it used,
and the others refuse to run with other sources.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import results_pages as pages
from scipy.stats import t as student

from afferents.evaluation.results import load_results
from afferents.evaluation.schemas import Outcome
from afferents.reporting.published import published_confusion, published_families

OUT = Path("out/results")
KEPT = pages.DATA / "rig"
SEEDS = (11, 12, 13, 14, 15)
"""Of the sessions; each has drums printed anew. No recipe was chosen on any of them."""
STRESSES = {
    "reprinted": (16, []),
    "remounted": (17, ["--remount", "run"]),
    "hard": (18, ["--nuisances", "hard"]),
}
"""Sessions that a recommended model must stand, by name: seed and options."""
OURS = "shear,sa-local,sa-wave-vector,ra-wave-vector,fusion-shear,order-te,fusion"
NOISE = "markers=0.05"
"""What makes the rig's RA-I as noisy as the published one, px."""
SOURCES = ("rig", "markers", "extraction", "encodings", "folds", "models", "channels.py")


@dataclass(frozen=True)
class Part:
    """Commands that are run one after the other, and the results folder that they leave."""

    name: str
    commands: tuple[tuple[str, ...], ...]
    results: str = ""


def store_of(name: str, seed: int, *options: str) -> Part:
    """Return the part that simulates a session of 130 recordings and extracts it."""
    size = ("--preset", "paper", "--seconds", "20", "--seed", str(seed))
    return Part(
        name,
        (("simulate", name, *size, *options), ("extract", name, f"{name}.zarr")),
    )


def evaluated(name: str, store: str, models: str, *options: str) -> Part:
    """Return the part that evaluates models on a store."""
    command = ("evaluate", f"{store}.zarr", "--out", name, "--models", models, *options)
    return Part(name, (command,), name)


def parts() -> Iterator[Part]:
    """Yield all parts, in the order in which they need one another."""
    yield Part("demo", (("reproduce", "demo"),), "demo/results")
    for seed in SEEDS:
        yield store_of(f"S{seed}", seed)
        yield evaluated(f"ours-S{seed}", f"S{seed}", OURS)
        yield evaluated(f"nested-S{seed}", f"S{seed}", "all")
    for name, (seed, options) in STRESSES.items():
        yield store_of(name, seed, *options)
        yield evaluated(f"ours-{name}", name, OURS)
    yield evaluated("ours-noise", "S11", OURS, "--disturb-training", NOISE, "--disturb", NOISE)
    yield evaluated("ours-noise-at-test", "S11", OURS, "--disturb", NOISE)
    yield evaluated("unknown", "S11", "sa-wave-vector,ra-wave-vector", "--split", "texture")
    for seed in SEEDS:
        yield evaluated(f"published-S{seed}", f"S{seed}", "all", "--protocol", "published")
    vibration = "vib-te,vib-te-aug"
    yield store_of("motor-off", 11, "--nuisances", "all,motor=0,motor-ripple=0,mains=0")
    yield evaluated("vibration-motor-off", "motor-off", vibration)
    yield evaluated("vibration-paper", "S11", vibration, "--preset", "paper", "--protocol", "both")
    for sensor in ("hex331", "radial127"):
        yield store_of(sensor, 11, "--sensor", sensor)
        yield evaluated(f"ours-{sensor}", sensor, "sa-wave-vector,ra-wave-vector,sa-local")


def run(part: Part) -> None:
    """Run a part's commands, keep what they found, and commit that."""
    for words in part.commands:
        if words[0] == "simulate" and (OUT / f"{words[1]}.zarr").is_dir():
            continue  # extracted already, and its videos are gone
        say(f"afferents {' '.join(words)}")
        with (OUT / "log.txt").open("a") as log:
            command = [sys.executable, "-m", "afferents", *words, "--quiet"]
            subprocess.run(command, cwd=OUT, stdout=log, stderr=log, check=True)
        if words[0] == "extract":
            shutil.rmtree(OUT / words[1])
    if part.results:
        KEPT.mkdir(exist_ok=True)
        file = KEPT / f"{part.name}.json"
        pages.write_json(file, {**source_of(part), "models": outcomes_of(OUT / part.results)})
        subprocess.run(["git", "add", str(KEPT)], cwd=pages.ROOT, check=True)
        commit = ["git", "commit", "-q", "-m", f"Results of the rig: {part.name}", "--", str(KEPT)]
        subprocess.run(commit, cwd=pages.ROOT, check=True)


def source_of(part: Part) -> dict[str, Any]:
    """Return commit, day, machine and commands of a part's numbers."""
    return pages.source([f"afferents {' '.join(words)}" for words in part.commands])


def outcomes_of(results: Path) -> dict[str, Any]:
    """Return each model's accuracies: mean, interval, by speed, by texture, by length of touch.

    Where textures were held out, what the files for that say of each model.
    """
    if (results / "unknown.json").is_file():
        files = ("unknown", "roughness")
        return {
            name: json.loads((results / f"{name}.json").read_text())["models"] for name in files
        }
    summary = load_results(results).found
    return {
        model: {protocol: _accuracies(one, summary.textures) for protocol, one in outcomes.items()}
        for model, outcomes in summary.models.items()
    }


def _accuracies(one: Outcome, textures: Sequence[str]) -> dict[str, Any]:
    rows = enumerate(zip(textures, one.confusion, strict=True))
    touches = {length: touch for length, touch in (one.by_touch or {}).items() if touch}
    return {
        "mean": round(one.mean_accuracy, 4),
        "ci95": [round(share, 4) for share in one.ci95],
        "by_speed": {speed: round(share, 4) for speed, share in one.by.items()},
        "by_texture": {name: round(row[n] / max(1, sum(row)), 4) for n, (name, row) in rows},
        "by_touch": {length: round(touch.mean_accuracy, 4) for length, touch in touches.items()},
    }


# The tables in the docs, of all sessions that are there.


def write_tables() -> None:
    """Write the tables of the paper's models and of ours, as far as their parts are made."""
    if demo := _sessions("demo"):
        _write("demo", "What the demo ends with", demo, _demo(demo[""]["models"]))
        picture = OUT / "demo" / "results" / "figures" / "accuracy-by-speed.png"
        if picture.is_file():
            shutil.copyfile(picture, pages.DOCS / "images" / "demo.png")
    nested, published = (_sessions(f"{protocol}-S") for protocol in ("nested", "published"))
    if nested:
        _write(
            "rig-table1", "The six models of Table 1 on the rig", nested, _table1(nested, published)
        )
        by_speed = _beside(nested, "by_speed", lambda n: published_families()[n].by_speed.values())
        _write("rig-speeds", "The six models by held-out speed", nested, by_speed)
        of_textures = _beside(nested, "by_texture", lambda n: np.diag(published_confusion(n)))
        _write("rig-textures", "The six models by texture", nested, of_textures)
    if ours := _sessions("ours-"):
        _write("rig-ours", "Models of ours on the rig", ours, _ours(ours))


def _demo(models: Mapping[str, Any]) -> list[list[str]]:
    rows = [["model", "paper", "here"]]
    for name, protocols in models.items():
        found, family = protocols["nested"], published_families().get(name)
        low, high = (100 * share for share in found["ci95"])
        here = f"{100 * found['mean']:.0f} [{low:.0f}, {high:.0f}]"
        paper = f"{family.mean_percent:g}" if family else "–"
        rows.append([f"`{name}`", paper, here])
    return rows


def _sessions(prefix: str) -> dict[str, dict[str, Any]]:
    """Return what parts of this kind found, by the name of the session."""
    files = [KEPT / f"{p.name}.json" for p in parts() if p.results and p.name.startswith(prefix)]
    return {
        file.stem.removeprefix(prefix): json.loads(file.read_text())
        for file in files
        if file.is_file()
    }


def _write(name: str, title: str, sessions: Mapping[str, Any], rows: list[list[str]]) -> None:
    one = next(iter(sessions.values()))
    found = {key: one[key] for key in ("commit", "date", "machine")}
    table = {
        "commands": [f"make results  # {', '.join(sessions)}".rstrip(" #")],
        "columns": rows[0],
        "rows": rows[1:],
    }
    pages.write_json(pages.DATA / f"{name}.json", {"title": title, **found, **table})


def _table1(nested: Mapping[str, Any], published: Mapping[str, Any]) -> list[list[str]]:
    rows = [["model", "the paper's own", "`nested`", "`published`", *nested]]
    for model, family in published_families().items():
        each = _accuracies_of(nested, model, "nested")
        leaky = _accuracies_of(published, model, "published")
        sessions = [f"{value:.0f}" for value in each]
        paper = f"{family.mean_percent:g}"
        rows.append([f"`{model}`", paper, _interval(each), _interval(leaky), *sessions])
    return rows


def _beside(
    nested: Mapping[str, Any], by: str, of_paper: Callable[[str], Iterable[float]]
) -> list[list[str]]:
    """Return two rows a model: the rig's and the paper's, by speed or texture."""
    rows: list[list[str]] = []
    for model in published_families():
        each = [session["models"][model]["nested"][by] for session in nested.values()]
        rows = rows or [["model", "whose", *each[0]]]
        means = np.mean([list(one.values()) for one in each], axis=0)
        rows.append([f"`{model}`", "rig", *(f"{100 * mean:.0f}" for mean in means)])
        rows.append(["", "paper", *(f"{percent:.0f}" for percent in of_paper(model))])
    return rows


def _ours(ours: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model and a column a session: from samples, 1 s and 4 s of touch."""
    rows = [["model", *ours]]
    for model in OURS.split(","):
        found = [session["models"].get(model) for session in ours.values()]
        rows.append([f"`{model}`", *(_touches(one["nested"]) if one else "–" for one in found)])
    return rows


def _touches(one: Mapping[str, Any]) -> str:
    lengths = (one["by_touch"].get(length) for length in ("0.11", "1", "4"))
    return ", ".join("–" if share is None else f"{100 * share:.0f}" for share in lengths)


def _accuracies_of(sessions: Mapping[str, Any], model: str, protocol: str) -> list[float]:
    return [100 * session["models"][model][protocol]["mean"] for session in sessions.values()]


def _interval(percents: Sequence[float]) -> str:
    """Return mean and 95% interval over sessions, Student's t."""
    if len(percents) < 2:
        return f"{percents[0]:.0f}" if percents else "–"
    half = student.ppf(0.975, len(percents) - 1) * np.std(percents, ddof=1) / len(percents) ** 0.5
    mean = np.mean(percents)
    return f"{mean:.0f} [{mean - half:.0f}, {mean + half:.0f}]"


def require_same_sources() -> None:
    """Write down what the numbers are made with, or refuse to go on with something else."""
    command = ["git", "rev-parse", *(f"HEAD:src/afferents/{name}" for name in SOURCES)]
    of_these = dict(zip(SOURCES, pages.output(*command).split(), strict=True))
    changed = pages.output("git", "status", "--porcelain", "--", "src/afferents")
    known = KEPT / "sources.json"
    if not known.exists():
        KEPT.mkdir(exist_ok=True)
        pages.write_json(known, of_these)
    others = [n for n, tree in json.loads(known.read_text()).items() if of_these.get(n) != tree]
    if others or changed:
        why = f"{', '.join(others)} changed since" if others else "changes are not committed"
        sys.exit(
            f"{known}: expected the sources that the first part was made with, found that {why}; "
            "go back to them, or remove docs/results/rig and out/results and make all parts again"
        )


def say(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def main(asked: Sequence[str]) -> None:
    """Run what was asked for."""
    there: Mapping[str, Part] = {part.name: part for part in parts()}
    if list(asked) == ["list"]:
        for name in there:
            say(f"{name}{'  made' if made(there[name]) else ''}")
        return
    if unknown := [name for name in asked if name not in there]:
        sys.exit(f"{unknown[0]}: expected one of {', '.join(there)}")
    OUT.mkdir(parents=True, exist_ok=True)
    require_same_sources()
    for name in asked or there:
        if not made(there[name]):
            run(there[name])
            write_tables()


def made(part: Part) -> bool:
    """Tell whether a part is done."""
    if part.results:
        return (KEPT / f"{part.name}.json").is_file()
    return (OUT / f"{part.name}.zarr").is_dir() and not (OUT / part.name).exists()


if __name__ == "__main__":
    main(sys.argv[1:])
