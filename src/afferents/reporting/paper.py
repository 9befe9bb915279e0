"""All figures as drawn in the paper, with what each shows in words."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from afferents import dims
from afferents.channels import CHANNELS, fill
from afferents.dims import PIXELS, PIXELS_PER_FRAME
from afferents.encodings.images import spatial_samples
from afferents.encodings.settings import ENCODINGS
from afferents.errors import InputError
from afferents.evaluation.results import Results
from afferents.folds.held_out import SPEED
from afferents.markers.places import covered
from afferents.models.classifiers import build, classifier_of
from afferents.models.layers import count_parameters
from afferents.models.model import MODELS, TABLE1
from afferents.models.shapes import layer_shapes, written_shape
from afferents.reporting.choice import PANELS, Shown, instead_of, shown_for
from afferents.reporting.confusion import TWICE, confusion_title, matrices_figure
from afferents.reporting.drawings import (
    PIECE_MM,
    DrawnLayer,
    DrawnNetwork,
    DrumView,
    figure03,
    networks_figure,
)
from afferents.reporting.images import N_FRAMES, SPACINGS, FrameRow, frames_figure
from afferents.reporting.labels import outcomes, source_line, texture_labels, texture_letter
from afferents.reporting.pictures import (
    FigureData,
    ReportFigure,
    confusion_pictures,
    draw_pictures,
    in_order_of_paper,
    stretch_picture,
)
from afferents.reporting.spectra import shown_spectra, spectra_figure
from afferents.rig.surface import bumped_surface
from afferents.store.recording import spacing_mm
from afferents.store.responses import Responses, speed_of

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


# What the figures as drawn in the paper show: of the data, the networks and the rig.

FIRST_SHOWN = 2521
"""Video frame with which the paper's Figures 8 and 10 begin (figures.ipynb, cells 7 to 25)."""
SETTLING_FRAMES = 90
"""Frames before the first shown that are read, so that a lost marker can be held."""


def paper_data(results: Results, recordings: Sequence[Responses], data: FigureData) -> PaperData:
    """Gather what the paper's figures show of an evaluation.

    Parameters
    ----------
    results
        Of the evaluation.
    recordings
        That were evaluated; their speeds are known.
    data
        What was read for our own figures.
    """
    frames: dict[tuple[str, int], list[FrameRow]] = {}
    beginnings: set[str] = set()
    for channel in (dims.SA1, dims.RA1):
        able = {
            (str(r.attrs[dims.TEXTURE]), float(speed_of(r) or 0)): r
            for r in reversed(recordings)
            if channel in r and dims.ROW in r.coords
        }
        for apart in SPACINGS if able else ():
            rows, said = _rows(able, channel, apart, results.summary)
            frames[channel, apart] = rows
            beginnings |= said
    return PaperData(
        frames, " or ".join(sorted(beginnings)), drums(results), networks(results, data)
    )


def _rows(
    recordings: Mapping[tuple[str, float], Responses],
    channel: str,
    apart: int,
    summary: Mapping[str, Any],
) -> tuple[list[FrameRow], set[str]]:
    rows, beginnings = [], set()
    for panel, wanted in PANELS.items():
        for shown in shown_for(wanted, recordings, summary):
            recording = recordings[shown.texture, shown.speed_mm_s]
            row, said = _row(panel, shown, recording, channel, apart)
            rows.append(row)
            beginnings.add(said)
    return rows, beginnings


def _row(
    panel: str, shown: Shown, recording: Responses, channel: str, apart: int
) -> tuple[FrameRow, str]:
    """Return ten frames of a recording, and where they begin: as in the paper, or in the middle."""
    response = recording[channel].assign_attrs(recording.attrs)
    length, n = (N_FRAMES - 1) * apart + 1, response.sizes[dims.TIME]
    as_published = n >= FIRST_SHOWN + (N_FRAMES - 1) * max(SPACINGS) + 1
    first = FIRST_SHOWN if as_published else max(1, (n - length) // 2)
    read = response.isel({dims.TIME: slice(max(0, first - SETTLING_FRAMES), first + length)})
    kept = slice(max(0, read.sizes[dims.TIME] - length), None)
    samples = spatial_samples(fill(read.load()), kept, CHANNELS[channel].lookback)
    # Pixels beside the markers of a layout that is not square show nothing.
    there = covered(response[dims.ROW].values, response[dims.COLUMN].values)
    values = np.where(there, samples.values[::apart], np.float32(np.nan))
    time_s = read[dims.TIME].values[kept][::apart]
    said = (
        f"at video frame {FIRST_SHOWN} as in the paper"
        if as_published
        else ("in the middle of each recording, which is shorter than the paper's")
    )
    return FrameRow(panel, shown, values, time_s - time_s[0]), said


def drums(results: Results) -> list[DrumView]:
    """Return the rig's drums of those textures that are of the paper's series."""
    found, summary = [], results.summary
    for texture in results.textures:
        spacing = spacing_mm(texture)
        if texture_letter(texture, summary) is None or spacing is None:
            continue
        surface = bumped_surface(spacing)
        name = texture_labels([texture], summary)[texture]
        found.append(DrumView(name, surface.height_mm, surface.length_mm, surface.width_mm))
    return found


def networks(results: Results, data: FigureData) -> dict[int, list[DrawnNetwork]]:
    """Return the paper's networks as they are built for samples of these data.

    Those of images by 5, those of vibration by 6; what the data have no samples of is left out.
    """
    found: dict[int, list[DrawnNetwork]] = {}
    shapes = _sample_shapes(results, data)
    n_textures = len(results.textures)
    titles: dict[str, list[str]] = {}
    for model in TABLE1.values():
        titles.setdefault(str(model.classifier), []).append(model.title)
    for name in TABLE1:
        model = MODELS[name]
        shape = shapes.get(str(model.encoding))
        kind = classifier_of(model.classifier)
        title = ", ".join(titles[str(model.classifier)])
        figure = 6 if ENCODINGS[str(model.encoding)].of_vibration else 5
        if shape is None or any(one.title == title for one in found.get(figure, ())):
            continue
        try:
            network = build(kind, n_textures, shape)
        except InputError:
            continue  # samples too small for it: it was not evaluated either
        layers = tuple(DrawnLayer(*layer) for layer in layer_shapes(network, shape))
        entered = (
            " x ".join(map(str, shape)) if figure == 5 else written_shape((shape[0], 1, shape[1]))
        )
        found.setdefault(figure, []).append(
            DrawnNetwork(title, entered, layers, *count_parameters(network))
        )
    return found


def _sample_shapes(results: Results, data: FigureData) -> dict[str, tuple[int, ...]]:
    """Return the shape of one sample of each of the paper's encodings that the data have."""
    shapes: dict[str, tuple[int, ...]] = {}
    images = data.sa1_images if data.sa1_images is not None else data.ra1_images
    if images is not None:
        size = tuple(images.shape[1:])
        frames = int(results.config.get("spatiotemporal", {}).get("frames", N_FRAMES))
        shapes |= {"spatial": size, "spatiotemporal": (frames, *size)}
    if data.spectra is not None:
        kept = int(results.config["spectral"]["model_bins"])
        bins = min(kept, data.spectra.sizes[dims.FREQUENCY])
        shapes["spectral"] = (data.spectra.sizes[dims.CHANNEL], bins)
    return shapes
