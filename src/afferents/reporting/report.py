"""From a results folder, and the data behind it where they still are, to the report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, fill
from afferents.choices import Figures
from afferents.documents import as_form
from afferents.encodings.augment import stretch_spectrum
from afferents.encodings.images import spatial_samples
from afferents.encodings.samples import Samples, concatenate
from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import open_data, recordings_in
from afferents.evaluation.encode import Source, encode_all
from afferents.evaluation.results import (
    CONFIG,
    Results,
    load_results,
    read_summary,
    texture_summaries,
)
from afferents.files import Place, write_text
from afferents.folds.ablation import Ablation
from afferents.markers.places import covered
from afferents.progress import Progress
from afferents.reporting.accuracy_figures import by_texture_table
from afferents.reporting.comparisons import beside_paper, runs_side_by_side
from afferents.reporting.html import write_report as write_page
from afferents.reporting.labels import are_published
from afferents.reporting.paper import PaperData, draw_paper_pictures, drums, paper_data
from afferents.reporting.pictures import FigureData, ReportFigure, draw_pictures, save_pictures
from afferents.reporting.spectra import FACTORS, StretchExample, stretch_example
from afferents.reporting.tables import Table, table1, to_markdown
from afferents.reporting.textures import texture_tables, write_texture_page
from afferents.store.responses import Responses, conditions, speed_of
from afferents.store.trimming import with_steady

PAGE, TABLE1, TEXTURES, BESIDE = "report.html", "table1.md", "textures.md", "beside_paper.md"
SHOWN_FRAMES, SETTLING_FRAMES = 12, 90
"""Frames from the middle of each recording for Figures 8 and 10, and how many before them are
read so that a lost marker can be held at its last value."""
_UNREADABLE = (AfferentsError, OSError, ValueError, RuntimeError)
"""What data that are gone, damaged or changed raise; a store's bad chunk is a RuntimeError."""


def write_report(results_folder: Path, progress: Progress, figures: Figures = "report") -> Path:
    """Write `report.html`, `table1.md` and the figures of a results folder.

    Of one of `--split texture`, the page and `textures.md`.

    Parameters
    ----------
    results_folder
        As `evaluate` leaves it.
    figures
        `paper` to draw Figures 3 to 13 as they are printed, in place of our own of the same
        numbers.

    Raises
    ------
    InputError
        If there are no results, or no such way to draw. Data that are gone, damaged, or others
        than were evaluated only cost their figures; the report says so.
    """
    if figures not in get_args(Figures):
        raise InputError(f"figures: expected {' or '.join(get_args(Figures))}, found '{figures}'")
    summaries = {name: one.content() for name, one in texture_summaries(results_folder).items()}
    if summaries:
        _write_textures(results_folder, texture_tables(summaries))
        return write_texture_page(results_folder / PAGE, summaries)
    results = load_results(results_folder)
    pictures, notes = _pictures(results, progress, figures)
    drawn = progress.track(pictures, "drawing", len(pictures))
    save_pictures(drawn, results_folder / "figures")
    write_text(results_folder / TABLE1, to_markdown(table1(results.summary)))
    _write_beside(results_folder / BESIDE, results)
    return write_page(results_folder / PAGE, results, pictures, notes)


def _write_textures(folder: Path, tables: Sequence[Table]) -> None:
    write_text(folder / TEXTURES, "\n".join(map(to_markdown, tables)))


def _write_beside(path: Path, results: Results) -> None:
    """Write our numbers beside the paper's, where textures are its own."""
    tables = [beside_paper(results.summary)]
    if are_published(results.summary):
        tables.append(by_texture_table(results))
    if text := "\n".join(to_markdown(table) for table in tables if table is not None):
        write_text(path, text)


def compare_runs(folders: Sequence[Path]) -> tuple[Table, Path]:
    """Return one table of all runs, Table 1 for a single one, and where it is written.

    Raises
    ------
    InputError
        If there are no results in one of them, two have the same name, or one of several is of
        `--split texture`.
    """
    of_textures = [folder for folder in folders if texture_summaries(folder)]
    if of_textures and len(folders) > 1:
        raise InputError(
            f"{of_textures[0]}: expected results of --split speed, to compare, found results of "
            "--split texture; report them alone"
        )
    if of_textures:
        summaries = {name: one.content() for name, one in texture_summaries(folders[0]).items()}
        return texture_tables(summaries)[0], folders[0] / TEXTURES
    runs = {folder.resolve().name: read_summary(folder).content() for folder in folders}
    if len(runs) < len(folders):
        raise InputError(
            "RESULTS: expected folders of different names, found one name twice; rename one"
        )
    if len(folders) == 1:
        return table1(*runs.values()), folders[0] / TABLE1
    table, path = runs_side_by_side(runs), folders[0] / "runs.md"
    write_text(path, to_markdown(table))
    return table, path


