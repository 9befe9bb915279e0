"""Order search: textures and speed together, from spectra over the logarithm of frequency.

At a supposed speed v a spectrum over frequency becomes one over cycles per mm, by a shift. A score
for every texture is linear in that: one linear layer that slides over the logarithm of frequency.

Speed known: the scores at that speed. Measured: first the speed alone, from how the phases of
several channels agree with it whatever the texture. Unknown: all speeds are supposed in turn,
and a texture's probability is the sum over them. So that the scores at different speeds can be
compared, it learns from spectra at their true speed, named by texture, and from the same ones at
wrong speeds, which are none of the textures.

What it can't do: where textures are one pattern at different scales, speed and scale are the same
shift. Then only what does not scale distinguishes them (the skin's and microphone's own band).
"""

import math
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from afferents import dims
from afferents.errors import InputError
from afferents.models import base, model, solved

WRONG_SPEEDS = 8
"""Wrong speeds that every spectrum is learnt at."""
_WRONG_FROM = 0.12
"""A speed that is wrong by fewer octaves is nearly right, and nothing is learnt from it."""
_BEYOND = 2.5
"""Speeds are searched for up to this factor beyond those learnt from."""
_LEAST_PER_OCTAVE = 12
"""Speeds supposed in a factor of 2; as many as frequencies, where these lie closer.

A speed that lies between two supposed moves narrow lines out of their place in both.
"""
_MOST = 1_000_000
"""Powers that the floor is taken from."""
_FLOOR = 0.1
"""Share of all powers learnt from that count as no more than the floor."""
_LEAST_SD = 0.1
"""Of a logarithm of power that hardly varies: it is not trusted to the last digit."""


