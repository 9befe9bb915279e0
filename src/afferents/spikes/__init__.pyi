from .artificial import artificial_spikes as artificial_spikes
from .population import Spikes as Spikes
