"""What spikes, units and trials must be, told in one sentence where they are not."""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from afferents.core.errors import InputError

CLASSES = ("SA", "RA", "PC")
"""Classes of afferents: slowly adapting type I, rapidly adapting type I, and Pacinian (RA-II)."""


def checked_units(units: Any, where: object) -> pd.DataFrame:
    """Return the units' table by name, whole: `class`, `resolution_s`, `receptive_field`.

    Raises
    ------
    InputError
        If a column is missing, a class is none of `CLASSES` or two units have one name.
    """
    table: pd.DataFrame = pd.DataFrame(units)
    if "name" in table:
        table = table.set_index("name")
    table.index = table.index.astype(str).rename("unit")
    if "class" not in table:
        raise InputError(where, "a column 'class' of units", f"columns {list(table)}")
    other = sorted(set(table["class"]) - set(CLASSES))
    if other:
        raise InputError(where, f"classes of {', '.join(CLASSES)}", f"'{other[0]}'")
    twice = table.index[table.index.duplicated()]
    if len(twice):
        raise InputError(where, "units of different names", f"two of the name '{twice[0]}'")
    if "resolution_s" not in table:
        table["resolution_s"] = 0.0
    if "receptive_field" not in table:
        table["receptive_field"] = [()] * len(table)
    return table


def checked_trials(trials: Any, where: object) -> pd.DataFrame:
    """Return the trials' table, whole: `texture`, `speed_mm_s`, `repetition`, `duration_s`.

    Raises
    ------
    InputError
        If a column is missing, or a duration is no positive number.
    """
    table: pd.DataFrame = pd.DataFrame(trials).reset_index(drop=True)
    missing = {"texture", "duration_s"} - set(table)
    if missing:
        raise InputError(where, f"a column '{min(missing)}' of trials", f"columns {list(table)}")
    table["texture"] = table["texture"].astype(str)
    table["duration_s"] = table["duration_s"].astype(np.float64)
    if not (np.isfinite(table["duration_s"]) & (table["duration_s"] > 0)).all():
        raise InputError(where, "trials of a positive duration in s", "one that is not")
    table["speed_mm_s"] = (
        table["speed_mm_s"].astype(np.float64) if "speed_mm_s" in table else np.nan
    )
    if "repetition" not in table:
        table["repetition"] = table.groupby(["texture", "speed_mm_s"], dropna=False).cumcount()
    return table


def check_trains(
    times: NDArray[np.float64],
    offsets: NDArray[np.int64],
    units: pd.DataFrame,
    trials: pd.DataFrame,
    where: object,
) -> None:
    """Refuse times that can't be: not finite, negative, out of order or beyond their trial.

    Raises
    ------
    InputError
        That names the first unit and trial, and says where units of ms are the likely reason.
    """
    if not len(times):
        return
    cells = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    duration_s = trials["duration_s"].to_numpy(np.float64)[cells // len(units)]
    later = np.diff(times, prepend=-np.inf) >= 0
    later[offsets[:-1][offsets[:-1] < len(times)]] = True
    faults = {
        "finite times": np.isfinite(times),
        "times of 0 s or more, from the trial's start": times >= 0,
        "times in ascending order": later,
        "times within the trial": times <= duration_s,
    }
    for expected, sound in faults.items():
        if not sound.all():
            first = int(np.argmin(sound))
            trial, unit = divmod(int(cells[first]), len(units))
            found = f"{times[first]:g} s in trial {trial} of unit {units.index[unit]}"
            raise InputError(where, expected, found, _remedy(expected, times, duration_s))


def _remedy(expected: str, times: NDArray[np.float64], duration_s: NDArray[np.float64]) -> str:
    """Return what to do: most times beyond the trial are ms where s are expected."""
    if not expected.endswith("within the trial"):
        return ""
    if np.mean(times > duration_s) > 0.5:
        return "most spikes lie beyond their trials: if times are in ms, divide them by 1000"
    return f"{np.sum(times > duration_s)} spikes lie beyond: give the trial's true duration"
