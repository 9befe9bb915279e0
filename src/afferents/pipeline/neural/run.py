"""From a store to spikes, tables, figures, and what they mean in words."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents.core.files import write_aside, write_json
from afferents.core.outputs import require_picture_folder
from afferents.core.progress import Progress
from afferents.core.store import open_responses
from afferents.pipeline.neural.beside import beside
from afferents.pipeline.neural.words import sentences_of
from afferents.pipeline.spikes import spikes_of_store
from afferents.reporting import save_figure
from afferents.reporting.neural import (
    raster_figure,
    resolution_figure,
    slope_figure,
    stretch_figure,
    units_figure,
)
from afferents.spikes.analysis import (
    accuracy_by_resolution,
    accuracy_by_units,
    exponents,
    rate_slopes,
    stretch_match,
)
from afferents.spikes.analysis.decoding import WINDOW_S, require_conditions
from afferents.spikes.analysis.speed import match_by_class
from afferents.spikes.analysis.windows import some_units
from afferents.spikes.natural import read_natural
from afferents.spikes.population import Spikes

FACTS = "neural.json"
TABLES = ("rates", "resolution", "units", "slopes", "stretch", "exponents")
"""Of the tables that are written, as CSV."""
_BESIDE = ("beside_resolution", "beside_stretch", "natural_stretch")
RASTER_UNITS, RASTER_S = 12, 0.5
"""Of each class in the raster, and how long it is."""


@dataclass(frozen=True)
class NeuralResults:
    """What was found, and where it lies.

    Attributes
    ----------
    spikes
        That everything was read from.
    tables
        By the names of `TABLES`.
    sentences
        What they mean.
    pictures
        Files.
    facts
        For scripts.
    """

    spikes: Spikes
    tables: dict[str, pd.DataFrame]
    sentences: list[str]
    pictures: list[Path]
    facts: dict[str, Any]


def neural(
    store: Path,
    out: Path,
    progress: Progress,
    model: str = "izhikevich",
    seed: int = 0,
    classes: Sequence[str] = ("SA", "RA", "PC"),
    window_s: float = WINDOW_S,
    natural: Path | None = None,
) -> NeuralResults:
    """Let a store's recordings drive spiking units, and ask what texture and speed do to them.

    Parameters
    ----------
    store
        As `afferents extract` writes it.
    out
        Folder for tables, figures and `neural.json`.
    model, seed, classes
        See `spikes.artificial_spikes`.
    window_s
        Of the stretches that texture is read from.
    natural
        Description of recordings of nerve fibres; see `spikes.natural.read_natural`.

    Raises
    ------
    InputError
        If the folder holds something else, the store can't be read, a recording has no speed, or
        there are fewer than two textures or speeds.
    """
    require_picture_folder(out, FACTS, *(f"{name}.csv" for name in TABLES + _BESIDE))
    fibres = None if natural is None else read_natural(natural)
    spikes = spikes_of_store(store, model, seed, classes, progress=progress)
    require_conditions(spikes)
    tables = _tables(store, spikes, seed, window_s, progress)
    source = f"{store.name}: {spikes.n_trials} recordings, {spikes.n_units} {model} units"
    figures = {
        "raster": raster_figure(_shown(spikes, seed), source),
        "resolution": resolution_figure(tables["resolution"], source),
        "units": units_figure(tables["units"], source),
        "stretch": stretch_figure(match_by_class(tables["stretch"]), source),
        "slopes": slope_figure(tables["slopes"], source),
    }
    sentences = sentences_of(tables)
    if fibres is not None:
        both = beside(spikes, fibres, window_s, seed, f"{source}; {natural}")
        tables |= {"beside_stretch": both.matches, "natural_stretch": both.natural}
        if both.resolution is not None and both.figure is not None:
            tables["beside_resolution"], figures["beside"] = both.resolution, both.figure
        sentences += both.sentences
    out.mkdir(parents=True, exist_ok=True)
    for name, table in tables.items():
        with write_aside(out / f"{name}.csv") as written:
            table.to_csv(written, index=False)
    pictures = [save_figure(figure, out / f"{name}.png") for name, figure in figures.items()]
    facts = {
        "store": store.name,
        "units": {
            "model": model,
            "seed": seed,
            "classes": spikes.units["class"].value_counts().to_dict(),
        },
        "tables": {name: _records(tables[name]) for name in tables if name != "slopes"},
    }
    write_json(out / FACTS, facts)
    return NeuralResults(spikes, tables, sentences, pictures, facts)


def _tables(
    store: Path, spikes: Spikes, seed: int, window_s: float, progress: Progress
) -> dict[str, pd.DataFrame]:
    """Return all tables, a step of the bar each."""
    steps: dict[str, Callable[[], pd.DataFrame]] = {
        "rates": partial(rates_table, spikes),
        "resolution": partial(accuracy_by_resolution, spikes, window_s=window_s, seed=seed),
        "units": partial(accuracy_by_units, spikes, window_s=window_s, seed=seed),
        "slopes": partial(rate_slopes, spikes),
        "stretch": partial(stretch_match, spikes, seed=seed),
        "exponents": lambda: exponents(open_responses(store)),
    }
    found = progress.track(steps.items(), "reading spikes", len(steps))
    return {name: step() for name, step in found}


def rates_table(spikes: Spikes) -> pd.DataFrame:
    """Return the mean rate of each class by texture and speed, and the share of silent units."""
    rates, rows = spikes.rates(), []
    for name in spikes.units["class"].unique():
        of_class = (spikes.units["class"] == name).to_numpy()
        for (texture, speed), trials in spikes.trials.groupby(["texture", "speed_mm_s"]):
            some = rates[np.ix_(trials.index, of_class)]
            given = {"class": name, "texture": texture, "speed_mm_s": speed}
            mean, silent = float(np.nanmean(some)), float(np.mean(some == 0))
            rows.append({**given, "spikes_per_s": mean, "silent": silent})
    return pd.DataFrame(rows)


def _shown(spikes: Spikes, seed: int) -> Spikes:
    """Return some units of each class, in the same half second of three trials of one speed."""
    speeds = np.unique(spikes.trials["speed_mm_s"])
    at = spikes.trials["speed_mm_s"] == speeds[len(speeds) // 2]
    trials = np.flatnonzero(at)
    trials = trials[np.linspace(0, len(trials) - 1, min(3, len(trials))).astype(int)]
    rng = np.random.default_rng(seed)
    parts = [some_units(spikes.of_class(c), RASTER_UNITS, rng).units.index
             for c in spikes.units["class"].unique()]  # fmt: skip
    units = spikes.units.index.get_indexer(pd.Index(np.concatenate(parts)))
    length_s = min(RASTER_S, float(spikes.trials["duration_s"].min()))
    return spikes.select(trials, units).window(0, length_s)


def _records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Return a table's rows for JSON, where there is no NaN."""
    plain = table.astype(object).where(table.notna(), None)
    return [{str(name): value for name, value in row.items()} for row in plain.to_dict("records")]
