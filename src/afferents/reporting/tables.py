"""The tables of the report: data frames whose rows and columns are as they are read.

The index says what a row is, in one level or several. Numbers are accuracies in percent, which
pages shade; texts stand as they are. `attrs` hold the title and the caption.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from afferents.dims import RA2
from afferents.evaluation.results import Accuracies, Outcome, Results, Summary
from afferents.folds.controls import CONTROLS
from afferents.folds.held_out import SPEED, key_of
from afferents.models.model import TABLE1
from afferents.reporting import labels, published
from afferents.reporting.labels import ABSENT, PROTOCOL_TITLES, caption, model_title, percent

Cell = str | float | None
PAPER_ROW = "the paper's own"
PAPER_COLUMN = "Paper, its own recordings"


def make_table(
    title: str,
    caption: str,
    columns: Sequence[str],
    rows: Iterable[Sequence[Cell]],
    n_headers: int = 1,
) -> pd.DataFrame:
    """Return a table.

    Parameters
    ----------
    columns
        Heads, of the cells that say what a row is as well.
    rows
        Cells; None for what is absent.
    n_headers
        How many cells, from the left, say what a row is.
    """
    cells = [tuple(ABSENT if cell is None else cell for cell in row) for row in rows]
    heads = [str(column) for column in columns]
    index = pd.MultiIndex.from_tuples([row[:n_headers] for row in cells], names=heads[:n_headers])
    values = [row[n_headers:] for row in cells]
    table = pd.DataFrame(values, index=index, columns=heads[n_headers:], dtype=object)
    table.attrs = {"title": title, "caption": caption}
    return table


def make_outcome_table(
    summary: Summary,
    title: str,
    caption: str,
    columns: Sequence[str],
    cells: Callable[[Outcome], Iterable[Cell]],
) -> pd.DataFrame:
    """Return a table with a row for each model and protocol, its cells made of the outcome."""
    rows = (
        (model_title(model, summary), protocol, *cells(found))
        for model, protocol, found in labels.outcomes(summary)
    )
    return make_table(title, caption, ("Model", "Protocol", *columns), rows, n_headers=2)


def list_heads(table: pd.DataFrame) -> list[str]:
    """Return the heads of all columns, those of the index first."""
    return [*map(str, table.index.names), *map(str, table.columns)]


def format_rows(table: pd.DataFrame) -> list[list[str]]:
    """Return the cells as they are printed, row by row, those of the index first."""
    return [
        [*index, *(cell if isinstance(cell, str) else f"{cell:.1f}" for cell in cells)]
        for index, cells in zip(table.index, table.to_numpy().tolist(), strict=True)
    ]


def render_markdown(table: pd.DataFrame) -> str:
    """Return the table as a markdown heading, pipe table and caption."""
    marks = ["---"] * table.index.nlevels + ["---:"] * len(table.columns)
    lines = [list_heads(table), marks, *format_rows(table)]
    escaped = ([text.replace("|", r"\|") for text in line] for line in lines)
    body = "\n".join(f"| {' | '.join(line)} |" for line in escaped)
    return f"### {table.attrs['title']}\n\n{body}\n\n{table.attrs['caption']}\n"


def mean_and_interval(found: Accuracies | None) -> str:
    """Return `50.1 [40.2, 60.3]` in percent."""
    if found is None:
        return ABSENT
    return "{} [{}, {}]".format(*map(percent, (found.mean_accuracy, *found.ci95)))


def format_worst(summary: Summary, found: Accuracies | None) -> str:
    """Return `10 mm/s: 25.0`: the group where accuracy is lowest."""
    if found is None:
        return ABSENT
    return f"{summary.split.printed(found.worst)}: {percent(found.by[found.worst])}"


def table1(summary: Summary) -> pd.DataFrame:
    """Return Table 1: the paper's mean next to ours under each protocol that was run, in percent.

    Where one of the paper's six models was evaluated on its drums, all six have a row; else those
    that were evaluated. Others follow.
    """
    split, families = summary.split, published.published_families()
    papers = [name for name in TABLE1 if name in summary.models]
    papers = list(TABLE1) if papers and summary.named_by_spacing else papers
    with_paper = split == SPEED and bool(papers)
    titles = {protocol: PROTOCOL_TITLES[protocol] for protocol in labels.list_protocols(summary)}
    rows = []
    for name in (*papers, *(name for name in labels.list_models(summary) if name not in TABLE1)):
        found = [labels.outcome(summary, name, protocol) for protocol in titles]
        paper = [str(families[name].mean_percent) if name in families else None]
        rows.append((
            model_title(name, summary),
            *(paper * with_paper),
            *map(mean_and_interval, found),
            format_worst(summary, next(filter(None, found), None)),  # under the strictest protocol
        ))  # fmt: skip
    same_grid = (
        labels.are_published(summary)
        and summary.speeds_mm_s == published.published_speeds()
        and not any(data.simulated for data in summary.data)
    )
    return make_table(
        f"Table 1. Accuracy at {split.many} held out of training",
        caption("table1", summary, papers, same_grid, spans_modalities(papers)),
        (
            "Model",
            *([PAPER_COLUMN] * with_paper),
            *(f"Here, {title}" for title in titles.values()),
            f"Worst {split.title} here",
        ),
        rows,
    )


def short_table1(summary: Summary) -> pd.DataFrame:
    """Return Table 1 for a terminal of 80 columns: short heads; of two protocols no worst."""
    whole = table1(summary)
    heads: dict[str, str] = {
        PAPER_COLUMN: "Paper",
        **{f"Here, {title}": f"Here, {name}" for name, title in PROTOCOL_TITLES.items()},
        f"Worst {summary.split.title} here": "Worst",
    }
    table = whole.rename(columns=heads)
    if len(labels.list_protocols(summary)) > 1:
        table = table.drop(columns="Worst")
    table.attrs = whole.attrs
    return table


def spans_modalities(models: Iterable[str]) -> bool:
    """Return whether there are models of both images and vibration among the paper's."""
    channels = {TABLE1[name].channel for name in models if name in TABLE1}
    return RA2 in channels and len(channels) > 1


