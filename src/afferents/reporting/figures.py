"""All figures of a report: drawn from results and, where given, from samples of the data."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from afferents import dims
from afferents.choices import Figures
from afferents.encodings.samples import Samples
from afferents.evaluation.results import Results
from afferents.reporting.accuracy import accuracy_pictures
from afferents.reporting.choice import instead_of
from afferents.reporting.confusion import (
    LEAST_WRITTEN,
    TWICE,
    confusion_figure,
    confusion_title,
    is_in_paper,
)
from afferents.reporting.images import FrameRow, images_figure
from afferents.reporting.labels import outcomes, percent, source_line
from afferents.reporting.spectra import (
    shown_spectra,
    spectra_figure,
    stretch_example,
    stretch_figure,
)
from afferents.reporting.style import ReportFigure

_OF_CHANNEL = {
    dims.SA1: ("figure08", "Figure 8", "SA-I", "How far each {} is from rest, {}"),
    dims.RA1: ("figure10", "Figure 10", "RA-I", "Change of SA-I of each {}, {}"),
}
"""Name, number, afferent and response of the figures of tactile images."""
_APART = {
    20: ("frames 20 apart", "20-apart", "as the paper's code draws them (its caption says 10)"),
    1: ("frames in a row", "in-a-row", "as the paper's text has them"),
}


@dataclass(frozen=True)
class FigureData:
    """What the figures of the data are drawn from; each may be missing.

    Attributes
    ----------
    spectra
        Vibration spectra, dims (sample, channel, frequency): Figures 7 and 12.
    frames
        Rows of Figures 8 and 10, by channel (`sa1`, `ra1`) and frames from one image to the next.
    began
        Where the first of these frames lies, in words.
    sliding
        Sliding direction in the camera's view; empty where nothing declares one.
    """

    spectra: Samples | None = None
    frames: Mapping[tuple[str, int], Sequence[FrameRow]] = field(default_factory=dict)
    began: str = ""
    sliding: str = ""


def draw_pictures(
    results: Results, data: FigureData, style: Figures = "report"
) -> list[ReportFigure]:
    """Draw every figure that the results and the data allow, in the order of the report.

    Those of results come first, then those that the paper has too, in its order, then the rest.

    Parameters
    ----------
    style
        `paper` draws the paper's figures as they are printed, in place of ours of the same numbers;
        what the paper has no figure of, such as matrices of other models, keeps its own.
    """
    source = source_line(results.found)
    of_paper = [
        *_stretch_picture(data, source),
        *_spectra_picture(data, source, style),
        *_image_pictures(data, source, style),
        *_confusion_pictures(results, style),
    ]
    return [
        *accuracy_pictures(results),
        *sorted(of_paper, key=_number_in_paper),
    ]


def _number_in_paper(picture: ReportFigure) -> tuple[float, str]:
    """Sort key: the figure's number in the paper, then its letter; what has none comes last."""
    found = re.match(r"Figure (\d+)([A-Z]?)\.", picture.title)
    return (int(found[1]), found[2]) if found else (math.inf, "")


def _confusion_pictures(results: Results, style: Figures) -> Iterator[ReportFigure]:
    """Draw the confusion matrices of every model and protocol."""
    for model, protocol, found in outcomes(results.found):
        printed = style == "paper" and is_in_paper(model, results.found)
        figure = confusion_figure(results, model, protocol, "paper" if printed else "report")
        if figure is None:
            continue
        title = confusion_title(model, protocol, results.found)
        yield ReportFigure(
            f"{'paper-' * printed}confusion-{model}-{protocol}",
            title,
            _printed_matrices(model) if printed else _matrices(results),
            f"Confusion matrices. {title}. Mean accuracy over held-out {results.split.many} "
            f"{percent(found.mean_accuracy)} percent.",
            figure,
        )


def _matrices(results: Results) -> str:
    return (
        f"Confusion matrices, one a held-out {results.split.title}: x true, y predicted texture. "
        "Every column is in percent of that texture's own test samples, so it sums to 100%; grey "
        "columns have none. Titles give the accuracy. Where cells are large enough to be read, "
        f"those of {LEAST_WRITTEN:g}% and more carry their number."
    )


