"""What decided: which markers, which waves or which frequencies a trained model leans on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch
import xarray as xr
from numpy.typing import NDArray

from afferents.channels import channel_of
from afferents.core import dims
from afferents.core.card import Card
from afferents.core.cut import Cut
from afferents.core.errors import InputError
from afferents.core.files import write_json
from afferents.core.outputs import require_picture_folder
from afferents.core.progress import Progress
from afferents.core.recording import spacing_mm
from afferents.core.responses import Responses, textures_of
from afferents.core.samples import Samples, concatenate
from afferents.core.split import order
from afferents.core.steady import with_steady
from afferents.encodings import ImageEncoding, encoding_of, images_of
from afferents.evaluation import Predict, bands, losses, neighbourhoods, patches
from afferents.models import Deployed
from afferents.pipeline.data import OpenedData
from afferents.pipeline.encode import Source, has
from afferents.pipeline.explained_samples import some_of
from afferents.pipeline.train import felt_with
from afferents.reporting import Table, explanation_figure, save_figure
from afferents.training import load_model

FACTS, PART = "explanation.json", "part"
SAMPLES = 130
"""About how many samples are asked, spread evenly over recordings."""
PATCH = 3
"""Markers on a side of what is covered at once: one alone is made up for by its neighbours."""
BAND_HZ = 4.0
"""Width of what is taken out of a spectrum at once."""
HARMONICS = np.arange(0, 5.1, 0.25)
"""Middles of the bins that frequencies over a drum's bumps a second are gathered in."""
_BATCH = 64
_RATE_TOLERANCE = 0.02
"""Clocks are read from a recording, and jitter."""

Floats = NDArray[np.float32]


@dataclass
class Explanation:
    """Sentences, pictures, numbers for scripts, and tables."""

    sentences: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)
    facts: dict[str, Any] = field(default_factory=dict)
    tables: list[Table] = field(default_factory=list)


@dataclass(frozen=True)
class Asked:
    """Samples of known textures that a model is asked about.

    Attributes
    ----------
    source
        What they were made of, and how.
    samples
        As the model takes them.
    labels
        Among the card's textures, (n,).
    runs
        The images that they are made of: (n, frame, component, row, column); none of vibration.
        Of models that learn from single markers (n, 1, component, marker).
    places
        Rows and columns of the markers in an image, (marker,) each; none where nobody knows.
    """

    source: Source
    samples: Samples
    labels: NDArray[np.int64]
    runs: Floats | None = None
    places: tuple[NDArray[Any], NDArray[Any]] | None = None


def explain(model: Path, data: OpenedData, out: Path, cut: Cut, progress: Progress) -> Explanation:
    """Take parts of the samples away, one after the other, and see what the model then misses.

    Squares of three by three markers stand still; a wave, or a band of a spectrum, is as it is in
    the mean of all that is asked. The loss is that of the true texture's log-odds, nats. Speeds
    (or groups of the model's split) that it has not learnt from are asked, where there are any.

    Parameters
    ----------
    out
        Folder for the pictures and `explanation.json`.

    Raises
    ------
    InputError
        If the model is none, knows none of the textures, or the data don't go with it.
    """
    require_picture_folder(out, FACTS)
    card, deployed = load_model(model)
    asked = _asked(card, data, cut, progress)
    split = card.held_out
    groups = sorted(np.unique(split.of(asked.samples)).tolist(), key=order)
    unseen = not set(groups) & set(card.groups)
    right = float((_predictor(deployed)(asked.samples.values).argmax(1) == asked.labels).mean())
    found = Explanation(
        [
            f"{len(asked.labels)} samples {split.at(groups)}, "
            f"{'not learnt from' if unseen else 'learnt from'}: {100 * right:.1f}% named rightly."
        ],
        facts={
            "model": card.model,
            "data": data.origin.describe(),
            split.groups: groups,
            "not_learnt_from": unseen,
            "n_samples": len(asked.labels),
            "accuracy": right,
        },
    )
    with progress.task("taking parts away", 1) as mark:
        by_part = _losses(deployed, asked, card.textures)
        mark(1)
    kind = "simulated " if data.origin.simulated else ""
    source = f"{card.title} on {kind}{data.origin.data_set.path.name}. {found.sentences[0]}"
    for name, lost in by_part.items():
        figure = explanation_figure(name, lost, source)
        found.pictures.append(save_figure(figure, out / f"{name}.png"))
        found.sentences.append(_most(lost))
        found.facts[name] = {
            **{str(dim): lost[dim].values.tolist() for dim in lost.dims},
            "loss_nats": np.round(lost.values, 5).tolist(),
        }
    write_json(out / FACTS, found.facts)
    return found


