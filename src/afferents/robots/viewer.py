"""A recording in rerun: the camera with its markers, SA-I and RA-I as images, sound and drum."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from afferents import dims, files, plugins
from afferents.markers.places import make_images
from afferents.robots.sources import QUALITY, Chosen, find_recordings, jpegs

_LOUDNESS_HZ = 100.0


def view(
    source: files.Place, recording: str | None = None, store: files.Place | None = None,
    save: files.Place | None = None,
) -> dict[str, int]:  # fmt: skip
    """Show a recording in rerun's viewer: camera, markers, SA-I, RA-I, sound and drum on one time.

    Needs the extra ``view``.

    Parameters
    ----------
    source
        A session, or a store that 'extract' wrote, which has no pictures of the camera.
    recording
        Its name, such as 4/60 (default: the first).
    store
        Store that was extracted from the session: adds markers and responses.
    save
        New file (.rrd) to write for 'rerun FILE', instead of opening the viewer.

    Returns
    -------
    dict
        How many values were logged, by entity.

    Raises
    ------
    InputError
        If there is no such recording, `save` is there already, or the package is missing.

    Examples
    --------
    >>> view("responses.zarr", "4/60", save="touch.rrd")["sa1"]
    1800
    """
    if save is not None:
        save = Path(save)
        files.require_free(save)
    rr: Any = plugins.import_extra("view", "view", "rerun")
    wanted = () if recording is None else (recording,)
    ((name, found),) = find_recordings(source, store, wanted, most=1).items()
    values = list_values(rr, found)
    rr.init("afferents", recording_id=name, spawn=save is None)
    if save is None:
        return _log(rr, values)
    with files.write_aside(save) as partial:
        rr.save(str(partial))
        return _log(rr, values)


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


def list_values(rr: Any, source: Chosen) -> Iterator[tuple[float, str, Any]]:
    """Yield what there is of a recording: when, as which entity, and the value."""
    recording, responses = source
    if recording is not None and recording.video is not None:
        for at_s, data in jpegs(recording.video, QUALITY):
            yield at_s, "camera", rr.EncodedImage(contents=data, media_type="image/jpeg")
    if recording is not None and recording.audio is not None:
        sound = recording.audio.read()
        yield from _loudness(rr, sound.values, recording.audio.sample_rate_hz)
    way = source.drum_path()
    if way is not None:
        speeds = np.gradient(way.position_mm, way.time_s)
        for at_s, speed in zip(way.time_s.tolist(), speeds.tolist(), strict=True):
            yield at_s, "drum/speed_mm_s", rr.Scalars(speed)
    if responses is None:
        return
    if recording is None and dims.RA2 in responses:
        rate_hz = responses[dims.RA2].attrs[dims.SAMPLE_RATE]
        yield from _loudness(rr, responses[dims.RA2].values, rate_hz)
    if dims.POSITION not in responses:
        return
    for at_s, position in zip(
        responses[dims.TIME].values.tolist(), responses[dims.POSITION].values, strict=True
    ):
        # rerun counts from the corner of the first pixel, we from its middle
        seen = position[np.isfinite(position).all(axis=1)] + 0.5
        yield at_s, "camera/markers", rr.Points2D(seen, radii=1.5, colors=(255, 60, 60))
    if dims.ROW not in responses.coords:  # markers in no layout make no image
        return
    row, column = responses[dims.ROW].values, responses[dims.COLUMN].values
    for name in (dims.SA1, dims.RA1):
        images = make_images(np.nan_to_num(responses[name].values), row, column)
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
