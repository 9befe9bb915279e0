"""All figures as drawn in the paper, with what each shows in words."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from afferents.core.dims import PIXELS, PIXELS_PER_FRAME
from afferents.core.results import Results
from afferents.core.split import SPEED
from afferents.reporting.confusion import confusion_title
from afferents.reporting.labels import outcomes, source_line
from afferents.reporting.paper.drums import PIECE_MM, DrumView, figure03
from afferents.reporting.paper.frames import FrameRow, frames_figure
from afferents.reporting.paper.matrices import TWICE, matrices_figure
from afferents.reporting.paper.networks import DrawnNetwork, networks_figure
from afferents.reporting.paper.spectra import shown_spectra, spectra_figure
from afferents.reporting.paper.stand_ins import instead_of
from afferents.reporting.pictures import (
    FigureData,
    ReportFigure,
    confusion_pictures,
    draw_pictures,
    in_order_of_paper,
    stretch_picture,
)

_FRAMES = {
    "sa1": ("figure08", "Figure 8", "SA-I", "Displacement of each marker from rest", PIXELS),
    "ra1": ("figure10", "Figure 10", "RA-I", "Change of SA-I of each marker", PIXELS_PER_FRAME),
}
_APART = {20: ("frames 20 apart", "20-apart"), 1: ("frames in a row", "in-a-row")}


@dataclass(frozen=True)
class PaperData:
    """What only the figures as drawn in the paper need; each may be missing.

    Attributes
    ----------
    frames
        Rows of Figures 8 and 10, by channel (`sa1`, `ra1`) and frames from one image to the next.
    began
        Where the first of these frames lies, in words.
    drums
        Of Figure 3.
    networks
        Of Figures 5 (images) and 6 (vibration), by the figure's number.
    """

    frames: Mapping[tuple[str, int], Sequence[FrameRow]] = field(default_factory=dict)
    began: str = ""
    drums: Sequence[DrumView] = ()
    networks: Mapping[int, Sequence[DrawnNetwork]] = field(default_factory=dict)


def draw_paper_pictures(results: Results, data: FigureData, paper: PaperData) -> list[ReportFigure]:
    """Draw the paper's figures in its order, in place of ours of the same numbers.

    Figures of results come first, as in `draw_pictures`; what the paper has no figure of, such as
    matrices of other models, keeps its own.
    """
    source = source_line(results.summary)
    return [
        *draw_pictures(results, FigureData(), with_confusion=False),
        *in_order_of_paper(
            [
                *_drum_picture(paper, source),
                *_network_pictures(paper, source),
                *stretch_picture(data, source),
                *_frame_pictures(paper, source, data.sliding),
                *_spectrum_pictures(data, source),
                *_matrix_pictures(results),
            ]
        ),
    ]


def _drum_picture(paper: PaperData, source: str) -> Iterator[ReportFigure]:
    if paper.drums:
        yield ReportFigure(
            "paper-figure03",
            "Figure 3. Textured drums",
            "Drawn from the surfaces of the simulated rig, where the paper shows photographs: each "
            "drum as seen from afar with its axis across the "
            "picture, lit from the upper left, "
            f"and beneath it {PIECE_MM:g} x {PIECE_MM:g} mm of its surface. Unequal bumps are "
            "errors of printing, as the rig supposes them. All heights have one colour scale.",
            "Pictures of drums with raised bumps, farther apart from one to the next.",
            figure03(paper.drums, source),
        )


def _network_pictures(paper: PaperData, source: str) -> Iterator[ReportFigure]:
    of_what = {5: "Networks of tactile images", 6: "Network of vibration spectra"}
    for number, networks in paper.networks.items():
        title = f"Figure {number}. {of_what[number]}"
        yield ReportFigure(
            f"paper-figure{number:02d}",
            title,
            "Layer by layer, read off the networks as they were built for these data: shape of "
            "what leaves a layer, and its parameters as Keras counts them (with the running means "
            "and variances of batch normalisation). Boxes are the wider the more values leave "
            "them, on a logarithmic scale. The softmax is part of the loss.",
            "Diagram of " + " and ".join(one.title for one in networks) + ", a box for each layer.",
            networks_figure(networks, title, source),
        )


def _frame_pictures(paper: PaperData, source: str, sliding: str) -> Iterator[ReportFigure]:
    for (channel, apart), rows in paper.frames.items():
        name, figure, afferent, what, unit = _FRAMES[channel]
        said, suffix = _APART[apart]
        title = f"{figure}. {afferent} tactile images, {said}"
        drawn = (
            "as the paper's code draws them (its caption says 10)"
            if apart != 1
            else "as the paper's text has them"
        )
        yield ReportFigure(
            f"paper-{name}-{suffix}",
            title,
            f"{what}, {unit}. A: textures a, g and m at 50 mm/s. B: texture g at 10, "
            f"50 and 100 mm/s. {instead_of(row.shown for row in rows)}Ten {said}, {drawn}, "
            f"beginning {paper.began}. All images have one colour scale, which spans what is "
            "shown. Row is the rank of a marker in y, column its rank in x; the paper's images "
            "are the transpose.",
            f"Rows of ten {afferent} tactile images, a row for each texture and speed.",
            frames_figure(rows, title, f"{afferent} ({unit})", source, sliding),
        )


def _spectrum_pictures(data: FigureData, source: str) -> Iterator[ReportFigure]:
    if data.spectra is None:
        return
    shown = [one for row in shown_spectra(data.spectra) for one in row]
    scales = {
        "one-scale": "All panels have one scale of amplitude, as in the paper",
        "own-scales": "Each texture has its own scale of amplitude, so that quiet ones are seen",
    }
    for suffix, scale in scales.items():
        yield ReportFigure(
            f"paper-figure12-{suffix}",
            f"Figure 12. Vibration spectra, {suffix.replace('-', ' ')}",
            "Textures a, g and m; speeds 20, 40, 50, 80 and 100 mm/s, which is what the paper's "
            "figure shows though four of its labels say otherwise. "
            f"{instead_of(shown)}Black: a single window, the middle one, as the paper draws. "
            f"Orange: the mean over windows. {scale}; offset and drift, the lowest hundredth of "
            "the axis, may go beyond it. Frequencies are true; the paper's axis is off by a "
            "factor of two.",
            "Grid of vibration spectra, amplitude against frequency in hertz.",
            spectra_figure(data.spectra, source, one_scale=suffix == "one-scale"),
        )


def _matrix_pictures(results: Results) -> Iterator[ReportFigure]:
    others = {picture.name: picture for picture in confusion_pictures(results)}
    for model, protocol, _ in outcomes(results.summary):
        figure = matrices_figure(results, model, protocol) if results.split == SPEED else None
        usual = f"confusion-{model}-{protocol}"
        if figure is None:
            if usual in others:
                yield others[usual]
            continue
        title = confusion_title(model, protocol, results.summary)
        normalised = (
            "The paper divides its 60 test samples of a texture as if they were 30: what it prints "
            "is twice the percentage and saturates at 50 %. Above, ours as the paper would print "
            "it; below, as it should be."
            if model in TWICE
            else "Divided by each texture's own number of test samples, which is what the paper "
            "prints too (its 2,500 or 250)."
        )
        yield ReportFigure(
            f"paper-{usual}",
            title,
            "Confusion matrices, one a held-out speed: x true, y predicted texture, the first "
            f"at the top left as in print. Titles give the accuracy. {normalised}",
            f"Confusion matrices. {title}.",
            figure,
        )
