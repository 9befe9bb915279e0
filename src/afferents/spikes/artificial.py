"""Spikes of artificial afferents: units that markers and the microphone drive."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd

from afferents import dims
from afferents.errors import InputError
from afferents.spikes.afferents import AfferentClass, afferent_classes
from afferents.spikes.population import Spikes, joined
from afferents.spikes.units import RATE_HZ, UNIT_MODELS, Drive
from afferents.store.responses import Responses, steady_s

_SHORTEST_S = 0.1
SETTLING_S = 0.5
"""What was recorded this long before a stretch drives the units already: they begin at rest, and a
press that is suddenly there makes them fire a volley that no fibre under a lasting press has."""


def artificial_spikes(
    recordings: Iterable[Responses],
    model: str = "izhikevich",
    seed: int = 0,
    classes: Sequence[str] = ("SA", "RA", "PC"),
    start_s: float | None = None,
    stop_s: float | None = None,
) -> Spikes:
    """Return what units that the fingertip's responses drive would fire; a trial a recording.

    SA units are driven by SA-I and RA units by RA-I, one a marker. PC units are driven by the
    vibration of the first channel, one a band of frequencies between 40 and 400 Hz. A recording
    has those classes that it has responses for.

    Between two frames the current is interpolated, so SA and RA units have no timing of their own
    below a frame's duration; `units.resolution_s` says so. The half second before a stretch drives
    the units too, as far as it was recorded; a stretch that begins with its recording finds them
    at rest.

    Parameters
    ----------
    recordings
        Responses as `store.zarr_store.open_responses` yields them.
    model
        Of a unit: ``izhikevich`` or ``lif``; see `spikes.units`.
    seed
        Draws how units of a class differ.
    start_s, stop_s
        The stretch of each recording; without them that at constant speed, or all of it.

    Raises
    ------
    InputError
        If there is no such model or class, a recording has none of the responses or is shorter
        than 0.1 s, or recordings differ in their markers.
    """
    if model not in UNIT_MODELS:
        raise InputError(f"model: expected one of {', '.join(UNIT_MODELS)}, found '{model}'")
    known = afferent_classes()
    other = [name for name in classes if name not in known]
    if other or not classes:
        raise InputError(
            f"classes: expected some of {', '.join(known)}, found '{', '.join(other)}'"
        )
    chosen = [known[name] for name in known if name in classes]
    return join_recordings(
        _drive_units(recording, model, seed, chosen, start_s, stop_s) for recording in recordings
    )


def join_recordings(parts: Iterable[Spikes]) -> Spikes:
    """Return one population; recordings of one texture and speed are its repetitions, from 0.

    Raises
    ------
    InputError
        If a recording lacks a class that another has, or they differ in their markers.
    """
    parts = list(parts)
    there = [set(part.units["class"]) for part in parts]
    known = [one for name, one in afferent_classes().items() if name in set().union(*there)]
    for part, has in zip(parts, there, strict=True):
        if lacking := [one for one in known if one.name not in has]:
            common = ",".join(one.name for one in known if all(one.name in has for has in there))
            raise InputError(
                f"{part.trials['recording'][0]}: expected {lacking[0].variable}, which drives "
                f"{lacking[0].name} units, as in other recordings, found none; "
                + (f"choose --classes {common}" if common else "leave the recording out")
            )
    spikes = joined(parts)
    trial = spikes.trials.groupby(["texture", "speed_mm_s"], dropna=False)
    return replace(spikes, trials=spikes.trials.assign(repetition=trial.cumcount()))


def _drive_units(
    recording: Responses,
    model: str,
    seed: int,
    classes: Sequence[AfferentClass],
    start_s: float | None,
    stop_s: float | None,
) -> Spikes:
    """Return the spikes of one recording."""
    start_s, stop_s = choose_stretch(recording, start_s, stop_s)
    recorded_s = start_s - (float(recording[dims.TIME][0]) if dims.TIME in recording else 0.0)
    before_s = math.floor(min(SETTLING_S, max(recorded_s, 0.0)) * RATE_HZ) / RATE_HZ
    duration_s, n_units = stop_s - start_s, 0
    tables, times, units = [], [np.empty(0)], [np.empty(0, np.int64)]
    for afferent in classes:
        if afferent.variable not in recording:
            continue
        given = afferent.read_input(recording, start_s - before_s, stop_s)
        values = afferent.values(model)
        current = afferent.current(given.response, values["gain"], seed)
        fired = UNIT_MODELS[model].fire(Drive(current, given.row, given.weight), values)
        after = fired.time_s > before_s
        times.append(fired.time_s[after] - before_s)
        units.append(fired.unit[after] + n_units)
        fields = given.receptive_fields
        names = pd.Index([f"{afferent.name}-{i}" for i in range(len(fields))], name="unit")
        of_all = {"class": afferent.name, "resolution_s": given.resolution_s}
        tables.append(pd.DataFrame({**of_all, "receptive_field": fields}, names))
        n_units += len(fields)
    if not tables:
        wanted = " or ".join(afferent.variable for afferent in classes)
        raise InputError(
            f"{recording.attrs['name']}: expected {wanted}, which drives the units, found none"
        )
    unit, time_s = np.concatenate(units), np.minimum(np.concatenate(times), duration_s)
    order = np.argsort(unit, kind="stable")  # within a unit, times are in order already
    offsets = np.append(0, np.cumsum(np.bincount(unit, minlength=n_units)))
    trial = {
        "recording": recording.attrs["name"],
        "texture": recording.attrs[dims.TEXTURE],
        "speed_mm_s": float(recording.attrs[dims.SPEED]),
        "repetition": 0,
        "duration_s": duration_s,
    }
    durations_s = np.full((1, n_units), duration_s)
    return Spikes(time_s[order], offsets, pd.concat(tables), pd.DataFrame([trial]), durations_s)


def end_times(recording: Responses) -> list[float]:
    """Return when a recording's video and its vibration end, s, of what it has."""
    ends = [float(recording[dims.TIME][-1])] if dims.TIME in recording else []
    if dims.RA2 in recording:
        ends.append(recording.sizes[dims.AUDIO_TIME] / recording[dims.RA2].attrs[dims.SAMPLE_RATE])
    return ends


def choose_stretch(
    recording: Responses, start_s: float | None = None, stop_s: float | None = None
) -> tuple[float, float]:
    """Return from when to when a recording is used, s.

    Raises
    ------
    InputError
        If that is less than 0.1 s.
    """
    first, last = steady_s(recording) or (0.0, np.inf)
    begin = first if start_s is None else start_s
    end = min([*end_times(recording), last if stop_s is None else stop_s])
    if end - begin < _SHORTEST_S:
        found = f"{begin:g} to {end:g} s"
        raise InputError(
            f"{recording.attrs['name']}: expected a stretch of {_SHORTEST_S:g} s or more, found "
            f"{found}"
        )
    return begin, end
