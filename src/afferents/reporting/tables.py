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
from afferents.reporting.labels import (
    ABSENT,
    PROTOCOL_TITLES,
    are_published,
    by_protocol,
    caution,
    drawn_over,
    model_order,
    model_title,
    outcome,
    outcomes,
    percent,
    picked_by_tested,
    texture_names,
    with_interval,
)
from afferents.reporting.published import (
    published_confusion,
    published_families,
    published_speeds,
)

Cell = str | float | None
PAPER_ROW = "the paper's own"
PAPER_COLUMN = "Paper, its own recordings"
OTHER_RECORDINGS = (
    "The paper's column was measured on other recordings (Pestell & Lepora 2022, published "
    "protocol): this is no reproduction of it, and a difference is no failure to reproduce."
)
SAME_GRID = (
    "The textures and speeds are those of the paper. The paper's column is comparable only if "
    "these are the published recordings themselves, which the results cannot tell."
)
ACROSS = (
    "Compare within a modality first: RA with SA, STE with SE, stretched spectra with plain ones. "
    "The paper (section 3.3.2) cautions against comparisons across modalities, of tactile images "
    "with vibration: its runs of images last 0.1 s, its windows of vibration 1 s. "
)
"""The caution wherever models of both modalities stand in one ranking: see `across_modalities`."""
_NAMED = 5
"""So many missing recordings are named below the table; the page names all."""


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
    table.attrs = {"title": title, "caption": caption.strip()}
    return table


def make_outcome_table(
    summary: Summary,
    title: str,
    caption: str,
    columns: Sequence[str],
    cells: Callable[[Outcome], Iterable[Cell]],
) -> pd.DataFrame:
    """Return a table with a row for each model and protocol, its cells made of the outcome."""
    return make_table(
        title,
        caption,
        ("Model", "Protocol", *columns),
        (
            (model_title(model, summary), protocol, *cells(found))
            for model, protocol, found in outcomes(summary)
        ),
        n_headers=2,
    )


def heads_of(table: pd.DataFrame) -> list[str]:
    """Return the heads of all columns, those of the index first."""
    return [*map(str, table.index.names), *map(str, table.columns)]


def texts_of(table: pd.DataFrame) -> list[list[str]]:
    """Return the cells as they are printed, row by row, those of the index first."""
    return [
        [*index, *(cell if isinstance(cell, str) else f"{cell:.1f}" for cell in cells)]
        for index, cells in zip(table.index, table.to_numpy().tolist(), strict=True)
    ]


def to_markdown(table: pd.DataFrame) -> str:
    """Return the table as a markdown heading, pipe table and caption."""
    marks = ["---"] * table.index.nlevels + ["---:"] * len(table.columns)
    lines = [heads_of(table), marks, *texts_of(table)]
    escaped = ([text.replace("|", r"\|") for text in line] for line in lines)
    body = "\n".join(f"| {' | '.join(line)} |" for line in escaped)
    return f"### {table.attrs['title']}\n\n{body}\n\n{table.attrs['caption']}\n"


def mean_and_interval(found: Accuracies | None) -> str:
    """Return `50.1 [40.2, 60.3]` in percent."""
    return ABSENT if found is None else with_interval(found.mean_accuracy, found.ci95)


def worst_of(summary: Summary, found: Accuracies | None) -> str:
    """Return `10 mm/s: 25.0`: the group where accuracy is lowest."""
    if found is None:
        return ABSENT
    return f"{summary.split.printed(found.worst)}: {percent(found.by[found.worst])}"


