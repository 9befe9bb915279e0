"""Texture read from spikes: at which temporal resolution, from how many units, across speeds.

Trials are cut into windows. In each, a unit's spikes are counted in bins as wide as the resolution.
Of the counts their mean and their amplitude spectrum are kept, so it does not matter with which
bump a window began. One bin as long as the window is the rate alone; finer bins add timing. A
linear discriminant on the principal components of the training windows recognises the texture; its
covariance is shrunk (Ledoit & Wolf, J. Multivar. Anal. 88:365, 2004).

Comparing decoding over resolutions is how the nerve's own codes for texture were distinguished
(Weber et al., PNAS 110:17107, 2013); the spectrum in place of aligned trains is ours.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import t as student

from afferents.errors import InputError
from afferents.plugins import import_extra
from afferents.spikes.population import Spikes, joined

Across = Literal["speeds", "windows"]
"""What is held out: every speed in turn, or within each speed later windows (or repetitions)."""

RESOLUTIONS_S = (0.001, 0.002, 0.005, 0.011, 0.02, 0.05, 0.1, 0.25, 0.5)
WINDOW_S = 0.5
COMPONENTS = 40
"""Principal components that the discriminant sees."""
_SLACK = 0.95
"""With a camera at 90 frames/s, whose frames last 11.1 ms, bins of 11 ms are allowed."""
TRIAL = "trial"
"""Column of windows: the number of the trial that one was cut from."""
MOST_WINDOWS = 8
"""Of a trial: more of the same recording adds little."""


def decode(
    windows: Spikes, resolution_s: float, across: Across, seed: int = 0, tested: float | None = None
) -> dict[float, float]:
    """Return the share of windows whose texture is recognised, by the speed tested.

    Parameters
    ----------
    windows
        Trials of one length, as `cut_windows` gives them.
    resolution_s
        Width of a bin.
    across
        ``speeds``: each speed is tested by what was learnt at all others, and nothing of it is
        seen before. ``windows``: each speed by itself, learnt from the first half of each trial and
        tested on the second; from all but one repetition where there are several.
    seed
        Of the principal components.
    tested
        Only this speed is tested, mm/s; None for all.

    Raises
    ------
    InputError
        If there are fewer than two textures or, across speeds, than two speeds, a speed is not
        known or not there, there are too few windows to learn from or none of a texture, or bins
        are finer than the units' times.
    """
    speeds = require_conditions(windows, across)
    if tested is not None and tested not in speeds:
        there = ", ".join(f"{speed:g}" for speed in speeds)
        raise InputError(f"tested: expected a speed of the trials ({there}), found {tested:g}")
    if resolution_s < _SLACK * _finest(windows):
        wanted = f"bins of {_finest(windows):.3g} s or more, as finely as these units fire"
        raise InputError(f"resolution: expected {wanted}, found {resolution_s:g} s")
    features = binned_features(windows, resolution_s)
    texture = windows.trials["texture"].to_numpy(str)
    found: dict[float, list[NDArray[np.bool_]]] = {}
    for speed, train, test in folds(windows, speeds, across):
        if tested is not None and speed != tested:
            continue
        if absent := sorted(set(texture[test]) - set(texture[train])):
            raise InputError(
                f"spikes: expected windows of '{absent[0]}' to learn from where those at {speed:g} "
                "mm/s are tested, found none; leave that texture out, as without_gaps does"
            )
        if len(train) <= len(np.unique(texture)):
            there = f"{len(train)} windows of {len(np.unique(texture))} textures"
            wanted = "more windows than textures to learn from"
            raise InputError(f"spikes: expected {wanted}, found {there}; choose shorter windows")
        named = _classify(features[train], texture[train], features[test], seed)
        found.setdefault(speed, []).append(named == texture[test])
    return {speed: float(np.mean(np.concatenate(right))) for speed, right in found.items()}


def accuracy_by_resolution(
    spikes: Spikes,
    resolutions_s: Sequence[float] = RESOLUTIONS_S,
    window_s: float = WINDOW_S,
    n_units: int = 8,
    seed: int = 0,
    stretched: bool = False,
) -> pd.DataFrame:
    """Return how well texture is recognised at each resolution, for each class and held-out part.

    The coarsest resolution is always a whole window: the rate alone.

    Units that were not recorded in every trial are left out; `without_gaps` leaves out textures
    and repetitions as well, where that keeps more. So are resolutions finer than a class'
    own (`resolution_s` of its units: a frame's duration, of a camera): spikes between two frames
    are interpolation. So are resolutions of more than half a window, of which but one bin fits.

    Parameters
    ----------
    n_units
        Of each class, drawn at random with the seed: as many of each, so that classes compare.
    stretched
        Whether speeds are held out in a second way as well: trains are stretched to the speed
        tested by the ratio of the speeds before windows are cut, so that each window is as much of
        the surface. What units resolve is stretched, too.

    Returns
    -------
    pandas.DataFrame
        `class`, `across` (``speeds``, ``windows`` or ``stretched``), `resolution_s` (at the speed
        tested), `accuracy`, `low`, `high` (95%, Student's t over the speeds tested, which share
        most of what was learnt from), `chance`, `n_units`, and `n_trials` that windows were cut of.

    Raises
    ------
    InputError
        As `decode`; if no unit of a class was recorded in every trial; if a trial is shorter than
        a window, as it is or stretched.
    """
    rows = []
    for name in spikes.units["class"].unique():
        recorded = always_recorded(spikes, name)
        units = some_units(recorded, n_units, np.random.default_rng(seed))
        whole = cut_windows(units, window_s, MOST_WINDOWS)
        cut: dict[str, dict[float | None, Spikes]] = {part: {None: whole} for part in _parts(whole)}
        if stretched:
            speed = units.trials["speed_mm_s"].to_numpy(np.float64)
            cut["stretched"] = {
                float(one): cut_windows(units.stretched(speed / one), window_s, MOST_WINDOWS)
                for one in require_conditions(units)
            }
        n = {"n_units": units.n_units, "n_trials": units.n_trials}
        for part, by_tested in cut.items():
            finest_s = _SLACK * max(map(_finest, by_tested.values()))
            possible = [one for one in resolutions_s if finest_s <= one <= window_s / 2]
            for resolution_s in (*possible, window_s):  # the rate is always possible
                by_speed: dict[float, float] = {}
                for tested, windows in by_tested.items():
                    across: Across = "windows" if part == "windows" else "speeds"
                    by_speed |= decode(windows, resolution_s, across, seed, tested)
                given = {"class": name, "across": part, "resolution_s": resolution_s}
                rows.append({**given, **mean_with_interval(by_speed), **n})
    return pd.DataFrame(rows).assign(chance=1 / spikes.trials["texture"].nunique())


def accuracy_by_units(
    spikes: Spikes,
    numbers: Sequence[int] = (1, 2, 4, 8, 16, 32, 64),
    window_s: float = WINDOW_S,
    draws: int = 5,
    seed: int = 0,
) -> pd.DataFrame:
    """Return how well texture is recognised from 1 to N units, by rates and with timing.

    Timing is taken at 11 ms, or as finely as the class has it.

    Parameters
    ----------
    draws
        Of the units, for each number.

    Returns
    -------
    pandas.DataFrame
        `class`, `across`, `code` (``rate`` or ``timing``), `n_units`, `accuracy` (mean over
        draws), `low`, `high` (95%, Student's t over the speeds tested), `chance`.
    """
    rows = []
    for name in spikes.units["class"].unique():
        units = always_recorded(spikes, name)
        windows = cut_windows(units, window_s, MOST_WINDOWS)
        codes = {"rate": window_s, "timing": max(0.011, _finest(units))}
        most = min(units.n_units, max(numbers))
        for number in sorted({n for n in (*numbers, units.n_units) if n <= most}):
            n_draws = draws if number < units.n_units else 1  # all units can be taken once
            for across in _parts(windows):
                for code, resolution_s in codes.items():
                    drawn = [
                        decode(some_units(windows, number, rng), resolution_s, across, seed)
                        for rng in np.random.default_rng(seed).spawn(n_draws)
                    ]
                    by_speed = {one: float(np.mean([d[one] for d in drawn])) for one in drawn[0]}
                    given = {"class": name, "across": across, "code": code, "n_units": number}
                    rows.append({**given, **mean_with_interval(by_speed)})
    return pd.DataFrame(rows).assign(chance=1 / spikes.trials["texture"].nunique())


def mean_with_interval(by_speed: dict[float, float]) -> dict[str, float]:
    """Return the mean over speeds, and its 95% interval by Student's t; NaN where all agree."""
    values = np.array(list(by_speed.values()))
    mean, n = float(values.mean()), len(values)
    spread = float(values.std(ddof=1)) if n > 1 else 0.0
    if spread == 0:  # a few shares that agree say nothing about how far apart they may be
        return {"accuracy": mean, "low": np.nan, "high": np.nan}
    half = float(student.ppf(0.975, n - 1) * spread / np.sqrt(n))
    return {"accuracy": mean, "low": max(mean - half, 0.0), "high": min(mean + half, 1.0)}


def binned_features(windows: Spikes, resolution_s: float) -> NDArray[np.float64]:
    """Return `(window, feature)`: of each unit the mean count and the spectrum of its bins.

    Square roots of both, which evens out the spread of counts; a unit that was not recorded in a
    window gives 0.
    """
    counts = np.nan_to_num(windows.binned(resolution_s).values)
    level = counts.mean(axis=-1, keepdims=True)
    waves = np.abs(np.fft.rfft(counts - level, axis=-1))[..., 1:] / counts.shape[-1]
    features: NDArray[np.float64] = np.sqrt(np.concatenate([level, waves], axis=-1))
    return features.reshape(len(counts), -1)


def require_conditions(spikes: Spikes, across: Across = "speeds") -> NDArray[np.float64]:
    """Return the speeds, ascending; refuse spikes that nothing can be held out of.

    Raises
    ------
    InputError
        If there are fewer than two textures or, across speeds, than two speeds, or a speed is not
        known.
    """
    n_textures = spikes.trials["texture"].nunique()
    if n_textures < 2:
        raise InputError(f"spikes: expected at least 2 textures, found {n_textures}")
    speed = spikes.trials["speed_mm_s"].to_numpy(np.float64)
    if np.isnan(speed).any():
        found = f"{np.isnan(speed).sum()} of {len(speed)} without"
        raise InputError(f"spikes: expected the speed of every trial, found {found}")
    speeds = np.unique(speed)
    if across == "speeds" and len(speeds) < 2:
        raise InputError(f"spikes: expected at least 2 speeds, found {len(speeds)}")
    return speeds


def folds(
    windows: Spikes, speeds: NDArray[np.float64], across: Across
) -> Iterator[tuple[float, NDArray[np.int64], NDArray[np.int64]]]:
    """Yield the speed tested and the places of windows to learn from and to test on.

    Within a speed, a repetition is held out together where there are several.
    """
    speed = windows.trials["speed_mm_s"].to_numpy(np.float64)
    for one in speeds:
        at = speed == one
        if across == "speeds":
            yield float(one), np.flatnonzero(~at), np.flatnonzero(at)
            continue
        trials = windows.trials[at]
        part, names = pd.factorize(trials["repetition"], sort=True, use_na_sentinel=False)
        if len(names) < 2:  # the second half of each trial is tested; -1: only learnt from
            place, by_trial = trials.groupby(TRIAL).cumcount(), trials.groupby(TRIAL)[TRIAL]
            part = np.where(place >= (by_trial.transform("size") + 1) // 2, 0, -1)
        for number in np.unique(part[part >= 0]):
            tested = part == number
            yield float(one), np.flatnonzero(at)[~tested], np.flatnonzero(at)[tested]


def _classify(
    train: NDArray[np.float64], texture: NDArray[np.str_], test: NDArray[np.float64], seed: int
) -> NDArray[np.str_]:
    """Return the texture that the discriminant finds in each test window."""
    import_extra("neural", "texture from spikes", "sklearn")
    # which take longer to import than all the rest
    from sklearn.covariance import ledoit_wolf
    from sklearn.decomposition import PCA

    if not np.ptp(train, axis=0).any():  # silent units say nothing
        return np.full(len(test), texture[0])
    n = min(COMPONENTS, train.shape[1], len(train) - 1)
    reduced = PCA(n, svd_solver="randomized", random_state=seed)
    learnt, tested = reduced.fit_transform(train), reduced.transform(test)
    names, which = np.unique(texture, return_inverse=True)
    mean = np.stack([learnt[which == k].mean(axis=0) for k in range(len(names))])
    # A covariance that all textures share, as the discriminant takes it to be. scikit-learn's own
    # shrinks that of each texture by itself, which takes most of the time and has fewer windows.
    within = learnt - mean[which]
    spread = within.std(axis=0)
    spread = np.maximum(spread, 1e-6 * (spread.max() or 1))
    mean, tested = mean / spread, tested / spread
    covariance = ledoit_wolf(within / spread, assume_centered=True)[0] + 1e-9 * np.eye(n)
    weights = np.linalg.solve(covariance, mean.T)
    level = np.log(np.bincount(which) / len(which)) - (mean.T * weights).sum(axis=0) / 2
    named: NDArray[np.str_] = names[(tested @ weights + level).argmax(axis=1)]
    return named


def _finest(units: Spikes) -> float:
    return float(units.units["resolution_s"].max())


def _parts(windows: Spikes) -> list[Across]:
    """Return what can be held out."""
    texture = windows.trials["texture"].to_numpy(str)
    speeds = np.unique(windows.trials["speed_mm_s"])
    halves = list(folds(windows, speeds, "windows"))
    within = bool(halves) and all(
        len(train) > len(set(texture)) and set(texture[test]) <= set(texture[train])
        for _, train, test in halves
    )
    parts: dict[Across, bool] = {"speeds": len(speeds) > 1, "windows": within}
    return [part for part, possible in parts.items() if possible]


def cut_windows(spikes: Spikes, window_s: float, most: int | None = None) -> Spikes:
    """Return windows of trials as trials, one after another, none overlapping.

    Parameters
    ----------
    window_s
        Their length.
    most
        Of a trial; they are spread evenly over it. None for all.

    Returns
    -------
    Spikes
        Its trials have a column `trial` more, the place of the trial that a window is of.

    Raises
    ------
    InputError
        If a trial is shorter than a window.
    """
    shortest = float(spikes.trials["duration_s"].min())
    if shortest < window_s - 1e-9:
        found = f"a trial of {shortest:g} s"
        raise InputError(
            f"spikes: expected trials of at least a window, {window_s:g} s, found {found}; choose "
            "shorter windows"
        )
    parts = []
    for trial, duration_s in enumerate(spikes.trials["duration_s"]):
        there = int(duration_s / window_s + 1e-9)
        places = np.arange(there)
        if most is not None and there > most:
            places = np.linspace(0, there - 1, most).astype(int)
        one = spikes.select(trials=[trial])
        for place in places:
            part = one.window(place * window_s, min((place + 1) * window_s, duration_s))
            parts.append(replace(part, trials=part.trials.assign(**{TRIAL: trial})))
    return joined(parts)


def some_units(spikes: Spikes, n: int, rng: np.random.Generator) -> Spikes:
    """Return `n` units drawn at random, in their order; all where there are no more."""
    if spikes.n_units <= n:
        return spikes
    return spikes.select(units=np.sort(rng.choice(spikes.n_units, n, replace=False)))


def always_recorded(spikes: Spikes, name: str) -> Spikes:
    """Return the units of a class that were recorded in every trial.

    Elsewhere a gap would give the texture away: a fibre that was never recorded on silk is silent
    there.

    Raises
    ------
    InputError
        If there are units of the class, and none of them was.
    """
    units = spikes.of_class(name)
    whole = units.select(units=units.recorded.all(axis=0))
    if units.n_units and not whole.n_units:
        found = f"{units.n_units} with gaps"
        wanted = f"units of class {name} that were recorded in every trial"
        raise InputError(
            f"spikes: expected {wanted}, found {found}; leave out textures and trials with gaps, "
            "as without_gaps does"
        )
    return whole
