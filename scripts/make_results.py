"""Make the numbers of the simulated rig in `docs/results` from seeds: ``make results``.

    python scripts/make_results.py                 all parts, in order
    python scripts/make_results.py PART [PART ...] these alone; `list` names them

A part takes an hour at most on two cores (`images-paper` some 80 minutes; `vibration-paper` some
two hours). It leaves what it found in `docs/results/rig/PART.json` (with commit, day, machine and
commands) and commits that file. A part whose file is there is not run again; one that was stopped
goes on where it was, since `evaluate` does. Sessions, stores and results lie in `out/results`, what
the commands print in `out/results/log.txt`.

All parts must be of one rig and one way of training: the first writes down which sources it used,
and the others refuse to run with other sources. A table names the commits, days and machines of
all its parts.
"""

import json
import math
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
from scipy.stats import spearmanr
from scipy.stats import t as student

from afferents.evaluation.metrics import accuracy_by_group, name_touches
from afferents.evaluation.results import Results, load_results
from afferents.folds.protocol import ProtocolName
from afferents.reporting.published import published_confusion, published_families
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
    "motor-off": ["--nuisances", "all,motor=0,motor-ripple=0,mains=0"],
    "noise-off": ["--nuisances", "all,microphone-noise=0,room-noise=0"],
    "even-speed": ["--nuisances", "all,speed-ripple=0,motor-ripple=0,drift=0"],
    "even-drums": ["--nuisances", "all,eccentricity=0,printing=0,warp=0"],
    "round-drums": ["--nuisances", "all,eccentricity=0"],
    "longer": ["--seconds", "60"],
}
"""What may make vibration hard to learn from, taken away: options of the first session's."""
OURS = "shear,sa-local,sa-wave-vector,ra-wave-vector,fusion-shear,order-te,fusion"
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
    yield evaluated("images-remounted", "remounted", "sa-se,ra-se,sa-ste,ra-ste")
    yield evaluated("ours-noise", "S11", OURS, "--disturb-training", NOISE, "--disturb", NOISE)
    yield evaluated("ours-noise-at-test", "S11", OURS, "--disturb", NOISE)
    yield evaluated("unknown", "S11", "sa-wave-vector,ra-wave-vector", "--split", "texture")
    for seed in SEEDS:
        yield evaluated(f"published-S{seed}", f"S{seed}", "all", "--protocol", "published")
    vibration = "vib-te,vib-te-aug"
    for name, options in CAUSES.items():
        yield store_of(name, 11, *options)
        yield evaluated(f"vibration-{name}", name, vibration)
    paper = ("--preset", "paper")
    yield evaluated("vibration-paper", "S11", vibration, *paper, "--protocol", "both")
    yield evaluated("images-paper", "S11", "sa-se", *paper, "--held-out", "10,50,100")
    yield store_of("no-nodules", 12, "--nodules", "off")
    yield evaluated("ours-no-nodules", "no-nodules", OURS)
    for sensor in ("hex331", "radial127"):
        yield store_of(sensor, 11, "--sensor", sensor)
        yield evaluated(f"ours-{sensor}", sensor, "sa-wave-vector,ra-wave-vector,sa-local")


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
            subprocess.run(command, cwd=OUT, stdout=log, stderr=log, check=True)
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
    """Return each model's accuracies: mean, interval, by speed, by texture, by length of touch.

    Where textures were held out, what the files for that say of each model.
    """
    if (results / "unknown.json").is_file():
        files = ("unknown", "roughness")
        return {
            name: json.loads((results / f"{name}.json").read_text())["models"] for name in files
        }
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
        "by_touch": {
            length: round(fmean(accuracy_by_group(touch.named).values()), 4)
            for length, touch in touches.items()
            if touch is not None
        },
    }


# Tables and the picture in the docs.


