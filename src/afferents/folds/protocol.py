"""The two evaluation protocols, by name; `folds.splits` makes their folds.

`published` is what the paper's code does (commit 880f9e4). `nested` never looks at the held-out
speed, and stretches spectra without ringing, with the originals kept; so for spectra the two
differ by more than a leak. `docs/discrepancies.md` lists where the paper's text and its code
differ and which side is taken.
"""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, model_validator

from afferents.errors import InputError
from afferents.folds.held_out import SPEED, Group, Split, key_of, order

Indices = NDArray[np.int64]
ProtocolName = Literal["nested", "published"]


@dataclass(frozen=True)
class Fold:
    """Indices of the samples that train, validate and test one group held out.

    Attributes
    ----------
    held_out, validated_by
        The group that is tested, and the one that validates (the same under `published`).
    split
        What the groups are.
    """

    held_out: Group
    validated_by: Group
    train: Indices
    validation: Indices
    test: Indices
    split: Split = SPEED


class Protocol(BaseModel):
    """How a held-out speed is kept apart from what is learnt and chosen.

    Attributes
    ----------
    validation
        What stops the training and picks its weights: whole ``training-speed``s, or the
        other half of the ``held-out-speed`` itself.
    scale_from
        Spectra are divided by the largest amplitude of the ``training`` samples or of
        ``everything``.
    stretch
        ``rebinned`` (keeps the level, no ringing) or ``fourier`` (resampling as published).
    keep_originals
        Whether the unstretched spectra stay in an augmented training set.
    solved_models_learn_from_validation
        Whether models of ours that stop and pick nothing by it learn from the validation samples
        too. A user's own estimator does not: what it would pick by them is not known.
    refuses_leaks
        Whether a fold that sees anything of the held-out speed is refused, not only recorded.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: ProtocolName
    validation: Literal["training-speed", "held-out-speed"]
    scale_from: Literal["training", "everything"]
    stretch: Literal["rebinned", "fourier"]
    keep_originals: bool
    solved_models_learn_from_validation: bool
    refuses_leaks: bool

    @model_validator(mode="after")
    def _nested_sees_nothing_held_out(self) -> Self:
        if self.refuses_leaks and (self.validation, self.scale_from) != (
            "training-speed",
            "training",
        ):
            raise ValueError("a nested protocol validates and scales on training speeds alone")
        return self

    def validation_group(
        self, groups: tuple[Group, ...], held_out: Group, split: Split = SPEED
    ) -> Group:
        """Return the group, by default a speed, that validates the fold holding out `held_out`.

        Under `nested` it is half the range of ranks away from the held-out speed, and never
        the slowest or fastest where that can be helped: taking an end away from training
        would turn a test of interpolation into one of extrapolation, and a neighbour of the
        held-out speed is the one that training needs most. Groups of other kinds are ranked by
        number, then alphabetically: the rule is as good as any, and the same each time.

        Raises
        ------
        InputError
            If fewer than three groups leave nothing to train on under `nested`.
        """
        if self.validation == "held-out-speed":
            return held_out
        n = len(groups)
        if n < 3:
            raise InputError(
                f"the data: expected at least 3 {split.many} for the nested protocol (train, "
                f"validate, hold out), found {n} ({', '.join(map(key_of, groups))}{split.unit}); "
                f"record more {split.many} or use --protocol published"
            )
        ranked = sorted(groups, key=order)
        opposite = (ranked.index(held_out) + n // 2) % n
        interior = min(max(opposite, 1), n - 2)
        return ranked[opposite if ranked[interior] == held_out else interior]


PROTOCOLS: dict[str, Protocol] = {
    "nested": Protocol(
        name="nested",
        validation="training-speed",
        scale_from="training",
        stretch="rebinned",
        keep_originals=True,
        solved_models_learn_from_validation=True,
        refuses_leaks=True,
    ),
    "published": Protocol(
        name="published",
        validation="held-out-speed",
        scale_from="everything",
        stretch="fourier",
        keep_originals=False,
        solved_models_learn_from_validation=False,
        refuses_leaks=False,
    ),
}