def group_table(summary: Summary) -> pd.DataFrame:
    """Return the accuracy of every model by group held out.

    The paper's stand beneath ours where the textures are its own and what is held out are speeds.
    """
    split, groups = summary.split, summary.held_out_keys
    families = published.published_families() if labels.are_published(summary) else {}
    rows: list[tuple[Cell, ...]] = []
    for model in labels.list_models(summary):
        title = model_title(model, summary)
        rows += [
            (title, protocol, *(100 * found.by[key] if key in found.by else None for key in groups))
            for protocol, found in labels.outcomes_by_protocol(summary, model).items()
        ]
        if model in families:
            paper = [families[model].by_speed.get(speed) for speed in summary.speeds_mm_s]
            rows += [(title, PAPER_ROW, *paper)] if any(paper) else []
    return make_table(
        f"Accuracy by held-out {split.axis}",
        caption("by_group", summary, any(row[1] == PAPER_ROW for row in rows)),
        ("Model", "Protocol", *groups),
        rows,
        n_headers=2,
    )


def controls_table(summary: Summary) -> pd.DataFrame | None:
    """Return what a quick model recognises once something was taken away, or why there is none.

    None where there are markers.
    """
    if not (summary.controls or summary.controls_left_out):
        return None
    left = {"none": "the recordings as they are", **CONTROLS}
    rows = [
        (left[name].partition(":")[0], mean_and_interval(found))
        for name, found in (summary.controls or dict.fromkeys(CONTROLS)).items()
    ]
    text = caption("controls", summary, CONTROLS.values())
    return make_table("Controls", text, ("What is left", "Accuracy"), rows)


def leak_table(summary: Summary) -> pd.DataFrame:
    """Return what each model saw of the group held out before its final test, as counted."""

    def cells(found: Outcome) -> Iterator[str]:
        yield f"{found.n_test:,}"
        for value in map(found.leaks.get, _name_leaks(summary)):
            if isinstance(value, bool):
                yield "yes" if value else "no"
            else:
                yield "not counted" if value is None else f"{value:,}"

    return make_outcome_table(
        summary,
        f"What was seen of the held-out {summary.split.title} before the final test",
        caption("leaks", summary),
        ("Test samples", *_name_leaks(summary).values()),
        cells,
    )


def _name_leaks(summary: Summary) -> dict[str, str]:
    """Return leaks as the summary names them, and the heads of their columns."""
    split = summary.split
    return {
        f"test_samples_of_a_{split.leaks}_seen_in_training": f"… of {split.one} trained on",
        f"test_samples_of_a_{split.leaks}_seen_in_validation": (
            f"… of {split.one} that picked the model"
        ),
        "test_samples_overlapping_validation": "… overlapping validation in time",
        "test_samples_overlapping_training": "… overlapping training in time",
        f"scale_saw_held_out_{split.leaks}": f"Scale saw the held-out {split.title}",
    }


