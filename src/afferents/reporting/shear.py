"""How much of the variance of tactile images is global shear, between textures and over time."""

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import CHANNELS, Channel
from afferents.choices import Cut
from afferents.encodings.images import MomentEncoding
from afferents.encodings.samples import Samples, concatenate, labels_of
from afferents.encodings.wavenumbers import WavenumberEncoding
from afferents.errors import InputError
from afferents.evaluation.data import OpenedData, open_data
from afferents.evaluation.encode import Source, has, kept_part, response_of
from afferents.evaluation.intervals import (
    Accuracy,
    bootstrap_interval,
    count_right,
    paired_difference,
)
from afferents.evaluation.metrics import accuracy_by_group
from afferents.evaluation.schemas import Difference
from afferents.files import Place, holds_only, is_our_picture, require_free, write_json
from afferents.folds.held_out import SPEED, key_of
from afferents.models.fit_solved import named_when_left_out
from afferents.progress import Progress
from afferents.recordings.data_set import Data
from afferents.reporting.explain import Explanation
from afferents.reporting.labels import texture_labels, with_interval
from afferents.reporting.style import BLUE, GREY, ORANGE, SKY, new_figure, save_figure, styled
from afferents.reporting.tables import make_table
from afferents.store.responses import (
    Responses,
    named_by_spacing,
    read_whole,
    speed_of,
    textures_of,
)

Floats = NDArray[np.float64]


class Shares(NamedTuple):
    """Variances of the displacement, px squared, mean over markers, x and y together.

    Attributes
    ----------
    shift, gradients
        Of the mean displacement, and of the plane's four gradients: together the global shear.
    local
        Of what is left of the images without it.
    """

    shift: float
    gradients: float
    local: float

    @property
    def total(self) -> float:
        """The variance of the images."""
        return self.shift + self.gradients + self.local

    @property
    def shear(self) -> float:
        """Share of the global shear in it, 0 to 1; NaN where nothing varies."""
        return (self.shift + self.gradients) / self.total if self.total > 0 else float("nan")

    @property
    def percents(self) -> tuple[float, ...]:
        """What each part has of the variance, percent."""
        return tuple(100 * part / self.total for part in self)

    @property
    def rms(self) -> float:
        """Root of the variance, px."""
        return math.sqrt(self.total)


class Moving(NamedTuple):
    """What a recording's displacement is on average, and how it varies over time.

    Attributes
    ----------
    mean
        (marker, space), px.
    over_time
        Its variances over the frames.
    """

    mean: Floats
    over_time: Shares


def plane_basis(rest: NDArray[np.floating]) -> Floats:
    """Return an orthonormal basis (marker, 3) of planes over places (marker, space); 1 is first."""
    places = np.column_stack([np.ones(len(rest)), rest - rest.mean(axis=0)])
    return np.asarray(np.linalg.qr(places.astype(np.float64))[0])


def variances(fields: NDArray[np.floating], basis: Floats) -> Shares:
    """Return the variances of displacement fields, (n, marker, space), over the n."""
    varying = fields - fields.mean(axis=0, dtype=np.float64)
    power = np.square(np.einsum("mb,nms->bns", basis, varying)).sum(axis=2).mean(axis=1)
    power /= len(basis)
    total = float(np.square(varying).sum(axis=(1, 2)).mean() / len(basis))
    shift, gradients = float(power[0]), float(power[1:].sum())
    return Shares(shift, gradients, max(0.0, total - shift - gradients))


def moving(displacement: NDArray[np.floating], basis: Floats) -> Moving:
    """Return mean and variances over time of a recording's displacement, (time, marker, space)."""
    mean = displacement.mean(axis=0, dtype=np.float64)
    return Moving(np.asarray(mean), variances(displacement, basis))


def variance_shares(
    recordings: Mapping[tuple[str, float], list[Moving]], basis: Floats
) -> dict[str, Shares]:
    """Return the variances between textures, between speeds, and over time.

    Between textures: of the recordings' means at one speed, mean over speeds. Between speeds: of
    one texture. Over time: within recordings.

    Parameters
    ----------
    recordings
        Of every texture and speed.
    basis
        See `plane_basis`.
    """
    means = {key: np.mean([one.mean for one in found], axis=0) for key, found in recordings.items()}
    times = [one.over_time for found in recordings.values() for one in found]
    return {
        "between textures": _between(means, 0, basis),
        "between speeds": _between(means, 1, basis),
        "over time": Shares(*np.mean(times, axis=0).tolist()),
    }


