"""From the responses of all recordings to the samples of one encoding."""

from collections.abc import Sequence

import xarray as xr

from afferents.channels import hold
from afferents.core import dims
from afferents.core.cut import Cut, cut_audio, cut_frames
from afferents.core.errors import AfferentsError, InputError
from afferents.core.families import FAMILIES, Encoding, Family
from afferents.core.progress import Progress
from afferents.core.responses import Responses, steady_s
from afferents.core.samples import Samples, concatenate
from afferents.encodings import (
    SpectralEncoding,
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


def supported_families(wanted: Sequence[Family], recordings: Sequence[Responses]) -> list[Family]:
    """Return the families that every recording supports.

    Raises
    ------
    InputError
        If none of them does, naming the families that are possible.
    """
    able = [f for f in wanted if all(supported(f, r) for r in recordings)]
    if not able:
        possible = [
            name for name, f in FAMILIES.items() if all(supported(f, r) for r in recordings)
        ]
        raise InputError(
            "--models",
            f"some that these data support ({', '.join(possible) or 'none'})",
            ", ".join(f.name for f in wanted),
        )
    return able


def encode(
    responses: Responses, afferent: str, encoding: Encoding, cut: Cut, spectral: SpectralEncoding
) -> Samples:
    """Encode one recording.

    Lost markers are held at their last seen value before they become images; windows never
    cross recordings since each is encoded alone.
    """
    name, steady = responses.attrs["name"], steady_s(responses)
    response: xr.DataArray = responses[afferent].assign_attrs(
        {**responses[afferent].attrs, **responses.attrs}
    )
    if encoding == "spectral":
        rate = response.attrs[dims.SAMPLE_RATE]
        kept = cut_audio(response.sizes[dims.AUDIO_TIME], rate, cut, steady, name)
        return spectral_samples(response, kept, spectral)
    frames = cut_frames(response[dims.TIME].values, cut, steady, name)
    encoder = spatial_samples if encoding == "spatial" else spatiotemporal_samples
    return encoder(hold(response.load()), frames, MEMORY_FRAMES[afferent])


def encode_all(
    recordings: Sequence[Responses],
    afferent: str,
    encoding: Encoding,
    cut: Cut,
    spectral: SpectralEncoding,
    progress: Progress,
    skipped: dict[str, str] | None = None,
) -> Samples:
    """Encode every recording and join the samples.

    Parameters
    ----------
    skipped
        None to stop at the first recording that fails; otherwise failing recordings are left
        out and entered here with the reason.
    """
    parts = []
    label = f"encoding {afferent} {encoding}"
    for responses in progress.track(recordings, label, len(recordings)):
        name = responses.attrs["name"]
        if skipped is not None and name in skipped:
            continue
        try:
            parts.append(encode(responses, afferent, encoding, cut, spectral))
        except AfferentsError as error:
            if skipped is None:
                raise
            skipped[name] = str(error)
    return concatenate(parts)
