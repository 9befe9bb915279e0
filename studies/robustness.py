"""How far models hold when recordings are worse than those that they learnt from.

    python studies/robustness.py S.zarr [T.zarr ...] --out OUT --models ra-wave-vector,fusion

Pinned to commit 5bcff185: it needs insides of the package, which may since have changed.

Each fold is trained once, and tested under every corruption (`afferents.folds.corruption`):
marker noise in px, noise of the microphone, dropped frames, lost markers. Each store is a session
of its own: models learn from one alone, and figures are means over sessions. Of a model that only
sees, nothing is asked about sound, and the other way round.

Writes OUT/robustness.parquet (a row a model, corruption, length of touch, session, seed, speed and
recording: samples or touches named rightly, and all), robustness.md (a row a model and amount: mean
over held-out speeds, 95% interval over sessions or, of a single one, over textures, and the worst
speed) and robustness.png.
What is finished is kept in OUT/parts: a run that was stopped goes on, and models may be added.
Samples under all corruptions are in memory at once: with the default amounts, fourteen times as
much as `evaluate` takes for models of images.
"""

import argparse
import itertools
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from afferents.encodings.samples import Samples
from afferents.evaluation.choice import encodings_for
from afferents.evaluation.data import open_data
from afferents.evaluation.data import require_support, find_sources
from afferents.evaluation.fold_files import FoldKey, digest_of
from afferents.evaluation.intervals import Accuracy, bootstrap_interval, count_right
from afferents.evaluation.job import encoded, train_and_test
from afferents.evaluation.metrics import TOUCHES_S, name_touches
from afferents.evaluation.options import EvaluationOptions
from afferents.evaluation.recipe import Evaluation, Recipe
from afferents.evaluation.run import planned
from afferents.files import write_aside, write_text
from afferents.folds.corruption import Corruption
from afferents.models.model import choose_models
from afferents.parallel import side_by_side
from afferents.progress import Progress
from afferents.reporting.labels import percent
from afferents.reporting.style import GREY, LINE, new_figure, save_figure, styled
from afferents.store.responses import textures_of

AMOUNTS = {
    "markers": "0.02,0.05,0.1,0.2,0.4",
    "sound": "-20dB,0dB,20dB",
    "frames": "0.05,0.2,0.5",
    "lost": "0.05,0.1,0.3",
}
TITLES = {
    "markers": "marker noise (px)",
    "sound": "noise over the sound's level",
    "frames": "share of the frames dropped",
    "lost": "share of the markers lost",
}
SAMPLE = "a sample"
NONE = "none"
BY = ["model", "corruption", "amount", "touch"]
SPEED = "held_out_speed_mm_s"

Test = tuple[str, str]
"""What is corrupted, and how much, as typed; ('', 'none') for nothing."""


def tests_of(recipe: Recipe, amounts: dict[str, list[str]]) -> list[Test]:
    """Return the corruptions that models of a recipe notice."""
    sources = [s for model in recipe.models for s in find_sources(model, recipe.encodings)]
    hears = any(source.encoding.of_vibration for source in sources)
    sees = any(not source.encoding.of_vibration for source in sources)
    noticed = [name for name in amounts if (hears if name == "sound" else sees)]
    return [("", NONE), *((name, amount) for name in noticed for amount in amounts[name])]


def counts_of(
    recipe: Recipe, key: FoldKey, samples: Sequence[Samples], tests: Sequence[Test], session: str
) -> Path:
    """Train on one fold, count what is named rightly in every test, and keep that."""
    part = part_of(recipe, key)
    if part.is_file():
        return part
    table = train_and_test(recipe, key, samples).table
    textures = [str(name)[2:] for name in table if str(name).startswith("p_")]
    counted = []
    for number, (name, amount) in enumerate(tests, start=1):
        mine = table[table["variant"] == number]
        named = {SAMPLE: mine}
        for length in TOUCHES_S:
            if (touches := name_touches(mine, textures, length)) is not None:
                named[f"{length:g} s"] = touches.named
        counted += [
            count_right(rows).assign(
                model=key.model, session=session, corruption=name, amount=amount, touch=touch
            )
            for touch, rows in named.items()
        ]
    part.parent.mkdir(parents=True, exist_ok=True)
    with write_aside(part) as partial, partial.open("wb") as file:
        pd.concat(counted, ignore_index=True).to_parquet(file, index=False)
    return part


