"""Spikes as Neo's segments and trains, and back."""

from typing import Any

import numpy as np
import pandas as pd

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes

_UNIT = ("class", "resolution_s", "receptive_field")


def to_neo(spikes: Spikes) -> Any:
    """Return a `neo.Block`: a segment a trial, a train for each unit that was recorded in it.

    Times are in s from the trial's start. Trials are in the annotations of segments, units in those
    of trains. Needs the extra ``neural``.

    Raises
    ------
    InputError
        If `neo` is missing.
    """
    neo = import_extra("neural", "to_neo", "neo", "quantities")
    block = neo.Block(name="afferents")
    block.annotate(units=[str(unit) for unit in spikes.units.index])
    for t, trial in enumerate(spikes.trials.to_dict("records")):
        segment = neo.Segment(name=f"trial {t}", index=t)
        segment.annotate(**{str(name): value for name, value in trial.items()})
        for u in np.flatnonzero(spikes.recorded[t]):
            unit = spikes.units.iloc[int(u)]
            about = {key: unit[key] for key in ("class", "receptive_field")}
            about |= {"name": str(unit.name), "resolution_s": float(unit["resolution_s"])}
            stop_s = float(spikes.durations_s[t, u])
            train = neo.SpikeTrain(spikes.train(t, int(u)), units="s", t_stop=stop_s, **about)
            segment.spiketrains.append(train)
        block.segments.append(segment)
    return block


def from_neo(block: Any, where: object = "neo block") -> Spikes:
    """Return the spikes of a `neo.Block`, ours or another program's.

    Parameters
    ----------
    block
        Segments are trials and need the annotation `texture`; trains need a name, the same in each
        segment, and the annotation `class`. A train that a segment lacks was not recorded. Times
        and durations of trains count from the first start in their segment.

    Raises
    ------
    InputError
        If these are missing, two trains of a segment have one name, and as `Spikes.from_trains`.
    """
    units: dict[str, dict[str, Any]] = {}
    rows, trials, ends = [], [], []
    for segment in block.segments:
        row: dict[str, Any] = {}
        lasting: dict[str, float] = {}
        starts_s = [float(train.t_start.rescale("s")) for train in segment.spiketrains]
        start_s = min(starts_s, default=0.0)
        for train in segment.spiketrains:
            name = str(train.name or "")
            if not name or name in row:
                found = f"two of the name '{name}'" if name else "one without"
                raise InputError(
                    f"{where}: expected a name of its own for each train of a segment, found "
                    f"{found}; give each unit's trains its name"
                )
            row[name] = train.rescale("s").magnitude - start_s
            lasting[name] = float(train.t_stop.rescale("s")) - start_s
            known = {key: train.annotations[key] for key in _UNIT if key in train.annotations}
            units.setdefault(name, {"name": name, **known})
        rows.append(row)
        ends.append(lasting)
        trials.append(dict(segment.annotations))
    ordered = [name for name in block.annotations.get("units", ()) if name in units]
    units = {name: units[name] for name in (*ordered, *units)}
    trains = [[row.get(name) for name in units] for row in rows]
    durations_s = [[one.get(name, np.nan) for name in units] for one in ends]
    return Spikes.from_trains(
        trains, pd.DataFrame(list(units.values())), trials, where, durations_s
    )
