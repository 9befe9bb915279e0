"""Linear discriminant analysis: textures are clouds of one shape about means of their own.

A score is the logarithm of a Gaussian's density, less what all textures share: linear in the values
(Fisher, Ann. Eugenics 1936, 7:179). For few values, of which a texture may take a middle one: there
a ridge on indicators of the textures names the outer ones alone (Hastie, Tibshirani & Friedman, The
Elements of Statistical Learning, 2009, section 4.2).
"""

from typing import cast

import numpy as np
from torch import nn

from afferents.models.base import FitData
from afferents.models.ridge import Gram, Ridge


class Discriminant(Ridge):
    """A linear discriminant, whose covariance within textures is shrunk.

    Its diagonal gains a share of each value's variance over all samples (Friedman, J. Am. Stat.
    Assoc. 1989, 84:165). The share is the penalty, chosen inside each fold.
    """

    name = "discriminant"
    penalties = (0.01, 0.1, 1.0)
    learns_from_sums = False

    def solve(self, data: FitData, rng: np.random.Generator, penalty: float) -> None:
        """Learn from samples, in place; the speeds tell nothing."""
        flat, linear = data.values.flatten(1), cast("nn.Linear", self.dense[0])
        gram = Gram(linear.in_features, linear.out_features)
        targets = nn.functional.one_hot(data.labels, linear.out_features)
        gram.add(flat, targets, data.weight)
        solved, constant = gram.solve_as_discriminant(penalty)
        linear.weight.copy_(solved.T)
        linear.bias.copy_(constant)