def table1(summary: Summary) -> pd.DataFrame:
    """Return Table 1: the paper's mean beside ours under each protocol that was run, in percent.

    Where one of the paper's six models was evaluated on its drums, all six have a row; else those
    that were evaluated. Others follow.
    """
    split, families = summary.split, published_families()
    papers = [name for name in TABLE1 if name in summary.models]
    papers = list(TABLE1) if papers and summary.named_by_spacing else papers
    run = {protocol for of_model in summary.models.values() for protocol in of_model}
    titles = {protocol: title for protocol, title in PROTOCOL_TITLES.items() if protocol in run}
    rows = []
    for name in (*papers, *(name for name in model_order(summary) if name not in TABLE1)):
        found = [outcome(summary, name, protocol) for protocol in titles]
        strictest = next(filter(None, found), None)
        paper = [str(families[name].mean_percent) if name in families else None]
        rows.append((
            model_title(name, summary),
            *(paper if split == SPEED and papers else []),
            *map(mean_and_interval, found),
            worst_of(summary, strictest),
        ))  # fmt: skip
    return make_table(
        f"Table 1. Accuracy at {split.many} held out of training",
        f"Percent of test samples, mean over held-out {split.many}, with 95% interval in brackets "
        f"(over {drawn_over(summary)}). Chance: {percent(summary.chance)}. "
        f"{_missing_note(summary)}{comparison_note(summary) if papers else ''} "
        f"{across_modalities(papers)}{caution(summary)}",
        (
            "Model",
            *((PAPER_COLUMN,) if split == SPEED and papers else ()),
            *(f"Here, {title}" for title in titles.values()),
            f"Worst {split.title} here",
        ),
        rows,
    )


def short_table1(summary: Summary) -> pd.DataFrame:
    """Return Table 1 for a terminal of 80 columns: short heads, no worst beside two protocols."""
    whole = table1(summary)
    both = all(f"Here, {title}" in whole for title in PROTOCOL_TITLES.values())
    heads: dict[str, str] = {
        PAPER_COLUMN: "Paper",
        **{f"Here, {title}": f"Here, {name}" for name, title in PROTOCOL_TITLES.items()},
        f"Worst {summary.split.title} here": "Worst",
    }
    table = whole[[name for name in whole if not (both and heads.get(str(name)) == "Worst")]]
    table = table.rename(columns=heads)
    table.attrs = whole.attrs
    return table


def across_modalities(models: Iterable[str]) -> str:
    """Return the caution of comparing images with vibration; empty without both of the paper's."""
    channels = {TABLE1[name].channel for name in models if name in TABLE1}
    return ACROSS if RA2 in channels and len(channels) > 1 else ""


def _missing_note(summary: Summary) -> str:
    """Say how many recordings the numbers are without, and which; empty where none is missing."""
    missing = [entry.recording for entry in summary.skipped]
    if not missing:
        return ""
    named = ", ".join(missing[:_NAMED]) + (" and others" if len(missing) > _NAMED else "")
    are = "recording is" if len(missing) == 1 else "recordings are"
    return f"{len(missing)} {are} missing: {named}. "


def comparison_note(summary: Summary) -> str:
    """Return the sentence that says how far the paper's column may be compared with ours."""
    split = summary.split
    if split != SPEED:
        return f"The paper holds out speeds: its figures are not comparable with {split.many}."
    same_grid = are_published(summary) and summary.speeds_mm_s == published_speeds()
    simulated = any(data.simulated for data in summary.data)
    return SAME_GRID if same_grid and not simulated else OTHER_RECORDINGS