def part_of(recipe: Recipe, key: FoldKey) -> Path:
    """Return the file that keeps what came of a fold: of these data, amounts and options alone."""
    folder = recipe.out / "parts" / digest_of(recipe.config)[:12]
    return folder / f"{key.model} {key.seed} {key.held_out}.parquet"


def session_counts(
    asked: argparse.Namespace, store: str, progress: Progress
) -> Iterator[pd.DataFrame]:
    """Yield the counts of all folds of one session."""
    opened = open_data([store], progress=progress)
    wanted = {"frames": asked.frames_a_sample, "mask": asked.mask}
    usual = Recipe(
        out=asked.out.resolve(),
        data=tuple(one.origin for one in opened),
        models=choose_models(asked.models),
        encodings=encodings_for(opened, "all", {n: v for n, v in wanted.items() if v}),
        options=EvaluationOptions(
            preset=asked.preset,
            penalty=asked.penalty,
            seeds=asked.seeds,
            held_out=asked.held_out,
            disturb_training=asked.disturb_training,
        ),
    )
    recordings = usual.recordings(opened)
    require_support(usual.models, recordings, may_leave_out=False)
    amounts = {name: getattr(asked, name).split(",") for name in AMOUNTS if getattr(asked, name)}
    groups = itertools.groupby(usual.models, lambda model: find_sources(model, usual.encodings))
    for sources, of_group in groups:
        recipe = replace(usual, models=list(of_group))
        tests = tests_of(recipe, amounts)
        each = tuple(Corruption.of({n: a} if n else None, "the amounts") for n, a in tests)
        recipe = replace(recipe, tests=each)
        keys = planned(Evaluation(recipe, opened), recipe.models, recordings)
        missing = [key for key in keys if not part_of(recipe, key).is_file()]
        if missing:
            samples = encoded(recipe, sources, recordings, progress)
            jobs = [(recipe, key, samples, tests, Path(store).name) for key in missing]
            title = ", ".join(model.name for model in recipe.models)
            done = side_by_side(counts_of, jobs, asked.workers, progress.note)
            for _ in progress.track(done, f"{title} on {Path(store).name}", len(jobs)):
                pass
        yield from (pd.read_parquet(part_of(recipe, key)) for key in keys)


def summary_of(counts: pd.DataFrame) -> pd.DataFrame:
    """Return a row a model, corruption, amount and touch: mean over speeds, interval, worst."""
    recordings = counts["session"] + ":" + counts["recording"]
    drawn_over = counts["session" if len(counts["session"].unique()) > 1 else "unit"]
    counts, rows = counts.assign(recording=recordings, replicate=drawn_over), []
    for names, mine in counts.groupby(BY, sort=False):
        accuracy = Accuracy(mine[[SPEED, "recording", "unit", "seed", "right", "n"]])
        interval = bootstrap_interval(accuracy)
        totals = mine.groupby(SPEED)[["right", "n"]].sum()
        by_speed = totals["right"] / totals["n"]
        rows.append((*names, accuracy.mean(), interval.low, interval.high, by_speed.idxmin(),
                     by_speed.min()))  # fmt: skip
    more = ["accuracy", "ci95_low", "ci95_high", "worst_mm_s", "worst_accuracy"]
    return pd.DataFrame(rows, columns=[*BY, *more])


def in_markdown(summary: pd.DataFrame, note: str) -> str:
    """Return the table as text, a row a model and amount and a column a length of touch."""
    there = set(summary["touch"])
    touches = [t for t in (SAMPLE, *(f"{length:g} s" for length in TOUCHES_S)) if t in there]
    lines = [
        "# Accuracy under corruptions at test", "", note, "",
        f"| model | corrupted | amount | {' | '.join(touches)} | worst speed, a sample |",
        f"|{'---|' * (4 + len(touches))}",
    ]  # fmt: skip
    for (model, name, amount), mine in summary.groupby(BY[:3], sort=False):
        of_touch = {str(row["touch"]): row for row in mine.to_dict("records")}
        cells = [_cell(of_touch[t]) if t in of_touch else "—" for t in touches]
        worst = of_touch[SAMPLE]
        cells.append(f"{worst['worst_mm_s']:g} mm/s: {percent(worst['worst_accuracy'])}")
        lines.append(f"| `{model}` | {name or NONE} | {amount} | {' | '.join(cells)} |")
    return "\n".join([*lines, ""])


