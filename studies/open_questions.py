"""Answer open questions on the simulated rig, two of them the paper's.

    python studies/open_questions.py                 all parts, in order
    python studies/open_questions.py PART [PART ...] these alone; `list` names them

Pinned to commit 5bcff185: it needs models that the package no longer has, and the insides of
`scripts/make_results.py`, whose sessions and folders it uses. A part takes an hour at most and
leaves what it found in `studies/data/open/PART.json`. Tables and figures are drawn from there for
`open-questions.md`, which says what is asked and what was expected.
"""

import json
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import here
import make_results as rig
import matplotlib.pyplot as plt
import numpy as np
import results_pages as pages
from make_results import Part, evaluated, store_of
from matplotlib.axes import Axes

from afferents.reporting.style import BLUE, GREEN, GREY, VERMILION

KEPT = here.DATA / "open"
SEEDS = (11, 12)
HELD_OUT = ("--held-out", "10,50,100")
PAPERS = "sa-se,ra-se,sa-ste,ra-ste,vib-te-aug"
SOLVED = "shear,sa-local,fusion-shear,sa-wave-vector,ra-wave-vector,order-te"
DEPTHS = ("0.8", "1.0", "1.2")
CELLS = "20/0.8,50/0.8,80/0.8,20/1,50/1,80/1,20/1.2,50/1.2,80/1.2"
SURFACES = (
    "poplin", "shirting", "duck", "hessian", "needlecord", "corduroy", "wide-cord",
    "elephant-cord", "P40", "P80", "P120",
)  # fmt: skip
Interval = tuple[float, float, float]
"""Mean, lower and upper end, percent."""
AROUND = "251.3,1"
"""Length of a map along the slide, mm, and a height that arrays of heights do not need."""
DRUMS = "drums"
"""Sessions of a seed whose recordings say their depth and print: questions share them."""
THRICE_LEARNT = ("--seeds", "3")
LENGTHS = ("0.011", "0.11", "0.5", "1", "4")


