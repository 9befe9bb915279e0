"""Spikes of artificial and natural afferents: units that fire, and what is asked of them."""

from afferents.spikes.artificial import artificial_spikes
from afferents.spikes.neo import from_neo, to_neo
from afferents.spikes.population import Spikes

__all__ = ["Spikes", "artificial_spikes", "from_neo", "to_neo"]
