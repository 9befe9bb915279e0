"""Spikes as channels: how often the units that a response drives fire, frame by frame.

What these give are counts in places of a channel's response, so every encoding, network and fold
works on spikes as on responses: an image of a frame's counts is a peri-stimulus time histogram laid
out on the skin.
"""

from abc import abstractmethod
from typing import ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from afferents.channels.base import Channel
from afferents.core import dims
from afferents.spikes.artificial import artificial_spikes

SPIKES = "spikes"


class SpikeChannel(Channel):
    """Counts of spikes of one class of units, Izhikevich's, with the default seed.

    Attributes
    ----------
    afferent
        Of `spikes.units.afferent_classes`.
    """

    afferent: ClassVar[str]

    @property
    def felt_live(self) -> bool:
        """Not yet: counts are those of whole recordings."""
        return False

    def response(self, recording: xr.Dataset) -> xr.DataArray:
        """Return the counts, float32, as many places as the response that drives the units has.

        A lost marker drives nothing: its unit is silent, not NaN.
        """
        driving = recording[self.made_of]
        edges = self.edges(driving)
        spikes = artificial_spikes(
            [recording[[self.made_of]]], classes=[self.afferent], start_s=edges[0], stop_s=edges[-1]
        )
        counts = np.zeros((len(edges) - 1, spikes.n_units), np.float32)
        unit = np.repeat(np.arange(spikes.n_units), np.diff(spikes.offsets))
        place = np.searchsorted(edges, spikes.times + edges[0], side="right") - 1
        np.add.at(counts, (np.clip(place, 0, len(counts) - 1), unit), 1)
        return self.labelled(counts, driving)

    @abstractmethod
    def edges(self, driving: xr.DataArray) -> NDArray[np.float64]:
        """Return from when to when spikes count for each place of the response, s, (place + 1,)."""

    @abstractmethod
    def labelled(self, counts: NDArray[np.float32], driving: xr.DataArray) -> xr.DataArray:
        """Return the counts with the dims of the response."""


class MarkerSpikes(SpikeChannel):
    """Of a unit a marker: spikes between a frame and the one before."""

    def edges(self, driving: xr.DataArray) -> NDArray[np.float64]:
        """Return the times of frames; the first has as long as the second."""
        time_s = np.asarray(driving[dims.TIME].values, np.float64)
        return np.concatenate([[2 * time_s[0] - time_s[1]], time_s])

    def labelled(self, counts: NDArray[np.float32], driving: xr.DataArray) -> xr.DataArray:
        """Return counts `(time, marker)`."""
        return driving.copy(data=counts).rename(self.name).assign_attrs(units=SPIKES)


class Sa1Spikes(MarkerSpikes):
    """Spikes of SA units, one a marker, driven by SA-I."""

    name, title, made_of, afferent = dims.SA1_SPIKES, "SA-I spikes", dims.SA1, "SA"


class Ra1Spikes(MarkerSpikes):
    """Spikes of RA units, one a marker, driven by RA-I."""

    name, title, made_of, afferent, lookback = dims.RA1_SPIKES, "RA-I spikes", dims.RA1, "RA", 1


class Ra2Spikes(SpikeChannel):
    """Spikes of PC units, one a band of the first channel's vibration."""

    name, title, made_of, afferent = dims.RA2_SPIKES, "RA-II spikes", dims.RA2, "PC"

    def edges(self, driving: xr.DataArray) -> NDArray[np.float64]:
        """Return the times between samples of sound."""
        n, rate_hz = driving.sizes[dims.AUDIO_TIME], float(driving.attrs[dims.SAMPLE_RATE])
        return np.arange(n + 1) / rate_hz

    def labelled(self, counts: NDArray[np.float32], driving: xr.DataArray) -> xr.DataArray:
        """Return counts `(audio_time, channel)`, a channel a unit, at the vibration's own rate."""
        attrs = {**driving.attrs, dims.UNITS: SPIKES}
        named = {dims.CHANNEL: [f"{self.afferent}-{i}" for i in range(counts.shape[1])]}
        shape = (dims.AUDIO_TIME, dims.CHANNEL)
        return xr.DataArray(counts, named, shape, self.name, attrs)