def parts() -> Iterator[Part]:
    """Yield all parts, in the order of the questions."""
    for seed in SEEDS:
        yield pressed(f"{DRUMS}-{seed}", seed)
    # 1. Three afferents together.
    alone = "vib-te-aug,sa-ste,ra-ste"
    fused = "fusion-networks,three-stems"
    for seed in SEEDS:
        drums, models = f"{DRUMS}-{seed}", f"{alone},{fused}"
        yield evaluated(f"together-S{seed}", drums, models, *HELD_OUT, *THRICE_LEARNT)
        for name, disturbed in (("deaf", "sound=20dB"), ("half", "lost=0.5")):
            harmed = f"together-{name}{of(seed)}"
            yield evaluated(harmed, drums, models, *HELD_OUT, "--disturb", disturbed)
    # 2. Speed for images.
    for seed in SEEDS:
        copied = "ra-se,ra-ste,sa-ste,ra-se-aug,ra-ste-aug,sa-ste-aug"
        yield evaluated(f"copies-S{seed}", f"{DRUMS}-{seed}", copied, *HELD_OUT)
    # Copies take the place of originals where their number is given, so once with three times both.
    thrice = ("--recipe", "../../studies/thrice.toml")
    of_ra = "ra-se,ra-ste,ra-se-aug,ra-ste-aug"
    yield evaluated("copies-thrice", f"{DRUMS}-11", of_ra, *HELD_OUT, *thrice)
    # 3. How long to feel.
    of_runs = (*HELD_OUT, "--frames", "1,2,5,20")
    yield evaluated("runs", f"{DRUMS}-11", "sa-ste,ra-ste", *of_runs)
    for window, points, bins in (("0.25", 44100, 200), ("0.5", 44100, 200), ("4", 176400, 800)):
        of_spectra = ("--fft-points", f"{points}", "--bins", f"{bins}")
        words = (*HELD_OUT, "--window-s", window, *of_spectra)
        yield evaluated(f"window-{window}", f"{DRUMS}-11", "vib-te-aug", *words)
    # 4. Another depth.
    for seed in SEEDS:
        others = {f"depth-{depth}{of(seed)}": depth for depth in ("0.8", "1.2")}
        for name, depth in others.items():
            yield pressed(name, seed, depth=depth)
        stores = [f"{name}.zarr" for name in (f"{DRUMS}-{seed}", *others)]
        models = f"sa-se,ra-se,vib-te-aug,{SOLVED}"
        yield together(f"depth{of(seed)}", stores, models, "--split", "indentation_mm")
        both = ("--split", "speed,indentation_mm", "--held-out", CELLS)
        yield together(f"depth-and-speed{of(seed)}", stores, SOLVED, *both)
    # 5. Natural surfaces.
    for seed in SEEDS:
        name, maps = f"natural-{seed}", f"maps-{seed}"
        words = [w for s in SURFACES for w in ("--height-map", f"{s}={maps}/{s}.npy,{AROUND}")]
        made = store_of(name, seed, "--textures", "a", *words)
        of_maps = ("studies/natural_surfaces.py", maps, f"{seed}")
        yield Part(name, (of_maps, *made.commands))
        yield evaluated(f"on-{name}", name, f"{PAPERS},{SOLVED}", *HELD_OUT)
    # 6. Shear, pattern or vibration?
    bumped = ("--textures", "b,c,d,e,f,g,h,i,j,k,l,m")  # a smooth drum has nothing to print anew
    printed = f"{SOLVED},sa-se,ra-se,vib-te-aug"
    for seed in SEEDS:
        same, anew = f"{DRUMS}-{seed}", f"print-99{of(seed)}"
        yield pressed(anew, seed, *bumped, reprint=99)
        stores, unseen = [f"{same}.zarr", f"{anew}.zarr"], ("--test-only", "print=99")
        yield together(f"reprinted{of(seed)}", stores, printed, *unseen, *HELD_OUT)
        yield evaluated(f"not-reprinted{of(seed)}", same, printed, *HELD_OUT)
    yield store_of("mounted-anew", 19, "--remount", "run")
    yield evaluated("ours-mounted-anew", "mounted-anew", printed)
    # 7. Slow slides. One speed is held out, so that three seeds are cheap.
    for seed in SEEDS:
        drums, slower, models = (
            f"{DRUMS}-{seed}",
            f"five-{seed}",
            f"{PAPERS},sa-wave-vector,order-te",
        )
        yield pressed(slower, seed, "--speeds", "5")
        stores, words = [f"{drums}.zarr", f"{slower}.zarr"], ("--held-out", "10", *THRICE_LEARNT)
        yield together(f"from-5{of(seed)}", stores, models, *words)
        yield together(f"from-10{of(seed)}", stores[:1], models, *words)


def pressed(
    name: str, seed: int, *options: str, depth: str = "1.0", reprint: int | None = None
) -> Part:
    """Return the part that makes a store whose recordings say their depth and print."""
    printed = ("--reprint", f"{reprint or seed}")
    return store_of(name, seed, *printed, "--indentation", depth, *options)


def of(seed: int) -> str:
    """Return what a part's name ends with: nothing for the first session."""
    return "" if seed == SEEDS[0] else f"-{seed}"


def together(name: str, stores: Sequence[str], models: str, *options: str) -> Part:
    """Return the part that evaluates models on several stores."""
    command = ("evaluate", *stores, "--out", name, "--models", models, *options)
    return Part(name, (command,), name)


# Tables and figures, of all parts that are there.


def write_tables() -> None:
    """Write the table and draw the figure of each question, as far as its parts are made."""
    draw = (_together, _copies, _lengths, _depth, _natural, _shear, _slow)
    for number, of_question in enumerate(draw, 1):
        of_question(number)


def found(*names: str) -> dict[str, dict[str, Any]]:
    """Return what those of these parts found that are made; of the rig's other results too."""
    files = [
        folder / f"{name}.json" for name in names for folder in (KEPT, here.DATA / "rig", rig.KEPT)
    ]
    return {file.stem: json.loads(file.read_text()) for file in files if file.is_file()}