def leak_sentences(summary: Summary) -> list[str]:
    """Return one sentence a protocol that names its leaks, or says that there are none."""
    name, sentences = summary.split.title, []
    for protocol in labels.list_protocols(summary):
        found = [one for _, its, one in labels.outcomes(summary) if its == protocol]
        counts = [sum(one.leaks.get(leak) or 0 for one in found) for leak in _name_leaks(summary)]
        trained, picked, validation, training, scale = counts
        text = f"nothing of a held-out {name} was seen before its one final test."
        if any(counts):
            scaled = f"; scaling constants had seen the held-out {name}" if scale else ""
            text = (
                f"{picked:,} of {sum(one.n_test for one in found):,} test samples are of "
                f"{summary.split.one} that picked the model and {trained:,} of one trained on; "
                f"{validation:,} overlap validation samples in time and "
                f"{training:,} overlap training samples{scaled}. Its accuracy is not that of an "
                f"unseen {name}."
            )
        sentences.append(f"{PROTOCOL_TITLES[protocol].capitalize()}: {text}")
    return sentences


def run_table(summary: Summary) -> pd.DataFrame:
    """Return how each model was run: seeds, epochs, time, macro-F1 and what validated it."""
    split = summary.split

    def cells(found: Outcome) -> Iterator[str]:
        yield f"{found.macro_f1:.3f}"
        yield ", ".join(map(str, found.seeds))
        epochs = [count for counts in found.epochs.values() for count in counts]
        low, high = min(epochs), max(epochs)
        yield f"{low}" if low == high else f"{low} to {high}"
        groups = {held_out: key_of(group) for held_out, group in found.validations.items()}
        if any(held_out != group for held_out, group in groups.items()):
            yield ", ".join(f"{held_out} → {group}" for held_out, group in groups.items())
        else:
            itself = labels.picked_by_tested(summary, found)
            yield f"the held-out {split.title} itself" if itself else ABSENT
        yield f"{found.seconds:,.0f}"

    heads = ("Macro-F1", "Seeds", "Epochs", f"Validation {split.title}", "Time (s)")
    text = caption("runs", summary)
    return make_outcome_table(summary, "How the models were trained", text, heads, cells)


def recordings_table(summary: Summary) -> pd.DataFrame:
    """Return how well samples and whole recordings are recognised, between the speeds and beyond.

    Of groups that lie on no scale, or some of them: over all of them, and in the worst.
    """
    split, ends = summary.split, (summary.held_out_keys[0], summary.held_out_keys[-1])
    on_a_scale = split.ordered and summary.all_held_out

    def cells(found: Outcome | Accuracies) -> Iterator[str]:
        yield mean_and_interval(found)
        if not on_a_scale:
            yield format_worst(summary, found)
            return
        yield mean_and_interval(getattr(found, "inside", None))
        for end in ends:
            if end in found.by:
                low, high = (percent(limit, 0) for limit in found.ci95_by[end])
                yield f"{percent(found.by[end])} [{low}, {high}]"
            else:
                yield ABSENT

    heads = [f"Over all {split.many}", "Worst"]
    if on_a_scale:
        heads = [f"All {split.many}", "Between", *(f"{end} mm/s" for end in ends)]
    return make_table(
        "Samples and whole recordings" + ", speeds between others and at the ends" * on_a_scale,
        caption("recordings", summary, on_a_scale),
        ("Model", "Protocol", "Of", *heads),
        (
            (model_title(model, summary), protocol, unit, *cells(found))
            for model, protocol, result in labels.outcomes(summary)
            for unit, found in (("a sample", result), ("a recording", result.recordings))
        ),
        n_headers=3,
    )


def touches_table(summary: Summary) -> pd.DataFrame | None:
    """Return each model's accuracy on touches of equal length; None where there are no models."""
    found = next(labels.outcomes(summary), None)
    if found is None:
        return None
    lengths = list(found[-1].by_touch)

    def cells(result: Outcome) -> Iterator[str]:
        for touches in map(result.by_touch.get, lengths):
            yield mean_and_interval(touches)
            yield ABSENT if touches is None else percent(touches.by[touches.worst])

    heads = [head for n in lengths for head in (f"{n} s", f"worst, {n} s")]
    text = caption("touches", summary)
    return make_outcome_table(summary, "Accuracy by length of touch", text, heads, cells)