def _between(means: Mapping[tuple[str, float], Floats], which: int, basis: Floats) -> Shares:
    """Return the variances between keys that differ in one place alone, mean over the other."""
    others = dict.fromkeys(key[1 - which] for key in means)
    fields = [np.stack([m for key, m in means.items() if key[1 - which] == one]) for one in others]
    return Shares(*np.mean([variances(f, basis) for f in fields if len(f) > 1], axis=0).tolist())


# Global shear against the images without it: shares of variance, and accuracies of each.

_PARTS = (("mean displacement", BLUE), ("its gradients", SKY), ("the rest", ORANGE))


class Recognised(NamedTuple):
    """How well texture is recognised from something: mean and 95% interval, 0 to 1."""

    mean: float
    low: float
    high: float


@styled
def shear_figure(
    shares: Mapping[str, Shares],
    accuracies: Mapping[str, Recognised],
    drag_px: pd.DataFrame,
    labels: Collection[str],
    source: str,
) -> Figure:
    """Draw shares of variance, accuracies, and how far each texture drags the skin.

    Parameters
    ----------
    shares
        Of the variance between textures, between speeds, over time.
    accuracies
        By what texture was asked of.
    drag_px
        Mean displacement by texture (rows) and speed.
    labels
        Of textures.
    source
        The line that says of what.
    """
    title = "Global shear, and the images without it"
    figure = new_figure(10.5, 3.2, title, source)
    left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.15))
    _draw_shares(left, shares)
    _draw_accuracies(middle, accuracies, 1 / len(drag_px))
    drawn = right.imshow(drag_px, cmap="cividis", aspect="auto", interpolation="nearest")
    right.set_xticks(range(drag_px.shape[1]), [f"{speed:g}" for speed in drag_px])
    right.set_yticks(range(len(labels)), labels)
    right.set(ylabel="texture", xlabel="speed (mm/s)")
    right.set_title("how far the skin is dragged", loc="left")
    figure.colorbar(drawn, ax=right, label="mean displacement (px)")
    return figure


def _draw_shares(axes: Axes, shares: Mapping[str, Shares]) -> None:
    percents = np.array([found.percents for found in shares.values()])
    left = np.zeros(len(shares))
    for (title, colour), width in zip(_PARTS, percents.T, strict=True):
        axes.barh(list(shares), width, left=left, color=colour, height=0.6, label=title)
        left += width
    names = [f"{name}\n(rms {found.rms:.2f} px)" for name, found in shares.items()]
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xlim=(0, 100), xlabel="share of the variance (%)")
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, fontsize=7,
                columnspacing=0.8, handlelength=1)  # fmt: skip


def _draw_accuracies(axes: Axes, accuracies: Mapping[str, Recognised], chance: float) -> None:
    titles = list(accuracies)
    mean, low, high = 100 * np.array(list(accuracies.values())).T
    error = np.maximum([mean - low, high - mean], 0)
    colours = [SKY if title.startswith("...") else BLUE for title in titles]
    axes.barh(titles, mean, xerr=error, color=colours, height=0.6, error_kw={"lw": 0.8})
    axes.axvline(100 * chance, color=GREY, lw=0.8, ls=(0, (4, 3)))
    axes.set_title("recognised from (dashed: chance)", loc="left")
    axes.invert_yaxis()
    axes.set(xlim=(0, 103), xlabel="accuracy at held-out speeds (%)")


