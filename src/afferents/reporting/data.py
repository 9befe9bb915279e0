"""What figures of the data show: which textures and speeds, and their spectra and images.

They are read from the data behind a results folder, where these still are what was evaluated. Where
a figure cannot show all textures and speeds it shows some, spread over what there is; drawn as in
the paper, the paper's own or what stands in for them.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import channels, choices, dims, documents, filling
from afferents.encodings.images import spatial_samples
from afferents.encodings.samples import Samples
from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import AfferentsError, InputError
from afferents.evaluation.data import Source, encode_all, join_recordings, open_data
from afferents.evaluation.results import CONFIG, Results
from afferents.folds.ablation import Ablation
from afferents.folds.held_out import key_of
from afferents.markers.places import covered
from afferents.progress import Progress
from afferents.reporting.labels import caption, texture_letter, texture_names
from afferents.store.recording import LETTERS, natural_order
from afferents.store.responses import Responses, conditions, speed_of
from afferents.store.trimming import set_steady

EXAMPLE_LETTERS = ("a", "e", "i", "m")
"""Four of the paper's textures, evenly spread: 0, 2, 4 and 6 mm. Its own figures show others, which
`report --figures paper` draws."""
PANELS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "A": (("a", 50.0), ("g", 50.0), ("m", 50.0)),
    "B": (("g", 10.0), ("g", 50.0), ("g", 100.0)),
}
"""Of Figures 8 and 10: texture and speed (mm/s) of each row, textures in A and speeds in B."""
SPEED, N_SPEEDS = 50.0, 3
"""In the report's own: near which speed textures stand, and at how many speeds one of them."""
N_FRAMES = 10
"""Tactile images in a row."""
SPACINGS = (20, 1)
"""Frames from one image to the next, as printed: as the paper's code draws, and as its text says.
"""
SETTLING_FRAMES = 90
"""How many frames before those of Figures 8 and 10 are read, so that a marker that can't be filled
from those round it has a last value to keep."""
FIRST_SHOWN = 2521
"""Video frame with which the paper's Figures 8 and 10 begin (figures.ipynb, cells 7 to 25)."""
_UNREADABLE = (AfferentsError, OSError, ValueError, RuntimeError)
"""What data that are gone, damaged or changed raise; a store's bad chunk is a RuntimeError."""

Item = TypeVar("Item")
Recorded = Collection[tuple[str, float]]
"""Texture and speed (mm/s) of every recording there is; at least one."""


class Shown(NamedTuple):
    """A recording that is shown, and what the paper shows there.

    Attributes
    ----------
    texture, speed_mm_s
        Of the recording.
    name
        What the report calls its texture.
    wanted
        What of the paper's is not shown, in few words; nothing where all of it is.
    instead
        What it stands for, in words; nothing where it is the paper's own.
    """

    texture: str
    speed_mm_s: float
    name: str
    wanted: str = ""
    instead: str = ""

    @property
    def label(self) -> str:
        """Return texture and speed as they stand at the left of a row, and what they are for."""
        wanted = [f"(for {self.wanted})"] if self.wanted else []
        return "\n".join([self.name, f"{key_of(self.speed_mm_s)} mm/s", *wanted])


@dataclass(frozen=True)
class FrameRow:
    """A row of Figure 8 or 10.

    Attributes
    ----------
    panel
        `A` (textures) or `B` (speeds).
    shown
        Which recording it is of.
    images
        Shape (frame, row, column).
    time_s
        Of each frame since the first, s, (frame,).
    unit
        Of the images.
    """

    panel: str
    shown: Shown
    images: NDArray[np.float32]
    time_s: NDArray[np.float64]
    unit: str


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


def list_recorded(samples: Samples) -> set[tuple[str, float]]:
    """Return texture and speed (mm/s) of every recording of the samples."""
    textures, speeds = samples[dims.TEXTURE].values.tolist(), samples[dims.SPEED].values.tolist()
    return set(zip(textures, speeds, strict=True))