def write(number: int, title: str, parts: Mapping[str, Any], rows: list[list[str]]) -> None:
    """Write the table of a question."""
    facts = pages.find_sources(parts.values())
    mine = [name for name in parts if (KEPT / f"{name}.json").is_file()]
    lines = {"results": [name for name in parts if name not in mine], "results-open": mine}
    commands = [f'make {goal} PART="{" ".join(names)}"' for goal, names in lines.items() if names]
    table = {"commands": commands, "columns": rows[0], "rows": rows[1:]}
    pages.write_json(here.DATA / f"open-{number}.json", {"title": title, **facts, **table})


def save(number: int, figure: Any) -> None:
    """Save the figure of a question."""
    figure.savefig(here.IMAGES / f"open-{number}.png", dpi=110)
    plt.close(figure)


def percent(part: Mapping[str, Any], model: str, speeds: Sequence[str] = ()) -> float:
    """Return a model's mean accuracy, or that over some speeds."""
    one = part["models"][model]["nested"]
    return 100 * (float(np.mean([one["by_speed"][s] for s in speeds])) if speeds else one["mean"])


def intervals(parts: Iterable[Mapping[str, Any]], model: str) -> list[Interval]:
    """Return a model's accuracy in each session that has it, with its 95% interval, percent."""
    there = [part["models"][model]["nested"] for part in parts if model in part["models"]]
    return [(100 * one["mean"], *(100 * share for share in one["ci95"])) for one in there]


def shown(each: Iterable[Interval]) -> str:
    """Return accuracies with their intervals as words."""
    return "; ".join(f"{mean:.0f} [{low:.0f}, {high:.0f}]" for mean, low, high in each) or "–"


def difference(more: Sequence[float], less: Sequence[float]) -> str:
    """Return the mean of paired differences and its 95% interval, Student's t."""
    gained = np.subtract(more, less)
    half = rig.half_width(gained.tolist())
    mean, low, high = (round(gained.mean() + way * half) for way in (0, -1, 1))
    return f"{mean:+d} [{low:+d}, {high:+d}]"


def cells(parts: Sequence[Mapping[str, Any]], model: str) -> list[float]:
    """Return a model's accuracies, percent: at each held-out speed of each session (six of two)."""
    speeds = HELD_OUT[1].split(",")
    return [percent(part, model, [speed]) for part in parts for speed in speeds]


def touched(part: Mapping[str, Any], model: str) -> dict[float, float]:
    """Return a model's accuracy, percent, by seconds of touch."""
    one = part["models"][model]["nested"]
    frame = {round(1 / 90, 3): 100 * one["mean"]} if model.endswith("-se") else {}
    return frame | {float(length): 100 * share for length, share in one["by_touch"].items()}


def curve(ax: Axes, by_length: Mapping[float, float], label: str, **style: Any) -> None:
    """Draw accuracy over seconds of touch."""
    ax.plot(
        *zip(*sorted(by_length.items()), strict=True),
        marker="o",
        markersize=3.5,
        label=label,
        **style,
    )


def over_touch(ax: Axes) -> None:
    """Label the axes of such curves."""
    ticks = [0.01, 0.03, 0.1, 0.25, 0.5, 1, 2, 4]
    ax.set(xscale="log", xlabel="length of touch, s", ylabel="accuracy, %", ylim=(0, 103))
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    ax.axhline(100 / 13, color=GREY, lw=0.7, ls="--")