def shear_tables(
    shares: Mapping[str, Shares], accuracies: Mapping[str, Recognised], chance: float, source: str
) -> list[pd.DataFrame]:
    """Return the shares of variance, and the accuracies, as tables."""
    of_variance = make_table(
        "Global shear in the variance of the markers' displacement",
        "Root of the mean variance of a marker, and percent of the variance.",
        ("Variance", "rms (px)", "Mean displacement", "Its gradients", "The rest"),
        (
            (name, f"{found.rms:.2f}", *(f"{share:.1f}" for share in found.percents))
            for name, found in shares.items()
        ),
    )
    rows = [(title, with_interval(mean, ends)) for title, (mean, *ends) in accuracies.items()]
    of_textures = make_table(
        "Texture at held-out speeds",
        "Percent of samples of ten frames, mean over held-out speeds, with 95% interval over "
        f"textures in brackets. A linear discriminant, nested. {source}.",
        ("Recognised from", "Accuracy"),
        (*rows, ("chance", f"{100 * chance:.1f}")),
    )
    return [of_variance, of_textures]


# Whether texture is in the global shear, or in the images without it: `explain --shear`.
#
# The paper says that its images are dominated by global shear, a cue of friction, and that this
# discriminates textures (Pestell & Lepora 2022, Discussion). Two questions ask it of any store: how
# much of the images' variance is global shear, and how well texture is recognised, at speeds not
# learnt from, by the shear alone, by the images without it, and by both.

FACTS = "shear.json"
MOST_RUNS = 200
"""Of a recording, spread evenly, that are learnt from: as many as it takes to be quick."""

ENCODED = {
    "shear": Source(CHANNELS[dims.SHEAR], MomentEncoding()),
    "markers": Source(CHANNELS[dims.SA1_LOCAL], MomentEncoding()),
    "waves": Source(CHANNELS[dims.SA1_LOCAL], WavenumberEncoding()),
}
"""What samples of ten frames are made of: the shear, and twice the images without it."""
SHEAR, WITHOUT, BOTH = "global shear alone", "images without it", "both"
ASKED = {
    SHEAR: ("shear",),
    WITHOUT: ("markers", "waves"),
    "... marker by marker": ("markers",),
    "... as waves": ("waves",),
    BOTH: ("shear", "markers", "waves"),
}
"""What texture is asked of."""


class Felt(NamedTuple):
    """What one recording shows.

    Attributes
    ----------
    samples
        By the names of `ENCODED`, of the same runs of frames.
    moved
        How its displacement varies.
    drag_px
        Mean length of the mean displacement.
    """

    samples: Mapping[str, Samples]
    moved: Moving
    drag_px: float


def explain_shear_of(data: OpenedData, out: Path, cut: Cut, progress: Progress) -> Explanation:
    """Say how much of the images is global shear, and how texture is recognised without it.

    Parameters
    ----------
    out
        Folder for the picture and `shear.json`.

    Raises
    ------
    InputError
        If the data have no markers, recordings without a speed, fewer than two textures or speeds,
        or a texture at one speed alone.
    """
    require_free(out, holds_only(FACTS, or_ours=is_our_picture))
    recordings, where = list(data.responses), data.origin.source
    _require_enough(recordings, where)
    asked = {name: source for name, source in ENCODED.items() if has(recordings[0], source)}
    basis = plane_basis(recordings[0][dims.REST_POSITION].values)
    felt = [
        _felt(responses, asked, basis, cut, where)
        for responses in progress.track(recordings, "shear", len(recordings))
    ]
    table = pd.DataFrame({
        "texture": [str(r.attrs[dims.TEXTURE]) for r in recordings],
        "speed": [float(r.attrs[dims.SPEED]) for r in recordings],
        "drag_px": [one.drag_px for one in felt],
        "moved": [one.moved for one in felt],
    })  # fmt: skip
    moved: dict[Any, list[Moving]] = (
        table.groupby(["texture", "speed"])["moved"].agg(list).to_dict()
    )
    drag_px = table.pivot_table("drag_px", "texture", "speed").loc[textures_of(recordings)]
    with progress.task("learning", 1) as mark:
        predictions = _predictions([one.samples for one in felt])
        mark(1)
    return _written(data, out, variance_shares(moved, basis), predictions, drag_px)