def write_tables() -> None:
    """Write the tables of the paper's models and of ours whose parts are all made."""
    if demo := _found("demo"):
        _write("demo", "What the demo ends with", demo, _demo(demo["demo"]["models"]))
        picture = OUT / "demo" / "results" / "figures" / "accuracy-by-speed.png"
        if picture.is_file():
            shutil.copyfile(picture, pages.DOCS / "images" / "demo.png")
    nested, published, ours = (
        _found(*(f"{kind}-S{seed}" for seed in SEEDS)) for kind in ("nested", "published", "ours")
    )
    if nested and published:
        both = {**nested, **published}
        _write("rig-table1", "Table 1 on the rig", both, _table1(nested, published))
        _write("rig-likeness", "How unlike the paper", both, _likeness(nested, published))
    if nested:
        paper = published_families()
        by_speed = _beside(nested, "by_speed", lambda name: paper[name].by_speed.values())
        _write("rig-speeds", "The six models by held-out speed", nested, by_speed)
        of_textures = _beside(nested, "by_texture", lambda n: np.diag(published_confusion(n)))
        _write("rig-textures", "The six models by texture", nested, of_textures)
        draw_speeds(list(nested.values())).savefig(
            pages.DOCS / "images" / "rig-by-speed.png", dpi=110
        )
        if images := _found("images-remounted"):
            rows = _remounted(nested, images["images-remounted"])
            _write("rig-remounted", "Images, mounted anew", {**nested, **images}, rows)
    if vibration := _found("nested-S11", *(f"vibration-{name}" for name in CAUSES)):
        _write("rig-vibration", "What real spectra lack", vibration, _vibration(vibration))
    if recipe := _found("vibration-paper"):
        _write("rig-vibration-paper", "The recipe of the authors' code", recipe, _vibration(recipe))
    stresses = _found("ours-noise", *(f"ours-{name}" for name in STRESSES))
    if ours and stresses:
        found = {**ours, **stresses}
        _write("rig-ours", "Our models on the rig", found, _ours(ours, stresses))
    if noise := _found("ours-S11", "ours-noise-at-test", "ours-noise"):
        _write("rig-noise", "Noise of the published size", noise, _touches_of(noise))
    if nodules := _found("ours-S12", "ours-no-nodules"):
        _write("rig-nodules", "A skin without nodules", nodules, _touches_of(nodules))
    if unknown := _found("unknown"):
        _write("rig-unknown", "Textures never learnt", unknown, _unknown(unknown["unknown"]))
    if layouts := _found("ours-S11", "ours-hex331", "ours-radial127"):
        _write("rig-layouts", "Other layouts", layouts, _touches_of(layouts))


def _found(*names: str) -> dict[str, dict[str, Any]]:
    """Return what these parts found; nothing unless all are made."""
    files = [KEPT / f"{name}.json" for name in names]
    there = all(file.is_file() for file in files)
    return {file.stem: json.loads(file.read_text()) for file in files} if there else {}


def _write(name: str, title: str, parts: Mapping[str, Any], rows: list[list[str]]) -> None:
    found = pages.sources_of(parts.values())
    made_by = f'make results PART="{" ".join(parts)}"'
    table = {"commands": [made_by], "columns": rows[0], "rows": rows[1:]}
    pages.write_json(pages.DATA / f"{name}.json", {"title": title, **found, **table})


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
        fair, leaky = _means(nested, model, "nested"), _means(published, model, "published")
        rows.append([f"`{model}`", f"{family.mean_percent}", interval(fair), interval(leaky)])
    return rows


def _likeness(nested: Mapping[str, Any], published: Mapping[str, Any]) -> list[list[str]]:
    """Return mean absolute difference from the paper's Table 1, and rank correlation with it."""
    paper = [family.mean_percent for family in published_families().values()]
    rows = [["protocol", "mean absolute difference, points", "rank correlation"]]
    for protocol, sessions in (("nested", nested), ("published", published)):
        each = np.array([_means(sessions, model, protocol) for model in published_families()])
        off = [float(np.abs(one - paper).mean()) for one in (each.mean(axis=1), *each.T)]
        rank = [float(spearmanr(one, paper)[0]) for one in (each.mean(axis=1), *each.T)]
        spread = [
            f"{min(of[1:]):{how}} to {max(of[1:]):{how}}"
            for of, how in ((off, ".0f"), (rank, ".2f"))
        ]
        rows.append([
            f"`{protocol}`",
            f"{off[0]:.0f} (single sessions: {spread[0]})",
            f"{rank[0]:.2f} ({spread[1]})",
        ])  # fmt: skip
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
        # A half is rounded up, as in the titles of the paper's matrices.
        rows.append(["", "paper", *(f"{math.floor(percent + 0.5)}" for percent in of_paper(model))])
    return rows