def _printed_matrices(model: str) -> str:
    normalised = (
        "The paper divides its 60 test samples of a texture as if they were 30: what it prints is "
        "twice the percentage and saturates at 50%. Above, ours as the paper would print it; "
        "below, as it should be."
        if model in TWICE
        else "Divided by each texture's own number of test samples, which is what the paper prints "
        "too (its 2,500 or 250)."
    )
    return (
        "Confusion matrices, one a held-out speed: x true, y predicted texture, the first at the "
        f"top left as in print. Titles give the accuracy. {normalised}"
    )


def _stretch_picture(data: FigureData, source: str) -> Iterator[ReportFigure]:
    """Draw Figure 7, where some texture has a speed, its half and its double."""
    example = None if data.spectra is None else stretch_example(data.spectra)
    if example is not None:
        yield ReportFigure(
            "figure07",
            "Figure 7. Stretching a spectrum to another speed",
            "A spectrum stretched by 0.5 and by 2 (colour) beside those recorded at half and at "
            "twice the speed (black). Means over the windows of the condition, true frequency "
            "axis. Each panel has its own scale of amplitude, since faster sliding is louder. The "
            "stretched copies are rebinned, as under the nested protocol; the published "
            "protocol resamples by Fourier transform, which rings.",
            "Three panels of amplitude against frequency: half the speed, the speed, twice it.",
            stretch_figure(example, source),
        )


def _spectra_picture(data: FigureData, source: str, style: Figures) -> Iterator[ReportFigure]:
    if data.spectra is None:
        return
    name, shown = "figure12", "Rows are textures, columns speeds. "
    scale = "Each texture has its own scale of amplitude, so that quiet ones are seen"
    true = (
        " Frequency and speed are those of the recordings: the paper's own figure has its "
        "frequency axis off by a factor of two and four of its five speeds mislabelled."
    ) * bool(data.spectra.attrs.get(dims.NAMED_BY_SPACING) or style == "paper")
    if style == "paper":
        every = [one for row in shown_spectra(data.spectra, style) for one in row]
        name, scale = "paper-figure12", "All panels have one scale of amplitude, as in the paper"
        shown = (
            "Textures a, g and m; speeds 20, 40, 50, 80 and 100 mm/s, which is what the paper's "
            f"figure shows though four of its labels say otherwise. {instead_of(every)}"
        )
    yield ReportFigure(
        name,
        "Figure 12. Vibration spectra",
        f"{shown}Black: a single window of one channel (the paper draws one, too), the middle one. "
        f"Orange: the mean over windows and channels. {scale}; offset and drift, the lowest "
        f"hundredth of the axis, may go beyond it.{true}",
        "Grid of vibration spectra, amplitude against frequency in hertz.",
        spectra_figure(data.spectra, source, style),
    )


def _image_pictures(data: FigureData, source: str, style: Figures) -> Iterator[ReportFigure]:
    printed = style == "paper"
    for (channel, apart), rows in data.frames.items():
        name, number, afferent, what = _OF_CHANNEL[channel]
        unit = rows[0].unit
        part = "cell" if unit.startswith(dims.GREY_LEVELS) else "marker"
        title, (frames, suffix, why) = f"{number}. {afferent} tactile images", _APART[apart]
        panels = "A: textures at one speed, or near it. B: one texture at several speeds"
        scale = (
            "Each recording has a colour scale of its own, to the right of its row: compare "
            "colours along a row, not between rows. It goes from the 1st to the 99th percentile"
        )
        if printed:
            name, title, frames = f"paper-{name}-{suffix}", f"{title}, {frames}", f"{frames}, {why}"
            panels = "A: textures a, g and m at 50 mm/s. B: texture g at 10, 50 and 100 mm/s"
            scale = "All images have one colour scale, 1st to 99th percentile of what is shown"
        yield ReportFigure(
            name,
            title,
            f"{what.format(part, unit)}. {panels}. {instead_of(row.shown for row in rows)}Ten "
            f"{frames}, beginning {data.began}. {scale}. Row is the rank of a {part} in y, column "
            "its rank in x; the paper's images are the transpose.",
            f"Rows of ten {afferent} tactile images, a row for each texture and speed.",
            images_figure(rows, channel, title, source, data.sliding, one_scale=printed),
        )
