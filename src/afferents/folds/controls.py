"""Controls: recordings from which was taken what should tell their textures apart.

What is recognised all the same rests on something else: loudness, an offset of the day, or a
mistake of whoever made the data or the model.
"""

import zlib
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.errors import InputError
from afferents.folds.corruption import of_no_digest, with_markers
from afferents.folds.held_out import Split, order
from afferents.store.responses import Responses, read_whole, steady_s, textures_of

CONTROLS: dict[str, str] = {
    "permuted": "labels permuted: in each group textures are named otherwise",
    "shuffled": "time shuffled: the same values in any order",
    "offsets": "offsets alone: each channel's mean, under noise that is the same in all recordings",
    "amplitudes": "amplitudes alone: noise as loud as each channel, without its mean",
}
"""What is left, in words, by name."""

Floats = NDArray[np.floating]


def controls_of(split: Split) -> tuple[str, ...]:
    """Return the controls that can be asked: between parts of a recording labels can't be named."""
    return tuple(name for name in CONTROLS if split.whole or name != "permuted")


def controlled(recordings: Sequence[Responses], control: str, split: Split) -> list[Responses]:
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
        return _permuted(recordings, split)
    if any(map(dims.of_cells, recordings)):
        expected = "sound or markers, whose ways can be changed"
        raise InputError(f"--control {control}: expected {expected}, found cells; take 'permuted'")
    each = [_Series(responses) for responses in recordings]
    usual = {
        name: float(np.median([one.spread[name] for one in each if name in one.spread]))
        for name in (dims.RA2, dims.POSITION)
        if any(name in one.spread for one in each)
    }
    return [one.changed(control, usual) for one in each]


def _permuted(recordings: Sequence[Responses], split: Split) -> list[Responses]:
    """Name textures otherwise in each group: by the next in the list, the next but one, ...

    So what is learnt of a texture in one group is false in another, however few textures there are.
    """
    if not split.whole:
        raise InputError(
            "--control permuted: expected whole recordings to be held out, found --split "
            f"{split.name}, where both sides of a recording would have one false texture"
        )
    groups = split.by_recording(recordings)
    # in no order of their own: the next coarser drum at the next slower speed may be as loud
    textures = np.random.default_rng(0).permutation(textures_of(recordings)).tolist()
    rank = {group: n for n, group in enumerate(sorted(set(groups.values()), key=order))}

    def named(responses: Responses) -> str:
        place = textures.index(str(responses.attrs[dims.TEXTURE]))
        return str(textures[(place + rank[groups[str(responses.attrs["name"])]]) % len(textures)])

    return [one.assign_attrs({dims.TEXTURE: named(one)}) for one in recordings]


class _Series:
    """What of a recording changes with time, in the part of it that is used."""

    def __init__(self, responses: Responses) -> None:
        self.responses = responses
        self.rng = np.random.default_rng(zlib.crc32(str(responses.attrs["name"]).encode()))
        self.whole = {
            name: read_whole(responses, name)
            for name in (dims.RA2, dims.POSITION)
            if name in responses
        }
        self.spread = {
            name: float(np.nanmean(np.nanstd(one.values[self._used(name)], axis=0)))
            for name, one in self.whole.items()
        }

    def _used(self, name: str) -> slice:
        """Return the steady part of a series; all of it where none is known."""
        steady = steady_s(self.responses)
        if steady is None:
            return slice(None)
        if name == dims.RA2:
            rate = float(self.whole[name].attrs[dims.SAMPLE_RATE])
            return slice(*(round(edge * rate) for edge in steady))
        return slice(*np.searchsorted(self.responses[dims.TIME].values, steady))

    def changed(self, control: str, usual: Mapping[str, float]) -> Responses:
        """Return the recording with nothing but what a control leaves.

        Parameters
        ----------
        usual
            Standard deviation over time of such a series in the median recording.
        """
        found = self.responses
        for name, one in self.whole.items():
            # Of markers it is the way from rest that has a mean and a spread.
            rest = read_whole(found, dims.REST_POSITION) if name == dims.POSITION else None
            values = one.values - (0 if rest is None else rest.values)
            used = self._used(name)
            values[used] = self._left(values[used], control, usual[name])
            if rest is None:
                found = found.assign({name: of_no_digest(one.copy(data=values))})
            else:
                moved = of_no_digest(one.copy(data=(values + rest.values).astype(one.dtype)))
                found = with_markers(found, moved, rest)
        return found

    def _left(self, values: Floats, control: str, usual: float) -> Floats:
        if control == "shuffled":
            return np.asarray(self.rng.permutation(values, axis=0))
        mean, spread = np.nanmean(values, axis=0), np.nanstd(values, axis=0)
        noise = self.rng.standard_normal(values.shape)
        left: Floats = mean + usual * noise if control == "offsets" else spread * noise
        return np.asarray(left, values.dtype)
