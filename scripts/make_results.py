"""Make the numbers of the simulated rig in `docs/results` from seeds: ``make results``.

    python scripts/make_results.py                 all parts, in order
    python scripts/make_results.py PART [PART ...] these alone; `list` names them

A part takes an hour at most on two cores. It leaves what it found in `docs/results/rig/PART.json`
(with commit, day, machine and commands) and commits that file. A part whose file is there is not
run again; one that was stopped goes on where it was, since `evaluate` does. Sessions, stores and
results lie in `out/results`, what the commands print in `out/results/log.txt`. `studies` has
further parts, made in the same way.

All parts must be of one rig and one way of training: the first writes down which sources it used,
and the others refuse to run with other sources. A table names the commits, days and machines of
all its parts.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import results_pages as pages
from matplotlib.figure import Figure
from scipy.stats import t as student

from afferents.evaluation.metrics import accuracy_by_group, name_touches
from afferents.evaluation.results import Results, load_results
from afferents.folds.protocol import ProtocolName
from afferents.reporting.published import published_families
from afferents.reporting.style import BLUE, GREY, VERMILION

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
CAUSES = {
    "round-drums": ("drums round", ["--nuisances", "all,eccentricity=0"]),
    "even-drums": (
        "drums round, bumps alike",
        ["--nuisances", "all,eccentricity=0,printing=0,warp=0,grip=0"],
    ),
}
"""What makes vibration hard to learn from, taken away: what is then so, and the options."""
OURS = "shear,sa-local,sa-wave-vector,ra-wave-vector,order-te,fusion"
CLAIMS = {
    "RA-I leads SA-I, single images": ("ra-se", "sa-se"),
    "RA-I leads SA-I, runs of images": ("ra-ste", "sa-ste"),
    "Runs help RA-I": ("ra-ste", "ra-se"),
    "Runs do not help SA-I": ("sa-ste", "sa-se"),
    "Stretching helps vibration": ("vib-te-aug", "vib-te"),
}
"""What the paper finds within a modality, and which model it compares with which."""
HALVES = ("shear", "sa-local")
"""SA-I in two: what the markers move in common, and what each moves unlike its neighbours."""
FAILED = 22
"""Recordings (speed, texture) of which the published SA-SE recognises less than a tenth (Figure 9;
digitised, diagonals below 10%)."""
NOISE = "markers=0.05"
"""What makes the rig's RA-I as noisy as the published one, px."""
TOUCHES_S = (0.11, 0.25, 0.5, 1.0, 2.0, 4.0)
SOURCES = ("rig", "markers", "extraction", "encodings", "folds", "models", "channels.py")


@dataclass(frozen=True)
class Part:
    """Commands that are run one after the other, and the results folder that they leave."""

    name: str
    commands: tuple[tuple[str, ...], ...]
    results: str = ""


def store_of(name: str, seed: int, *options: str, extract: Sequence[str] = ()) -> Part:
    """Return the part that simulates a session of 130 recordings and extracts it."""
    size = ("--preset", "paper", "--seconds", "20", "--seed", str(seed))
    simulated = ("simulate", name, *size, *options)
    return Part(name, (simulated, ("extract", name, f"{name}.zarr", *extract)))


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
        going = ("--keep-going",) if name == "hard" else ()  # some rest frames lack markers
        yield store_of(name, seed, *options, extract=going)
        yield evaluated(f"ours-{name}", name, OURS, *going)
    yield evaluated("images-remounted", "remounted", "sa-se,ra-se,sa-ste,ra-ste")
    yield evaluated("ours-noise", "S11", OURS, "--disturb-training", NOISE, "--disturb", NOISE)
    yield evaluated("published-S11", "S11", "all", "--protocol", "published")
    for name, (_, options) in CAUSES.items():
        yield store_of(name, 11, *options)
        yield evaluated(f"vibration-{name}", name, "vib-te,vib-te-aug")
    yield store_of("no-nodules", 12, "--nodules", "off")
    yield evaluated("ours-no-nodules", "no-nodules", OURS)


def run(part: Part, kept: Path = KEPT) -> None:
    """Run a part's commands, keep what they found in a folder of the docs, and commit that."""
    for words in part.commands:
        if words[0] == "simulate" and (OUT / f"{words[1]}.zarr").is_dir():
            continue  # extracted already, and its videos are gone
        say(line_of(words))
        own = words[0].endswith(".py")
        command = [str(pages.ROOT / words[0]), *words[1:]] if own else ["-m", "afferents", *words]
        command = [sys.executable, *command, *(() if own else ("--quiet",))]
        with (OUT / "log.txt").open("a") as log:
            done = subprocess.run(command, cwd=OUT, stdout=log, stderr=log)
        if done.returncode not in (0, 3):  # 3: some recordings were left out, as the log says
            sys.exit(f"{part.name}: exit code {done.returncode}; see {OUT / 'log.txt'}")
        if words[0] == "extract":
            shutil.rmtree(OUT / words[1])
    if part.results:
        kept.mkdir(exist_ok=True)
        file = kept / f"{part.name}.json"
        pages.write_json(file, {**source_of(part), "models": outcomes_of(OUT / part.results)})
        subprocess.run(["git", "add", str(kept)], cwd=pages.ROOT, check=True)
        commit = ["git", "commit", "-q", "-m", f"Results of the rig: {part.name}", "--", str(kept)]
        subprocess.run(commit, cwd=pages.ROOT, check=True)


