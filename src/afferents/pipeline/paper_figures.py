"""What the figures as drawn in the paper show: of the data, the networks and the rig."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from afferents.channels import CHANNELS, fill
from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.model import MODELS, TABLE1
from afferents.core.recording import spacing_mm
from afferents.core.responses import Responses, speed_of
from afferents.core.results import Results
from afferents.encodings import ENCODINGS, covered, spatial_samples
from afferents.models import build, classifier_of, count_parameters, layer_shapes, written_shape
from afferents.reporting import FigureData
from afferents.reporting.paper import (
    PANELS,
    DrawnLayer,
    DrawnNetwork,
    DrumView,
    FrameRow,
    PaperData,
    Shown,
    shown_for,
)
from afferents.reporting.paper.frames import N_FRAMES, SPACINGS
from afferents.reporting.texture_names import texture_labels, texture_letter
from afferents.rig import bumped_surface

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
