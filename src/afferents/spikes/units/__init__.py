"""Units that fire: models of a spiking neuron, and what drives them in each class of afferent."""

from afferents.spikes.units.afferent import AfferentClass, afferent_classes
from afferents.spikes.units.base import Drive, Fired, UnitModel
from afferents.spikes.units.izhikevich import Izhikevich
from afferents.spikes.units.leaky import LeakyIntegrateAndFire

UNIT_MODELS: dict[str, UnitModel] = {
    model.name: model for model in (Izhikevich(), LeakyIntegrateAndFire())
}
"""Models of a unit by name; a new one is named here."""

__all__ = [
    "UNIT_MODELS",
    "AfferentClass",
    "Drive",
    "Fired",
    "Izhikevich",
    "LeakyIntegrateAndFire",
    "UnitModel",
    "afferent_classes",
]
