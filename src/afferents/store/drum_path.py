"""The drum's way through a recording: the log of a drive, and what a store keeps of it.

Positions are of the drum's surface, mm, and go on from turn to turn. Where they count from is the
drum's zero: a mark on the drum (an index pulse, an absolute encoder), or where it was when the
drive was opened. Of two recordings with one zero it is known which stretches of the drum they
touched both.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from afferents import dims, documents
from afferents.errors import InputError
from afferents.store.log import read_log

Values = NDArray[np.float64]

DRIVE = "drive.csv"
"""A log next to a recording's video: `time_s`, `position_mm`, and what else the drive reported."""
MARK = "mark"
"""Zero of positions that count from a mark on the drum, whenever it was mounted."""
CONTACT_MM = 16.0
"""Width of the contact patch along the slide.

Of the paper's fingertip, pressed 1 mm on its drum: 2 sqrt(2 R 1 mm), by Hertz' geometry, where
1 / R = 1 / 40 mm + 1 / 141 mm (the radii of drum and tip).
"""
LONGEST_GAP_MM = 20.0
"""Way between two entries of a drive's log, up to which a straight line stands for it.

A drum whose speed goes 10% off one way, then the other, is 5% of the gap from the line: 1 mm here.
That is twice what the drive's gate allows (5%), and small compared with the contact patch.
"""
_WHAT = "what is known of a drum"


class Drum(BaseModel):
    """What must be known of a drum to say which stretch of it was touched.

    Attributes
    ----------
    circumference_mm
        Where positions are measured.
    contact_mm
        Width of the contact patch along the slide.
    zero
        `MARK`, or what names the time from which on positions count; equal where it is the same.
    """

    model_config = ConfigDict(frozen=True)

    circumference_mm: float = Field(gt=0, lt=1e6)
    contact_mm: float = Field(ge=0, lt=1e6)
    zero: str = Field(min_length=1)


@dataclass(frozen=True)
class DrumPath:
    """A drum's way.

    Attributes
    ----------
    drum
        Whose it is.
    time_s, position_mm
        Shape (n,), times on the recording's clock, in order.
    """

    drum: Drum
    time_s: Values
    position_mm: Values

    def at(self, time_s: Values) -> Values:
        """Return the positions at some times, mm: straight lines between what was logged."""
        return np.asarray(np.interp(time_s, self.time_s, self.position_mm))

    def turns(self, steady_s: tuple[float, float] | None) -> float:
        """Return how often the drum turned, in the steady part where that is known."""
        first, last = steady_s or (self.time_s[0], self.time_s[-1])
        way = self.at(np.array([first, last]))
        return float(abs(way[1] - way[0]) / self.drum.circumference_mm)

    def longest_gap_mm(self, steady_s: tuple[float, float] | None) -> float:
        """Return the longest way of which nothing was logged, mm, in the steady part if known.

        Before the first entry and after the last it is reckoned by the mean speed of the log.
        """
        first, last = steady_s or (self.time_s[0], self.time_s[-1])
        touches = (self.time_s[1:] > first) & (self.time_s[:-1] < last)
        between = np.abs(np.diff(self.position_mm))[touches]
        whole_s = self.time_s[-1] - self.time_s[0]
        speed = abs(self.position_mm[-1] - self.position_mm[0]) / whole_s
        beyond_s = max(0.0, self.time_s[0] - first, last - self.time_s[-1])
        return float(max(between.max(initial=0.0), speed * beyond_s))

    def variable(self) -> xr.DataArray:
        """Return it as a store keeps it: float32, within the first turn at its beginning."""
        whole = np.floor(self.position_mm[0] / self.drum.circumference_mm)
        position = self.position_mm - whole * self.drum.circumference_mm
        return xr.DataArray(
            position.astype(np.float32),
            dims=dims.DRIVE_TIME,
            coords={dims.DRIVE_TIME: self.time_s},
            attrs={dims.UNITS: "mm", **self.drum.model_dump()},
        )


def logged_path(folder: Path) -> DrumPath | None:
    """Read the way of a recording's drum from the log in its folder.

    Returns
    -------
    DrumPath
        None where nothing logged it, or not on which drum.

    Raises
    ------
    InputError
        If the log is not what it should be, or its times go back.
    """
    path = folder / DRIVE
    if (log := read_log(path, {"time_s": float, "position_mm": float})) is None:
        return None
    head, table = log
    drum = None if head.drum is None else documents.as_form(head.drum, Drum, path, _WHAT)
    values = table.to_numpy()
    time_s, position = values[np.isfinite(values).all(axis=1)].T
    if (np.diff(time_s) < 0).any():
        raise InputError(
            f"{path}: expected times that rise, found some that go back; bring it back as it was, "
            "or remove it"
        )
    if drum is None or head.origin_s is None:
        return None
    time_s, first = np.unique(time_s - head.origin_s, return_index=True)
    if len(time_s) < 2:
        return None
    return DrumPath(drum, time_s, position[first])


def read_path(responses: xr.Dataset) -> DrumPath | None:
    """Return the way that the responses to a recording hold; None if they hold none.

    Raises
    ------
    InputError
        If what is stated of the drum is not what it should be.
    """
    if dims.DRUM_POSITION not in responses:
        return None
    stored = responses[dims.DRUM_POSITION]
    where = f"{dims.DRUM_POSITION} of {responses.attrs['name']}"
    drum = documents.as_form(stored.attrs, Drum, where, _WHAT)
    return DrumPath(drum, stored[dims.DRIVE_TIME].values, stored.values.astype(float))
