"""Signals of a fingertip: which there are, what comes with them, and giving them out."""

import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import PARTS
from afferents.choices import words_in
from afferents.errors import InputError
from afferents.lab.live.fingertip import Fingertip
from afferents.lab.live.touch import Touch
from afferents.stopping import stop_later

UNITS = {
    dims.POSITION: dims.PIXELS,
    dims.SA1: dims.PIXELS,
    dims.RA1: dims.PIXELS_PER_FRAME,
    "speed": dims.PIXELS_PER_SECOND,
    dims.SHEAR: dims.PIXELS,
    dims.RA2: "full scale",
}
"""Signals that can be given out, and their units; those of cells differ, see `give_signals`."""
DIGITS = 4
Content = dict[str, Any]
"""By name, as JSON has it."""


class Writer(Protocol):
    """Gives signals out at one place."""

    def write(self, touch: Touch, status: Content) -> None:
        """Give out the signals of a frame, and its status (`give_signals`)."""

    def close(self) -> None:
        """End it, so that what was given out is whole."""


Place = Callable[[Content, Touch], Writer]
"""Opens a writer, given the header and the first touch, which is then written as the others."""


def parse_signals(text: str | Sequence[str], has_sound: bool) -> list[str]:
    """Return the names of signals that a text holds, separated by commas.

    Raises
    ------
    InputError
        If there is none of that name, or vibration is among them without a source of sound.
    """
    names = list(dict.fromkeys(words_in(text)))
    unknown = [name for name in names if name not in UNITS]
    if unknown or not names:
        found = f"'{unknown[0]}'" if unknown else "none"
        raise InputError(f"--signals: expected of {', '.join(UNITS)}, found {found}")
    if dims.RA2 in names and not has_sound:
        raise InputError("--signals: expected a source of sound for ra2 (--audio), found none")
    return names


def give_signals(
    fingertip: Fingertip, names: Sequence[str], places: Sequence[Place], name: str = ""
) -> None:
    """Run a fingertip until its sources end, and give its signals out.

    The header says which sensor it is, where its markers are at rest, the units, and of a camera
    how far the Unix clock is ahead of the monotonic one, by which its frames are timed. The status
    of a frame is its `time_s`, the share of markers that are `lost`, how many frames were `dropped`
    before it, whether something is `touching` the skin, and `events` where something happened; rest
    that was set anew comes with it. Events and dropped frames are printed on standard error, too.

    Parameters
    ----------
    names
        Of the signals, see `UNITS`.
    places
        Where they go; see `places.prepare_places`.
    name
        Of the fingertip, where there are several.
    """
    dropped = 0
    with fingertip, ExitStack() as opened:
        writers: list[Writer] = []
        for touch in fingertip:
            status: Content = {
                "time_s": round(touch.time_s, 6),
                "lost": round(touch.lost, DIGITS),
                "dropped": touch.quality.dropped - dropped,
                "touching": touch.touching,
            }
            if dims.RA2 in names:
                status["ra2_time_s"] = touch.ra2_time_s[:1].round(6).tolist()
            if touch.events:
                status["events"] = touch.events
                status[dims.REST_POSITION] = round_values(touch.now.rest)
            dropped = touch.quality.dropped
            sys.stderr.writelines(f"{touch.time_s:.2f} s: {event}\n" for event in touch.events)
            with stop_later():
                for place in places[len(writers) :]:
                    writers.append(place(_make_header(fingertip, touch, names, name), touch))
                    opened.callback(writers[-1].close)
                for writer in writers:
                    writer.write(touch, status)
    if dropped:
        hint = "" if fingertip.is_live else "; --speed max drops none of a clip"
        sys.stderr.write(f"{dropped} frames were dropped{hint}\n")


def _make_header(fingertip: Fingertip, touch: Touch, names: Sequence[str], name: str) -> Content:
    """Return the header.

    Raises
    ------
    InputError
        If these are cells, and a signal is of markers that move.
    """
    units = {name: UNITS[name] for name in names}
    if touch.now.grey is not None:
        for of_move in (name for name in names if name in ("speed", dims.SHEAR)):
            raise InputError(
                f"--signals: expected of sa1, ra1, position and ra2, found '{of_move}', which "
                "cells don't have, since they have no displacement; leave it out"
            )
        for of_grey in {dims.SA1, dims.RA1} & units.keys():
            units[of_grey] = units[of_grey].replace(dims.PIXELS, dims.GREY_LEVELS)
    assert fingertip.sensor is not None  # there is a touch
    return {
        **({"fingertip": name} if name else {}),
        "sensor": fingertip.sensor.name,
        "layout": fingertip.sensor.layout,
        "fps_hz": fingertip.fps_hz,
        "sample_rate_hz": fingertip.sample_rate_hz,
        "unix_ahead_s": time.time() - time.monotonic() if fingertip.is_live else None,
        "units": units,
        "shear": list(PARTS),
        dims.REST_POSITION: round_values(touch.now.rest),
    }


def round_values(values: NDArray[np.floating]) -> list[Any]:
    """Return an array as lists of numbers that are short as text."""
    listed: list[Any] = np.round(values.astype(float), DIGITS).tolist()
    return listed
