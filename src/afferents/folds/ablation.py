"""Fewer textures, speeds, markers or training speeds: as a lab might have, of what there is."""

import re
from collections.abc import Collection, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import xarray as xr
from pydantic import ConfigDict
from pydantic.dataclasses import dataclass

from afferents import dims
from afferents.encodings.samples import Samples
from afferents.errors import InputError
from afferents.folds.held_out import SPEED, condition_text
from afferents.folds.protocol import Fold
from afferents.store.recording import LETTERS, name_folder
from afferents.store.responses import Responses, conditions, list_speeds, speed_of, textures_of

_SPREAD = (0.7548776662466927, 0.5698402909980532)
"""Steps of a sequence that fills the plane evenly at any length (Roberts 2018)."""


@dataclass(frozen=True, config=ConfigDict(extra="forbid"))
class Ablation:
    """What of the data is used; by default all of it.

    Attributes
    ----------
    textures
        Names in the data, or the paper's letters; none for all.
    speeds_mm_s
        None for all.
    markers
        Share of the markers that show something, evenly spread; the others are 0, as if their pins
        were missing.
    train_speeds
        At how many speeds each fold trains, evenly spread over those it has; None for all.
    test_only
        A condition, name and value, whose recordings are tested and never learnt from, while the
        others are learnt from and not tested; None for no such difference.
    speed_change
        Most by which a sample's speed changes, as a share of its mean; None for any.
    """

    textures: tuple[str, ...] = ()
    speeds_mm_s: tuple[float, ...] = ()
    markers: float = 1.0
    train_speeds: int | None = None
    test_only: tuple[str, str] | None = None
    speed_change: float | None = None

    def __post_init__(self) -> None:
        """Refuse shares and numbers that make no sense."""
        if not 0 < self.markers <= 1:
            raise InputError(
                f"--markers: expected a share above 0, up to 1, found {self.markers:g}"
            )
        if self.train_speeds is not None and self.train_speeds < 1:
            raise InputError(f"--train-speeds: expected at least 1, found {self.train_speeds}")

    def describe(self) -> dict[str, Any]:
        """Return what is left out, ready for JSON; empty where nothing is."""
        usual = asdict(Ablation())
        mine = {name: value for name, value in asdict(self).items() if value != usual[name]}
        return {name: list(v) if isinstance(v, tuple) else v for name, v in mine.items()}

    def recordings(self, recordings: Sequence[Responses]) -> list[Responses]:
        """Return the recordings of the textures and speeds that are used.

        Raises
        ------
        InputError
            If one of them is not in the data.
        """
        wanted = self.speeds_mm_s
        if not (wanted or self.textures):
            return list(recordings)
        there, textures = textures_of(recordings), []
        for name in self.textures:
            known = name_folder(name) if name not in there and name in tuple(LETTERS) else name
            if known not in there:
                raise InputError(f"--textures: expected some of {', '.join(there)}, found '{name}'")
            textures.append(known)
        textures = textures or there
        SPEED.require(wanted, list_speeds(recordings), "--speeds")
        return [
            r
            for r in recordings
            if str(r.attrs[dims.TEXTURE]) in textures and (not wanted or speed_of(r) in wanted)
        ]

    def tested(self, recordings: Sequence[Responses]) -> frozenset[str]:
        """Return the names of the recordings that are tested and never learnt from.

        Raises
        ------
        InputError
            If none, or all, are under the condition given.
        """
        if self.test_only is None:
            return frozenset()
        name, value = self.test_only
        declared = [(str(r.attrs["name"]), conditions(r)) for r in recordings]
        tested = frozenset(
            of for of, its in declared if name in its and condition_text(its[name]) == value
        )
        if not 0 < len(tested) < len(declared):
            there = sorted(
                {f"{k}={condition_text(v)}" for _, its in declared for k, v in its.items()}
            )
            raise InputError(
                "--test-only: expected a condition of some recordings "
                f"({', '.join(there) or 'none is declared'}), found {name}={value}, of "
                f"{len(tested)} of {len(declared)}"
            )
        return tested

    def shown(self, response: xr.DataArray) -> xr.DataArray:
        """Return a response in which some of the markers show 0; vibration as it is.

        Raises
        ------
        InputError
            If nothing is known of where the markers stand.
        """
        if self.markers == 1 or dims.MARKER not in response.dims:
            return response
        if dims.ROW not in response.coords:
            where = response.attrs.get("name", "a recording")
            raise InputError(
                f"--markers: expected markers whose places are known, found none in {where}"
            )
        at = _SPREAD[0] * response[dims.ROW] + _SPREAD[1] * response[dims.COLUMN]
        return response.where(at % 1 < self.markers, 0)

    def fold(self, fold: Fold, samples: Samples, tested: Collection[str] = ()) -> Fold:
        """Return the fold with fewer speeds to train on, and some recordings alone to test.

        Parameters
        ----------
        tested
            Names of the recordings that alone are tested; none for all. See `tested`.

        Raises
        ------
        InputError
            If it has fewer speeds than that, or nothing is left to learn from or to test.
        """
        if tested:
            is_tested = np.isin(samples[dims.RECORDING].values, list(tested))
            fold = replace(
                fold,
                train=fold.train[~is_tested[fold.train]],
                validation=fold.validation[~is_tested[fold.validation]],
                test=fold.test[is_tested[fold.test]],
            )
            for name in ("train", "validation", "test"):
                if len(getattr(fold, name)) == 0:
                    found = f"nothing to {name} with {fold.split.printed(fold.held_out)} held out"
                    raise InputError(
                        f"--test-only: expected some of both kinds at every {fold.split.name}, "
                        f"found {found}"
                    )
        return fold if self.train_speeds is None else self._take_speeds(fold, samples)

    def _take_speeds(self, fold: Fold, samples: Samples) -> Fold:
        assert self.train_speeds is not None
        speeds = samples[dims.SPEED].values[fold.train]
        if np.isnan(speeds).any():
            expected = "the speed of every recording"
            raise InputError(
                f"--train-speeds: expected {expected}, found none of some; leave it out"
            )
        there = np.unique(speeds)
        if len(there) < self.train_speeds:
            raise InputError(
                f"--train-speeds: expected at most {len(there)}, as each fold has, found "
                f"{self.train_speeds}"
            )
        places = np.linspace(0, len(there) - 1, self.train_speeds).round().astype(int)
        train = fold.train[np.isin(speeds, there[places])]
        if fold.split == SPEED:  # its validation group is one speed more
            return replace(fold, train=train)
        validation = fold.validation[
            np.isin(samples[dims.SPEED].values[fold.validation], there[places])
        ]
        return replace(fold, train=train, validation=validation)


def parse_speeds(text: str | None, option: str = "--speeds") -> tuple[float, ...]:
    """Read the speeds in mm/s of an option: ``10,50,100``, or ``10..100:30`` for 10, 40, 70, 100.

    Raises
    ------
    InputError
        If it is neither.
    """
    number = r"\s*(\d+(?:\.\d+)?)\s*"
    speeds: list[float] = []
    for part in (text or "").split(",") if text else ():
        steps = re.fullmatch(rf"{number}\.\.{number}:{number}", part)
        if steps:
            first, last, step = map(float, steps.groups())
            speeds += list(np.arange(first, last + step / 1e6, step)) if step > 0 else []
        elif re.fullmatch(number, part):
            speeds.append(float(part))
        else:
            speeds = []
            break
    if text and not speeds:
        raise InputError(f"{option}: expected mm/s as in 10,50,100 or 10..100:30, found '{text}'")
    return tuple(float(v) for v in dict.fromkeys(speeds))
