"""Controls: recordings from which was taken what should distinguish their textures.

What is recognised all the same rests on something else: loudness, an offset of the day, or a
mistake in the data or the model.
"""

import zlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.folds.corruption import drop_digest, replace_markers
from afferents.folds.held_out import Split, order
from afferents.store.recording import natural_order
from afferents.store.responses import Responses, read_whole, steady_s

CONTROLS: dict[str, str] = {
    "permuted": "labels permuted: in each group textures are named otherwise",
    "shuffled": "time shuffled: the same values in any order",
    "offsets": "offsets alone: each channel's mean, under noise that is the same in all recordings",
    "amplitudes": "amplitudes alone: noise as loud as each channel, without its mean",
}
"""What is left, in words, by name."""

Floats = NDArray[np.floating]


def list_controls(split: Split) -> tuple[str, ...]:
    """Return the controls that can be made: labels of parts of a recording can't be exchanged."""
    return tuple(name for name in CONTROLS if split.whole or name != "permuted")


def apply_control(recordings: Sequence[Responses], control: str, split: Split) -> list[Responses]:
    """Return recordings as a control leaves them.

    What is drawn depends on the recording's name alone, so that every process draws the same.

    Parameters
    ----------
    control
        One of `CONTROLS`; ``none`` for the recordings as they are.
    split
        What is held out: textures are exchanged within its groups.

    Raises
    ------
    InputError
        If labels can't be exchanged, since groups share recordings.
    """
    if control == "none":
        return list(recordings)
    if control == "permuted":
        if not split.whole:
            raise InputError(
                "--control permuted: expected whole recordings to be held out, found --split "
                f"{split.name}, where both sides of a recording would have one false texture"
            )
        groups = split.by_recording(recordings)
        of = np.array([groups[str(one.attrs["name"])] for one in recordings])
        textures = np.array([str(one.attrs[dims.TEXTURE]) for one in recordings])
        named = zip(recordings, exchange_labels(textures, of).tolist(), strict=True)
        return [one.assign_attrs({dims.TEXTURE: texture}) for one, texture in named]
    if any(map(dims.of_cells, recordings)):
        expected = "sound or markers, whose ways can be changed"
        raise InputError(f"--control {control}: expected {expected}, found cells; take 'permuted'")
    each = [_find_series(responses) for responses in recordings]
    spreads: dict[str, list[float]] = {}
    for name, (whole, used) in (item for its in each for item in its.items()):
        spreads.setdefault(name, []).append(measure_spread(whole.values[used]))
    usual = {name: float(np.median(values)) for name, values in spreads.items()}
    return [
        _change(responses, its, control, usual)
        for responses, its in zip(recordings, each, strict=True)
    ]


def exchange_labels(labels: NDArray[Any], groups: NDArray[Any]) -> NDArray[Any]:
    """Return labels (n,) by which textures are named otherwise in each group, (n,).

    So what is learnt of a texture in one group is false in another, however few textures there are.

    In the first group as they are, in the next by the next in a list, then by the next but one.
    """
    found, number = np.unique(labels, return_inverse=True)
    in_order = np.array(sorted(range(len(found)), key=lambda n: natural_order(str(found[n]))))
    # in no order of their own: the next coarser drum at the next slower speed may be as loud
    listed = np.random.default_rng(0).permutation(in_order)
    rank = {group: n for n, group in enumerate(sorted(set(groups.tolist()), key=order))}
    place = np.argsort(listed)[number] + np.array([rank[group] for group in groups.tolist()])
    return np.asarray(found[listed[place % len(found)]])


def stands_out(left: float, own: float, chance: float, n_recordings: int) -> bool:
    """Return whether a control leaves enough that the model's accuracy may rest on it.

    That is half of what the model has above chance, 10 points, and more than chance alone gives.

    Parameters
    ----------
    left, own, chance
        Accuracy under the control, the model's, and that of a constant answer: shares, 0 to 1.
    """
    by_chance = 2 * (chance * (1 - chance) / n_recordings) ** 0.5
    return bool(left - chance > max((own - chance) / 2, 0.1, by_chance))


def make_rng(recording: str) -> np.random.Generator:
    """Return what draws for a recording: the same numbers in every process."""
    return np.random.default_rng(zlib.crc32(recording.encode()))


def measure_spread(values: Floats) -> float:
    """Return the standard deviation over time of a series (time, ...), mean over its channels."""
    return float(np.nanmean(np.nanstd(values, axis=0)))


def change_series(values: Floats, control: str, usual: float, rng: np.random.Generator) -> Floats:
    """Return what a control leaves of a series (time, ...).

    Parameters
    ----------
    control
        `shuffled`, `offsets` or `amplitudes`.
    usual
        Standard deviation of the noise over `offsets`: that of the median recording.
    """
    if control == "shuffled":
        return np.asarray(rng.permutation(values, axis=0))
    noise = rng.standard_normal(values.shape)
    if control == "offsets":
        return np.asarray(np.nanmean(values, axis=0) + usual * noise, values.dtype)
    return np.asarray(np.nanstd(values, axis=0) * noise, values.dtype)


def _find_series(responses: Responses) -> dict[str, tuple[xr.DataArray, slice]]:
    """Return what of a recording changes with time, and its steady part; all if none is known."""
    steady, found = steady_s(responses), {}
    for name in (dims.RA2, dims.POSITION):
        if name in responses:
            whole, used = read_whole(responses, name), slice(None)
            if steady is not None and name == dims.RA2:
                rate = float(whole.attrs[dims.SAMPLE_RATE])
                used = slice(*(round(edge * rate) for edge in steady))
            elif steady is not None:
                used = slice(*np.searchsorted(responses[dims.TIME].values, steady))
            found[name] = whole, used
    return found


def _change(
    responses: Responses,
    series: Mapping[str, tuple[xr.DataArray, slice]],
    control: str,
    usual: Mapping[str, float],
) -> Responses:
    """Return a recording with nothing but what a control leaves.

    Parameters
    ----------
    usual
        Standard deviation over time of such a series in the median recording.
    """
    rng = make_rng(str(responses.attrs["name"]))
    for name, (one, used) in series.items():
        # Of markers it is the way from rest that has a mean and a spread.
        rest = read_whole(responses, dims.REST_POSITION) if name == dims.POSITION else None
        values = one.values - (0 if rest is None else rest.values)
        values[used] = change_series(values[used], control, usual[name], rng)
        if rest is None:
            responses = responses.assign({name: drop_digest(one.copy(data=values))})
        else:
            moved = drop_digest(one.copy(data=(values + rest.values).astype(one.dtype)))
            responses = replace_markers(responses, moved, rest)
    return responses