def bars(
    ax: Axes,
    names: Sequence[str],
    groups: Mapping[str, Sequence[Sequence[Interval]]],
    textures: Sequence[int] = (13,),
) -> None:
    """Draw a group of bars a model: means over sessions, and each session with its interval."""
    colours, width = (BLUE, VERMILION, GREEN), 0.8 / len(groups)
    for n, (label, of_models) in enumerate(groups.items()):
        places = np.arange(len(names)) + (n - (len(groups) - 1) / 2) * width
        there = [(x, np.array(each)) for x, each in zip(places, of_models, strict=True) if each]
        at, means = zip(*((x, each[:, 0].mean()) for x, each in there), strict=True)
        ax.bar(at, means, width, label=label, color=colours[n])
        for x, each in there:
            beside = x + width / 4 * (np.arange(len(each)) - (len(each) - 1) / 2)
            mean, low, high = each.T
            way = [mean - low, high - mean]
            ax.errorbar(beside, mean, way, fmt=".", ms=2, lw=0.8, color="black")
    ax.set_xticks(range(len(names)), names, rotation=30, ha="right", fontsize=8)
    for n_textures in textures:
        ax.axhline(100 / n_textures, color=GREY, lw=0.7, ls="--")
    ax.set(ylabel="accuracy, %", ylim=(0, 103))
    ax.legend(loc="upper left", bbox_to_anchor=(0, 1.13), ncols=len(groups), fontsize=8)


def _together(number: int) -> None:
    whole = found(*(f"together-S{seed}" for seed in SEEDS))
    if not whole:
        return
    harmed = [found(*(f"together-{how}{of(seed)}" for seed in SEEDS)) for how in ("deaf", "half")]
    models = list(next(iter(whole.values()))["models"])
    lost = ("microphone lost, 1 s", "half of the markers lost, 1 s")
    rows = [["model", *(f"{length} s" for length in LENGTHS), *lost, "single samples"]]
    figure, ax = plt.subplots(figsize=(6, 3.6), layout="constrained")
    styles = {
        "fusion-networks": {"color": BLUE, "lw": 2.2},
        "three-stems": {"color": VERMILION, "lw": 2.2},
    }
    for model in models:
        each = [touched(part, model) for part in whole.values()]
        mean = {s: float(np.mean([one[s] for one in each])) for s in each[0]}
        harm = [[touched(part, model).get(1.0) for part in of_one.values()] for of_one in harmed]
        rows.append([
            f"`{model}`",
            *(_range([one.get(float(length)) for one in each]) for length in LENGTHS),
            *map(_range, harm),
            shown(intervals(whole.values(), model)),
        ])  # fmt: skip
        curve(ax, mean, model, **styles.get(model, {"lw": 1, "color": None}))
    over_touch(ax)
    ax.legend(fontsize=8)
    save(number, figure)
    write(number, "Three afferents together", {**whole, **harmed[0], **harmed[1]}, rows)


def _range(values: Sequence[float | None]) -> str:
    """Return mean and both sessions."""
    there = [value for value in values if value is not None]
    if not there:
        return "–"
    both = f" ({', '.join(f'{value:.0f}' for value in there)})" if len(there) > 1 else ""
    return f"{np.mean(there):.0f}{both}"


def _copies(number: int) -> None:
    once, thrice = found(*(f"copies-S{seed}" for seed in SEEDS)), found("copies-thrice")
    if not once:
        return
    speeds = HELD_OUT[1].split(",")
    rows = [
        ["model", "learnt from", *(f"{speed} mm/s" for speed in speeds), "each session", "gained"]
    ]
    for label, found_of in (("as many samples", once), ("three times as many", thrice)):
        sessions = list(found_of.values())
        for model in ("ra-se", "ra-ste", "sa-ste"):
            for name in (model, f"{model}-aug"):
                there = [part for part in sessions if name in part["models"]]
                if not there:
                    continue
                at = [_range([percent(part, name, [s]) for part in there]) for s in speeds]
                copied = name != model
                gain = difference(cells(there, name), cells(there, model)) if copied else ""
                rows.append([f"`{name}`", label, *at, shown(intervals(there, name)), gain])
    figure, ax = plt.subplots(figsize=(5, 3.4), layout="constrained")
    models = ("ra-se", "ra-ste", "sa-ste")
    ends = {"without copies": "", "with copies": "-aug"}
    groups = {
        label: [intervals(once.values(), f"{model}{end}") for model in models]
        for label, end in ends.items()
    }
    bars(ax, models, groups)
    save(number, figure)
    write(number, "Copies of images at other speeds", {**once, **thrice}, rows)


