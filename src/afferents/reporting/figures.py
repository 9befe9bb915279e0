"""All figures of a report: drawn from results and, where given, from samples of the data."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from matplotlib.figure import Figure

from afferents import dims
from afferents.choices import Figures
from afferents.encodings.samples import Samples
from afferents.evaluation.results import Results
from afferents.models.shapes import LayerShape
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
from afferents.reporting.style import LINE, ReportFigure, new_figure, styled

_OF_CHANNEL = {
    dims.SA1: ("figure08", "Figure 8", "SA-I", "Displacement of each marker from rest, px"),
    dims.RA1: ("figure10", "Figure 10", "RA-I", "Change of SA-I of each marker, px/frame"),
}
"""Name, number, afferent and response of the figures of tactile images."""
_APART = {
    20: ("frames 20 apart", "20-apart", "as the paper's code draws them (its caption says 10)"),
    1: ("frames in a row", "in-a-row", "as the paper's text has them"),
}


class DrawnNetwork(NamedTuple):
    """A network: its title, what enters it, its layers, and its parameters in all."""

    title: str
    input_shape: str
    layers: Sequence[LayerShape]
    n_parameters: int
    n_trainable: int


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
    networks
        Of Figures 5 (images) and 6 (vibration), as printed, by the figure's number.
    """

    spectra: Samples | None = None
    frames: Mapping[tuple[str, int], Sequence[FrameRow]] = field(default_factory=dict)
    began: str = ""
    sliding: str = ""
    networks: Mapping[int, Sequence[DrawnNetwork]] = field(default_factory=dict)


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
    printed = style == "paper"
    of_paper = [
        *(_network_pictures(data, source) if printed else ()),
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
        f"Confusion matrices, one a held-out {results.split.name}: x true, y predicted texture. "
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
            f"{what}. {panels}. {instead_of(row.shown for row in rows)}Ten {frames}, beginning "
            f"{data.began}. {scale}. Row is the rank of a marker in y, column its rank in x; the "
            f"paper's images are the transpose.",
            f"Rows of ten {afferent} tactile images, a row for each texture and speed.",
            images_figure(rows, channel, title, source, data.sliding, one_scale=printed),
        )


def _network_pictures(data: FigureData, source: str) -> Iterator[ReportFigure]:
    of_what = {5: "Networks of tactile images", 6: "Network of vibration spectra"}
    for number, networks in data.networks.items():
        title = f"Figure {number}. {of_what[number]}"
        yield ReportFigure(
            f"paper-figure{number:02d}",
            title,
            "Layer by layer, read off the networks as they were built for these data: shape of "
            "what leaves a layer, and its parameters as Keras counts them (with the running means "
            "and variances of batch normalisation). The softmax is part of the loss.",
            "Layers of " + " and ".join(one.title for one in networks) + ", a line for each.",
            networks_figure(networks, title, source),
        )


# Figures 5 and 6: the networks layer by layer, as they were built for the data.
#
# What a layer is, the shape that leaves it and how many parameters it has come from the network
# itself; nothing of them is written here.


@styled
def networks_figure(networks: Sequence[DrawnNetwork], title: str, source: str) -> Figure:
    """Draw networks side by side, each a column of layers from the input down."""
    longest = max(len(network.layers) for network in networks)
    size = max(4.2 * len(networks), 5.6), 0.225 * (longest + 3) + 1.0
    figure = new_figure(*size, title, source)
    panels = figure.subplots(1, len(networks), squeeze=False)[0]
    for axes, network in zip(panels, networks, strict=True):
        axes.set_axis_off()
        axes.set_title(network.title, loc="left", fontweight="bold", fontsize=9.5)
        layers = [(one.title, one.shape, f"{one.n_parameters:,}") for one in network.layers]
        n, trainable = f"{network.n_parameters:,}", f"in all; {network.n_trainable:,} are trainable"
        table = axes.table(
            [("input", network.input_shape, ""), *layers, ("", trainable, n)],
            colLabels=("layer", "output", "parameters"), colWidths=(0.42, 0.38, 0.2),
            cellLoc="right", colLoc="right", edges="horizontal", bbox=(0, 0, 1, 1),
        )  # fmt: skip
        table.auto_set_font_size(False)
        for (_, column), cell in table.get_celld().items():
            cell.set(edgecolor=LINE, linewidth=0.5)
            cell.set_text_props(fontsize=8, ha="right" if column else "left")
    return figure
