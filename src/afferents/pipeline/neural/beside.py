"""Artificial units beside natural fibres, made alike: `afferents neural --natural`."""

from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from afferents.reporting.neural import beside_figure
from afferents.spikes.analysis import accuracy_by_resolution, matched, stretch_match
from afferents.spikes.analysis.speed import match_by_class
from afferents.spikes.population import Spikes

_SHARE = 1 / 3
"""Of the shortest trial: the longest window that still leaves some to learn from."""


@dataclass(frozen=True)
class Beside:
    """What both populations say, with a column `population`: ``artificial`` or ``natural``."""

    resolution: pd.DataFrame
    matches: pd.DataFrame
    figure: Figure
    sentences: list[str]


def beside(artificial: Spikes, natural: Spikes, window_s: float, seed: int, source: str) -> Beside:
    """Read texture from both, from as many textures, speeds, units and seconds of each.

    Raises
    ------
    InputError
        As `spikes.analysis.matched`, and if trials are too short for windows.
    """
    pair = dict(zip(("artificial", "natural"), matched(artificial, natural, seed), strict=True))
    shortest = min(float(one.trials["duration_s"].min()) for one in pair.values())
    window_s = min(window_s, shortest * _SHARE)
    resolution, matches = [], []
    for population, spikes in pair.items():
        given = {"population": population}
        by_resolution = accuracy_by_resolution(spikes, window_s=window_s, seed=seed)
        resolution.append(by_resolution.assign(**given))
        found = match_by_class(stretch_match(spikes, seed=seed))
        matches.append(found.assign(**given))
    both, stretched = pd.concat(resolution), pd.concat(matches)
    return Beside(both, stretched, beside_figure(both, stretched, source), _said(pair, stretched))


def _said(pair: dict[str, Spikes], matches: pd.DataFrame) -> list[str]:
    """Return what was made alike, and what stretching does to both."""
    one = pair["natural"]
    units = ", ".join(f"{n} {name}" for name, n in one.units["class"].value_counts().items())
    speeds = {
        name: ", ".join(f"{speed:g}" for speed in sorted(spikes.trials["speed_mm_s"].unique()))
        for name, spikes in pair.items()
    }
    said = [
        f"Compared: {one.trials['texture'].nunique()} textures of each; {units} of each; "
        f"{speeds['artificial']} mm/s beside {speeds['natural']} mm/s."
    ]
    table = matches.pivot_table("accuracy", ["class", "population"], "stretched", sort=False)
    for (name, population), row in zip(table.index, table.to_numpy(), strict=True):
        plain, stretched = (100 * value for value in row)
        said.append(
            f"{name}, {population}: {stretched:.0f}% of trains find their texture at another speed "
            f"when stretched, {plain:.0f}% as they are."
        )
    return said