def _pictures(
    results: Results, progress: Progress, figures: Figures
) -> tuple[list[ReportFigure], list[str]]:
    if figures == "report":
        data, notes = figure_data(results, progress)
        return draw_pictures(results, data), notes
    try:
        recordings = _recordings(results, progress)
        data = _read_data(results, recordings, progress)
        paper, notes = paper_data(results, recordings, data), []
    except _UNREADABLE as error:
        data, paper = FigureData(), PaperData(drums=drums(results))
        notes = [_missing(error)]
    return draw_paper_pictures(results, data, paper), notes


def figure_data(results: Results, progress: Progress) -> tuple[FigureData, list[str]]:
    """Read what the figures of the data show; notes say what could not be had."""
    try:
        return _read_data(results, _recordings(results, progress), progress), []
    except _UNREADABLE as error:
        return FigureData(), [_missing(error)]


def _missing(error: Exception) -> str:
    return f"Figures of the data are missing: {error}."


def _recordings(results: Results, progress: Progress) -> list[Responses]:
    """Return the recordings that were evaluated and whose speed is known."""
    config = results.config
    sources = [data["source"] for data in config["data"]]
    opened = open_data(sources, config["without"], keep_going=True, progress=progress)
    if [d.origin.fingerprint for d in opened] != [d["fingerprint"] for d in config["data"]]:
        raise InputError(
            f"{', '.join(sources)}: expected the data that were evaluated, found changed data"
        )
    left_out = {entry["recording"] for entry in results.summary["skipped"]}
    ablation = Ablation(**config.get("ablation", {}))
    everything = with_steady(ablation.recordings(recordings_in(opened)), config.get("steady_s"))
    recordings = [r for r in everything if r.attrs["name"] not in left_out and speed_of(r)]
    if not recordings:
        raise InputError(
            "the data: expected recordings whose speed is known, to show by it, found none"
        )
    return recordings


def _read_data(results: Results, recordings: list[Responses], progress: Progress) -> FigureData:
    config = results.config
    spectra = _spectra(recordings, config, progress)
    example = stretch_example(spectra) if spectra is not None else None
    return FigureData(
        spectra=spectra,
        example=example,
        stretched=_stretched(example) if example else {},
        sa1_images=_middle_images(recordings, dims.SA1),
        ra1_images=_middle_images(recordings, dims.RA1),
        sliding=_sliding(recordings),
    )


def _sliding(recordings: Sequence[Responses]) -> str:
    """Return the one sliding direction that all recordings declare; nothing where they do not."""
    said = {str(conditions(recording).get("direction", "")) for recording in recordings}
    return said.pop() if len(said) == 1 else ""


def _spectra(
    recordings: list[Responses], config: dict[str, Any], progress: Progress
) -> Samples | None:
    with_vibration = [r for r in recordings if dims.RA2 in r]
    if not with_vibration:
        return None
    spectral = as_form(config["spectral"], SpectralEncoding, CONFIG, "spectra of this version")
    source = Source(CHANNELS[dims.RA2], spectral)
    return encode_all(with_vibration, source, config["cut"], progress)


def _stretched(example: StretchExample) -> dict[float, NDArray[np.float32]]:
    return {factor: stretch_spectrum(example.middle.to_numpy(), factor) for factor in FACTORS}


def _middle_images(recordings: list[Responses], channel: str) -> Samples | None:
    """Return a few tactile images from the middle of every recording that has them."""
    parts = []
    for recording in recordings:
        if channel in recording and dims.ROW in recording.coords:
            response = recording[channel].assign_attrs(recording.attrs)
            last = response.sizes[dims.TIME] // 2 + SHOWN_FRAMES
            around = response.isel({dims.TIME: slice(max(0, last - SETTLING_FRAMES), last)})
            shown = slice(-SHOWN_FRAMES, None)
            samples = spatial_samples(fill(around.load()), shown, CHANNELS[channel].lookback)
            # Pixels beside the markers of a layout that is not square show nothing.
            there = covered(response[dims.ROW].values, response[dims.COLUMN].values)
            parts.append(samples.where(xr.DataArray(there, dims=(dims.ROW, dims.COLUMN))))
    return concatenate(parts) if parts else None


def report(results: Place, quiet: bool = False, figures: Figures = "report") -> Path:
    """Write Table 1, figures and a self-contained page from a results folder.

    Parameters
    ----------
    results
        As `evaluate` leaves it.
    figures
        ``paper`` to draw the paper's figures as they are printed (3, 5 to 13), each saying where
        it departs from that; ``report`` for those that suit what was evaluated.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Path
        Of the page, ``report.html``.

    Raises
    ------
    InputError
        If the folder holds no finished evaluation.

    Examples
    --------
    >>> report("results").name
    'report.html'
    """
    with Progress(quiet) as progress:
        return write_report(Path(results), progress, figures)
