"""One clock for a whole session, and the units and trials of an NWB file."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents import dims
from afferents.files import safe_names
from afferents.spikes.artificial import choose_stretch, end_times
from afferents.spikes.population import Spikes
from afferents.spikes.units import RATE_HZ
from afferents.store.responses import Responses, conditions

GAP_S = 1.0
"""Between recordings: how long it really was is not known."""


@dataclass(frozen=True)
class Placed:
    """A recording's place on the session's clock.

    Attributes
    ----------
    name
        Its name, as a file's object may be called; see `files.safe_names`.
    responses
        Of the recording.
    start_s
        When it began.
    """

    name: str
    responses: Responses
    start_s: float

    @property
    def frame_times_s(self) -> NDArray[np.float64]:
        """`(time,)`, when its frames were taken, on the session's clock."""
        return self.start_s + np.asarray(self.responses[dims.TIME].values, np.float64)


def place_recordings(recordings: Sequence[Responses]) -> list[Placed]:
    """Return recordings one after another, each from a whole second on.

    A store does not say at which time of day each recording was made, and NWB has one clock: it
    counts from the first recording's beginning.
    """
    found, start_s = [], 0.0
    names = safe_names(str(responses.attrs["name"]) for responses in recordings)
    for responses, name in zip(recordings, names.values(), strict=True):
        found.append(Placed(name, responses, start_s))
        start_s = float(np.ceil(start_s + max(end_times(responses), default=0.0) + GAP_S))
    return found


_TRIALS = {
    "texture": "What the fingertip slid over.",
    "speed_mm_s": "Sliding speed in mm/s; NaN where it is not known.",
    "repetition": "Number of the repetition, from 0.",
    "recording": "Name of the recording in the store.",
}
_UNITS = {
    "unit_name": "Name of the unit.",
    "class": "SA: slowly adapting type I. RA: rapidly adapting type I. PC: Pacinian (RA-II).",
    "resolution_s": "Spike times are no finer than this, in s: frames of the camera lie so far "
    "apart, and times between them are interpolated.",
}
_FIELD = "Markers that drive the unit (SA, RA), or channels of the vibration (PC), from 0."
_TAKEN = ("id", "start_time", "stop_time", "duration_s", "tags", "timeseries")


def add_trials(nwbfile: Any, spikes: Spikes, placed: Sequence[Placed]) -> NDArray[np.float64]:
    """Add a trial a recording: the stretch of it in which units were run.

    Returns
    -------
    `(trial,)`, when each begins on the session's clock, s.
    """
    from pynwb.epoch import TimeIntervals

    begin = np.array([one.start_s + choose_stretch(one.responses)[0] for one in placed])
    duration_s = spikes.trials["duration_s"].to_numpy(np.float64)
    ends = pd.DataFrame({"start_time": begin, "stop_time": begin + duration_s})
    table = ends.join(spikes.trials.drop(columns="duration_s"))
    further = pd.DataFrame([conditions(one.responses) for one in placed], index=table.index)
    for name in further:
        values = further[name].infer_objects()
        is_numeric = values.dtype.kind in "iufb"
        further[name] = values.astype(float) if is_numeric else values.fillna("").astype(str)
    names = safe_names(map(str, further)).values()  # some of which mean something else in the file
    further.columns = [f"condition_{one}" if one in _TAKEN else one for one in names]
    table = table.join(further.drop(columns=[name for name in further if name in table]))
    about = {str(name): _TRIALS.get(str(name), "A condition of the recording.") for name in table}
    columns = [{"name": name, "description": text} for name, text in about.items()]
    nwbfile.trials = TimeIntervals.from_dataframe(
        table, "trials", table_description="experimental trials", columns=columns
    )
    return begin


def add_units(nwbfile: Any, spikes: Spikes, begin_s: NDArray[np.float64]) -> None:
    """Add units with their spikes on the session's clock, and when each was observed.

    Columns are made as whole arrays: spike by spike, as `add_unit` has it, a session would not fit
    into memory.
    """
    from hdmf.common import ElementIdentifiers, VectorData
    from pynwb.misc import Units

    end_s = begin_s + spikes.trials["duration_s"].to_numpy(np.float64)
    seen = [np.flatnonzero(of_unit).tolist() for of_unit in spikes.recorded.T]
    times = [
        np.concatenate([np.empty(0), *(begin_s[t] + spikes.train(t, unit) for t in trials)])
        for unit, trials in enumerate(seen)
    ]
    intervals = [np.stack([begin_s[trials], end_s[trials]], axis=1) for trials in seen]
    columns = [
        *_ragged("spike_times", "Times of spikes on the session's clock, s.", times),
        *_ragged("obs_intervals", "Trials in which the unit was there, s.", intervals),
    ]
    values = {
        "unit_name": spikes.units.index.to_numpy(str).tolist(),
        "class": spikes.units["class"].to_numpy(str).tolist(),
        "resolution_s": spikes.units["resolution_s"].to_numpy(np.float64),
    }
    for name, about in _UNITS.items():
        columns.append(VectorData(name=name, description=about, data=values[name]))
    fields = [np.asarray(field, np.int64) for field in spikes.units["receptive_field"]]
    if all(map(len, fields)):
        columns += _ragged("receptive_field", _FIELD, fields)
    nwbfile.units = Units(
        name="units",
        description="Units that the fingertip's responses drive.",
        id=ElementIdentifiers(name="id", data=np.arange(spikes.n_units)),
        resolution=1 / RATE_HZ,
        columns=columns,
        colnames=[one.name for one in columns if not one.name.endswith("_index")],
    )


def _ragged(name: str, about: str, parts: Sequence[NDArray[Any]]) -> list[Any]:
    """Return a column of several values a row, and where the values of each row end."""
    from hdmf.common import VectorData, VectorIndex

    values = VectorData(name=name, description=about, data=np.concatenate(parts))
    ends = np.cumsum([len(part) for part in parts]).astype(np.uint64)
    return [values, VectorIndex(name=f"{name}_index", data=ends, target=values)]
