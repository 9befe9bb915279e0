"""What is in a store of responses, and how steady its tactile images are.

The paper writes of its tactile images that those of SA-I stay nearly the same while a texture
slides past, and those of RA-I change. Put as a number: the correlation, over markers, of an image
with that of the same recording 20 frames (0.22 s) later, as far apart as its Figures 8 and 10 show
them.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents import dims
from afferents.evaluation.data import share_lost, summarise_lost
from afferents.extraction.copies import make_notes
from afferents.inspection.files import PICTURED_S, RESPONSES, Inspection, draw_vibration
from afferents.recordings.data_set import DataSet
from afferents.reporting import recording_figures, style, text
from afferents.store.motion import series_sentences
from afferents.store.responses import Responses, named_by_spacing, speed_of

STEADINESS = "steadiness.png"
MOST_LOST = 0.01
"""Share of marker positions lost beyond which a recording is named."""
APART = 20
"""Frames between the two images, as in the paper's Figures 8 and 10."""
LOOKED_AT = 900
"""Most frames of a recording that are looked at, from its middle: 10 s at 90 frames/s."""
_FEWEST = 3
"""Markers that both images must show."""


def steadiness(response: NDArray[np.floating], apart: int = APART) -> float:
    """Return the mean correlation of images with those some frames later.

    Parameters
    ----------
    response
        Of a channel, (time, marker); NaN where a marker was lost.
    apart
        Frames between the two images.

    Returns
    -------
    Mean over frames of Pearson's correlation over the markers that both images show, -1 to 1: near
    1 where images stay the same, near 0 where they change entirely. NaN where there are fewer than
    `apart` + 1 frames, or images that are the same everywhere.
    """
    values = response.astype(np.float64)
    earlier, later = values[:-apart], values[apart:]
    used = np.isfinite(earlier + later).sum(axis=1) >= _FEWEST
    one, other = pd.DataFrame(earlier[used]), pd.DataFrame(later[used])
    with np.errstate(invalid="ignore"):  # of images that are the same everywhere
        return float(one.corrwith(other, axis=1).mean())


def measure_steadiness(recordings: Sequence[Responses]) -> list[dict[str, str | float | None]]:
    """Return how steady SA-I and RA-I images of each recording are, in the middle of it.

    Returns
    -------
    list of dict
        ``recording``, ``texture``, ``speed_mm_s`` (None where not known), ``named_by_spacing``
        (where textures are), ``sa1`` and ``ra1``, the correlations; recordings without markers, or
        too short for a number, are left out.
    """
    found: list[dict[str, str | float | None]] = []
    for responses in recordings:
        if dims.SA1 not in responses or dims.RA1 not in responses:
            continue
        first = max(0, (responses.sizes[dims.TIME] - LOOKED_AT) // 2)
        middle = responses.isel({dims.TIME: slice(first, first + LOOKED_AT)})
        # Time first: in a store dims have an order, but nothing forces it on other sources.
        values = {
            name: steadiness(middle[name].transpose(dims.TIME, ...).values)
            for name in (dims.SA1, dims.RA1)
        }
        if np.isfinite(list(values.values())).all():
            found.append({
                "recording": str(responses.attrs["name"]),
                "texture": str(responses.attrs[dims.TEXTURE]),
                "speed_mm_s": speed_of(responses),
                **named_by_spacing([responses]),
                **values,
            })  # fmt: skip
    return found


def inspect_responses(
    source: str, data_set: DataSet, recordings: Sequence[Responses], out: Path
) -> Inspection:
    """Report what responses a data set holds, and how steady its tactile images are."""
    found = Inspection(source, facts={"config": dict(data_set.config())})
    names = sorted({str(name) for r in recordings for name in r.data_vars})
    held = f"{data_set.title} of {len(recordings)} recordings with {', '.join(names)}."
    found.add("Recordings", [held])
    notes = make_notes({str(r.attrs["name"]): r.attrs for r in recordings})
    found.add("Extraction", notes.sentences)
    found.add("Motion", [*series_sentences(recordings), *notes.of_force])
    lost = {
        str(responses.attrs["name"]): share_lost(responses[dims.DETECTED], responses.attrs)
        for responses in recordings
        if dims.DETECTED in responses
    }
    found.add("Markers", [text.describe_lost(summarise_lost(lost))])
    found.problems += [
        f"{name}: {100 * share:.1f}% of marker positions are lost."
        for name, share in lost.items()
        if share > MOST_LOST
    ]
    if rows := measure_steadiness(recordings):
        found.facts["steadiness"] = rows
        found.add("Steadiness", [recording_figures.steadiness_sentence(rows, APART)])
        figure = recording_figures.steadiness_figure(
            rows, APART, f"{source}, middle of each recording"
        )
        found.pictures = [style.save_figure(figure, out / STEADINESS)]
    if recordings:
        found.pictures += draw_responses(recordings[len(recordings) // 2], source, out)
    return found


def draw_responses(responses: Responses, source: str, out: Path) -> list[Path]:
    """Draw the first seconds of one recording, as of a clip and a sound."""
    name, pictures = f"{source}, {responses.attrs['name']}", []
    if dims.SA1 in responses and dims.RA1 in responses:
        times = responses[dims.TIME].values
        part = responses.isel({dims.TIME: times < times[0] + PICTURED_S})
        figure = recording_figures.responses_figure(part[dims.SA1], part[dims.RA1], name)
        pictures.append(style.save_figure(figure, out / RESPONSES))
    if dims.RA2 in responses:
        pictures.append(draw_vibration(responses[dims.RA2], name, out))
    return pictures
