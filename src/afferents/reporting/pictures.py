"""All figures of a report: drawn from results and, where given, from samples of the data."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents.dims import NAMED_BY_SPACING
from afferents.encodings.samples import Samples
from afferents.evaluation.results import Results
from afferents.files import write_aside
from afferents.folds.held_out import SPEED
from afferents.reporting.accuracy_figures import (
    by_texture_figure,
    has_lengths,
    has_reliability,
    lengths_figure,
    reliability_figure,
    scaled,
    speed_figure,
)
from afferents.reporting.confusion import LEAST_WRITTEN, confusion_figure, confusion_title
from afferents.reporting.images import figure08, figure10
from afferents.reporting.labels import are_published, drawn_over, outcomes, percent, source_line
from afferents.reporting.spectra import StretchExample, figure07, figure12
from afferents.reporting.style import png_bytes


@dataclass(frozen=True)
class FigureData:
    """What the figures of the data are drawn from; each may be missing.

    Attributes
    ----------
    spectra
        Vibration spectra, dims (sample, channel, frequency): Figure 12.
    example, stretched
        From `stretch_example`, and its `middle` stretched by each of `FACTORS`: Figure 7.
    sa1_images, ra1_images
        Tactile images, dims (sample, row, column): Figures 8 and 10.
    sliding
        Sliding direction in the camera's view; empty where nothing declares one.
    """

    spectra: Samples | None = None
    example: StretchExample | None = None
    stretched: Mapping[float, NDArray[np.float32]] = field(default_factory=dict)
    sa1_images: Samples | None = None
    ra1_images: Samples | None = None
    sliding: str = ""


@dataclass(frozen=True)
class ReportFigure:
    """A figure with what stands beside it: a file name, a title, a caption, and what it shows.

    `description` is read out to those who cannot see the figure.
    """

    name: str
    title: str
    caption: str
    description: str
    figure: Figure

    @cached_property
    def png(self) -> bytes:
        """The figure as the content of a PNG file, drawn once."""
        return png_bytes(self.figure)


def save_pictures(pictures: Iterable[ReportFigure], folder: Path) -> list[Path]:
    """Write every picture to `folder/<name>.png` and return the paths."""
    paths = []
    for picture in pictures:
        path = folder / f"{picture.name}.png"
        with write_aside(path) as partial:
            partial.write_bytes(picture.png)
        paths.append(path)
    return paths


def draw_pictures(
    results: Results, data: FigureData, with_confusion: bool = True
) -> list[ReportFigure]:
    """Draw every figure that the results and the data allow, in the order of the report.

    Those of results come first, then those that the paper has too, in its order, then the rest.

    Parameters
    ----------
    with_confusion
        Whether confusion matrices are drawn.
    """
    source = source_line(results.summary)
    of_paper = [
        *stretch_picture(data, source),
        *_spectrum_picture(data, source),
        *_image_pictures(data, source),
        *(confusion_pictures(results) if with_confusion else ()),
    ]
    return [
        *_speed_picture(results),
        *_lengths_picture(results),
        *_texture_picture(results),
        *_reliability_picture(results),
        *in_order_of_paper(of_paper),
    ]


def in_order_of_paper(pictures: Iterable[ReportFigure]) -> list[ReportFigure]:
    """Return figures by their numbers in the paper, then those that have none."""
    return sorted(pictures, key=_number_in_paper)


def _number_in_paper(picture: ReportFigure) -> tuple[float, str]:
    """Sort key: the figure's number in the paper, then its letter; what has none comes last."""
    found = re.match(r"Figure (\d+)([A-Z]?)\.", picture.title)
    return (int(found[1]), found[2]) if found else (math.inf, "")


def _marks(results: Results, nested: str = "", published: str = "") -> str:
    """Return what the marks of the protocols that there are stand for."""
    there = {protocol for _, protocol, _ in outcomes(results.summary)}
    filled = f"Filled: nested protocol{nested}. " if "nested" in there else ""
    return filled + (f"Open: published protocol{published}. " if "published" in there else "")


def _speed_picture(results: Results) -> Iterator[ReportFigure]:
    split = results.split
    crosses = split == SPEED and are_published(results.summary)
    bars = any(found.get(split.ci95_by) for _, _, found in outcomes(results.summary))
    yield ReportFigure(
        f"accuracy-by-{split.leaks}",
        f"Accuracy by held-out {split.name}",
        _marks(
            results,
            f", where nothing of the held-out {split.name} was seen",
            f", where the other half of that {split.name} picked the model",
        )
        + (f"Bars: 95% intervals, drawn over {drawn_over(results.summary)}. " if bars else "")
        + ("Crosses: the paper, measured on its own recordings. " if crosses else "")
        + "The dashed line is chance.",
        f"Line chart of accuracy in percent against held-out {split.name}, a panel for each model. "
        "The same numbers stand in the table above.",
        speed_figure(results.summary),
    )