class OrderSearch(base.Solved):
    """Log-probabilities of textures and speeds.

    Parameters
    ----------
    n_classes
        Number of textures.
    n_channels
        Of the vibration: features are their powers, then, for more than one, 2 n_channels parts
        of cross-spectra (`encodings.orders.OrderEncoding`).
    frequencies
        Geometric, Hz.
    per_mm
        The textures' axis, geometric, cycles per mm.
    speed_from
        Where the speed of a sample to classify comes from; see `Model`.

    Raises
    ------
    InputError
        If the speed is to be measured from one channel.
    """

    name = "orders"
    takes = (dims.FEATURE, dims.FREQUENCY)
    deployable = False
    needs_speed = True
    searched = solved.SEARCHED
    penalties = (30.0,)  # for each channel; chosen on inner folds of a tuning session
    mean: Tensor
    sd: Tensor
    weight: Tensor
    constant: Tensor
    right: Tensor
    floor: Tensor
    speeds: Tensor

    @classmethod
    def built_for(cls, task: base.Task) -> Self:
        """Return one for samples (feature, frequency) of `encodings.orders.OrderEncoding`."""
        n_features = task.sample_shape[0]
        n_channels = 1 if n_features == 1 else n_features // 3
        assert task.frequency_hz is not None
        per_mm = task.encoding.per_mm
        return cls(task.n_classes, n_channels, task.frequency_hz, per_mm, task.speed_from)

    def __init__(
        self,
        n_classes: int,
        n_channels: int,
        frequencies: NDArray[np.float64],
        per_mm: NDArray[np.float64],
        speed_from: model.SpeedFrom,
    ) -> None:
        """Start with nothing learnt."""
        super().__init__()
        if speed_from == "measured" and n_channels == 1:
            raise InputError(
                "the data: expected several vibration channels to measure the speed between, "
                "found one; use order-te or order-te-speed-known"
            )
        self.n_channels, self.speed_from = n_channels, speed_from
        self._low = float(frequencies[0])
        self._octaves = math.log2(frequencies[1] / frequencies[0])
        self._log_per_mm = torch.from_numpy(np.log2(per_mm)).float()
        n_features = n_channels if n_channels == 1 else 3 * n_channels
        shape = (n_features, len(per_mm))
        self.register_buffer("mean", torch.zeros(shape))
        self.register_buffer("sd", torch.ones(shape))
        self.register_buffer("weight", torch.zeros(n_features * len(per_mm), n_classes))
        self.register_buffer("constant", torch.zeros(n_classes))
        self.register_buffer("right", torch.zeros((n_features - n_channels) * len(per_mm), 1))
        self.register_buffer("floor", torch.tensor(-math.inf))
        self.register_buffer("speeds", torch.ones(1))
        self.register_buffer("temperature", torch.ones(()))

    def solve(self, data: base.FitData, rng: np.random.Generator, penalty: float) -> None:
        """Learn, in place; `rng` draws the wrong speeds, the penalty is for each channel."""
        values, labels, weight, speed_mm_s = data
        powers = values[:, : self.n_channels].flatten()
        spread = powers[:: max(1, len(powers) // _MOST)]  # evenly, where there are very many
        self.floor = torch.quantile(spread, _FLOOR)
        low, high = float(speed_mm_s.min()) / _BEYOND, float(speed_mm_s.max()) * _BEYOND
        per_octave = max(_LEAST_PER_OCTAVE, round(1 / self._octaves))
        steps = math.ceil(math.log2(high / low) * per_octave)
        self.speeds = low * 2.0 ** (torch.arange(steps + 1) / per_octave)
        parts, heard = self._shifted(values, speed_mm_s)
        n_heard = heard.sum(0).clamp_min(1)
        self.mean = (parts * heard).sum(0) / n_heard
        variance = ((parts - self.mean) * heard).square().sum(0) / n_heard
        self.sd = variance.sqrt().clamp_min(_LEAST_SD)
        named = nn.functional.one_hot(labels, len(self.constant))
        names, measures = solved.Gram(*self.weight.shape), solved.Gram(*self.right.shape)
        n_wrong = 0 if self.speed_from == "given" else WRONG_SPEEDS
        for right in (True, *([False] * n_wrong)):
            supposed = speed_mm_s if right else _draw_wrong(speed_mm_s, low, high, rng)
            share = weight if right else weight / WRONG_SPEEDS
            parts = self._over_textures(values, supposed)
            if right or self.speed_from == "none":
                names.add(parts.flatten(1), named * right, share)
            if self.speed_from == "measured":
                is_right = torch.full((len(parts), 1), float(right))
                measures.add(parts[:, self.n_channels :].flatten(1), is_right, share)
        strength = penalty * self.n_channels
        self.weight, self.constant = names.solve(strength)
        if self.speed_from == "measured":
            self.right, _ = measures.solve(strength)  # the constant favours no speed

    def scores(self, values: Tensor, speed_mm_s: Tensor | None = None) -> Tensor:
        """Return the scores of samples, (n, supposed speed, n_classes).

        Where the speed is known or measured, that is the only one supposed.

        Raises
        ------
        InputError
            If it needs the speed, and is not given it.
        """
        if self.speed_from == "given":
            if speed_mm_s is None:
                raise InputError(
                    "order-te-speed-known: expected the sliding speed, found none; use order-te"
                )
            return self._at(values, speed_mm_s)[:, None]
        if self.speed_from == "measured":
            return self._at(values, self.measured(values))[:, None]
        return self._search(values)

    def measured(self, values: Tensor) -> Tensor:
        """Return the speeds that the phases between channels agree with, mm/s, (n,)."""
        agreeing = [
            self._over_textures(values, v.expand(len(values)))[:, self.n_channels :].flatten(1)
            @ self.right
            for v in self.speeds
        ]
        return self.speeds[torch.cat(agreeing, 1).argmax(1)]

    def forward(self, values: Tensor, speed_mm_s: Tensor | None = None) -> Tensor:
        """Return log-probabilities of samples, (n, n_classes)."""
        return solved.log_probabilities(self.scores(values, speed_mm_s), self.temperature)

    def speed(self, values: Tensor, textures: Tensor) -> Tensor | None:
        """Return the most likely speeds, mm/s, (n,), of samples whose textures are named.

        Parameters
        ----------
        textures
            Numbers of the textures, (n,); from these scores, or known for certain.
        """
        if self.speed_from == "given":
            return None
        if self.speed_from == "measured":
            return self.measured(values)
        named = self._search(values)[torch.arange(len(values)), :, textures]
        return self.speeds[named.argmax(1)]

    def _search(self, values: Tensor) -> Tensor:
        """Return scores at all speeds, (n, supposed speed, n_classes)."""
        return torch.stack([self._at(values, v.expand(len(values))) for v in self.speeds], 1)

    def _at(self, values: Tensor, speed_mm_s: Tensor) -> Tensor:
        """Return scores at one supposed speed a sample, (n, n_classes)."""
        return self._over_textures(values, speed_mm_s).flatten(1) @ self.weight + self.constant

    def _over_textures(self, values: Tensor, speed_mm_s: Tensor) -> Tensor:
        """Return what a sample would be over cycles per mm at a supposed speed, standardised.

        What was not heard is 0, the mean of all.
        """
        parts, heard = self._shifted(values, speed_mm_s)
        return (parts - self.mean) / self.sd * heard

    def _shifted(self, values: Tensor, speed_mm_s: Tensor) -> tuple[Tensor, Tensor]:
        """Return values over cycles per mm (n, feature, per_mm), and which of these were heard.

        Linear between frequencies. Powers are relative to their mean over what was heard, which
        lies between the lowest and the highest frequency: (n, 1, per_mm), 1 or 0.
        """
        place = self._log_per_mm + torch.log2(speed_mm_s.float())[:, None] - math.log2(self._low)
        place = place / self._octaves
        below = place.floor().long()
        heard = ((below >= 0) & (below < values.shape[2] - 1)).float()[:, None]
        below = below.clamp(0, values.shape[2] - 2)
        share = (place - below)[:, None]
        index = below[:, None].expand(-1, values.shape[1], -1)
        parts = values.gather(2, index) * (1 - share) + values.gather(2, index + 1) * share
        power = torch.logaddexp(parts[:, : self.n_channels], self.floor)
        n_heard = (heard.sum((1, 2)) * self.n_channels).clamp_min(1)
        level = (power * heard).sum((1, 2)) / n_heard
        return torch.cat([power - level[:, None, None], parts[:, self.n_channels :]], 1), heard


def _draw_wrong(speed_mm_s: Tensor, low: float, high: float, rng: np.random.Generator) -> Tensor:
    """Draw a speed for each that is not the right one."""
    right = speed_mm_s.double().numpy()
    drawn = np.exp(rng.uniform(math.log(low), math.log(high), len(right)))
    while (near := np.abs(np.log2(drawn / right)) < _WRONG_FROM).any():
        drawn[near] = np.exp(rng.uniform(math.log(low), math.log(high), int(near.sum())))
    return torch.from_numpy(drawn)