def _remounted(nested: Mapping[str, Any], images: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model of images: mounted once a session, and anew for each run."""
    rows = [["model", "the paper's own", "mounted once", "mounted anew for each run"]]
    for model, one in images["models"].items():
        paper = f"{published_families()[model].mean_percent}"
        once, anew = (
            interval(_means(nested, model, "nested")),
            f"{100 * one['nested']['mean']:.0f}",
        )
        rows.append([f"`{model}`", paper, once, anew])
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


def _vibration(found: Mapping[str, Any]) -> list[list[str]]:
    """Return a row for each way in which the two models of vibration learnt."""
    rows: list[list[str]] = []
    ways = {
        "nested-S11": "as it is",
        "vibration-motor-off": "without motor and mains",
        "vibration-noise-off": "without noise of microphone and room",
        "vibration-even-speed": "speed without ripple and drift",
        "vibration-even-drums": "drums round, all bumps alike",
        "vibration-round-drums": "drums round, bumps printed unevenly",
        "vibration-longer": "60 s a recording instead of 20",
        "vibration-paper": "preset `paper`",
    }
    for name, part in found.items():
        for model in ("vib-te", "vib-te-aug"):
            for protocol, one in part["models"][model].items():
                rows = rows or [
                    ["model", "how", "protocol", "mean", "smooth drum", *one["by_speed"]]
                ]
                percents = (one["mean"], one["by_texture"]["0"], *one["by_speed"].values())
                percents = [f"{100 * share:.0f}" for share in percents]
                rows.append([f"`{model}`", ways[name], f"`{protocol}`", *percents])
    return rows


def _ours(ours: Mapping[str, Any], stresses: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model: touches of 0.11, 1 and 4 s, and the worst of the stresses, 4 s."""
    names = [name.removeprefix("ours-") for name in stresses]
    rows = [["model", "as it is", *names, "worst of these, 4 s"]]
    for model in OURS.split(","):
        usual = np.mean([_percents(part, model) for part in ours.values()], axis=0)
        each = [_percents(part, model) for part in stresses.values()]
        worst = f"{min(one[-1] for one in each):.0f}"
        rows.append([f"`{model}`", *map(_in_words, (usual, *each)), worst])
    return rows


def _touches_of(found: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model and a column a part: touches of 0.11, 1 and 4 s."""
    rows = [["model", *(name.removeprefix("ours-") for name in found)]]
    for model in OURS.split(","):
        if all(model in part["models"] for part in found.values()):
            each = [_in_words(_percents(part, model)) for part in found.values()]
            rows.append([f"`{model}`", *each])
    return rows


def _unknown(found: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model: what is called unknown, and the error of the bump spacing."""
    rows = [[
        "model", "never learnt, called unknown", "false alarms", "at the slowest and fastest",
        "spacing of drums learnt, error", "of drums never learnt",
    ]]  # fmt: skip
    for model, one in found["models"]["unknown"].items():
        called, alarms = (one[which]["recordings"] for which in ("found", "false_alarms"))
        shares = (called, alarms["inside"], alarms["outside"])
        errors = (found["models"]["roughness"][model][which] for which in ("seen", "unseen"))
        rows.append([
            f"`{model}`",
            *(f"{100 * share['mean']:.0f} [{100 * share['ci95'][0]:.0f}, "
              f"{100 * share['ci95'][1]:.0f}]" for share in shares),
            *(f"{error['mae_mm_recordings']:.2f} mm" for error in errors),
        ])  # fmt: skip
    return rows


def _percents(part: Mapping[str, Any], model: str) -> list[float]:
    """Return accuracies from touches of 0.11, 1 and 4 s; NaN where samples are longer."""
    by_touch = part["models"][model]["nested"]["by_touch"]
    return [100 * by_touch.get(length, np.nan) for length in ("0.11", "1", "4")]


def _in_words(percents: Sequence[float]) -> str:
    return ", ".join("–" if np.isnan(percent) else f"{percent:.0f}" for percent in percents)


def _means(sessions: Mapping[str, Any], model: str, protocol: str) -> list[float]:
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