def outcomes_by_length(summary: Summary, base: str, protocol: str) -> dict[str, Outcome]:
    """Return what came out by length of window, shortest first, of those that were run."""
    models = summary.lengths[base].items()
    found = {n: labels.outcome(summary, name, protocol) for n, name in models}
    return {n: one for n, one in found.items() if one is not None}


def lengths_table(summary: Summary) -> pd.DataFrame | None:
    """Return accuracy by length of window, in percent; None where there is but one length."""
    if not summary.lengths:
        return None
    lengths = sorted({n for of in summary.lengths.values() for n in of}, key=int)
    return make_table(
        "Accuracy by length of window",
        caption("lengths", summary),
        ("Model", "Protocol", *(f"{n} frame{'' if n == '1' else 's'}" for n in lengths)),
        (
            (model_title(base, summary), protocol, *(mean_and_interval(of.get(n)) for n in lengths))
            for base in summary.lengths
            for protocol in PROTOCOL_TITLES
            if (of := outcomes_by_length(summary, base, protocol))
        ),
        n_headers=2,
    )


def accuracy_by_texture(results: Results, model: str, protocol: str) -> dict[str, float]:
    """Return percent of a texture's test samples recognised, mean over what was held out.

    Textures that were not tested are left out.
    """
    table = results.predictions
    mine = table[(table["model"] == model) & (table["protocol"] == protocol)]
    right = mine["true_texture"] == mine["predicted_texture"]
    groups = [mine["true_texture"], mine[results.split.column]]
    shares: pd.Series = right.groupby(groups, observed=True).mean()
    means = 100 * shares.groupby(level=0, observed=True).mean()
    return {texture: float(means[texture]) for texture in results.textures if texture in means}


def paper_by_texture(results: Results, model: str) -> list[float]:
    """Return the paper's accuracies by texture, percent; nothing where textures are others.

    They are the diagonals of its matrices.
    """
    if model not in published.published_families() or not labels.are_published(results.found):
        return []
    found: list[float] = published.published_confusion(model).diagonal().tolist()
    return found


def texture_table(results: Results) -> pd.DataFrame | None:
    """Return accuracy by texture, the paper's beneath ours; None where nothing was evaluated.

    The paper finds that SA-I recognises the smooth drum and the one with the widest spacing better:
    they lie at the ends of the series, which have columns of their own where they are there.
    """
    textures, summary = results.textures, results.found
    named = labels.texture_names(textures, summary.named_by_spacing)
    smooth, widest = named[textures[0]], named[textures[-1]]
    with_ends = labels.are_published(summary)

    def cells(values: Sequence[float | None]) -> tuple[float | None, ...]:
        if not with_ends:
            return tuple(values)
        ends, inner = ([v for v in part if v is not None] for part in (values[::12], values[1:-1]))
        return (*values, *(float(np.mean(part)) if part else None for part in (ends, inner)))

    rows: list[tuple[Cell, ...]] = []
    for model in labels.list_models(summary):
        title = model_title(model, summary)
        for protocol in labels.outcomes_by_protocol(summary, model):
            found = accuracy_by_texture(results, model, protocol)
            rows.append((title, protocol, *cells([found.get(one) for one in textures])))
        if of_paper := paper_by_texture(results, model):
            rows.append((title, PAPER_ROW, *cells(of_paper)))
    if not rows:
        return None
    ends = (f"{smooth} and {widest}", "the others") if with_ends else ()
    text = caption("by_texture", summary, smooth, widest)
    heads = ("Model", "Protocol", *named.values(), *ends)
    return make_table("Accuracy by texture", text, heads, rows, n_headers=2)


def confidence_table(summary: Summary) -> pd.DataFrame | None:
    """Return the expected calibration error of every model, and on which side it errs.

    None where no model gives probabilities.
    """
    known = [found.reliability for _, _, found in labels.outcomes(summary) if found.reliability]
    if not known:
        return None

    def cells(found: Outcome) -> list[str | None]:
        if found.reliability is None:
            return [None] * 3
        bins = found.reliability
        means = (np.average(each, weights=bins.count) for each in (bins.confidence, bins.accuracy))
        return [*(percent(float(mean)) for mean in means), percent(bins.ece)]

    text = caption("confidence", summary, len(known[0].count))
    heads = ("Confidence", "Accuracy", "ECE")
    return make_outcome_table(summary, "Confidence and accuracy", text, heads, cells)