def _require_enough(recordings: Sequence[Responses], where: str) -> None:
    for responses in recordings:
        name = responses.attrs["name"]
        if not {dims.POSITION, dims.REST_POSITION} <= set(responses.variables):
            raise InputError(f"{where}: expected recordings of markers, found none in {name}")
    SPEED.groups_of(recordings)  # refuses those whose speed is not known
    pairs = {(str(one.attrs[dims.TEXTURE]), speed_of(one)) for one in recordings}
    n_speeds = Counter(texture for texture, _ in pairs)
    if alone := [texture for texture, n in n_speeds.items() if n < 2]:
        raise InputError(
            f"{where}: expected each texture at 2 speeds or more, found {alone[0]} at one"
        )
    if max(Counter(speed for _, speed in pairs).values()) < 2:
        raise InputError(f"{where}: expected 2 textures or more at one speed, found one at each")


def _felt(
    responses: Responses, asked: Mapping[str, Source], basis: NDArray[np.float64], cut: Cut,
    where: str,
) -> Felt:  # fmt: skip
    """Return what a recording shows; its markers are read once."""
    if responses.sizes[dims.MARKER] != len(basis):
        found = f"{responses.sizes[dims.MARKER]} in {responses.attrs['name']}"
        raise InputError(
            f"{where}: expected {len(basis)} markers in every recording, found {found}"
        )
    read = responses.assign({dims.POSITION: read_whole(responses, dims.POSITION)})
    shear = asked["shear"]
    kept = kept_part(read, shear, cut)

    def of(channel: Channel) -> xr.DataArray:
        return response_of(read, shear._replace(channel=channel))

    moved = of(CHANNELS[dims.SA1_VECTOR]).isel({dims.TIME: kept})
    responses_of = {name: of(source.channel) for name, source in asked.items()}
    drag = responses_of["shear"].isel({dims.TIME: kept}).sel({dims.SHEAR: ["shift_x", "shift_y"]})
    return Felt(
        {name: _some(responses_of[name], source, kept) for name, source in asked.items()},
        moving(moved.transpose(dims.TIME, dims.MARKER, dims.SPACE).values, basis),
        float(np.linalg.norm(drag.mean(dims.TIME).values)),
    )


def _some(response: xr.DataArray, source: Source, kept: slice) -> Samples:
    """Return up to `MOST_RUNS` samples of a recording, evenly spread, their dims flattened."""
    samples = source.encoding.samples(response, kept, source.channel.lookback)
    n = min(MOST_RUNS, len(samples))
    some = samples.isel({dims.SAMPLE: np.linspace(0, len(samples) - 1, n).round().astype(int)})
    coords = {name: some[name] for name in dims.SAMPLE_COORDS}
    return xr.DataArray(some.values.reshape(n, -1), coords, (dims.SAMPLE, dims.FEATURE))


def _predictions(felt: Sequence[Mapping[str, Samples]]) -> dict[str, pd.DataFrame]:
    """Return what textures are taken for, each speed held out in turn, by what is asked."""
    samples = {name: concatenate([one[name] for one in felt]) for name in felt[0]}
    stops = np.cumsum([0, *(part.shape[1] for part in samples.values())])
    columns = {name: np.arange(*stops[i : i + 2]) for i, name in enumerate(samples)}
    asked = {title: names for title, names in ASKED.items() if set(names) <= set(samples)}
    if WITHOUT not in asked:  # markers that stand in no image
        asked |= {WITHOUT: ("markers",), BOTH: ("shear", "markers")}
        del asked["... marker by marker"]
    labelled = samples["shear"]
    speeds, labels = labelled[dims.SPEED].values, labels_of(labelled)
    found = named_when_left_out(
        np.concatenate([part.values for part in samples.values()], axis=1),
        labels,
        np.unique(speeds, return_inverse=True)[1],
        [np.concatenate([columns[name] for name in names]) for names in asked.values()],
    )
    given = {SPEED.column: speeds, dims.RECORDING: labelled[dims.RECORDING].values}
    return {
        title: pd.DataFrame({**given, "true_texture": labels, "predicted_texture": one})
        for title, one in zip(asked, found, strict=True)
    }