def source_of(part: Part) -> dict[str, Any]:
    """Return the sources' last commit, day, machine and commands of a part's numbers."""
    commit = pages.output("git", "log", "-1", "--format=%h", "--", "src/afferents")
    return {**pages.source([line_of(words) for words in part.commands]), "commit": commit}


def line_of(words: Sequence[str]) -> str:
    """Return a command as it is typed."""
    return f"{'python' if words[0].endswith('.py') else 'afferents'} {' '.join(words)}"


def outcomes_of(results: Path) -> dict[str, Any]:
    """Return each model's accuracies: mean, interval, by speed, by texture, by length of touch."""
    found = load_results(results)
    return {
        model: {protocol: _accuracies(found, model, protocol) for protocol in outcomes}
        for model, outcomes in found.found.models.items()
    }


def _accuracies(results: Results, model: str, protocol: ProtocolName) -> dict[str, Any]:
    one = results.found.models[model][protocol]
    rows = enumerate(zip(results.textures, one.confusion, strict=True))
    table = results.predictions
    table = table[(table["model"] == model) & (table["protocol"] == protocol)]
    touches = {f"{s:g}": name_touches(table, results.textures, s) for s in TOUCHES_S}
    return {
        "mean": round(one.mean_accuracy, 4),
        "ci95": [round(share, 4) for share in one.ci95],
        "by_speed": {speed: round(share, 4) for speed, share in one.by.items()},
        "by_texture": {name: round(row[n] / max(1, sum(row)), 4) for n, (name, row) in rows},
        "by_recording": _accuracy_by_recording(table),
        "by_touch": {
            length: round(fmean(accuracy_by_group(touch.named).values()), 4)
            for length, touch in touches.items()
            if touch is not None
        },
    }


def _accuracy_by_recording(predictions: Any) -> dict[str, float]:
    right = predictions["true_texture"] == predictions["predicted_texture"]
    return right.groupby(predictions["recording"]).mean().round(4).to_dict()


# Tables and the picture in the docs.


def write_tables() -> None:
    """Write the tables of the paper's models and of ours whose parts are all made."""
    if demo := found("demo"):
        write("demo", "What the demo ends with", demo, _demo(demo["demo"]["models"]))
        picture = OUT / "demo" / "results" / "figures" / "accuracy-by-speed.png"
        if picture.is_file():
            shutil.copyfile(picture, pages.DOCS / "images" / "demo.png")
    nested, ours = (found(*(f"{kind}-S{seed}" for seed in SEEDS)) for kind in ("nested", "ours"))
    published = found("published-S11")
    if nested:
        both = {**nested, **published}
        write("rig-table1", "Table 1 on the rig", both, _table1(nested, published))
        draw_speeds(list(nested.values())).savefig(
            pages.DOCS / "images" / "rig-by-speed.png", dpi=110
        )
    if nested and ours:
        write("rig-claims", "What the paper finds", {**nested, **ours}, _claims(nested, ours))
    away = found("images-remounted", *(f"vibration-{name}" for name in CAUSES), "ours-no-nodules")
    if nested and ours and away:
        rows = _causes(nested, ours["ours-S12"], away)
        parts = {**nested, "ours-S12": ours["ours-S12"], **away}
        write("rig-causes", "What the simulation makes so, taken away", parts, rows)
    stresses: dict[str, Any] = {}
    for name in ("noise", *STRESSES):
        stresses |= found(f"ours-{name}")
    if ours and stresses:
        write("rig-ours", "Our models on the rig", {**ours, **stresses}, _ours(ours, stresses))


def found(*names: str) -> dict[str, dict[str, Any]]:
    """Return what these parts found; nothing unless all are made."""
    files = [KEPT / f"{name}.json" for name in names]
    there = all(file.is_file() for file in files)
    return {file.stem: json.loads(file.read_text()) for file in files} if there else {}


def write(name: str, title: str, parts: Mapping[str, Any], rows: list[list[str]]) -> None:
    """Write the data of a table of the docs."""
    sources = pages.find_sources(parts.values())
    table = {"commands": [made_by(parts)], "columns": rows[0], "rows": rows[1:]}
    pages.write_json(pages.DATA / f"{name}.json", {"title": title, **sources, **table})


