"""What a trained model relies on: the markers, waves or frequencies that it fails without.

Occlusion (Zeiler & Fergus, Visualizing and understanding convolutional networks, ECCV 2014): how
much less likely the true texture is without a part of the input. Only the model's answers count,
whatever it is made of, and the loss has a unit: the logarithm of the true texture's odds, which
unlike its probability does not stand still near 1.
"""

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import logsumexp

from afferents import dims
from afferents.channels import find_channel
from afferents.choices import Cut
from afferents.encodings.images import ImageEncoding
from afferents.encodings.samples import Samples, concatenate
from afferents.encodings.settings import read_encoding
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, Source, has, make_response, open_data
from afferents.evaluation.train import describe_sensor
from afferents.files import Place, holds_only, is_our_picture, require_free, write_json
from afferents.folds.held_out import Group, Split, order
from afferents.markers.places import make_images
from afferents.models.card import Card, require_unit
from afferents.models.deployed import Deployed
from afferents.models.folder import load_model
from afferents.progress import Progress
from afferents.recordings.data_set import Data
from afferents.reporting import labels, style
from afferents.rig.surface import Drum
from afferents.store.recording import spacing_mm
from afferents.store.responses import Responses, textures_of
from afferents.store.trimming import set_steady

PART = "part"
"""Dimension of losses over the parts of the global shear."""
PATCH = 3
"""Markers on a side of what is covered at once: one alone is made up for by its neighbours."""
BAND_HZ = 4.0
"""Width of what is taken out of a spectrum at once."""
HARMONICS = np.arange(0, 5.1, 0.25)
"""Middles of the bins that frequencies over a drum's own rate are gathered in."""
FACTS = "explanation.json"
SAMPLES = 130
"""About how many samples are used, spread evenly over recordings."""
_BATCH = 64
_RATE_TOLERANCE = 0.02
"""Clocks are read from a recording, and jitter."""
_TITLES = {
    "markers": "What is lost where 3 x 3 markers stand still",
    "parts": "What is lost without each part of the global shear",
    "waves": "What is lost without each wave",
    "frequencies": "What is lost without each band of the spectrum",
    "harmonics": "What is lost without each multiple of a drum's own rate",
}
_AXES = {
    dims.ROW: "row of markers",
    dims.COLUMN: "column of markers",
    dims.ROW_WAVENUMBER: "down (cycles a marker)",
    dims.COLUMN_WAVENUMBER: "across (cycles a marker)",
    dims.FREQUENCY: "frequency (Hz)",
    "harmonic": "frequency, as a multiple of the drum's own rate",
    PART: "part of the global shear",
}
_LOSS = "lost log-odds of the true texture (nats)"
_COLOURS = "PuOr_r"
"""Orange where a part speaks for the true texture, purple where against it, white for neither."""
_A_ROW = 7
"""Images in a row at most."""
_LEAST_INCH, _AXIS_INCH = 6.0, 1.7
"""Widths of the line that names the source, and of axis and colour bar next to images."""

Floats = NDArray[np.float32]
Predict = Callable[[Floats], NDArray[np.floating]]
"""A model: log-probabilities (n, n_classes) of inputs."""


@dataclass
class Explanation:
    """Sentences, pictures, and numbers for scripts."""

    sentences: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Examples:
    """Samples of textures that a model knows, to be recognised with and without their parts.

    Attributes
    ----------
    source
        What they were made of, and how.
    samples
        As the model takes them.
    textures
        Those that the model knows.
    labels
        Numbers among these, (n,).
    runs
        The images that they are made of: (n, frame, component, row, column); none of vibration.
        Of models that learn from single markers (n, 1, component, marker).
    places
        Rows and columns of the markers in an image, (marker,) each; none where not known.
    """

    source: Source
    samples: Samples
    textures: tuple[str, ...]
    labels: NDArray[np.int64]
    runs: Floats | None = None
    places: tuple[NDArray[Any], NDArray[Any]] | None = None

    @property
    def by_spacing(self) -> bool:
        """Whether textures are named by the spacing of their bumps, mm."""
        return bool(self.samples.attrs.get(dims.NAMED_BY_SPACING, False))


