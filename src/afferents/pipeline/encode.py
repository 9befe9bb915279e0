"""From the responses of all recordings to the samples of one encoding."""

from collections.abc import Sequence

import xarray as xr

from afferents.channels import hold
from afferents.core import dims
from afferents.core.cut import Cut, cut_audio, cut_frames
from afferents.core.errors import InputError
from afferents.core.families import FAMILIES, Encoding, Family
from afferents.core.progress import Progress
from afferents.core.responses import Responses, steady_s
from afferents.core.samples import Samples, concatenate
from afferents.encodings import (
    FRAMES,
    SpectralEncoding,
    require_run,
    require_window,
    spatial_samples,
    spatiotemporal_samples,
    spectral_samples,
)

MEMORY_FRAMES = {dims.SA1: 0, dims.RA1: 1}
"""How many frames back a response looks (Eqs. 1 and 2)."""


def supported(family: Family, responses: Responses) -> bool:
    """Tell whether a recording has what a model family learns from."""
    if family.afferent not in responses:
        return False
    return family.encoding == "spectral" or dims.ROW in responses.coords


def require_support(
    wanted: Sequence[Family], recordings: Sequence[Responses], may_leave_out: bool
) -> list[Family]:
    """Return the families that every recording supports.

    Parameters
    ----------
    may_leave_out
        Whether families that are not supported are left out instead of refused.

    Raises
    ------
    InputError
        If a family, or all of them, can't learn from these data; names a recording that
        lacks what it needs, and the families that are possible.
    """
    possible = [f for f in FAMILIES.values() if all(supported(f, r) for r in recordings)]
    able = [family for family in wanted if family in possible]
    if len(able) < len(wanted) and not (may_leave_out and able):
        refused = next(family for family in wanted if family not in possible)
        lacking = next(r.attrs["name"] for r in recordings if not supported(refused, r))
        raise InputError(
            "--models",
            f"some that these data support ({', '.join(f.name for f in possible) or 'none'})",
            f"{refused.name}, for which {lacking} has no {refused.afferent} in the form it needs",
        )
    return able


def kept_part(
    responses: Responses, afferent: str, encoding: Encoding, cut: Cut, spectral: SpectralEncoding
) -> slice:
    """Return what the cut keeps of a recording, after checking that it can be encoded.

    Images begin with the rest frame: before it there are no markers, and nothing to hold.

    Raises
    ------
    InputError
        If the recording is too short for the cut, a window or a run of frames.
    """
    name, steady, response = responses.attrs["name"], steady_s(responses), responses[afferent]
    if encoding == "spectral":
        rate, n = float(response.attrs[dims.SAMPLE_RATE]), response.sizes[dims.AUDIO_TIME]
        kept = cut_audio(n, rate, cut, steady, name)
        require_window(kept.stop - kept.start, rate, spectral, name)
        return kept
    frames = cut_frames(response[dims.TIME].values, cut, steady, name)
    first = int(responses.attrs.get("rest_frame", 0)) + MEMORY_FRAMES[afferent]
    kept = slice(max(frames.start, first), frames.stop)
    require_run(kept.stop - kept.start, name, FRAMES if encoding == "spatiotemporal" else 1)
    return kept


def encode(
    responses: Responses, afferent: str, encoding: Encoding, cut: Cut, spectral: SpectralEncoding
) -> Samples:
    """Encode one recording; see `kept_part` for what it refuses.

    Lost markers are held at their last seen value before they become images; windows never
    cross recordings since each is encoded alone.
    """
    kept = kept_part(responses, afferent, encoding, cut, spectral)
    response = _load(responses, afferent)
    if encoding == "spectral":
        return spectral_samples(response, kept, spectral)
    encoder = spatial_samples if encoding == "spatial" else spatiotemporal_samples
    return encoder(hold(response), kept, MEMORY_FRAMES[afferent])


def _load(responses: Responses, afferent: str) -> xr.DataArray:
    """Read a response into memory, with its own attributes and the recording's."""
    try:
        # Not `load`, which would keep what was read in the responses.
        response = responses[afferent].compute()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"{afferent} of {responses.attrs['name']}",
            "data that can be read",
            f"{error}",
            "extract the recording again",
        ) from error
    return response.assign_attrs({**response.attrs, **responses.attrs})


def encode_all(
    recordings: Sequence[Responses],
    afferent: str,
    encoding: Encoding,
    cut: Cut,
    spectral: SpectralEncoding,
    progress: Progress,
) -> Samples:
    """Encode every recording and join the samples."""
    label = f"encoding {afferent} {encoding}"
    return concatenate(
        [
            encode(responses, afferent, encoding, cut, spectral)
            for responses in progress.track(recordings, label, len(recordings))
        ]
    )