def made_by(parts: Iterable[str]) -> str:
    """Return the command that makes these parts."""
    return f'make results PART="{" ".join(parts)}"'


def _demo(models: Mapping[str, Any]) -> list[list[str]]:
    rows = [["model", "paper", "here"]]
    for name, protocols in models.items():
        found, family = protocols["nested"], published_families().get(name)
        low, high = (100 * share for share in found["ci95"])
        here = f"{100 * found['mean']:.0f} [{low:.0f}, {high:.0f}]"
        paper = f"{family.mean_percent:g}" if family else "–"
        rows.append([f"`{name}`", paper, here])
    return rows


def _table1(nested: Mapping[str, Any], published: Mapping[str, Any]) -> list[list[str]]:
    rows = [["model", "the paper's own", "`nested`", "`published`"]]
    for model, family in published_families().items():
        fair, leaky = means_of(nested, model, "nested"), means_of(published, model, "published")
        rows.append([f"`{model}`", f"{family.mean_percent}", interval(fair), interval(leaky)])
    return rows


def _claims(nested: Mapping[str, Any], ours: Mapping[str, Any]) -> list[list[str]]:
    """Return a row for each of the paper's findings: its own numbers, and the rig's."""
    rows = [["the paper finds", "measure", "paper", "rig"]]
    paper = {name: family.mean_percent for name, family in published_families().items()}
    for claim, (more, less) in CLAIMS.items():
        gained = np.subtract(*(means_of(nested, model, "nested") for model in (more, less)))
        half = half_width(gained)
        mean, low, high = (round(gained.mean() + way * half) for way in (0, -1, 1))
        measure = f"`{more}` less `{less}`, points"
        here = f"{mean:+d} [{low:+d}, {high:+d}]"
        rows.append([claim, measure, f"{paper[more] - paper[less]:+g}", here])
    each = [part["models"]["sa-se"]["nested"].get("by_recording") for part in nested.values()]
    failed = [sum(share < 0.1 for share in one.values()) for one in each if one]
    if failed:
        measure = "of 130 recordings, those of which `sa-se` recognises less than a tenth"
        here = f"{np.mean(failed):.0f}" + " (one session)" * (len(failed) == 1)
        rows.append(["SA-I fails recording by recording", measure, f"{FAILED}", here])
    pair = (np.mean([percents_of(part, model)[0] for part in ours.values()]) for model in HALVES)
    measure = "`shear` alone, `sa-local` (no shear)"
    here = ", ".join(f"{percent:.0f}" for percent in pair)
    return [*rows, ["Friction carries the texture in SA-I", measure, "–", here]]


def _causes(
    nested: Mapping[str, Any], usual: Mapping[str, Any], away: Mapping[str, Any]
) -> list[list[str]]:
    """Return a row for each thing that is changed in the simulation, and each model it moves."""
    rows = [["change", "model", "as it is", "changed"]]
    for model, one in away["images-remounted"]["models"].items():
        as_it_is = interval(means_of(nested, model, "nested"))
        now = f"{100 * one['nested']['mean']:.0f}"
        rows.append(["mounted anew for each run", f"`{model}`", as_it_is, now])
    for name, (what, _) in CAUSES.items():
        for model, one in away[f"vibration-{name}"]["models"].items():
            each = (nested["nested-S11"]["models"][model], one)
            rows.append([what, f"`{model}`", *(f"{100 * of['nested']['mean']:.0f}" for of in each)])
    for model in ("sa-wave-vector", "ra-wave-vector", "sa-local", "shear"):
        each = (percents_of(part, model)[0] for part in (usual, away["ours-no-nodules"]))
        rows.append(["no nodules", f"`{model}`", *(f"{one:.0f}" for one in each)])
    changes = [row[0] for row in rows]
    for row, change, before in zip(rows[1:], changes[1:], changes, strict=False):
        row[0] = "" if change == before else change
    return rows


def draw_speeds(sessions: Sequence[Mapping[str, Any]]) -> Figure:
    """Draw each model's accuracy by held-out speed: mean and range of sessions, and the paper's."""
    figure, axes = plt.subplots(
        2, 3, figsize=(9, 4.6), layout="constrained", sharex=True, sharey=True
    )
    for ax, (model, family) in zip(axes.flat, published_families().items(), strict=True):
        of_each = [session["models"][model]["nested"]["by_speed"] for session in sessions]
        speeds = [float(speed) for speed in of_each[0]]
        percents = 100 * np.array([list(one.values()) for one in of_each])
        ax.fill_between(
            speeds, percents.min(axis=0), percents.max(axis=0), color=BLUE, alpha=0.2, lw=0
        )
        ax.plot(speeds, percents.mean(axis=0), color=BLUE, marker="o", markersize=3.5, label="rig")
        ax.plot(*zip(*family.by_speed.items(), strict=True), "x", color=VERMILION, label="paper")
        ax.axhline(100 / 13, color=GREY, lw=0.7, ls="--", label="chance")
        ax.set(title=model, ylim=(0, 103), xlim=(5, 105))
    for ax in axes[-1]:
        ax.set_xlabel("held-out speed, mm/s")
    for ax in axes[:, 0]:
        ax.set_ylabel("accuracy, %")
    axes[0, 0].legend(fontsize=8)
    return figure