def explain(
    model: Place, data: Data, out: Place, cut: Cut = "all", quiet: bool = False
) -> Explanation:
    """Show what a model relies on: the markers, waves or frequencies that it fails without.

    Parts of the samples are taken away, one after the other. Squares of three by three markers
    stand still; a wave, or a band of a spectrum, is as it is in the mean of all samples. The loss
    is that of the true texture's log-odds, nats. Samples are of speeds (or groups of the model's
    split) that it has not learnt from, where there are any.

    Parameters
    ----------
    model
        Folder of a model that 'train' wrote.
    data
        A store that 'extract' wrote, a dataset.toml or fabricslide:PATH. In Python a `DataSet`.
    out
        Folder for the pictures and explanation.json.
    cut
        Part of each recording to use: 'all' at constant speed, or the 'published' cut.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    Explanation
        Sentences, pictures, and numbers.

    Raises
    ------
    InputError
        If `model` holds no model, it knows none of the textures, or the data do not fit it.

    Examples
    --------
    >>> [picture.name for picture in explain("model", "responses.zarr", "why").pictures]
    ['markers.png', 'waves.png']
    """
    out = Path(out)
    with Progress(quiet) as progress:
        (opened,) = open_data([data], progress=progress)
        require_free(out, holds_only(FACTS, or_ours=is_our_picture))
        card, deployed = load_model(Path(model))
        examples, predict = _choose_examples(card, opened, cut, progress), _make_predictor(deployed)
        with progress.task("taking parts away", 1) as mark:
            by_part = lose_parts(predict, examples)
            mark(1)
    split, samples, true = card.held_out, examples.samples, examples.labels
    groups = sorted(np.unique(split.of(samples)).tolist(), key=order)
    unseen = not set(groups) & set(card.groups)
    right = float((predict(samples.values).argmax(1) == true).mean())
    found = Explanation(
        [
            f"{len(true)} samples {split.at(groups)}, "
            f"{'not learnt from' if unseen else 'learnt from'}: {100 * right:.1f}% recognised."
        ],
        facts={
            "model": card.model,
            "data": opened.origin.model_dump(),
            split.groups: groups,
            "not_learnt_from": unseen,
            "n_samples": len(true),
            "accuracy": right,
        },
    )
    kind = "simulated " if opened.origin.simulated else ""
    source = f"{card.title} on {kind}{opened.origin.data_set.path.name}. {found.sentences[0]}"
    for name, lost in by_part.items():
        figure = explanation_figure(name, lost, source)
        found.pictures.append(style.save_figure(figure, out / f"{name}.png"))
        found.sentences.append(_describe_most(lost))
        found.facts[name] = {
            **{str(dim): lost[dim].values.tolist() for dim in lost.dims},
            "loss_nats": np.round(lost.values, 5).tolist(),
        }
    write_json(out / FACTS, found.facts)
    return found


