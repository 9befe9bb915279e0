"""The clocks of what was logged alongside a session's images, from a press that all recorded.

A fingertip is pressed on something and lifted. How far the skin's markers then are from rest on
average is some function of how deep it is pressed, or how hard, whatever the gel: so the lag of the
other clock is that under which a function of its z, made of straight pieces, explains most of the
mean SA-I (least squares). The way down and the way up are on the two sides of the press, so that a
lag can't look like another function. Half of what they differ by, if each is used alone, is the
uncertainty, and a quarter of a frame. A gel that comes back late, on both ways, looks like a lag
and is not told from one.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from afferents import dims
from afferents.channels import compute_sa1
from afferents.errors import InputError
from afferents.markers.session_sensors import Sensors
from afferents.markers.track import track_markers
from afferents.recordings.session import Session
from afferents.store.log import Lag

Floats = NDArray[np.float64]

Z = 2
"""Column of what is logged that is pressed along."""
STEP_S, COARSE_S, FINE_S = 0.001, 0.02, 0.06
"""Lags are tried in coarse steps as far as the files go, then in fine ones round the best."""
KNOTS = 6
LEAST_EXPLAINED = 0.9
APART_S = 0.1
"""From one lag to another: two presses may both fit."""
AS_GOOD = 2.0
"""A lag that leaves less than this many times what the best leaves might be the true one."""


def measure_lag(time_s: Floats, skin: Floats, other_s: Floats, z: Floats) -> Lag:
    """Measure how far a clock is ahead of the images', from one press.

    Parameters
    ----------
    time_s, skin
        Of the images, (n,), s, and mean SA-I in them, px.
    other_s, z
        By the other clock, (m,), s; and depth or force.

    Raises
    ------
    InputError
        If nothing was pressed, or no lag stands out.
    """
    grid = np.arange(time_s[0], time_s[-1], 2 * STEP_S)
    seen = np.interp(grid, time_s, skin)
    knots = np.linspace(z.min(), z.max(), KNOTS, endpoint=False)

    def basis(lag: float) -> Floats:
        bent = np.maximum(np.interp(grid + lag, other_s, z)[:, None] - knots, 0)
        return np.column_stack([np.ones(len(grid)), bent])

    def left(lag: float) -> float:
        """Share of the variance that a lag leaves unexplained."""
        part, _ = np.linalg.qr(basis(lag))  # a tenth of the time of lstsq
        return float((seen - part @ (part.T @ seen)).var() / max(seen.var(), 1e-12))

    half = min(np.ptp(grid), np.ptp(other_s)) / 2
    lags = np.arange(other_s[0] - grid[-1] + half, other_s[-1] - grid[0] - half, COARSE_S)
    unexplained = np.array([left(lag) for lag in lags])
    n = int(unexplained.argmin()) if len(lags) else 0
    if len(lags) < 3 or n in (0, len(lags) - 1) or unexplained[n] > 1 - LEAST_EXPLAINED:
        found = 1 - unexplained[n] if len(lags) else 0.0
        raise InputError(
            f"the press: expected one whose z explains {LEAST_EXPLAINED:.0%} of what the skin feels"
            f" (mean SA-I), found {found:.0%}; press and lift once more, or leave the file out"
        )
    others = unexplained[np.abs(lags - lags[n]) > APART_S]
    if (others < AS_GOOD * unexplained[n]).any():
        raise InputError(
            "the press: expected one lag of the clocks that fits, found two that do; press once, "
            "not several times alike, or leave the file out"
        )
    fine = lags[n] + np.arange(-COARSE_S, COARSE_S + STEP_S, STEP_S)
    best = _lowest(fine, np.array([left(lag) for lag in fine]))
    columns = basis(best)
    weights = np.linalg.lstsq(columns, seen, rcond=None)[0]
    near = best + np.arange(-FINE_S, FINE_S + STEP_S, STEP_S)
    off = np.array([(seen - basis(lag) @ weights) ** 2 for lag in near])
    top = int(np.argmax(np.abs(seen - np.median(seen))))
    down, up = (_lowest(near, off[:, part].mean(axis=1)) for part in (slice(top), slice(top, None)))
    frame_s = float(np.median(np.diff(time_s)))
    error_s = abs(down - up) / 2 + frame_s / 4
    return Lag(best, error_s, 1 - left(best), float(time_s.mean()))


def _lowest(at: Floats, values: Floats) -> float:
    """Return where values are lowest, by a parabola through the three lowest in a row."""
    n = int(np.clip(values.argmin(), 1, len(at) - 2))
    before, here, after = values[n - 1 : n + 2]
    bend = before - 2 * here + after
    aside = 0.0 if bend <= 0 else float(np.clip((before - after) / (2 * bend), -1, 1))
    return float(at[n] + aside * (at[1] - at[0]))


def measure_clocks(session: Session, sensors: Sensors) -> dict[str, Lag]:
    """Return the lag of each log's clock, by its name, from the session's press.

    Raises
    ------
    InputError
        If the press can't be read, or as `measure_lag`, naming the file.
    """
    press = session.press
    if press is None or press.video is None or not press.beside:
        return {}
    tracks = track_markers(press.video, sensors.of(press))
    skin = compute_sa1(tracks).mean(dims.MARKER).values
    time_s, seen = (
        tracks[dims.TIME].values + getattr(press.video, "began_s", 0.0),
        np.isfinite(skin),
    )
    found = {}
    for one in press.beside:
        other_s, values = one.read()
        z = values[:, min(Z, values.shape[1] - 1)]
        try:
            found[one.name] = measure_lag(time_s[seen], skin[seen], other_s, z)
        except InputError as error:
            raise error.at(one.path) from error
    return found


def set_clocks(session: Session, lags: Mapping[str, Lag]) -> Session:
    """Return a session whose recordings' logs have these lags."""
    recordings = tuple(
        replace(r, beside=tuple(replace(b, lag=lags.get(b.name, b.lag)) for b in r.beside))
        for r in session.recordings
    )
    return replace(session, recordings=recordings)


def describe(lags: Mapping[str, Lag], press: str) -> list[str]:
    """Return what was found, in sentences."""
    return [
        f"The clock of '{name}' is {abs(lag.seconds):.4f} s "
        f"{'behind' if lag.seconds < 0 else 'ahead of'} the images', by the press of {press}, "
        f"within {1000 * lag.error_s:.1f} ms there and 0.1 ms more a second from it; the "
        "store says how much in each recording. How far apart they are does not matter."
        for name, lag in lags.items()
    ]
