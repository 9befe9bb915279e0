"""From a results folder to its report: Table 1, figures and a page; and runs side by side."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import pandas as pd

from afferents.choices import Figures
from afferents.errors import InputError
from afferents.evaluation.results import Results, load_results
from afferents.files import Place, write_aside, write_text
from afferents.progress import Progress
from afferents.reporting import compare, data, grids, labels, page, style, tables

PAGE, FIRST_TABLE, FOLDS = "report.html", "table1.md", "beside_paper.md"


def report(results: Place, quiet: bool = False, figures: Figures = "report") -> Path:
    """Write Table 1, figures and a self-contained page from a results folder.

    Parameters
    ----------
    results
        As `evaluate` leaves it.
    figures
        ``paper`` to draw the paper's figures as they are printed (7 to 13), in place of our own of
        the same numbers, each saying where it departs from that; ``report`` for those that suit
        what was evaluated.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the page, ``report.html``.

    Raises
    ------
    InputError
        If the folder holds no finished evaluation, or there is no such way to draw. Data that are
        gone, damaged, or others than were evaluated only cost their figures; the report says so.

    Examples
    --------
    >>> report("results").name
    'report.html'
    """
    if figures not in get_args(Figures):
        raise InputError(f"figures: expected {' or '.join(get_args(Figures))}, found '{figures}'")
    folder = Path(results)
    evaluated = load_results(folder)
    with Progress(quiet) as progress:
        shown, notes = data.read_figure_data(evaluated, progress, figures)
        pictures = draw_pictures(evaluated, shown, figures)
        for picture in progress.track(pictures, "drawing", len(pictures)):
            with write_aside(folder / "figures" / f"{picture.name}.png") as partial:
                partial.write_bytes(picture.png)
    _write_tables(folder / FIRST_TABLE, tables.table1(evaluated.found))
    compared = [compare.compare_folds(evaluated.found)]
    compared += [tables.texture_table(evaluated)] if labels.are_published(evaluated.found) else []
    _write_tables(folder / FOLDS, *compared)
    write_text(folder / PAGE, page.render_report(evaluated, pictures, notes))
    return folder / PAGE


def draw_pictures(
    results: Results, shown: data.FigureData, figures: Figures = "report"
) -> list[style.ReportFigure]:
    """Draw every figure that the results and the data allow, in the order of the report.

    Those of accuracy come first, then those that the paper has too, in its order, then the rest.

    Parameters
    ----------
    figures
        `paper` draws the paper's figures as they are printed, in place of ours of the same numbers;
        what the paper has no figure of, such as matrices of other models, keeps its own.
    """

    def find_number(picture: style.ReportFigure) -> tuple[float, str]:
        found = re.match(r"Figure (\d+)([A-Z]?)\.", picture.title)
        return (int(found[1]), found[2]) if found else (math.inf, "")

    source = labels.source_line(results.found)
    others = [
        *grids.picture_spectra(shown, source, figures),
        *grids.picture_images(shown, source, figures),
        *grids.picture_matrices(results, figures),
    ]
    return [*grids.picture_accuracies(results), *sorted(others, key=find_number)]


def _write_tables(path: Path, *found: pd.DataFrame | None) -> None:
    """Write tables as markdown, if there are any."""
    if texts := [tables.render_markdown(table) for table in found if table is not None]:
        write_text(path, "\n".join(texts))


def compare_runs(folders: Sequence[Path]) -> tuple[pd.DataFrame, Path]:
    """Return one table of all runs, Table 1 for a single one, and where it is written.

    Raises
    ------
    InputError
        If there are no results in one of them, or one is given twice.
    """
    names = [folder.resolve().name for folder in folders]
    if len(set(names)) < len(names):  # such as `results`, where `reproduce` leaves them
        names = list(map(str, folders))
    runs = {name: load_results(folder).found for name, folder in zip(names, folders, strict=True)}
    if len(runs) < len(folders):
        raise InputError("RESULTS: expected each folder once, found one twice; leave it out")
    if len(folders) == 1:
        return tables.short_table1(*runs.values()), folders[0] / FIRST_TABLE
    table, path = compare.compare_summaries(runs), folders[0] / "runs.md"
    _write_tables(path, table)
    return table, path
