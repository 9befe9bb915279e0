"""From the responses of all recordings to the samples of one encoding."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from afferents.channels import (
    hold,
    ra1,
    ra1_circumferential,
    ra1_signed,
    ra1_vector,
    sa1_vector,
)
from afferents.core import dims
from afferents.core.cut import Cut, cut_audio, cut_frames
from afferents.core.errors import InputError
from afferents.core.extras import import_extra
from afferents.core.families import BEST, FAMILIES, MEMORY_FRAMES, VIBRATIONS, Encoding, Family
from afferents.core.progress import Progress
from afferents.core.responses import Responses, steady_s
from afferents.core.samples import Samples, concatenate
from afferents.encodings import (
    FRAMES,
    Encodings,
    WavenumberEncoding,
    kernel_samples,
    order_samples,
    require_kernels,
    require_orders,
    require_run,
    require_window,
    spatial_samples,
    spatiotemporal_samples,
    spectral_samples,
    wavenumber_samples,
)

Source = tuple[str, Encoding]
"""What samples are made of, and how: an afferent and an encoding."""

LARGEST = 1e18
"""Its square, summed over a window, still is a number in float32."""

_MADE_OF = {
    dims.RA1_SIGNED: dims.SA1,
    dims.SA1_VECTOR: dims.POSITION,
    dims.RA1_VECTOR: dims.POSITION,
    dims.RA1_CIRCUMFERENTIAL: dims.POSITION,
}
"""What is worked out when asked for, and the variable that it is worked out of."""


def sources_of(family: Family) -> tuple[Source, ...]:
    """Return what a family's samples are made of; a fusion has several kinds."""
    if not family.parts:
        return ((family.afferent, family.encoding),)
    return tuple(source for name in family.parts for source in sources_of(FAMILIES[name]))


def supported(family: Family, responses: Responses) -> bool:
    """Tell whether a recording has what a model family learns from."""
    has_all = all(_has(responses, *source) for source in sources_of(family))
    if has_all and family.speed_from == "fingertip":
        # The speed is measured between channels.
        return responses[dims.RA2].sizes[dims.CHANNEL] > 1
    return has_all