def _written(
    data: OpenedData, out: Path, shares: dict[str, Shares], predictions: dict[str, pd.DataFrame],
    drag_px: pd.DataFrame,
) -> Explanation:  # fmt: skip
    """Draw the picture, write the numbers, and say what they mean."""
    chance = 1 / len(drag_px)
    of = {title: Accuracy(count_right(table)) for title, table in predictions.items()}
    accuracies = {
        title: Recognised(one.mean(), *bootstrap_interval(one)) for title, one in of.items()
    }
    losses = {
        title: paired_difference(of[BOTH], of[other])
        for title, other in (("without the shear", WITHOUT), ("with the shear alone", SHEAR))
    }
    n, (n_textures, n_speeds) = len(data.responses), drag_px.shape
    kind = "simulated " if data.origin.simulated else ""
    source = (
        f"{kind}{data.origin.data_set.path.name}: {n} recordings, {n_textures} textures, "
        f"{n_speeds} speeds, each held out in turn"
    )
    named = texture_labels(list(drag_px.index), bool(named_by_spacing(data.responses)))
    figure = shear_figure(shares, accuracies, drag_px, named.values(), source)
    picture = save_figure(figure, out / "shear.png")
    facts = {
        "data": data.origin.model_dump(),
        "chance": chance,
        "variances_px2": {name: found._asdict() for name, found in shares.items()},
        "accuracy": {
            title: {
                "mean": mean,
                "ci95": [low, high],
                "by_speed": {
                    key_of(v): share for v, share in accuracy_by_group(predictions[title]).items()
                },
            }
            for title, (mean, low, high) in accuracies.items()
        },
        "lost": {title: found.content() for title, found in losses.items()},
        "drag_px": {
            texture: [None if np.isnan(px) else px for px in row.tolist()]
            for texture, row in drag_px.iterrows()
        },
        "speeds_mm_s": drag_px.columns.tolist(),
    }
    write_json(out / FACTS, facts)
    between, over_time = (100 * shares[name].shear for name in ("between textures", "over time"))
    sentences = [
        f"Of what differs between textures in the images, {between:.0f}% of the variance is "
        f"global shear; over time, {over_time:.0f}%.",
        meaning(accuracies, chance, *losses.values()),
    ]
    tables = shear_tables(shares, accuracies, chance, source)
    return Explanation(sentences, [picture], facts, tables)


def meaning(
    accuracies: Mapping[str, Recognised],
    chance: float,
    without_shear: Difference,
    shear_alone: Difference,
) -> str:
    """Say in a sentence what carries the texture.

    Parameters
    ----------
    accuracies
        By what is asked.
    without_shear, shear_alone
        How much more accurate both together are than the images without shear, and than the shear.
    """
    if all(accuracies[title].low <= chance for title in (SHEAR, WITHOUT, BOTH)):
        return (
            "How well texture is recognised, with the global shear or without it, these data do "
            "not tell from chance."
        )
    said = {  # by whether the shear adds to the images without it, and they to the shear
        (True, True): "Texture is recognised from both: "
        f"{100 * without_shear.difference:.1f} points are lost without the global shear, "
        f"{100 * shear_alone.difference:.1f} without the rest of the images.",
        (True, False): "The global shear carries the texture: the rest of the images adds nothing "
        "to it that these data show.",
        (False, True): "The images carry the texture without the global shear: it adds nothing to "
        "them that these data show.",
        (False, False): "These data show no gain of both together over the global shear alone, or "
        "over the images without it.",
    }
    return said[without_shear.ci95[0] > 0, shear_alone.ci95[0] > 0]


def explain_shear(data: Data, out: Place, cut: Cut = "all", quiet: bool = False) -> Explanation:
    """Say whether texture is in the global shear of the skin, or in the images without it.

    No model is needed: small ones are learnt, at all speeds but one in turn. It is what
    ``explain --shear`` does at the command line.

    Parameters
    ----------
    data
        An extracted store.
    out
        Folder for the picture and ``shear.json``.
    cut
        Part of the recordings that is used.
    quiet
        Whether no progress is shown.

    Returns
    -------
    Explanation
        Sentences, a picture, tables, and numbers.

    Raises
    ------
    InputError
        If the data have no markers, unknown speeds, or fewer than two textures or speeds.

    Examples
    --------
    >>> explain_shear("responses.zarr", "shear").pictures
    [PosixPath('shear/shear.png')]
    """
    with Progress(quiet) as progress:
        (opened,) = open_data([data], progress=progress)
        return explain_shear_of(opened, Path(out), cut, progress)
