"""From a results folder, and the data behind it where they still are, to the report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS
from afferents.choices import Figures
from afferents.documents import as_form
from afferents.encodings.images import spatial_samples
from afferents.encodings.samples import Samples
from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import Source, encode_all, join_recordings, open_data
from afferents.evaluation.results import (
    CONFIG,
    Results,
    load_results,
)
from afferents.files import Place, write_aside, write_text
from afferents.filling import fill
from afferents.folds.ablation import Ablation
from afferents.markers.places import covered
from afferents.progress import Progress
from afferents.reporting.choice import panels_of
from afferents.reporting.comparisons import beside_paper, runs_side_by_side
from afferents.reporting.figures import FigureData, draw_pictures
from afferents.reporting.images import N_FRAMES, SPACINGS, FrameRow
from afferents.reporting.labels import are_published
from afferents.reporting.page import render_report
from afferents.reporting.tables import by_texture_table, short_table1, table1, to_markdown
from afferents.store.responses import Responses, conditions, speed_of
from afferents.store.trimming import with_steady

PAGE, FIRST_TABLE = "report.html", "table1.md"
BESIDE = "beside_paper.md"
SETTLING_FRAMES = 90
"""How many frames before those of Figures 8 and 10 are read, so that a marker that can't be filled
from those round it has a last value to keep."""
FIRST_SHOWN = 2521
"""Video frame with which the paper's Figures 8 and 10 begin (figures.ipynb, cells 7 to 25)."""
_UNREADABLE = (AfferentsError, OSError, ValueError, RuntimeError)
"""What data that are gone, damaged or changed raise; a store's bad chunk is a RuntimeError."""


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
        data, notes = figure_data(evaluated, progress, figures)
        pictures = draw_pictures(evaluated, data, figures)
        for picture in progress.track(pictures, "drawing", len(pictures)):
            with write_aside(folder / "figures" / f"{picture.name}.png") as partial:
                partial.write_bytes(picture.png)
    _write_tables(folder / FIRST_TABLE, table1(evaluated.found))
    beside = [beside_paper(evaluated.found)]
    beside += [by_texture_table(evaluated)] if are_published(evaluated.found) else []
    _write_tables(folder / BESIDE, *beside)
    page = folder / PAGE
    write_text(page, render_report(evaluated, pictures, notes))
    return page


def _write_tables(path: Path, *tables: pd.DataFrame | None) -> None:
    """Write tables as markdown, if there are any."""
    if texts := [to_markdown(table) for table in tables if table is not None]:
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
        return short_table1(*runs.values()), folders[0] / FIRST_TABLE
    table, path = runs_side_by_side(runs), folders[0] / "runs.md"
    _write_tables(path, table)
    return table, path


# What the figures of the data show.


def figure_data(
    results: Results, progress: Progress, style: Figures = "report"
) -> tuple[FigureData, list[str]]:
    """Read what the figures of the data show; notes say what could not be had."""
    notes: list[str] = []
    try:
        recordings = _recordings(results, progress)
        try:
            spectra = _spectra(recordings, results.config, progress)
        except _UNREADABLE as error:  # such as sound shorter than a window
            spectra, notes = None, [f"Figures of spectra are missing: {error}."]
        frames, began = _frames(recordings, results.found.named_by_spacing, style)
        said = {str(conditions(recording).get("direction", "")) for recording in recordings}
        sliding = said.pop() if len(said) == 1 else ""
        return FigureData(spectra, frames, began, sliding), notes
    except _UNREADABLE as error:
        return FigureData(), [f"Figures of the data are missing: {error}."]


def _recordings(results: Results, progress: Progress) -> list[Responses]:
    """Return the recordings that were evaluated and whose speed is known."""
    config = results.config
    sources = [data["source"] for data in config["data"]]
    opened = open_data(sources, config["without"], keep_going=True, progress=progress)
    if [d.origin.fingerprint for d in opened] != [d["fingerprint"] for d in config["data"]]:
        raise InputError(
            f"{', '.join(sources)}: expected the data that were evaluated, found changed data"
        )
    left_out = {entry.recording for entry in results.found.skipped}
    ablation = Ablation(**config.get("ablation", {}))
    everything = with_steady(ablation.recordings(join_recordings(opened)), config.get("steady_s"))
    recordings = [r for r in everything if r.attrs["name"] not in left_out and speed_of(r)]
    if not recordings:
        raise InputError(
            "the data: expected recordings whose speed is known, to show by it, found none"
        )
    return recordings


def _spectra(
    recordings: list[Responses], config: dict[str, Any], progress: Progress
) -> Samples | None:
    with_vibration = [r for r in recordings if dims.RA2 in r]
    if not with_vibration:
        return None
    spectral = as_form(config["spectral"], SpectralEncoding, CONFIG, "spectra of this version")
    source = Source(CHANNELS[dims.RA2], spectral)
    return encode_all(with_vibration, source, config["cut"], progress)


def _frames(
    recordings: Sequence[Responses], by_spacing: bool, style: Figures
) -> tuple[dict[tuple[str, int], list[FrameRow]], str]:
    """Return the rows of Figures 8 and 10, and where their frames begin, in words."""
    rows: dict[tuple[str, int], list[FrameRow]] = {}
    beginnings: set[str] = set()
    for channel in (dims.SA1, dims.RA1):
        able = {
            (str(r.attrs[dims.TEXTURE]), float(speed_of(r) or 0)): r
            for r in reversed(recordings)
            if channel in r and dims.ROW in r.coords
        }
        if not able:
            continue
        for apart in SPACINGS if style == "paper" else (1,):
            rows[channel, apart] = []
            for panel, shown in panels_of(able, by_spacing, style):
                recording = able[shown.texture, shown.speed_mm_s]
                images, time_s, said = _frame_row(recording, channel, apart)
                unit = str(recording[channel].attrs.get(dims.UNITS, dims.PIXELS))
                rows[channel, apart].append(FrameRow(panel, shown, images, time_s, unit))
                beginnings.add(said)
    return rows, " or ".join(sorted(beginnings))


def _frame_row(
    recording: Responses, channel: str, apart: int
) -> tuple[NDArray[np.float32], NDArray[np.float64], str]:
    """Return ten frames, their times (s), and where they begin: as in the paper, or the middle."""
    n, there = (N_FRAMES - 1) * apart + 1, recording.sizes[dims.TIME]
    as_published = there >= FIRST_SHOWN + (N_FRAMES - 1) * max(SPACINGS) + 1
    first = FIRST_SHOWN if as_published else max(1, (there - n) // 2)
    images, last = _images(recording, channel, first, n)[::apart], min(first + n, there)
    time_s = recording[dims.TIME].values[max(0, last - n) : last : apart]
    said = (
        f"at video frame {FIRST_SHOWN} as in the paper"
        if as_published
        else "in the middle of each recording, which is shorter than the paper's"
    )
    return images.values, time_s - time_s[0], said


def _images(recording: Responses, channel: str, first: int, n: int) -> Samples:
    """Return n frames of a channel as images; pixels beside the markers show nothing."""
    response = recording[channel].assign_attrs(recording.attrs)
    read = response.isel({dims.TIME: slice(max(0, first - SETTLING_FRAMES), first + n)})
    kept = slice(max(0, read.sizes[dims.TIME] - n), None)
    samples = spatial_samples(fill(read.load()), kept, CHANNELS[channel].lookback)
    there = covered(response[dims.ROW].values, response[dims.COLUMN].values)
    return samples.where(xr.DataArray(there, dims=(dims.ROW, dims.COLUMN)))