def _lengths(number: int) -> None:
    runs = found("runs", *(f"window-{s}" for s in ("0.25", "0.5", "4")))
    of_all = found(*(f"{kind}-S{seed}" for kind in ("nested", "ours") for seed in rig.SEEDS))
    if not of_all:
        return
    figure, axes = plt.subplots(1, 2, figsize=(9.5, 3.8), layout="constrained", sharey=True)
    rows = [["model", *(f"{length} s" for length in LENGTHS)]]
    for kind, ax in zip(("nested", "ours"), axes, strict=True):
        sessions = [part for name, part in of_all.items() if name.startswith(kind)]
        for model in sessions[0]["models"]:
            each = [touched(part, model) for part in sessions]
            curve(ax, {s: float(np.mean([one[s] for one in each])) for s in each[0]}, model)
            at_lengths = ([one.get(float(s)) for one in each] for s in LENGTHS)
            at_lengths = ([one for one in at if one is not None] for at in at_lengths)
            rows.append([f"`{model}`", *map(rig.interval, at_lengths)])
        over_touch(ax)
        ax.legend(fontsize=7.5, loc="lower right")
    axes[0].set_title("the paper's models, all ten speeds", fontsize=9)
    axes[1].set_title("ours", fontsize=9)
    save(number, figure)
    for name, part in runs.items():
        for model in sorted(part["models"], key=lambda m: (m.rpartition("-")[0], len(m), m)):
            what = f"`{model}`" + (
                f", windows of {name.split('-')[1]} s" if "window" in name else ""
            )
            at = [touched(part, model).get(float(length)) for length in LENGTHS]
            words = ("–" if share is None else f"{share:.0f}" for share in at)
            rows.append([f"{what}, 10, 50, 100 mm/s", *words])
    write(number, "Accuracy by seconds of touch", {**of_all, **runs}, rows)


def _depth(number: int) -> None:
    depth, both = (
        found(*(f"{kind}{of(seed)}" for seed in SEEDS)) for kind in ("depth", "depth-and-speed")
    )
    once = [f"{kind}-S{seed}" for kind in ("ours", "nested") for seed in SEEDS[: len(depth)]]
    usual = found(*once)
    if not depth:
        return
    rows = [
        ["model", "speed held out", "depth held out", *(f"{d} mm" for d in DEPTHS), "both held out"]
    ]
    names = list(next(iter(depth.values()))["models"])
    groups = {
        label: [intervals(parts.values(), model) for model in names]
        for label, parts in (("speed held out", usual), ("depth held out", depth))
    }
    for model in names:
        by = [part["models"][model]["nested"]["by_speed"].values() for part in depth.values()]
        rows.append([
            f"`{model}`",
            shown(intervals(usual.values(), model)),
            shown(intervals(depth.values(), model)),
            *(_range([100 * share for share in at]) for at in zip(*by, strict=True)),
            shown(intervals(both.values(), model)),
        ])  # fmt: skip
    figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
    bars(ax, names, groups)
    save(number, figure)
    write(number, "Another depth", {**usual, **depth, **both}, rows)


def _natural(number: int) -> None:
    natural = found(*(f"on-natural-{seed}" for seed in SEEDS))
    seeds = [int(name.rpartition("-")[2]) for name in natural]
    drums = found(*(f"not-reprinted{of(s)}" for s in seeds), *(f"together-S{s}" for s in seeds))
    if not natural or not drums:
        return
    rows = [["model", "drums", "natural surfaces", "difference"]]
    models = [name for name in next(iter(natural.values()))["models"] if name in _models_of(drums)]
    groups: dict[str, list[list[Interval]]] = {"drums": [], "natural surfaces": []}
    for model in models:
        of_drums = [part for part in drums.values() if model in part["models"]][: len(natural)]
        these = list(natural.values())
        both = [intervals(parts, model) for parts in (of_drums, these)]
        differ = difference(cells(these, model), cells(of_drums, model))
        rows.append([f"`{model}`", *map(shown, both), differ])
        for label, each in zip(groups, both, strict=True):
            groups[label].append(each)
    figure, ax = plt.subplots(figsize=(8, 3.4), layout="constrained")
    bars(ax, models, groups, textures=(13, len(SURFACES) + 1))
    save(number, figure)
    write(number, "Natural surfaces", {**natural, **drums}, rows)


