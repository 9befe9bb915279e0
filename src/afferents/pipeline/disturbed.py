"""Responses as a disturbance leaves them, and samples of which some are learnt, others tested."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import xarray as xr

from afferents.channels import ra1, sa1
from afferents.core import dims
from afferents.core.errors import InputError
from afferents.core.fold import Fold
from afferents.core.responses import Responses
from afferents.core.samples import Samples, concatenate
from afferents.core.split import Group
from afferents.evaluation import LeaveOneGroupOut
from afferents.evaluation.ablation import Ablation
from afferents.evaluation.disturbance import Disturbance
from afferents.pipeline.reading import read_whole


def disturbed(responses: Responses, of_vibration: bool, disturbance: Disturbance) -> Responses:
    """Return the responses to a recording, disturbed: its vibration, or what its markers do.

    Noise is added to the positions of markers. SA-I and RA-I are worked out from these anew, as
    all other channels are, so that RA-I has the difference of two noises.

    Raises
    ------
    InputError
        If the recording has no positions that could be disturbed.
    """
    if not (disturbance.sound if of_vibration else disturbance.of_markers):
        return responses
    name = str(responses.attrs["name"])
    if of_vibration:
        whole = read_whole(responses, dims.RA2)
        noisy = disturbance.with_noise(whole.values, name)
        return responses.assign({dims.RA2: _of_no_digest(whole.copy(data=noisy))})
    if dims.POSITION not in responses:
        expected = "recordings with the positions of markers"
        raise InputError("--disturb", expected, f"none in {name}", "disturb the sound alone")
    return _with_markers(responses, disturbance, name)


def _with_markers(responses: Responses, disturbance: Disturbance, name: str) -> Responses:
    position = read_whole(responses, dims.POSITION)
    rest = read_whole(responses, dims.REST_POSITION)
    at_rest = int(responses.attrs.get("rest_frame", 0))
    noise = disturbance.noise(position.shape, name)
    seen = position.values + noise
    still = (rest + noise[at_rest]).astype(rest.dtype)
    if disturbance.lost:
        unseen = disturbance.unseen(position[dims.TIME].values, rest.values, name)
        unseen[: at_rest + 1] = False
        seen[unseen] = np.nan
    if disturbance.frames:
        left = disturbance.left(len(seen), name)
        used = np.concatenate([np.arange(at_rest + 1), left[left > at_rest]])
    else:
        used = np.arange(len(seen))
    moved = _of_no_digest(position.copy(data=seen.astype(position.dtype)))
    moved = moved.isel({dims.TIME: used})
    slow = sa1(moved, _of_no_digest(still))
    found = responses.isel({dims.TIME: used}).assign({
        dims.POSITION: moved,
        dims.DETECTED: moved.notnull().all(dims.SPACE),
        dims.REST_POSITION: _of_no_digest(still),
        dims.SA1: _of_no_digest(slow),
        dims.RA1: _of_no_digest(ra1(slow)),
    })  # fmt: skip
    return found.assign_attrs(responses.attrs)


def _of_no_digest(response: xr.DataArray) -> xr.DataArray:
    """Return a response without the digest of its values, which it no longer has."""
    kept = {k: v for k, v in response.attrs.items() if k in (dims.UNITS, dims.SAMPLE_RATE)}
    return response.drop_attrs(deep=False).assign_attrs(kept)


def in_variants(learnt: Samples, tested: Sequence[Samples]) -> Samples:
    """Return samples that are learnt from, then those that are tested, one array.

    The coordinate `variant` says which is which: 0 is learnt from, n is of the n-th test.
    """
    parts = [learnt, *tested]
    return concatenate([
        part.assign_coords({dims.VARIANT: (dims.SAMPLE, np.full(len(part), number))})
        for number, part in enumerate(parts)
    ])  # fmt: skip


def fold_of_variants(
    splitter: LeaveOneGroupOut,
    samples: Samples,
    held_out: Group,
    ablation: Ablation,
    tested: frozenset[str],
) -> tuple[int, Fold]:
    """Return a fold and its rank: training samples of one variant, test samples of the others.

    Where there are no variants it is the fold of the samples as they are.
    """
    rank, folds, offset = 0, [], 0
    for part in _variants(samples):
        rank, fold = splitter.fold(part, held_out)
        fold = ablation.fold(fold, part, tested)
        folds.append(replace(fold, test=fold.test + offset))
        offset += len(part)
    tests = folds[1:] or folds
    return rank, replace(folds[0], test=np.concatenate([fold.test for fold in tests]))


def _variants(samples: Samples) -> list[Samples]:
    """Return the samples of each variant, as they stand one after the other."""
    if dims.VARIANT not in samples.coords:
        return [samples]
    edges = np.flatnonzero(np.diff(samples[dims.VARIANT].values)) + 1
    bounds = [0, *edges.tolist(), len(samples)]
    return [samples.isel({dims.SAMPLE: slice(*pair)}) for pair in pairwise(bounds)]
