"""Natural afferents: recordings of nerve fibres, from MATLAB, NWB and tables."""

from afferents.spikes.natural.nwb import read_nwb
from afferents.spikes.natural.reader import described_natural, read_natural

__all__ = ["described_natural", "read_natural", "read_nwb"]