def select_condition(samples: Samples, texture: str, speed_mm_s: float) -> Samples:
    """Return the samples of one texture at one speed, maybe none."""
    chosen = (samples[dims.TEXTURE].values == texture) & (samples[dims.SPEED].values == speed_mm_s)
    return samples.isel({dims.SAMPLE: np.flatnonzero(chosen)})


def group_speeds(recorded: Recorded) -> dict[str, list[float]]:
    """Return the speeds of each texture, mm/s, ascending; textures in natural order."""
    speeds: dict[str, list[float]] = {}
    for texture, speed in sorted(recorded, key=lambda one: (natural_order(one[0]), one[1])):
        speeds.setdefault(texture, []).append(speed)
    return speeds


def choose_textures(textures: Sequence[str], by_spacing: bool) -> list[str]:
    """Return a, e, i, m of the paper where they are there, else four spread over the rest."""
    known = [one for one in textures if texture_letter(one, by_spacing) in EXAMPLE_LETTERS]
    return known if len(known) == len(EXAMPLE_LETTERS) else spread(textures, 4)


def spread(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most `most` of the items, evenly spread, both ends included."""
    if len(items) <= most:
        return list(items)
    return [items[round(place)] for place in np.linspace(0, len(items) - 1, most)]


def choose_substitutes(wanted: Recorded, recorded: Recorded, by_spacing: bool) -> list[Shown]:
    """Choose a recording for each that the paper shows.

    Parameters
    ----------
    wanted
        Letter and speed (mm/s) of each.
    by_spacing
        Whether textures are named by their spacing; see `texture_names`.

    Returns
    -------
    The texture itself where it is there; else the first, the middle or the last of the session's
    for a, g and m. Of it the recording whose speed is nearest.
    """
    speeds = group_speeds(recorded)
    textures = list(speeds)
    names = texture_names(textures, by_spacing)
    known = {texture_letter(one, by_spacing): one for one in reversed(textures)}
    found = []
    for letter, paper_mm_s in wanted:
        along = LETTERS.index(letter) / (len(LETTERS) - 1)
        texture = known.get(letter) or textures[round(along * (len(textures) - 1))]
        speed = _find_nearest(speeds[texture], paper_mm_s)
        other = "" if letter in known else letter
        off = [other] * bool(other) + [key_of(paper_mm_s)] * (speed != paper_mm_s)
        instead = (
            f"{names[texture]} at {key_of(speed)} mm/s for "
            f"{f'{other} at ' * bool(other)}{key_of(paper_mm_s)} mm/s"
        )
        found.append(Shown(texture, speed, names[texture], ", ".join(off), instead * bool(off)))
    return found


def choose_rows(
    recorded: Recorded, by_spacing: bool, style: choices.Figures
) -> list[tuple[str, Shown]]:
    """Choose the rows of Figures 8 and 10: textures at one speed (A), one at several speeds (B).

    The paper's own, or what stands in for them; for the report, textures spread over those that
    were recorded, and the middle one, or g, at speeds spread over its own.
    """
    speeds = group_speeds(recorded)
    textures = list(speeds)
    if style == "paper":
        chosen = {
            panel: choose_substitutes(rows, recorded, by_spacing) for panel, rows in PANELS.items()
        }
    else:
        names = texture_names(textures, by_spacing)
        middle = "3" if by_spacing and "3" in textures else textures[len(textures) // 2]
        chosen = {
            "A": [
                Shown(one, _find_nearest(speeds[one], SPEED), names[one])
                for one in choose_textures(textures, by_spacing)
            ],
            "B": [Shown(middle, v, names[middle]) for v in spread(speeds[middle], N_SPEEDS)],
        }
    return [(panel, one) for panel, shown in chosen.items() for one in shown]


def _find_nearest(speeds: Iterable[float], wanted: float) -> float:
    return min(speeds, key=lambda one: (abs(one - wanted), one))


def describe_substitutes(shown: Iterable[Shown]) -> str:
    """Return a sentence on what is shown in place of the paper's; nothing where all is there."""
    return caption("instead", list(dict.fromkeys(one.instead for one in shown if one.instead)))


def read_figure_data(
    results: Results, progress: Progress, style: choices.Figures = "report"
) -> tuple[FigureData, list[str]]:
    """Read what the figures of the data show; notes say what could not be read."""
    notes: list[str] = []
    try:
        recordings = _read_recordings(results, progress)
        try:
            spectra, config = None, results.config
            if heard := [recording for recording in recordings if dims.RA2 in recording]:
                what = "spectra of this version"
                spectral = documents.as_form(config["spectral"], SpectralEncoding, CONFIG, what)
                source = Source(channels.CHANNELS[dims.RA2], spectral)
                spectra = encode_all(heard, source, config["cut"], progress)
        except _UNREADABLE as error:  # such as sound shorter than a window
            spectra, notes = None, [f"Figures of spectra are missing: {error}."]
        frames, began = read_frames(recordings, results.found.named_by_spacing, style)
        directions = {str(conditions(recording).get("direction", "")) for recording in recordings}
        sliding = directions.pop() if len(directions) == 1 else ""
        return FigureData(spectra, frames, began, sliding), notes
    except _UNREADABLE as error:
        return FigureData(), [f"Figures of the data are missing: {error}."]


def _read_recordings(results: Results, progress: Progress) -> list[Responses]:
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
    everything = set_steady(ablation.recordings(join_recordings(opened)), config.get("steady_s"))
    recordings = [r for r in everything if r.attrs["name"] not in left_out and speed_of(r)]
    if not recordings:
        raise InputError(
            "the data: expected recordings whose speed is known, to show by it, found none"
        )
    return recordings


def read_frames(
    recordings: Sequence[Responses], by_spacing: bool, style: choices.Figures
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
            for panel, shown in choose_rows(able, by_spacing, style):
                recording = able[shown.texture, shown.speed_mm_s]
                images, time_s, began = _read_row(recording, channel, apart)
                unit = str(recording[channel].attrs.get(dims.UNITS, dims.PIXELS))
                rows[channel, apart].append(FrameRow(panel, shown, images, time_s, unit))
                beginnings.add(began)
    return rows, " or ".join(sorted(beginnings))


def _read_row(
    recording: Responses, channel: str, apart: int
) -> tuple[NDArray[np.float32], NDArray[np.float64], str]:
    """Return ten frames, their times (s), and where they begin: as in the paper, or the middle.

    Pixels with no marker round them are NaN.
    """
    n, there = (N_FRAMES - 1) * apart + 1, recording.sizes[dims.TIME]
    as_published = there >= FIRST_SHOWN + (N_FRAMES - 1) * max(SPACINGS) + 1
    first = FIRST_SHOWN if as_published else max(1, (there - n) // 2)
    response = recording[channel].assign_attrs(recording.attrs)
    read = response.isel({dims.TIME: slice(max(0, first - SETTLING_FRAMES), first + n)})
    kept = slice(max(0, read.sizes[dims.TIME] - n), None)
    samples = spatial_samples(filling.fill(read.load()), kept, channels.CHANNELS[channel].lookback)
    shown = xr.DataArray(
        covered(response[dims.ROW].values, response[dims.COLUMN].values),
        dims=(dims.ROW, dims.COLUMN),
    )
    last = min(first + n, there)
    time_s = recording[dims.TIME].values[max(0, last - n) : last : apart]
    began = (
        f"at video frame {FIRST_SHOWN} as in the paper"
        if as_published
        else "in the middle of each recording, which is shorter than the paper's"
    )
    return samples.where(shown)[::apart].values, time_s - time_s[0], began