def accuracy_by_speed(summary: Summary) -> pd.DataFrame:
    """Return the accuracy of every model by group held out.

    The paper's stand beneath ours where the textures are its own and what is held out are speeds.
    """
    split, groups = summary.split, summary.held_out_keys
    rows: list[tuple[Cell, ...]] = []
    for model in model_order(summary):
        title = model_title(model, summary)
        rows += [
            (title, protocol, *(100 * found.by[key] if key in found.by else None for key in groups))
            for protocol, found in by_protocol(summary, model).items()
        ]
        if of_paper := _paper_by_speed(summary, model):
            rows.append((title, PAPER_ROW, *of_paper))
    of_paper_too = any(row[1] == PAPER_ROW for row in rows)
    return make_table(
        f"Accuracy by held-out {split.axis}",
        "Percent of test samples; columns are "
        f"{'held-out speeds in mm/s' if split == SPEED else f'held-out {split.many}'}. "
        + "The paper's figures stand where it has the same speed; they were measured on its own "
        "recordings, under the published protocol. " * of_paper_too + caution(summary),
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
    return make_table(
        "Controls",
        f"Left out: {summary.controls_left_out}. "
        if summary.controls_left_out
        else "Percent that a linear discriminant on log spectra recognises, each "
        f"{summary.split.title} left out in turn. What is recognised all the same does not rest on "
        "what was taken. "
        + " ".join(f"{text[:1].upper()}{text[1:]}." for text in CONTROLS.values()),
        ("What is left", "Accuracy"),
        rows,
    )


def _paper_by_speed(summary: Summary, model: str) -> list[float | None]:
    """Return the paper's accuracies at our speeds, percent; nothing where it has none of them."""
    paper = published_families().get(model)
    if paper is None or not are_published(summary):
        return []
    found = [paper.by_speed.get(speed) for speed in summary.speeds_mm_s]
    return found if any(found) else []


def leak_table(summary: Summary) -> pd.DataFrame:
    """Return what each model saw of the group held out before its final test, as counted."""
    split, heads = summary.split, _leaks_of(summary)
    return make_outcome_table(
        summary,
        f"What was seen of the held-out {split.title} before the final test",
        f"Counted over all held-out {split.many} and seeds.",
        ("Test samples", *heads.values()),
        lambda found: (f"{found.n_test:,}", *(_leak(found.leaks.get(name)) for name in heads)),
    )


def _leaks_of(summary: Summary) -> dict[str, str]:
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


def _leak(value: bool | int | None) -> str:
    if value is None:
        return "not counted"
    return ("yes" if value else "no") if isinstance(value, bool) else f"{value:,}"


def leak_sentences(summary: Summary) -> list[str]:
    """Return one sentence a protocol that names its leaks, or says that there are none."""
    name, sentences = summary.split.title, []
    for protocol, title in PROTOCOL_TITLES.items():
        found = [one for _, its, one in outcomes(summary) if its == protocol]
        counts = [sum(one.leaks.get(leak) or 0 for one in found) for leak in _leaks_of(summary)]
        if not found:
            continue
        trained, picked, validation, training, scale = counts
        said = f"nothing of a held-out {name} was seen before its one final test."
        if any(counts):
            scaled = f"; scaling constants had seen the held-out {name}" if scale else ""
            said = (
                f"{picked:,} of {sum(one.n_test for one in found):,} test samples are of "
                f"{summary.split.one} that picked the model and {trained:,} of one trained on; "
                f"{validation:,} overlap validation samples in time and "
                f"{training:,} overlap training samples{scaled}. Its accuracy is not that of an "
                f"unseen {name}."
            )
        sentences.append(f"{title.capitalize()}: {said}")
    return sentences


def run_table(summary: Summary) -> pd.DataFrame:
    """Return how each model was run: seeds, epochs, time, macro-F1 and what validated it."""
    split = summary.split
    return make_outcome_table(
        summary,
        "How the models were trained",
        f"{'Speeds are in mm/s' if split == SPEED else split.many.capitalize()}: "
        "held out → validated by.",
        ("Macro-F1", "Seeds", "Epochs", f"Validation {split.title}", "Time (s)"),
        lambda found: (
            f"{found.macro_f1:.3f}",
            ", ".join(map(str, found.seeds)),
            _epochs(found),
            _validation(summary, found),
            f"{found.seconds:,.0f}",
        ),
    )


def _epochs(found: Outcome) -> str:
    epochs = [count for counts in found.epochs.values() for count in counts]
    low, high = min(epochs), max(epochs)
    return f"{low}" if low == high else f"{low} to {high}"


def _validation(summary: Summary, found: Outcome) -> str:
    groups = {held_out: key_of(group) for held_out, group in found.validations.items()}
    if all(held_out == group for held_out, group in groups.items()):
        if not picked_by_tested(summary, found):
            return ABSENT
        return f"the held-out {summary.split.title} itself"
    return ", ".join(f"{held_out} → {group}" for held_out, group in groups.items())


# How well samples, whole recordings, and touches of equal length are recognised.


def touches_table(summary: Summary) -> pd.DataFrame:
    """Return how well samples and whole recordings are recognised, between the speeds and beyond.

    Of groups that lie on no scale, or some of them: over all of them, and in the worst.
    """
    split, ends = summary.split, (summary.held_out_keys[0], summary.held_out_keys[-1])
    on_a_scale = split.ordered and summary.all_held_out

    def cells(found: Outcome | Accuracies) -> list[str]:
        if not on_a_scale:
            return [mean_and_interval(found), worst_of(summary, found)]
        inside = mean_and_interval(getattr(found, "inside", None))
        return [mean_and_interval(found), inside, *(_at(found, end) for end in ends)]

    heads = [f"Over all {split.many}", "Worst"]
    if on_a_scale:
        heads = [f"All {split.many}", "Between", *(f"{end} mm/s" for end in ends)]
    between = (
        "Between: held-out speeds that lie between other speeds of the data; to hold out the "
        "slowest or the fastest is to extrapolate. "
    )
    protocols = {protocol for _, protocol, _ in outcomes(summary)}
    halves = " (protocol published: of half of them)" * ("published" in protocols)
    return make_table(
        "Samples and whole recordings" + ", speeds between others and at the ends" * on_a_scale,
        "Percent recognised. A recording is classified by the sum of its samples' "
        f"log-probabilities{halves}. {between * on_a_scale}In brackets: 95% interval (over "
        f"{drawn_over(summary)}). {caution(summary)}",
        ("Model", "Protocol", "Of", *heads),
        (
            (model_title(model, summary), protocol, unit, *cells(found))
            for model, protocol, result in outcomes(summary)
            for unit, found in (("a sample", result), ("a recording", result.recordings))
        ),
        n_headers=3,
    )


def _at(found: Accuracies, key: str) -> str:
    """Return the accuracy at a speed, and its interval."""
    if key not in found.by:
        return ABSENT
    low, high = (percent(end, 0) for end in found.ci95_by[key])
    return f"{percent(found.by[key])} [{low}, {high}]"


def by_touch_table(summary: Summary) -> pd.DataFrame | None:
    """Return how well touches of equal length are recognised by all models; None of no models."""
    found = list(outcomes(summary))
    if not found:
        return None
    lengths = list(found[0][-1].by_touch)

    def cells(result: Outcome) -> Iterator[str]:
        for touches in map(result.by_touch.get, lengths):
            yield mean_and_interval(touches)
            yield ABSENT if touches is None else percent(touches.by[touches.worst])

    return make_outcome_table(
        summary,
        "Accuracy by length of touch",
        "Percent of touches recognised, each by the mean log-probability of the samples that it is "
        f"made of: mean over held-out {summary.split.many}, with 95% interval in brackets (over "
        f"{drawn_over(summary)}), and in the worst of them. A touch is a number of whole samples: "
        f"its length differs from the one stated by at most a quarter. {caution(summary)}",
        [head for n in lengths for head in (f"{n} s", f"worst, {n} s")],
        cells,
    )


def by_length(summary: Summary, base: str, protocol: str) -> dict[str, Outcome]:
    """Return what came out by length of window, shortest first, of those that were run."""
    found = {n: outcome(summary, name, protocol) for n, name in summary.lengths[base].items()}
    return {n: one for n, one in found.items() if one is not None}


def lengths_table(summary: Summary) -> pd.DataFrame | None:
    """Return accuracy by length of window, in percent; None where there is but one length."""
    if not summary.lengths:
        return None
    lengths = sorted({n for of in summary.lengths.values() for n in of}, key=int)
    return make_table(
        "Accuracy by length of window",
        f"Percent of test samples, mean over held-out {summary.split.many}, with 95% interval in "
        f"brackets (over {drawn_over(summary)}). Columns are frames of a window, which is one "
        "sample: longer windows are longer touches, and there are fewer of them to learn from. "
        f"{caution(summary)}",
        ("Model", "Protocol", *(f"{n} frame{'' if n == '1' else 's'}" for n in lengths)),
        (
            (model_title(base, summary), protocol, *(mean_and_interval(of.get(n)) for n in lengths))
            for base in summary.lengths
            for protocol in PROTOCOL_TITLES
            if (of := by_length(summary, base, protocol))
        ),
        n_headers=2,
    )


# Accuracy of each texture, and the paper's own beside it.
#
# The paper finds that SA-I recognises the smooth drum and the one with the widest spacing better:
# they lie at the ends of the series. Its accuracies are the diagonals of its matrices.


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
    """Return the paper's accuracies by texture, percent; nothing where textures are others."""
    if model not in published_families() or not are_published(results.found):
        return []
    found: list[float] = published_confusion(model).diagonal().tolist()
    return found


def by_texture_table(results: Results) -> pd.DataFrame | None:
    """Return accuracy by texture, the paper's beneath ours; None where nothing was evaluated."""
    textures, summary = results.textures, results.found
    named = texture_names(textures, summary.named_by_spacing)
    with_ends = are_published(summary)
    smooth, widest = named[textures[0]], named[textures[-1]]

    def cells(values: Sequence[float | None]) -> tuple[float | None, ...]:
        if not with_ends:
            return tuple(values)
        ends, inner = ([v for v in part if v is not None] for part in (values[::12], values[1:-1]))
        return (*values, *(float(np.mean(part)) if part else None for part in (ends, inner)))

    rows: list[tuple[Cell, ...]] = []
    for model in model_order(summary):
        title = model_title(model, summary)
        for protocol in by_protocol(summary, model):
            found = accuracy_by_texture(results, model, protocol)
            rows.append((title, protocol, *cells([found.get(one) for one in textures])))
        if of_paper := paper_by_texture(results, model):
            rows.append((title, PAPER_ROW, *cells(of_paper)))
    if not rows:
        return None
    claim = (
        f"The paper writes of SA-I alone that both ends of the series ({smooth} and {widest}) are "
        "recognised better, and its matrices agree: the last two columns compare the mean of both "
        "with that of all others. The paper's figures are the diagonals of those matrices, "
        "measured on its own recordings, under the published protocol."
    )
    return make_table(
        "Accuracy by texture",
        f"Percent of a texture's test samples recognised, mean over held-out {results.split.many}; "
        f"columns are textures. {claim * with_ends}",
        (
            "Model",
            "Protocol",
            *named.values(),
            *((f"{smooth} and {widest}", "the others") if with_ends else ()),
        ),
        rows,
        n_headers=2,
    )


def reliability_table(summary: Summary) -> pd.DataFrame | None:
    """Return the expected calibration error of every model, and on which side it errs.

    None where no model gives probabilities.
    """
    known = [found.reliability for _, _, found in outcomes(summary) if found.reliability]
    if not known:
        return None

    def cells(found: Outcome) -> list[str | None]:
        if found.reliability is None:
            return [None] * 3
        bins = found.reliability
        means = (np.average(each, weights=bins.count) for each in (bins.confidence, bins.accuracy))
        return [*(percent(float(mean)) for mean in means), percent(bins.ece)]

    return make_outcome_table(
        summary,
        "Confidence and accuracy",
        f"Percent of test samples, all {summary.split.many} held out together. Confidence is the "
        "mean probability of the predicted texture; ECE, the expected calibration error, the mean "
        f"difference between confidence and accuracy over {len(known[0].count)} bins of "
        f"confidence. {temperature_note(summary)}",
        ("Confidence", "Accuracy", "ECE"),
        cells,
    )


def temperature_note(summary: Summary) -> str:
    """Return what stands behind the confidences."""
    return (
        f"Models that are solved at once have a temperature, set at {summary.split.many} left out "
        "inside the fold; networks are taken as they come out of training."
    )


def accuracy_tables(results: Results) -> list[pd.DataFrame | None]:
    """Return the tables of accuracies in the order of the page; None for what was not evaluated."""
    summary = results.found
    return [
        table1(summary),
        accuracy_by_speed(summary),
        touches_table(summary),
        lengths_table(summary),
        by_touch_table(summary),
        by_texture_table(results),
        reliability_table(summary),
        controls_table(summary),
    ]
