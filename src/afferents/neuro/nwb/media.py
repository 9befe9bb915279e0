"""Video, sound and marker tracks of an NWB file.

Sound and tracks are large. The file is written without them first; each recording's are then put
into their places in it, so that one recording at a time is in memory.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from afferents import dims
from afferents.neuro.nwb.tables import Placed
from afferents.recordings.pictures import ImageFolder
from afferents.store.recording import Recording
from afferents.store.responses import check_values

CAMERA, TRACKS = "camera", "markers"
_CHUNK = 4096
_REGULAR_S = 1e-6
"""Steps between frames that differ less are one rate."""
_COMPRESSION = {"compression": "gzip", "compression_opts": 4, "shuffle": True}


def add_videos(
    nwbfile: Any, placed: Sequence[Placed], recordings: Mapping[str, Recording], out: Path
) -> None:
    """Add each recording's video as an external file, by its path from the NWB file."""
    from pynwb.image import ImageSeries

    for one in placed:
        video = recordings[one.responses.attrs["name"]].video
        if video is None or dims.TIME not in one.responses.coords:
            continue
        files = [video.path]
        if isinstance(video, ImageFolder) and video.path.is_dir():
            files = [Path(str(file)) for file in video.numbered.values()]
        steps_s = np.diff(one.frame_times_s)
        clock: dict[str, Any] = {"timestamps": one.frame_times_s}
        if len(steps_s) and np.ptp(steps_s) < _REGULAR_S:  # NWB wants a rate then
            clock = {"starting_time": one.frame_times_s[0], "rate": float(1 / steps_s.mean())}
        nwbfile.add_acquisition(
            ImageSeries(
                name=f"video_{one.name}",
                description="Markers on the inside of the skin, as the camera saw them.",
                external_file=[os.path.relpath(file, out.parent.resolve()) for file in files],
                starting_frame=list(range(len(files))),
                format="external",
                dimension=[video.width, video.height],
                unit="n.a.",
                device=nwbfile.devices[CAMERA],
                num_samples=len(one.frame_times_s),
                **clock,
            )
        )


def add_sounds(nwbfile: Any, placed: Sequence[Placed]) -> None:
    """Add room for each recording's vibration: sound, or channels of another kind."""
    from ndx_sound import AcousticWaveformSeries
    from pynwb import TimeSeries

    for one in placed:
        if dims.RA2 not in one.responses:
            continue
        vibration = one.responses[dims.RA2]
        shape = vibration.shape[:1] if vibration.shape[1] == 1 else vibration.shape
        unit = str(vibration.attrs.get(dims.UNITS) or "n.a.")
        # A series of sound has one or two channels, and no unit: others keep theirs.
        is_sound = unit in ("full scale", "n.a.") and (len(shape) == 1 or shape[1] == 2)
        kind = AcousticWaveformSeries if is_sound else TimeSeries
        nwbfile.add_acquisition(
            kind(
                name=f"sound_{one.name}",
                description="RA-II: vibration, as recorded.",
                data=_room(shape, True),
                unit=unit,
                rate=float(vibration.attrs[dims.SAMPLE_RATE]),
                starting_time=one.start_s,
            )
        )


def _room(shape: tuple[int, ...], chunks: Any) -> Any:
    """Return room for numbers that are written when the file is there."""
    from hdmf.backends.hdf5 import H5DataIO

    return H5DataIO(shape=shape, dtype=np.dtype("float32"), chunks=chunks, **_COMPRESSION)


def add_tracks(nwbfile: Any, placed: Sequence[Placed]) -> None:
    """Add room for where markers are seen: a series a marker, over the whole session.

    Cells, which never move, are left out.
    """
    from hdmf.backends.hdf5 import H5DataIO
    from ndx_pose import PoseEstimation, PoseEstimationSeries, Skeleton, Skeletons

    tracked = [one for one in placed if dims.POSITION in one.responses]
    if not tracked or dims.of_cells(tracked[0].responses):
        return
    nodes = [f"marker_{m:03d}" for m in range(tracked[0].responses.sizes[dims.MARKER])]
    times_s = np.concatenate([one.frame_times_s for one in tracked])
    chunk, series = min(len(times_s), _CHUNK), list[Any]()
    for marker, node in enumerate(nodes):
        series.append(
            PoseEstimationSeries(
                name=node,
                description=f"Centre of marker {marker} in the camera's image; NaN where lost.",
                data=_room((len(times_s), 2), (chunk, 2)),
                confidence=_room((len(times_s),), (chunk,)),
                confidence_definition="1 where the marker was found, 0 where it was lost",
                reference_frame="Centre of the pixel at the top left; x to the right, y down.",
                unit="pixels",
                timestamps=series[0] if series else H5DataIO(times_s, **_COMPRESSION),
            )
        )
    skeleton = Skeleton(name="skin", nodes=nodes)
    module = nwbfile.create_processing_module(
        "behavior", "Where markers on the skin are seen, all recordings one after another."
    )
    module.add(Skeletons(skeletons=[skeleton]))
    module.add(
        PoseEstimation(
            name=TRACKS,
            description="Markers on the inside of the skin, followed from frame to frame.",
            pose_estimation_series=series,
            skeleton=skeleton,
            device=nwbfile.devices[CAMERA],
            source_software="afferents",
        )
    )


def write_values(file: Any, one: Placed, first_frame: int) -> int:
    """Write sound and tracks of a recording where there is room for them in the HDF5 file.

    Parameters
    ----------
    file
        A `h5py.File`.
    first_frame
        Where its frames begin among those of the session.

    Returns
    -------
    Where those of the next begin.
    """
    name = one.responses.attrs["name"]
    sound = f"acquisition/sound_{one.name}/data"
    if sound in file:
        values = check_values(one.responses[dims.RA2], f"{dims.RA2} of {name}").values
        file[sound][...] = values.reshape(file[sound].shape)
    tracks = f"processing/behavior/{TRACKS}"
    if tracks not in file or dims.POSITION not in one.responses:
        return first_frame
    where = f"{dims.POSITION} of {name}"
    position = check_values(one.responses[dims.POSITION], where).values
    detected = one.responses[dims.DETECTED].values
    last = first_frame + len(position)
    for marker in range(position.shape[1]):
        series = file[f"{tracks}/marker_{marker:03d}"]
        series["data"][first_frame:last] = position[:, marker]
        series["confidence"][first_frame:last] = detected[:, marker]
    return last
