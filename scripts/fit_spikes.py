"""Fit the gains of spiking units to firing rates, on a session of the simulated rig.

    python scripts/fit_spikes.py S.zarr

For each class and model of a unit one number is fitted, its gain: the mean rate over units and
recordings becomes what stands in `AIMED`. Monkeys' SA1 and RA fibres answer textures that slide
over the fingertip with tens of spikes/s and PC fibres with up to hundreds (Weber et al., PNAS
110:17107, 2013; Lieber et al., J. Neurophysiol. 118:3107, 2017). The means aimed at are chosen in
the middle of that. Nothing else is fitted; no accuracy is looked at. The table that is printed goes
into `src/afferents/spikes/*.toml`.
"""

import sys

import numpy as np
from scipy.optimize import brentq

from afferents.spikes.afferents import AfferentClass, afferent_classes
from afferents.spikes.artificial import choose_stretch
from afferents.spikes.units import UNIT_MODELS, Drive
from afferents.store.zarr_store import open_responses

AIMED = {"SA": 25.0, "RA": 40.0, "PC": 100.0}
"""Mean spikes/s of a unit, over textures and speeds."""
SECONDS = 4.0
"""Of each recording."""
EVERY = 8
"""So many units apart are those that are fitted on; of the PC units all."""


def mean_rate(afferent: AfferentClass, model: str, inputs: list, gain: float) -> float:
    """Return spikes/s of a unit, mean over recordings and units."""
    rates = []
    for one in inputs:
        every = 1 if afferent.bands_hz else EVERY
        current = afferent.current(one.response, gain, seed=0)[:, ::every].copy()
        fired = UNIT_MODELS[model].fire(Drive(current, one.row, one.weight), afferent.values(model))
        rates.append(len(fired.unit) / current.shape[1] / SECONDS)
    return float(np.mean(rates))


def fitted_gain(afferent: AfferentClass, model: str, inputs: list) -> float:
    """Return the gain at which the mean rate is as aimed."""

    def missing(log_gain: float) -> float:
        return mean_rate(afferent, model, inputs, np.exp(log_gain)) - AIMED[afferent.name]

    return float(np.exp(brentq(missing, np.log(0.5), np.log(200), xtol=0.01)))


def main(store: str) -> None:
    """Print the gains."""
    recordings = open_responses(store)
    for afferent in afferent_classes().values():
        inputs = []
        for recording in recordings:
            start_s, _ = choose_stretch(recording)
            inputs.append(afferent.read_input(recording, start_s, start_s + SECONDS))
        for model in UNIT_MODELS:
            print(f"{afferent.name} {model}: gain {fitted_gain(afferent, model, inputs):.2f}")


if __name__ == "__main__":
    main(sys.argv[1])
