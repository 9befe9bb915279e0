"""Trials cut into windows, and units drawn from many."""

from dataclasses import replace

import numpy as np

from afferents.errors import InputError
from afferents.spikes.population import Spikes, joined

TRIAL = "trial"
"""Column of the trials: the number of the trial that a window was cut from."""


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
            f"spikes: expected trials of at least a window, {window_s:g} s, found {found}"
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

    Elsewhere a gap would tell the texture: a fibre that was never recorded on silk is silent there.

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
            f"spikes: expected {wanted}, found {found}; leave out textures or trials with gaps"
        )
    return whole