def _has(responses: Responses, afferent: str, encoding: Encoding) -> bool:
    if _MADE_OF.get(afferent, afferent) not in responses:
        return False
    return encoding in VIBRATIONS or dims.ROW in responses.coords


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
        lacks what it needs, and the families that are possible. If one of them needs a package
        that is missing: said here, before any other has learnt for hours.
    """
    possible = [f for f in FAMILIES.values() if all(supported(f, r) for r in recordings)]
    able = [family for family in wanted if family in possible]
    if len(able) < len(wanted) and not (may_leave_out and able):
        refused = next(family for family in wanted if family not in possible)
        lacking = next(r.attrs["name"] for r in recordings if not supported(refused, r))
        raise InputError(
            "--models",
            f"some that these data support ({', '.join(f.name for f in possible) or 'none'})",
            f"{refused.name}, for which {lacking} lacks {_needs(refused)}",
        )
    if any(family.encoding == "kernels" for family in able):
        import_extra("baselines", "--models rocket-te", "pyts")
    return able


def _needs(family: Family) -> str:
    if family.speed_from == "fingertip":
        return "several vibration channels to measure the speed between"
    return f"{' and '.join(afferent for afferent, _ in sources_of(family))} in the form it needs"


def best_of(recordings: Sequence[Responses]) -> Family:
    """Return the family that is recommended for such recordings; see `BEST`.

    Raises
    ------
    InputError
        If they support none.
    """
    for name in BEST:
        if all(supported(FAMILIES[name], responses) for responses in recordings):
            return FAMILIES[name]
    return require_support([FAMILIES[BEST[0]]], recordings, may_leave_out=False)[0]


def kept_part(
    responses: Responses, afferent: str, encoding: Encoding, cut: Cut, how: Encodings
) -> slice:
    """Return what the cut keeps of a recording, after checking that it can be encoded.

    Images begin with the rest frame: before it there are no markers, and nothing to hold.

    Raises
    ------
    InputError
        If the recording is too short for the cut, a window or a run of frames.
    """
    name, steady = responses.attrs["name"], steady_s(responses)
    response = responses[_MADE_OF.get(afferent, afferent)]
    if encoding in VIBRATIONS:
        rate, n = float(response.attrs[dims.SAMPLE_RATE]), response.sizes[dims.AUDIO_TIME]
        kept = cut_audio(n, rate, cut, steady, name)
        if encoding == "spectral":
            require_window(kept.stop - kept.start, rate, how.spectral, name)
        elif encoding == "orders":
            require_orders(kept.stop - kept.start, rate, how.orders, name)
        else:
            require_kernels(kept.stop - kept.start, rate, how.kernels, name)
        return kept
    every = how.wavenumbers.every if encoding == "wavenumbers" else 1
    frames = cut_frames(response[dims.TIME].values, cut, steady, name)
    rest = int(responses.attrs.get("rest_frame", 0))
    start, rest, stop = (-(-frame // every) for frame in (frames.start, rest, frames.stop))
    kept = slice(max(start, rest + MEMORY_FRAMES[afferent]), stop)
    lengths = {"spatiotemporal": FRAMES, "wavenumbers": how.wavenumbers.frames}
    require_run(kept.stop - kept.start, name, lengths.get(encoding, 1))
    return kept


def require_numbers(responses: Responses, kept: slice) -> None:
    """Refuse vibration that holds what is no number, or a number that has no power in float32.

    Parameters
    ----------
    kept
        Samples that are encoded.

    Raises
    ------
    InputError
        Naming the recording and the first such sample.
    """
    vibration = responses[dims.RA2]
    rate = float(vibration.attrs[dims.SAMPLE_RATE])
    values = _load(responses.isel({dims.AUDIO_TIME: kept}), dims.RA2).values
    sound = np.abs(values) < LARGEST  # False for NaN
    if sound.all():
        return
    first = int(np.argmin(sound.all(axis=1)))
    found, n = values[first][~sound[first]][0], kept.start + first
    raise InputError(
        f"{dims.RA2} of {responses.attrs['name']}",
        "samples that are numbers",
        f"{found:.3g} at sample {n} ({n / rate:.3f} s)",
        "record and extract it again, or skip it with --keep-going",
    )


def encode(
    responses: Responses, afferent: str, encoding: Encoding, cut: Cut, how: Encodings
) -> Samples:
    """Encode one recording; see `kept_part` and `require_numbers` for what it refuses.

    Lost markers are held at their last seen value before they become images; windows never
    cross recordings since each is encoded alone.
    """
    kept = kept_part(responses, afferent, encoding, cut, how)
    if encoding in VIBRATIONS:
        require_numbers(responses, kept)
    if encoding == "spectral":
        return spectral_samples(_load(responses, afferent), kept, how.spectral)
    if encoding == "orders":
        return order_samples(_load(responses, afferent), kept, how.orders)
    if encoding == "kernels":
        return kernel_samples(_load(responses, afferent), kept, how.kernels)
    memory = MEMORY_FRAMES[afferent]
    if encoding == "wavenumbers":
        response = response_of(responses, afferent, how.wavenumbers)
        return wavenumber_samples(response, kept, memory, how.wavenumbers)
    encoder = spatial_samples if encoding == "spatial" else spatiotemporal_samples
    return encoder(hold(_load(responses, afferent)), kept, memory)


def response_of(responses: Responses, afferent: str, encoding: WavenumberEncoding) -> xr.DataArray:
    """Return what waves are looked for in: of every so manyth frame, lost markers held."""
    slower = responses.isel({dims.TIME: slice(None, None, encoding.every)})
    return hold(_worked_out(slower, afferent))


def _worked_out(responses: Responses, afferent: str) -> xr.DataArray:
    """Return a response of the frames that are there, from SA-I or from the markers' places."""
    if afferent == dims.SA1:
        return _load(responses, dims.SA1)
    if afferent in (dims.RA1, dims.RA1_SIGNED):
        sa1 = _load(responses, dims.SA1)
        change = ra1(sa1) if afferent == dims.RA1 else ra1_signed(sa1)
        return _labelled(change, responses)
    displacement = sa1_vector(_load(responses, dims.POSITION), responses[dims.REST_POSITION])
    further = {dims.RA1_VECTOR: ra1_vector, dims.RA1_CIRCUMFERENTIAL: ra1_circumferential}
    response = further[afferent](displacement) if afferent in further else displacement
    return _labelled(response, responses)


def _load(responses: Responses, variable: str) -> xr.DataArray:
    """Read a response into memory, with its own attributes and the recording's."""
    try:
        # Not `load`, which would keep what was read in the responses.
        response = responses[variable].compute()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"{variable} of {responses.attrs['name']}",
            "data that can be read",
            f"{error}",
            "extract the recording again",
        ) from error
    return _labelled(response, responses)


def _labelled(response: xr.DataArray, responses: Responses) -> xr.DataArray:
    return response.assign_attrs({**response.attrs, **responses.attrs})


def encode_all(
    recordings: Sequence[Responses],
    afferent: str,
    encoding: Encoding,
    cut: Cut,
    how: Encodings,
    progress: Progress,
) -> Samples:
    """Encode every recording and join the samples."""
    label = f"encoding {afferent} {encoding}"
    return concatenate(
        [
            encode(responses, afferent, encoding, cut, how)
            for responses in progress.track(recordings, label, len(recordings))
        ]
    )
