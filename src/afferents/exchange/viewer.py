"""A recording in rerun: the camera with its markers, SA-I and RA-I as images, sound and drum."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from afferents import dims
from afferents.errors import InputError
from afferents.exchange.bag_tracks import QUALITY, jpegs
from afferents.files import Place, write_aside
from afferents.markers.places import images_of
from afferents.outputs import require_free
from afferents.plugins import import_extra
from afferents.recordings.session import read_session
from afferents.store.drum_path import way_in
from afferents.store.integrity import is_group
from afferents.store.recording import Recording
from afferents.store.responses import Responses
from afferents.store.zarr_store import open_responses

_LOUDNESS_HZ = 100.0


def write_view(
    source: Path, recording: str | None, store: Path | None, save: Path | None
) -> dict[str, int]:
    """Show a recording in rerun's viewer, or write it for it.

    Parameters
    ----------
    source
        A session or a store.
    recording
        Its name; None for the first.
    store
        Of a session: the store that was extracted from it.
    save
        File ``.rrd`` to write instead of opening the viewer.

    Returns
    -------
    How many values were logged, by entity.

    Raises
    ------
    InputError
        If the extra ``view`` is missing, or there is no such recording.
    """
    rr: Any = import_extra("view", "view", "rerun")
    session = None if is_group(source) else read_session(source)
    stored = open_responses(source) if session is None else open_responses(store) if store else []
    responses = {str(one.attrs["name"]): one for one in stored}
    recordings = {one.name: one for one in session.recordings} if session else {}
    names = list(recordings or responses)
    name = names[0] if recording is None else recording
    if name not in names:
        raise InputError(
            f"recording: expected one of {source} ({', '.join(names[:5])}, ...), found '{name}'"
        )
    if store is not None and name not in responses:
        raise InputError(
            f"{store}: expected the recording '{name}', found none; give the session's own store"
        )
    rr.init("afferents", recording_id=name, spawn=save is None)
    values = _logged(rr, recordings.get(name), responses.get(name))
    if save is None:
        return _log(rr, values)
    require_free(save, "a recording for rerun", _is_rrd, force=True, reads=[source])
    with write_aside(save) as partial:
        rr.save(str(partial))
        return _log(rr, values)


def _is_rrd(path: Path) -> bool:
    return path.suffix == ".rrd"


def _log(rr: Any, values: Iterator[tuple[float, str, Any]]) -> dict[str, int]:
    """Log values at their times, close, and return how many there were of each entity."""
    n: dict[str, int] = {}
    try:
        for at_s, entity, value in values:
            rr.set_time("recording", duration=at_s)
            rr.log(entity, value)
            n[entity] = n.get(entity, 0) + 1
    finally:
        rr.disconnect()
    return n


def _logged(
    rr: Any, recording: Recording | None, responses: Responses | None
) -> Iterator[tuple[float, str, Any]]:
    if recording is not None and recording.video is not None:
        for at_s, data in jpegs(recording.video, QUALITY):
            yield at_s, "camera", rr.EncodedImage(contents=data, media_type="image/jpeg")
    if recording is not None and recording.audio is not None:
        sound = recording.audio.read()
        yield from _loudness(rr, sound.values, recording.audio.sample_rate_hz)
    if responses is None:
        return
    if recording is None and dims.RA2 in responses:
        rate_hz = responses[dims.RA2].attrs[dims.SAMPLE_RATE]
        yield from _loudness(rr, responses[dims.RA2].values, rate_hz)
    way = way_in(responses)
    if way is not None:
        speeds = np.gradient(way.position_mm, way.time_s)
        for at_s, speed in zip(way.time_s.tolist(), speeds.tolist(), strict=True):
            yield at_s, "drum/speed_mm_s", rr.Scalars(speed)
    if dims.POSITION not in responses:
        return
    for at_s, position in zip(
        responses[dims.TIME].values.tolist(), responses[dims.POSITION].values, strict=True
    ):
        seen = position[np.isfinite(position).all(axis=1)]
        yield at_s, "camera/markers", rr.Points2D(seen, radii=1.5, colors=(255, 60, 60))
    row, column = responses[dims.ROW].values, responses[dims.COLUMN].values
    for name in (dims.SA1, dims.RA1):
        images = images_of(np.nan_to_num(responses[name].values), row, column)
        top = float(np.quantile(images, 0.999)) or 1.0
        grey = (255 * np.clip(images / top, 0, 1)).astype(np.uint8)
        for at_s, image in zip(responses[dims.TIME].values.tolist(), grey, strict=True):
            yield at_s, name, rr.Image(image, color_model="L")


def _loudness(rr: Any, sound: Any, rate_hz: float) -> Iterator[tuple[float, str, Any]]:
    """Yield the loudness of each hundredth of a second, dB of full scale."""
    size = max(1, round(rate_hz / _LOUDNESS_HZ))
    for first in range(0, len(sound) - size + 1, size):
        power = float(np.square(sound[first : first + size], dtype=np.float64).mean())
        yield first / rate_hz, "microphone/dB", rr.Scalars(10 * np.log10(power + 1e-12))


def view(
    source: Place, recording: str | None = None, store: Place | None = None,
    save: Place | None = None,
) -> dict[str, int]:  # fmt: skip
    """Show a recording in rerun's viewer: camera and markers, SA-I, RA-I, sound, drum, on one time.

    Needs the extra ``view``.

    Parameters
    ----------
    source
        A session, or a store, which has no pictures of the camera.
    recording
        Its name, such as ``4/60``; None for the first.
    store
        Of a session: the store that was extracted from it, for markers and responses.
    save
        File to write, which ``rerun FILE`` shows later; None to open the viewer.

    Returns
    -------
    dict
        How many values were logged, by entity.

    Raises
    ------
    InputError
        If there is no such recording, or the package is missing.

    Examples
    --------
    >>> view("responses.zarr", "4/60", save="touch.rrd")["sa1"]
    1800
    """
    given = [None if path is None else Path(path) for path in (store, save)]
    return write_view(Path(source), recording, *given)