def _cell(row: Mapping[Hashable, Any]) -> str:
    low, high = percent(row["ci95_low"]), percent(row["ci95_high"])
    return f"{percent(row['accuracy'])} [{low}, {high}]"


@styled
def drawn(summary: pd.DataFrame, chance: float, touch: str, note: str) -> Figure:
    """Return accuracy against the amount of each corruption, a panel each and a line a model."""
    summary = summary[summary["touch"] == touch]
    names = [name for name in TITLES if name in set(summary["corruption"])]
    figure = new_figure(3.0 * len(names) + 2.2, 3.4, f"Corrupted at test, {touch}", note)
    panels = figure.subplots(1, len(names), sharey=True, squeeze=False)[0]
    for axes, name in zip(panels, names, strict=True):
        _draw_panel(axes, summary, name, chance)
    panels[0].set_ylabel("accuracy (%)")
    handles = {h.get_label(): h for axes in panels for h in axes.get_lines()}
    figure.legend(handles.values(), handles.keys(), loc="outside right upper")
    return figure


def _draw_panel(axes: Axes, summary: pd.DataFrame, name: str, chance: float) -> None:
    there = summary[summary["corruption"] == name]
    amounts = [NONE, *dict.fromkeys(there["amount"])]
    for number, model in enumerate(dict.fromkeys(summary["model"])):
        mine = summary[summary["model"] == model].query("corruption in ('', @name)")
        if name not in set(mine["corruption"]):
            continue
        place = [amounts.index(amount) for amount in mine["amount"]]
        low, high = mine["ci95_low"], mine["ci95_high"]
        (line,) = axes.plot(
            place, 100 * mine["accuracy"], marker="os^vDP*X"[number % 8], ms=3.5, label=model,
            color=f"C{number % 10}", ls="-" if number < 10 else "--",
        )  # fmt: skip
        axes.fill_between(place, 100 * low, 100 * high, color=line.get_color(), alpha=0.12, lw=0)
    axes.axhline(100 * chance, color=GREY, lw=0.8, ls=(0, (4, 3)), label="chance")
    axes.set_xticks(range(len(amounts)), amounts)
    axes.set_xlabel(TITLES[name])
    axes.set_ylim(0, 103)
    axes.grid(axis="y", color=LINE, lw=0.4)


def main() -> None:
    """Run what is missing, and write the table and the figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("stores", nargs="+", help="extracted stores, a session each")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--models", default="ra-wave-vector,sa-wave-vector")
    parser.add_argument("--preset", default="fast", choices=["quick", "fast", "paper"])
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--held-out", help="speeds, mm/s, held out in turn (default: all)")
    parser.add_argument("--disturb-training", help="as of 'evaluate': markers=0.05")
    parser.add_argument("--penalty", default="fixed", choices=["fixed", "searched"])
    parser.add_argument("--frames-a-sample", type=int, help="--frames of 'evaluate'")
    parser.add_argument("--mask", help="as of 'evaluate'")
    parser.add_argument("--touch", default=SAMPLE, help="what the figure shows: 'a sample', '1 s'")
    parser.add_argument("--workers", type=int)
    for name, amounts in AMOUNTS.items():
        parser.add_argument(f"--{name}", default=amounts, help=f"amounts (default: {amounts})")
    asked = parser.parse_args()
    with Progress() as progress:
        counts = pd.concat(
            [part for store in asked.stores for part in session_counts(asked, store, progress)],
            ignore_index=True,
        )
        n_textures = max(len(textures_of(open_data([s])[0].responses)) for s in asked.stores)
    summary = summary_of(counts)
    learnt = f"; learnt under {asked.disturb_training}" if asked.disturb_training else ""
    over = "textures" if len(asked.stores) == 1 else "sessions"
    note = (
        f"{len(asked.stores)} session(s), nested, preset {asked.preset}, {asked.seeds} seed(s)"
        f"{learnt}. Percent, mean over held-out speeds; 95% intervals over {over}."
    )
    with write_aside(asked.out / "robustness.parquet") as partial, partial.open("wb") as file:
        counts.to_parquet(file, index=False)
    write_text(asked.out / "robustness.md", in_markdown(summary, note))
    save_figure(drawn(summary, 1 / n_textures, asked.touch, note), asked.out / "robustness.png")
    print(f"Table: {asked.out / 'robustness.md'}\nFigure: {asked.out / 'robustness.png'}")


if __name__ == "__main__":
    main()