def _ours(ours: Mapping[str, Any], stresses: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model: touches of 0.11, 1 and 4 s, and the worst of the stresses, 4 s."""
    names = [name.removeprefix("ours-") for name in stresses]
    rows = [["model", "as it is", *names, "worst of these, 4 s"]]
    for model in next(iter(ours.values()))["models"]:  # of parts made earlier, also models gone
        usual = np.mean([percents_of(part, model) for part in ours.values()], axis=0)
        each = [percents_of(part, model) for part in stresses.values()]
        worst = f"{min(one[-1] for one in each):.0f}"
        rows.append([f"`{model}`", *map(in_words, (usual, *each)), worst])
    return rows


def percents_of(part: Mapping[str, Any], model: str) -> list[float]:
    """Return accuracies from touches of 0.11, 1 and 4 s; NaN where samples are longer."""
    by_touch = part["models"][model]["nested"]["by_touch"]
    return [100 * by_touch.get(length, np.nan) for length in ("0.11", "1", "4")]


def in_words(percents: Sequence[float]) -> str:
    """Return the three accuracies as one cell."""
    return ", ".join("–" if np.isnan(percent) else f"{percent:.0f}" for percent in percents)


def means_of(sessions: Mapping[str, Any], model: str, protocol: str) -> list[float]:
    """Return a model's mean accuracy in each session, percent."""
    return [100 * session["models"][model][protocol]["mean"] for session in sessions.values()]


def interval(percents: Sequence[float]) -> str:
    """Return mean and 95% interval over sessions, Student's t; of two sessions, both."""
    if len(percents) < 2:
        return f"{percents[0]:.0f}" if percents else "–"
    if len(percents) == 2:
        return f"{np.mean(percents):.0f} ({min(percents):.0f}, {max(percents):.0f})"
    mean, half = np.mean(percents), half_width(percents)
    return f"{mean:.0f} [{max(0, mean - half):.0f}, {min(100, mean + half):.0f}]"


def half_width(values: Sequence[float]) -> float:
    """Return half of the 95% interval of a mean, Student's t."""
    spread = np.std(values, ddof=1) / len(values) ** 0.5
    return float(student.ppf(0.975, len(values) - 1) * spread)


def require_same_sources(kept: Path = KEPT) -> None:
    """Write down what the numbers are made with, or refuse to go on with something else."""
    command = ["git", "rev-parse", *(f"HEAD:src/afferents/{name}" for name in SOURCES)]
    of_these = dict(zip(SOURCES, pages.output(*command).split(), strict=True))
    changed = pages.output("git", "status", "--porcelain", "--", "src/afferents")
    known = kept / "sources.json"
    if not known.exists():
        kept.mkdir(exist_ok=True)
        pages.write_json(known, of_these)
    others = [n for n, tree in json.loads(known.read_text()).items() if of_these.get(n) != tree]
    if others or changed:
        why = f"{', '.join(others)} changed since" if others else "changes are not committed"
        sys.exit(
            f"{known}: expected the sources that the first part was made with, found that {why}; "
            f"go back to them, or remove {kept} and out/results and make all parts again"
        )


def say(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


def make(
    parts: Iterable[Part],
    asked: Sequence[str],
    kept: Path = KEPT,
    tables: Callable[[], None] = write_tables,
) -> None:
    """Run the parts that were asked for, all if none was, and write tables after each."""
    there: Mapping[str, Part] = {part.name: part for part in parts}
    if list(asked) == ["list"]:
        for name in there:
            say(f"{name}{'  made' if made(there[name], kept) else ''}")
        return
    if unknown := [name for name in asked if name not in there]:
        sys.exit(f"{unknown[0]}: expected one of {', '.join(there)}")
    OUT.mkdir(parents=True, exist_ok=True)
    require_same_sources(kept)
    for name in asked or there:
        if not made(there[name], kept):
            run(there[name], kept)
            tables()


def made(part: Part, kept: Path) -> bool:
    """Tell whether a part is done."""
    if part.results:
        return (kept / f"{part.name}.json").is_file()
    return (OUT / f"{part.name}.zarr").is_dir() and not (OUT / part.name).exists()


if __name__ == "__main__":
    make(parts(), sys.argv[1:])