def _choose_examples(card: Card, data: OpenedData, cut: Cut, progress: Progress) -> Examples:
    """Return some samples of every recording whose texture the model knows.

    Raises
    ------
    InputError
        If there is none, or samples have another form than those learnt from.
    """
    everything, split = set_steady(data.responses, card.steady_s), card.held_out
    known = [r for r in everything if str(r.attrs[dims.TEXTURE]) in card.textures]
    if not known:
        found = ", ".join(textures_of(data.responses))
        raise InputError(
            f"{data.origin.source}: expected some of {', '.join(card.textures)}, found {found}"
        )
    unseen = [r for r in known if not {*split.groups_of([r])} <= {*card.groups}]
    recordings = unseen or known
    source = Source(find_channel(card.channel), read_encoding(card.encoding, "the model's card"))
    _require_fitting(card, data, recordings, source)
    each = max(1, SAMPLES // len(recordings))
    parts = [
        _sample(responses, source, cut, each, split, card.groups if unseen else ())
        for responses in progress.track(recordings, "encoding", len(recordings))
    ]
    samples = concatenate([part for part, _ in parts])
    if samples.shape[1:] != card.shape:
        raise InputError(
            f"{data.origin.source}: expected samples of the form {card.shape}, as {card.model} "
            f"learnt from, found {samples.shape[1:]}; take data of the same sensor"
        )
    true = np.array([card.textures.index(str(t)) for t in samples[dims.TEXTURE].values])
    runs = [run for _, run in parts if run is not None]
    first = recordings[0]
    places = (first[dims.ROW].values, first[dims.COLUMN].values) if dims.ROW in first else None
    run_of_each = np.concatenate(runs) if runs else None
    return Examples(source, samples, card.textures, true, run_of_each, places)


def _require_fitting(
    card: Card, data: OpenedData, recordings: Sequence[Responses], source: Source
) -> None:
    """Refuse data that lack the model's channel, or are of another sensor."""
    where = data.origin.source
    require_unit(card, any(map(dims.of_cells, recordings)), where)
    for responses in recordings:
        if not has(responses, source):
            raise InputError(
                f"{where}: expected {source.channel.name} in the form that {card.model} learnt "
                f"from, found none in {responses.attrs['name']}"
            )
    found = describe_sensor(data, source)
    for name, unit in (("fps_hz", "frames/s"), ("sample_rate_hz", "Hz")):
        learnt = getattr(card, name)
        if learnt and not math.isclose(learnt, here := found[name], rel_tol=_RATE_TOLERANCE):
            raise InputError(
                f"{where}: expected {learnt:g} {unit}, as {card.model} learnt from, found "
                f"{here:g}; take data of the same sensor"
            )
    rest = {"rest_frame": 0}  # of recordings, not of the sensor
    if card.sensor is not None and found["sensor"] | rest != card.sensor | rest:
        raise InputError(
            f"{where}: expected the sensor {card.sensor.get('name')} that {card.model} learnt "
            f"from, found another or other settings ({found['sensor'].get('name')}); take data "
            "extracted with the same sensor file"
        )


def _sample(
    responses: Responses,
    source: Source,
    cut: Cut,
    n: int,
    split: Split,
    learnt: Collection[Group],
) -> tuple[Samples, Floats | None]:
    """Return up to n samples of a recording, evenly spread, and the runs of images they are of.

    None of them is of a group in `learnt`.
    """
    (channel, encoding), number = source, "number"
    kept = encoding.kept(responses, channel.made_of, channel.lookback, cut)
    response = make_response(responses, source)
    samples = encoding.samples(response, kept, channel.lookback)
    if dims.FREQUENCY in samples.dims:
        n_seen = encoding.seen(samples.values[:1]).shape[-1]
        samples = samples.isel({dims.FREQUENCY: slice(n_seen)})
    samples = samples.assign_coords({number: (dims.SAMPLE, np.arange(len(samples)))})
    samples = split.labelled(samples, [responses])
    samples = samples[~np.isin(split.of(samples), np.array([*learnt]))] if learnt else samples
    spread = np.unique(np.linspace(0, len(samples) - 1, n).round().astype(int))
    samples = samples.isel({dims.SAMPLE: spread})
    index = samples[number].values
    runs = None
    if isinstance(encoding, ImageEncoding):
        runs = encoding.runs(response, kept)[index]
    return samples.drop_vars(number), runs


def _make_predictor(deployed: Deployed) -> Predict:
    """Return a function from inputs to the model's log-probabilities."""

    @torch.no_grad()
    def predict(values: Floats) -> NDArray[np.floating]:
        parts = torch.split(torch.from_numpy(np.ascontiguousarray(values)), _BATCH)
        logits = [deployed.network.scores_of(deployed.last_features(part)) for part in parts]
        logs = (torch.cat(logits).double() / deployed.temperature).log_softmax(1)
        return np.asarray(logs.numpy())

    return predict


def losses(
    predict: Predict,
    inputs: Floats,
    labels: NDArray[np.int64],
    masks: Iterable[NDArray[np.bool_]],
    instead: Floats,
) -> NDArray[np.float64]:
    """Return what the true textures lose in log-odds without each part, (part, n), nats.

    Parameters
    ----------
    inputs, labels
        (n, ...) and (n,).
    masks
        Of each part, of the inputs' last dimensions: True for what is taken away.
    instead
        What stands there then, of the inputs' shape without n, or one that goes with it.

    Returns
    -------
    Positive where the part speaks for the true texture.
    """
    whole = log_odds(predict(inputs), labels)
    found = [
        whole - log_odds(predict(np.where(mask, instead, inputs).astype(np.float32)), labels)
        for mask in masks
    ]
    return np.asarray(found, dtype=np.float64)


def log_odds(logs: NDArray[np.floating], labels: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return log p - log (1 - p) of the true textures, (n,), from (n, n_classes) of log p."""
    is_true = np.arange(logs.shape[1]) == labels[:, None]
    others = np.where(is_true, -np.inf, logs)
    return np.asarray(logs[is_true] - logsumexp(others, axis=1), dtype=np.float64)


def patches(shape: tuple[int, int], size: int) -> list[NDArray[np.bool_]]:
    """Return a square patch of a grid round each of its places, (row, column), row by row."""
    row, column = np.indices(shape)
    half = size // 2
    return [
        (abs(row - r) <= half) & (abs(column - c) <= half)
        for r in range(shape[0])
        for c in range(shape[1])
    ]


def neighbourhoods(
    row: NDArray[np.generic], column: NDArray[np.generic], size: int
) -> list[NDArray[np.bool_]]:
    """Return each marker with its nearest, `size` in all, by the places of markers, (marker,)."""
    place = np.stack([row, column], axis=1).astype(np.float64)
    _, near = cKDTree(place).query(place, k=min(size, len(place)))
    return [np.isin(np.arange(len(place)), own) for own in near]


def bands(n: int, width: int) -> list[NDArray[np.bool_]]:
    """Return bands of an axis of n bins, side by side, the last perhaps narrower."""
    at = np.arange(n)
    return [at // width == k for k in range(-(-n // width))]


def lose_parts(predict: Predict, examples: Examples) -> dict[str, xr.DataArray]:
    """Return what each texture loses without each part, by the kind of part, nats."""
    samples, runs, labels = examples.samples, examples.runs, examples.labels
    found: dict[str, xr.DataArray] = {}
    channel, encoding = examples.source
    if isinstance(encoding, ImageEncoding) and runs is not None:

        def without(masks: list[NDArray[np.bool_]], instead: Floats) -> NDArray[np.float64]:
            return losses(
                lambda values: predict(encoding.of_runs(values, channel.lookback)),
                runs, labels, masks, instead,
            )  # fmt: skip

        still = np.zeros(runs.shape[-1], np.float32)
        if channel.parts:  # one is as it is on average
            names = list(channel.parts)
            lost = without(bands(len(names), 1), runs.mean(axis=0))
            found["parts"] = _mean_by_texture(examples, lost, {PART: np.array(names)})
        elif encoding.of_pixels:
            shape = runs.shape[-2], runs.shape[-1]
            lost = without(patches(shape, PATCH), still)
            found["markers"] = _mean_by_texture(examples, lost, _grid(shape))
        elif examples.places is not None:  # a marker and its nearest; pixels of none are 0
            lost = without(neighbourhoods(*examples.places, PATCH**2), still)
            images = make_images(lost.T, *examples.places).astype(np.float64)
            flat = images.reshape(len(images), -1).T
            found["markers"] = _mean_by_texture(examples, flat, _grid(images.shape[1:]))
    if dims.FREQUENCY in samples.dims:
        found |= lose_frequencies(predict, examples)
    if dims.ROW_WAVENUMBER in samples.dims:
        each = patches((samples.shape[-2], samples.shape[-1]), 1)
        lost = losses(predict, samples.values, labels, each, samples.values.mean(axis=0))
        axes = {str(dim): samples[dim].values for dim in samples.dims[-2:]}
        found["waves"] = _mean_by_texture(examples, lost, axes)
    return found


def _grid(shape: tuple[int, ...]) -> dict[str, NDArray[Any]]:
    return {dims.ROW: np.arange(shape[0]), dims.COLUMN: np.arange(shape[1])}


def lose_frequencies(predict: Predict, examples: Examples) -> dict[str, xr.DataArray]:
    """Return the losses over frequency, and over harmonics where textures have a spacing."""
    samples, labels = examples.samples, examples.labels
    values, frequency = samples.values, samples[dims.FREQUENCY].values
    taken = bands(len(frequency), max(1, round(BAND_HZ / float(frequency[1] - frequency[0]))))
    lost = losses(predict, values, labels, taken, values.mean(axis=0))
    middle = np.array([frequency[band].mean() for band in taken])
    found = {"frequencies": _mean_by_texture(examples, lost, {dims.FREQUENCY: middle})}
    bumps = [(examples.by_spacing and spacing_mm(one)) or 0.0 for one in examples.textures]
    per_mm = np.array([Drum().rate_hz(x, 1.0) if x else 0.0 for x in bumps])[labels]
    if (bumpy := per_mm > 0).any():
        harmonic = middle[:, None] / (samples[dims.SPEED].values * per_mm)[bumpy]
        at = np.digitize(harmonic, np.append(HARMONICS - 0.125, HARMONICS[-1] + 0.125)) - 1
        there = np.intersect1d(at, np.arange(len(HARMONICS)))
        means = [lost[:, bumpy][at == k].mean() for k in there]
        found["harmonics"] = xr.DataArray(means, {"harmonic": HARMONICS[there]}, ("harmonic",))
    return found


def _mean_by_texture(
    examples: Examples, lost: NDArray[np.float64], axes: dict[str, NDArray[Any]]
) -> xr.DataArray:
    """Return the mean losses of each texture's samples, over the axes of the parts."""
    there = np.unique(examples.labels).tolist()
    shape = [len(axis) for axis in axes.values()]
    means = [lost[:, examples.labels == k].mean(axis=1).reshape(shape) for k in there]
    textures = [examples.textures[k] for k in there]
    found = np.stack(means), {dims.TEXTURE: textures, **axes}, (dims.TEXTURE, *axes)
    return xr.DataArray(*found, attrs={dims.NAMED_BY_SPACING: examples.by_spacing})


def _describe_most(lost: xr.DataArray) -> str:
    """Return without which part most is lost, in a sentence."""
    mean = lost.mean(dims.TEXTURE) if dims.TEXTURE in lost.dims else lost
    at = np.unravel_index(int(mean.values.argmax()), mean.shape)
    where = ", ".join(
        f"{str(dim).replace('_', ' ')} {mean[dim].values[i]:{'s' if dim == PART else '.3g'}}"
        for dim, i in zip(mean.dims, at, strict=True)
    )
    return f"Most is lost without what is at {where}: {float(mean.values.max()):.2f} nats."


@style.styled
def explanation_figure(name: str, lost: xr.DataArray, source: str) -> Figure:
    """Draw losses by texture: images over a grid, a table over frequency, or one curve.

    Parameters
    ----------
    name
        `markers`, `parts`, `waves`, `frequencies` or `harmonics`.
    lost
        (texture, y, x), (texture, x) or (x,), nats.
    source
        The line that says what was used.
    """
    if lost.ndim == 3:
        return _draw_images(_TITLES[name], lost, source)
    height = max(3.6, 0.16 * len(lost) + 1.2) if lost.ndim == 2 else 3.6
    figure = style.new_figure(7.2, height, _TITLES[name], source)
    axes = figure.subplots()
    (dim,) = (str(d) for d in lost.dims if d != dims.TEXTURE)
    axes.set_xlabel(_AXES[dim])
    if lost.ndim == 1:
        axes.axhline(0, color=style.GREY, linewidth=0.7)
        axes.plot(lost[dim], lost, color=style.BLUE, marker="o", markersize=3)
        axes.set_ylabel(_LOSS.replace(" of", "\nof"))
        return figure
    names = lost[dim].values
    named = names.dtype.kind == "U"
    at = np.arange(len(names)) if named else names
    half = (at[1] - at[0]) / 2
    extent = (at[0] - half, at[-1] + half, len(lost) - 0.5, -0.5)
    most = _largest(lost)
    drawn = style.draw_cells(axes, lost.values, _COLOURS, -most, most, extent=extent, aspect="auto")
    if named:
        axes.set_xticks(at, names)
    axes.set_yticks(range(len(lost)), _name_textures(lost))
    axes.set_ylabel("texture")
    style.add_bar(figure, drawn, axes, _LOSS)
    return figure


def _draw_images(title: str, lost: xr.DataArray, source: str) -> Figure:
    """Draw the mean of all textures, and each; a wave's row runs through 0 in the middle."""
    y, x = (str(dim) for dim in lost.dims[1:])
    lost = lost.sortby(y)
    panels = [("all", lost.mean(dims.TEXTURE))]
    panels += list(zip(_name_textures(lost), lost, strict=True))
    n_rows = -(-len(panels) // _A_ROW)
    n_columns = -(-len(panels) // n_rows)
    width = max(1.2 * n_columns + _AXIS_INCH, _LEAST_INCH)
    image = min((width - _AXIS_INCH) / n_columns - 0.1, 2.0)
    tall = image * min(lost.sizes[y] / lost.sizes[x], 2.0)
    figure = style.new_figure(width, n_rows * (tall + 0.5) + 0.8, title, source)
    grid = figure.subplots(n_rows, n_columns, squeeze=False, sharex=True, sharey=True)
    half_y, half_x = (float(lost[dim][1] - lost[dim][0]) / 2 for dim in (y, x))
    extent = (
        float(lost[x][0]) - half_x, float(lost[x][-1]) + half_x,
        float(lost[y][-1]) + half_y, float(lost[y][0]) - half_y,
    )  # fmt: skip
    for axes, (label, one) in zip(grid.flat, panels, strict=False):
        most = _largest(one)
        drawn = style.draw_cells(axes, one.values, _COLOURS, -most, most, extent=extent)
        axes.set_title(f"{label}\nup to {most:.2g} nats", fontsize=7.5)
    style.hide(list(grid.flat)[len(panels) :])
    if y == dims.ROW:
        grid[0, 0].yaxis.set_major_locator(MaxNLocator(4, integer=True))
    grid[0, 0].set_ylabel(_AXES[y])
    grid[-1, 0].set_xlabel(_AXES[x])
    label = _LOSS.replace(" of", "\nof").removesuffix(" (nats)")
    bar = style.add_bar(figure, drawn, grid, label, aspect=12 * n_rows, fraction=0.05)
    bar.set_ticks([-most, 0, most], labels=["gains most", "0", "loses most"])
    return figure


def _name_textures(lost: xr.DataArray) -> list[str]:
    textures = [str(texture) for texture in lost[dims.TEXTURE].values]
    return list(
        labels.texture_labels(textures, bool(lost.attrs.get(dims.NAMED_BY_SPACING))).values()
    )


def _largest(lost: xr.DataArray) -> float:
    return float(np.abs(lost.values).max()) or 1.0