def _models_of(parts: Mapping[str, Any]) -> set[str]:
    return {model for part in parts.values() for model in part["models"]}


def _shear(number: int) -> None:
    once = found(*(f"{kind}-S{seed}" for kind in ("ours", "nested") for seed in SEEDS))
    anew = found("ours-remounted", "images-remounted", "ours-mounted-anew")
    same, printed = (
        found(*(f"{kind}{of(seed)}" for seed in SEEDS)) for kind in ("not-reprinted", "reprinted")
    )
    if not (once and anew and same and printed):
        return
    rows = [
        [
            "model",
            "mounted once",
            "mounted anew for each run",
            "same drums",
            "printed anew",
            "difference",
        ]
    ]
    names = list(next(iter(printed.values()))["models"])
    mounted = {
        label: [intervals(parts.values(), name) for name in names]
        for label, parts in (("mounted once", once), ("mounted anew", anew))
    }
    on_prints = {
        "same drums": [[_on_bumps(part, name) for part in same.values()] for name in names],
        "printed anew": [intervals(printed.values(), name) for name in names],
    }
    columns = (*mounted.values(), *on_prints.values())
    for name, *of_model in zip(names, *columns, strict=True):
        before, after = (
            np.mean([_by_drum(part, name) for part in parts.values()], axis=0)
            for parts in (same, printed)
        )
        rows.append([f"`{name}`", *map(shown, of_model), difference(after, before)])
    figure, axes = plt.subplots(1, 2, figsize=(11, 3.4), layout="constrained")
    bars(axes[0], names, mounted)
    bars(axes[1], names, on_prints)
    save(number, figure)
    write(number, "Shear, pattern or vibration", {**once, **anew, **same, **printed}, rows)


def _by_drum(part: Mapping[str, Any], model: str) -> list[float]:
    """Return a model's accuracy, percent, on each drum but the smooth one."""
    by = part["models"][model]["nested"]["by_texture"]
    return [100 * share for texture, share in by.items() if texture != "0"]


def _on_bumps(part: Mapping[str, Any], model: str) -> Interval:
    """Return a model's accuracy on drums with bumps, with its interval over them."""
    each = _by_drum(part, model)
    mean, half = float(np.mean(each)), rig.half_width(each)
    return mean, max(0, mean - half), min(100, mean + half)


def _slow(number: int) -> None:
    without, with_5 = (found(*(f"{n}{of(seed)}" for seed in SEEDS)) for n in ("from-10", "from-5"))
    if not (without and with_5):
        return
    labels = ("10 mm/s held out, learnt from 20 mm/s up", "10 mm/s held out, 5 mm/s learnt too")
    models = list(next(iter(without.values()))["models"])
    both = [list(parts.values()) for parts in (without, with_5)]
    rows = [["model", *labels]]
    groups = {
        label: [intervals(parts, model) for model in models]
        for label, parts in zip(labels, both, strict=True)
    }
    columns = zip(models, *groups.values(), strict=True)
    rows += [[f"`{model}`", *map(shown, each)] for model, *each in columns]
    figure, ax = plt.subplots(figsize=(7, 3.4), layout="constrained")
    bars(ax, models, groups)
    save(number, figure)
    write(number, "Slow slides", {**without, **with_5}, rows)


if __name__ == "__main__":
    rig.make(parts(), sys.argv[1:], KEPT, write_tables)