def _asked(card: Card, data: OpenedData, cut: Cut, progress: Progress) -> Asked:
    """Return some samples of every recording whose texture the model knows.

    Raises
    ------
    InputError
        If there is none, or samples have another form than those learnt from.
    """
    everything, split = with_steady(data.responses, card.steady_s), card.held_out
    known = [r for r in everything if str(r.attrs[dims.TEXTURE]) in card.textures]
    if not known:
        found = ", ".join(textures_of(data.responses))
        raise InputError(data.origin.source, f"some of {', '.join(card.textures)}", found)
    unseen = [r for r in known if not {*split.groups_of([r])} <= {*card.groups}]
    recordings, source = unseen or known, _source(card)
    _require_fitting(card, data, recordings, source)
    each = max(1, SAMPLES // len(recordings))
    parts = [
        some_of(responses, source, cut, each, split, card.groups if unseen else ())
        for responses in progress.track(recordings, "encoding", len(recordings))
    ]
    samples = concatenate([part for part, _ in parts])
    if samples.shape[1:] != card.shape:
        raise InputError(
            data.origin.source, f"samples of the form {card.shape}, as {card.model} learnt from",
            f"{samples.shape[1:]}", "take data of the same sensor",
        )  # fmt: skip
    labels = np.array([card.textures.index(str(t)) for t in samples[dims.TEXTURE].values])
    runs = [run for _, run in parts if run is not None]
    first = recordings[0]
    places = (first[dims.ROW].values, first[dims.COLUMN].values) if dims.ROW in first else None
    return Asked(source, samples, labels, np.concatenate(runs) if runs else None, places)


def _require_fitting(
    card: Card, data: OpenedData, recordings: Sequence[Responses], source: Source
) -> None:
    """Refuse data that lack what the model feels with, or are of another sensor."""
    where = data.origin.source
    for responses in recordings:
        if not has(responses, source):
            raise InputError(
                where, f"{source.channel.name} in the form that {card.model} learnt from",
                f"none in {responses.attrs['name']}",
            )  # fmt: skip
    found = felt_with([data], source)
    for name in ("fps_hz", "sample_rate_hz"):
        learnt = getattr(card, name)
        if learnt and not math.isclose(learnt, here := found[name], rel_tol=_RATE_TOLERANCE):
            unit = "frames/s" if name == "fps_hz" else "Hz"
            raise InputError(
                where, f"{learnt:g} {unit}, as {card.model} learnt from", f"{here:g}",
                "take data of the same sensor",
            )  # fmt: skip
    if card.sensor is not None and found["sensor"] != card.sensor:
        raise InputError(
            where, f"the sensor {card.sensor.get('name')} that {card.model} learnt from",
            f"another or other settings ({found['sensor'].get('name')})",
            "take data extracted with the same sensor file",
        )  # fmt: skip


def _source(card: Card) -> Source:
    """Return what the model's samples were made of, and how."""
    return Source(channel_of(card.channel), encoding_of(card.encoding, "the model's card"))


def _predictor(deployed: Deployed) -> Predict:
    """Return what asks a model for log-probabilities."""

    @torch.no_grad()
    def predict(values: Floats) -> NDArray[np.floating]:
        parts = torch.split(torch.from_numpy(np.ascontiguousarray(values)), _BATCH)
        logits = [deployed.network.scores_of(deployed.last_features(part)) for part in parts]
        logs = (torch.cat(logits).double() / deployed.temperature).log_softmax(1)
        return np.asarray(logs.numpy())

    return predict


def _losses(deployed: Deployed, asked: Asked, textures: tuple[str, ...]) -> dict[str, xr.DataArray]:
    """Return what each texture loses without each part, by the kind of part, nats."""
    predict, samples = _predictor(deployed), asked.samples
    found: dict[str, xr.DataArray] = {}
    (channel, encoding), runs = asked.source, asked.runs
    if isinstance(encoding, ImageEncoding) and runs is not None:

        def say_of_runs(runs: Floats) -> NDArray[np.floating]:
            return predict(encoding.of_runs(runs, channel.lookback))

        if channel.parts:
            found["parts"] = _parts(textures, say_of_runs, asked, runs)
        elif encoding.of_pixels:
            found["markers"] = _markers(textures, say_of_runs, asked, runs)
        elif asked.places is not None:
            found["markers"] = _single_markers(textures, say_of_runs, asked, runs, asked.places)
    if dims.FREQUENCY in samples.dims:
        found |= _frequencies(textures, predict, asked)
    if dims.ROW_WAVENUMBER in samples.dims:
        each = patches((samples.shape[-2], samples.shape[-1]), 1)
        lost = losses(predict, samples.values, asked.labels, each, samples.values.mean(axis=0))
        axes = {str(dim): samples[dim].values for dim in samples.dims[-2:]}
        found["waves"] = _by_texture(textures, asked, lost, axes)
    return found


def _markers(
    textures: tuple[str, ...], predict: Predict, asked: Asked, images: Floats
) -> xr.DataArray:
    """Return the losses where markers stand still, (texture, row, column)."""
    n_rows, n_columns = images.shape[-2:]
    still = patches((n_rows, n_columns), PATCH)
    lost = losses(predict, images, asked.labels, still, np.zeros((n_rows, n_columns), np.float32))
    axes = {dims.ROW: np.arange(n_rows), dims.COLUMN: np.arange(n_columns)}
    return _by_texture(textures, asked, lost, axes)


def _parts(textures: tuple[str, ...], predict: Predict, asked: Asked, runs: Floats) -> xr.DataArray:
    """Return the losses where a part of what all markers feel is as it is on average."""
    names = list(asked.source.channel.parts)
    taken = bands(len(names), 1)
    lost = losses(predict, runs, asked.labels, taken, runs.mean(axis=0))
    return _by_texture(textures, asked, lost, {PART: np.array(names)})


def _single_markers(
    textures: tuple[str, ...],
    predict: Predict,
    asked: Asked,
    runs: Floats,
    places: tuple[NDArray[Any], NDArray[Any]],
) -> xr.DataArray:
    """Return the losses where a marker and its nearest stand still, (texture, row, column).

    As an image of the layout; beside the markers it is 0.
    """
    still = neighbourhoods(*places, PATCH**2)
    nothing = np.zeros(runs.shape[-1], np.float32)
    lost = losses(predict, runs, asked.labels, still, nothing)
    images = images_of(lost.T, *places).astype(np.float64)
    axes = {dims.ROW: np.arange(images.shape[1]), dims.COLUMN: np.arange(images.shape[2])}
    return _by_texture(textures, asked, images.reshape(len(images), -1).T, axes)


def _frequencies(
    textures: tuple[str, ...], predict: Predict, asked: Asked
) -> dict[str, xr.DataArray]:
    """Return the losses over frequency, and over harmonics where textures have a spacing."""
    values, frequency = asked.samples.values, asked.samples[dims.FREQUENCY].values
    taken = bands(len(frequency), max(1, round(BAND_HZ / float(frequency[1] - frequency[0]))))
    lost = losses(predict, values, asked.labels, taken, values.mean(axis=0))
    middle = np.array([frequency[band].mean() for band in taken])
    found = {"frequencies": _by_texture(textures, asked, lost, {dims.FREQUENCY: middle})}
    named = asked.samples.attrs.get(dims.NAMED_BY_SPACING, False)
    bumps = [(named and spacing_mm(texture)) or 0.0 for texture in textures]
    spacing = np.array(bumps)[asked.labels]
    if (bumpy := spacing > 0).any():
        per_s = asked.samples[dims.SPEED].values[bumpy] / spacing[bumpy]
        harmonic = middle[:, None] / per_s
        at = np.digitize(harmonic, np.append(HARMONICS - 0.125, HARMONICS[-1] + 0.125)) - 1
        there = np.intersect1d(at, np.arange(len(HARMONICS)))
        means = [lost[:, bumpy][at == k].mean() for k in there]
        found["harmonics"] = xr.DataArray(means, {"harmonic": HARMONICS[there]}, ("harmonic",))
    return found


def _by_texture(
    textures: tuple[str, ...],
    asked: Asked,
    lost: NDArray[np.float64],
    axes: dict[str, NDArray[Any]],
) -> xr.DataArray:
    """Return the mean losses of each texture's samples, over the axes of the parts."""
    there = [k for k in range(len(textures)) if (asked.labels == k).any()]
    shape = [len(axis) for axis in axes.values()]
    means = [lost[:, asked.labels == k].mean(axis=1).reshape(shape) for k in there]
    asked_of = [textures[k] for k in there]
    found = np.stack(means), {dims.TEXTURE: asked_of, **axes}, (dims.TEXTURE, *axes)
    named = asked.samples.attrs.get(dims.NAMED_BY_SPACING, False)
    return xr.DataArray(*found, attrs={dims.NAMED_BY_SPACING: named})


def _most(lost: xr.DataArray) -> str:
    """Say without which part most is lost."""
    mean = lost.mean(dims.TEXTURE) if dims.TEXTURE in lost.dims else lost
    at = np.unravel_index(int(mean.values.argmax()), mean.shape)
    where = ", ".join(
        f"{str(dim).replace('_', ' ')} {mean[dim].values[i]:{'s' if dim == PART else '.3g'}}"
        for dim, i in zip(mean.dims, at, strict=True)
    )
    return f"Most is lost without what is at {where}: {float(mean.values.max()):.2f} nats."
