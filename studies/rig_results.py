"""Make the numbers of the simulated rig that the studies alone need, from seeds.

    python studies/rig_results.py                 all parts, in order
    python studies/rig_results.py PART [PART ...] these alone; `list` names them

Pinned to commit 5bcff185: it needs models and options that the package no longer has
(`--split texture`), and the insides of `scripts/make_results.py`, whose sessions it uses. A part
leaves what it found in `studies/data/rig/PART.json`; `images-paper` takes some 80 minutes on two
cores, `vibration-paper` some two hours, each other an hour at most. There all parts were of
`make results`.
"""

import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import here
import make_results as rig
import numpy as np
import results_pages as pages
from make_results import Part, evaluated, store_of
from scipy.stats import spearmanr

from afferents.reporting.published import published_confusion, published_families

KEPT = here.DATA / "rig"
CAUSES = {
    "motor-off": ["--nuisances", "all,motor=0,motor-ripple=0,mains=0"],
    "noise-off": ["--nuisances", "all,microphone-noise=0,room-noise=0"],
    "even-speed": ["--nuisances", "all,speed-ripple=0,motor-ripple=0,drift=0"],
    "longer": ["--seconds", "60"],
}
"""What may make vibration hard to learn from, taken away; `make_results.py` has two more."""


def parts() -> Iterator[Part]:
    """Yield all parts; they need the sessions of `make results`."""
    yield evaluated("ours-noise-at-test", "S11", rig.OURS, "--disturb", rig.NOISE)
    yield evaluated("unknown", "S11", "sa-wave-vector,ra-wave-vector", "--split", "texture")
    vibration = "vib-te,vib-te-aug"
    for name, options in CAUSES.items():
        yield store_of(name, 11, *options)
        yield evaluated(f"vibration-{name}", name, vibration)
    paper = ("--preset", "paper")
    yield evaluated("vibration-paper", "S11", vibration, *paper, "--protocol", "both")
    yield evaluated("images-paper", "S11", "sa-se", *paper, "--held-out", "10,50,100")
    for sensor in ("hex331", "radial127"):
        yield store_of(sensor, 11, "--sensor", sensor)
        yield evaluated(f"ours-{sensor}", sensor, "sa-wave-vector,ra-wave-vector,sa-local")


def write_tables() -> None:
    """Write the tables whose parts are all made."""
    nested, published = (
        found(*(f"{kind}-S{seed}" for seed in rig.SEEDS)) for kind in ("nested", "published")
    )
    if nested and published:
        write(
            "likeness",
            "How unlike the paper",
            {**nested, **published},
            _likeness(nested, published),
        )
    if nested:
        paper = published_families()
        by_speed = _beside(nested, "by_speed", lambda name: paper[name].by_speed.values())
        write("speeds", "The six models by held-out speed", nested, by_speed)
        of_textures = _beside(nested, "by_texture", lambda n: np.diag(published_confusion(n)))
        write("textures", "The six models by texture", nested, of_textures)
        if images := found("images-remounted"):
            rows = _remounted(nested, images["images-remounted"])
            write("remounted", "Images, mounted anew", {**nested, **images}, rows)
    names = ("motor-off", "noise-off", "even-speed", "even-drums", "round-drums", "longer")
    if vibration := found("nested-S11", *(f"vibration-{name}" for name in names)):
        write("vibration", "What real spectra lack", vibration, _vibration(vibration))
    if recipe := found("vibration-paper"):
        write("vibration-paper", "The recipe of the authors' code", recipe, _vibration(recipe))
    if noise := found("ours-S11", "ours-noise-at-test", "ours-noise"):
        write("noise", "Noise of the published size", noise, _touches_of(noise))
    if nodules := found("ours-S12", "ours-no-nodules"):
        write("nodules", "A skin without nodules", nodules, _touches_of(nodules))
    if unknown := found("unknown"):
        write("unknown", "Textures never learnt", unknown, _unknown(unknown["unknown"]))
    if layouts := found("ours-S11", "ours-hex331", "ours-radial127"):
        write("layouts", "Other layouts", layouts, _touches_of(layouts))


def found(*names: str) -> dict[str, dict[str, Any]]:
    """Return what these parts found, of the docs' too; nothing unless all are made."""
    paths = [[folder / f"{name}.json" for folder in (KEPT, rig.KEPT)] for name in names]
    files = [next((path for path in both if path.is_file()), None) for both in paths]
    return {file.stem: json.loads(file.read_text()) for file in files if file} if all(files) else {}


def write(name: str, title: str, parts: Mapping[str, Any], rows: list[list[str]]) -> None:
    """Write the data of a table of `rig.md` or `models.md`."""
    sources = pages.find_sources(parts.values())
    table = {"commands": [rig.made_by(parts)], "columns": rows[0], "rows": rows[1:]}
    pages.write_json(here.DATA / f"rig-{name}.json", {"title": title, **sources, **table})


def _likeness(nested: Mapping[str, Any], published: Mapping[str, Any]) -> list[list[str]]:
    """Return mean absolute difference from the paper's Table 1, and rank correlation with it."""
    paper = [family.mean_percent for family in published_families().values()]
    rows = [["protocol", "mean absolute difference, points", "rank correlation"]]
    for protocol, sessions in (("nested", nested), ("published", published)):
        each = np.array([rig.means_of(sessions, model, protocol) for model in published_families()])
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
            rig.interval(rig.means_of(nested, model, "nested")),
            f"{100 * one['nested']['mean']:.0f}",
        )
        rows.append([f"`{model}`", paper, once, anew])
    return rows


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


def _touches_of(found: Mapping[str, Any]) -> list[list[str]]:
    """Return a row a model and a column a part: touches of 0.11, 1 and 4 s."""
    rows = [["model", *(name.removeprefix("ours-") for name in found)]]
    for model in next(iter(found.values()))["models"]:
        if all(model in part["models"] for part in found.values()):
            each = [rig.in_words(rig.percents_of(part, model)) for part in found.values()]
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


if __name__ == "__main__":
    rig.make(parts(), sys.argv[1:], KEPT, write_tables)