def _lengths_picture(results: Results) -> Iterator[ReportFigure]:
    if has_lengths(results.summary):
        yield ReportFigure(
            "accuracy-by-length",
            "Accuracy by length of window",
            f"Mean over what was held out, against the frames of a window. {_marks(results)}"
            f"Bars: 95% intervals, drawn over "
            f"{drawn_over(results.summary)}. The dashed line is chance.",
            "Line chart of accuracy in percent against frames of a window, a panel for each model. "
            "The same numbers stand in the table above.",
            lengths_figure(results.summary),
        )


def _texture_picture(results: Results) -> Iterator[ReportFigure]:
    crosses = results.split == SPEED and are_published(results.summary)
    yield ReportFigure(
        "accuracy-by-texture",
        "Accuracy by texture",
        f"Share of each texture's test samples named rightly, mean over held-out "
        f"{results.split.many}. {_marks(results)}"
        + ("Crosses: the paper, from the diagonals of its matrices. " if crosses else "")
        + "The dashed line is chance.",
        "Chart of accuracy in percent against texture, a panel for each model. The same numbers "
        "stand in a table above.",
        by_texture_figure(results),
    )


def _reliability_picture(results: Results) -> Iterator[ReportFigure]:
    if has_reliability(results.summary):
        yield ReportFigure(
            "reliability",
            "Right as often as it says?",
            "Reliability diagram: test samples gathered by confidence, the probability of what "
            "they are named, in bins of equal width. The area of a mark is its share of the "
            "samples. On the dashed line a model is right as often as it says; below it is too "
            "sure, above too modest. ECE: expected calibration error. "
            f"{scaled(results.summary)}",
            "Line chart of accuracy against confidence, both in percent, a panel for each model. "
            "The calibration errors stand in the table above.",
            reliability_figure(results.summary),
        )


def confusion_pictures(results: Results) -> Iterator[ReportFigure]:
    """Draw the confusion matrices of every model and protocol."""
    for model, protocol, found in outcomes(results.summary):
        figure = confusion_figure(results, model, protocol)
        if figure is None:
            continue
        title = confusion_title(model, protocol, results.summary)
        yield ReportFigure(
            f"confusion-{model}-{protocol}",
            title,
            f"Confusion matrices, one a held-out {results.split.name}: x true, y predicted "
            "texture. Every column is in percent of that texture's own test samples, so it sums to "
            "100 %; grey columns have none. Titles give the accuracy. Where cells are large enough "
            f"to be read, those of {LEAST_WRITTEN:g} % and more carry their number.",
            f"Confusion matrices. {title}. Mean accuracy over held-out {results.split.many} "
            f"{percent(found['mean_accuracy'])} percent.",
            figure,
        )


def stretch_picture(data: FigureData, source: str) -> Iterator[ReportFigure]:
    """Draw Figure 7, where some texture has a speed, its half and its double."""
    if data.example is not None:
        yield ReportFigure(
            "figure07",
            "Figure 7. Stretching a spectrum to another speed",
            "A spectrum stretched by 0.5 and by 2 (colour) beside those recorded at half and at "
            "twice the speed (black). Means over the windows of the condition, true frequency "
            "axis. Each panel has its own scale of amplitude, since faster sliding is louder. The "
            "stretched copies are rebinned, as under the nested protocol; the published "
            "protocol resamples by Fourier transform, which rings.",
            "Three panels of amplitude against frequency: half the speed, the speed, twice it.",
            figure07(data.example, data.stretched, source),
        )


def _spectrum_picture(data: FigureData, source: str) -> Iterator[ReportFigure]:
    if data.spectra is not None:
        misprint = (
            " Frequency and speed are those of the recordings: the paper's own figure has its "
            "frequency axis off by a factor of two and four of its five speeds mislabelled."
        ) * bool(data.spectra.attrs.get(NAMED_BY_SPACING))
        yield ReportFigure(
            "figure12",
            "Figure 12. Vibration spectra",
            f"Rows are textures, columns speeds; mean over windows and channels.{misprint}",
            "Grid of vibration spectra, amplitude against frequency in hertz.",
            figure12(data.spectra, source),
        )


def _image_pictures(data: FigureData, source: str) -> Iterator[ReportFigure]:
    arrow = "; the arrow is the sliding direction" if data.sliding else ""
    layout = (
        "First: textures by speed, the middle frame of each. Then consecutive frames of one "
        f"recording. Row is the rank of a marker in y, column its rank in x{arrow}. Each texture "
        "has a colour scale of its own, to the right of its row, as have the consecutive frames: "
        "compare colours along a row, not between rows."
    )
    if data.sa1_images is not None:
        yield ReportFigure(
            "figure08",
            "Figure 8. SA-I tactile images",
            f"Displacement of each marker from rest, px. {layout}",
            "Grid of SA-I tactile images for several textures and speeds.",
            figure08(data.sa1_images, source, data.sliding),
        )
    if data.ra1_images is not None:
        yield ReportFigure(
            "figure10",
            "Figure 10. RA-I tactile images",
            f"Change of SA-I of each marker, px a frame. {layout}",
            "Grid of RA-I tactile images for several textures and speeds.",
            figure10(data.ra1_images, source, data.sliding),
        )
