"""From an extracted store to the spikes of artificial afferents, and what is read from them."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from afferents import files
from afferents.choices import LARGEST_SEED, require_number, words_in
from afferents.files import Place
from afferents.neuro import decoding, exponent, figures, matching, speed
from afferents.neuro.natural import read_spikes
from afferents.parallel import side_by_side, side_by_side_numbered
from afferents.progress import Progress
from afferents.reporting.style import save_figure
from afferents.spikes.artificial import artificial_spikes, join_recordings
from afferents.spikes.population import Spikes
from afferents.store.zarr_store import open_responses, open_whole

FACTS = "neural.json"
TABLES = ("rates", "resolution", "units", "slopes", "stretch", "exponents")
"""Of the tables that are written, as CSV."""
_COMPARED = ("beside_resolution", "beside_stretch", "natural_stretch", "natural_rates")
"""Tables that are written as well where natural fibres are compared."""
RASTER_UNITS, RASTER_S = 12, 0.5
"""Of each class in the raster, and how long it is."""
_MANY = 20
"""Recordings for which it pays to start other processes."""


def spikes_of_store(
    store: str | Path,
    model: str = "izhikevich",
    seed: int = 0,
    classes: Sequence[str] = ("SA", "RA", "PC"),
    start_s: float | None = None,
    stop_s: float | None = None,
    progress: Progress | None = None,
) -> Spikes:
    """Return the spikes of units that the recordings of a store drive; a trial a recording.

    Parameters
    ----------
    store
        As `afferents extract` writes it.
    model, seed, classes, start_s, stop_s
        See `artificial_spikes`.

    Raises
    ------
    InputError
        If the store can't be read or lacks recordings of its session, and as `artificial_spikes`.
    """
    recordings = open_whole(store)
    progress = progress or Progress(quiet=True)
    jobs = (([one], model, seed, classes, start_s, stop_s) for one in recordings)
    workers = None if len(recordings) >= _MANY else 1
    done = side_by_side_numbered(artificial_spikes, jobs, workers, progress.note)
    return join_recordings(dict(sorted(progress.track(done, "spikes", len(recordings)))).values())


@dataclass(frozen=True)
class NeuralResults:
    """What was found, and the files it was written to.

    Attributes
    ----------
    spikes
        That everything was read from.
    tables
        By the names of `TABLES`.
    summary
        Three tables for people: rates, decoding, and stretching.
    pictures
        Files.
    facts
        For scripts.
    """

    spikes: Spikes
    tables: dict[str, pd.DataFrame]
    summary: list[pd.DataFrame]
    pictures: list[Path]
    facts: dict[str, Any]


def neural(
    store: Place,
    out: Place,
    units: str = "izhikevich",
    seed: int = 0,
    classes: str | Sequence[str] = "SA,RA,PC",
    window_s: float = decoding.WINDOW_S,
    natural: Place | Spikes | None = None,
    quiet: bool = False,
) -> NeuralResults:
    """Turn responses into spikes, and analyse them as spikes of nerve fibres are analysed.

    How often units fire; at which temporal resolution, and from how many units, texture is read;
    how rates grow with speed; whether trains stretch with it.

    Parameters
    ----------
    store
        A store that 'extract' wrote, of two textures and two speeds or more.
    out
        Folder for tables (CSV), figures (PNG) and neural.json.
    units
        Model of a unit: izhikevich, or lif (leaky integrate-and-fire).
    seed
        Draws how units differ, and which are analysed.
    classes
        Classes of afferents, some of SA, RA and PC.
    window_s
        Length of the stretches that texture is read from, s.
    natural
        Recordings of nerve fibres to compare with: a table of spikes (CSV, Parquet) or an NWB file.
        In Python also `Spikes`.
    quiet
        No progress bars; plain lines on stderr.

    Returns
    -------
    NeuralResults
        `spikes`, `tables`, `summary`, `pictures`.

    Raises
    ------
    InputError
        If the store can't be read or is half of one, the folder holds something else, a recording
        has no speed, or there are fewer than two textures or speeds.

    Examples
    --------
    >>> found = neural("S.zarr", "neural")  # doctest: +SKIP
    >>> found.tables["stretch"].groupby(["class", "stretched"]).accuracy.mean()  # doctest: +SKIP
    """
    require_number("--seed", seed, 0, LARGEST_SEED)
    require_number("--window-s", window_s, 0.01)
    store, out = Path(store), Path(out)
    # A user's tables may have such names, too: they are ours where our facts are.
    ours = [f"{name}.csv" for name in TABLES + _COMPARED if (out / FACTS).is_file()]
    files.require_free(out, files.holds_only(FACTS, *ours, or_ours=files.is_our_picture))
    with Progress(quiet) as progress:
        fibres, name = _read_fibres(natural, progress)
        spikes = spikes_of_store(store, units, seed, words_in(classes), progress=progress)
        decoding.require_conditions(spikes)
        source = f"{store.name}: {spikes.n_trials} recordings, {spikes.n_units} {units} units"
        found = matching.Comparison({}, "", "")
        if fibres is not None:
            found = matching.compare(spikes, fibres, window_s, seed)
            found.tables["natural_rates"] = rates_table(fibres)
        tables = _make_tables(store, spikes, seed, window_s, progress) | found.tables
    drawn = {
        "raster": figures.raster_figure(_choose_shown(spikes, seed), source),
        "resolution": figures.accuracy_figure(tables["resolution"], source),
        "units": figures.accuracy_figure(tables["units"], source),
        "stretch": figures.stretch_figure(speed.match_by_class(tables["stretch"]), source),
        "slopes": figures.slope_figure(tables["slopes"], source),
    }
    if fibres is not None:
        shown = _choose_shown(fibres, seed)
        drawn["natural_raster"] = figures.raster_figure(shown, f"{name}; grey: not recorded")
    if "beside_resolution" in tables:
        both = tables["beside_resolution"], tables["beside_stretch"]
        drawn["beside"] = figures.comparison_figure(*both, f"{source}; {name}")
    counts = spikes.units["class"].value_counts().to_dict()
    records = {
        name: table.astype(object).where(table.notna(), None).to_dict("records")  # no NaN in JSON
        for name, table in tables.items()
        if name != "slopes"
    }
    facts = {
        "store": store.name,
        "units": {"model": units, "seed": seed, "classes": counts},
        "tables": records,
    }
    out.mkdir(parents=True, exist_ok=True)
    files.write_json(out / FACTS, facts)  # first: a run that is killed now can be begun again
    for name in (*(f"{table}.csv" for table in _COMPARED), "beside.png", "natural_raster.png"):
        (out / name).unlink(missing_ok=True)  # of an earlier run
    for name, table in tables.items():
        with files.write_aside(out / f"{name}.csv") as written:
            table.to_csv(written, index=False)
    pictures = [save_figure(figure, out / f"{name}.png") for name, figure in drawn.items()]
    summary = [
        figures.summarise_rates(tables),
        figures.summarise_decoding(tables, found.whole),
        figures.summarise_stretching(tables, found.matched),
    ]
    return NeuralResults(spikes, tables, summary, pictures, facts)


def _read_fibres(natural: Place | Spikes | None, progress: Progress) -> tuple[Spikes | None, str]:
    """Return natural fibres and what they are called; note what is doubtful about them."""
    if natural is None or isinstance(natural, Spikes):
        return natural, "natural fibres"
    with warnings.catch_warnings(record=True) as doubts:
        warnings.simplefilter("always", UserWarning)
        fibres = read_spikes(natural)
    for doubt in doubts:
        progress.note(f"warning: {doubt.message}")
    return fibres, str(natural)


def _make_tables(
    store: Path, spikes: Spikes, seed: int, window_s: float, progress: Progress
) -> dict[str, pd.DataFrame]:
    """Return all tables, a step of the bar each; the longest is begun first."""
    steps = {
        "units": partial(decoding.accuracy_by_units, spikes, window_s=window_s, seed=seed),
        "exponents": partial(exponent.exponents, open_responses(store)),
        "stretch": partial(speed.stretch_match, spikes, seed=seed),
        "resolution": partial(
            decoding.accuracy_by_resolution, spikes, window_s=window_s, seed=seed
        ),
        "slopes": partial(speed.rate_slopes, spikes),
        "rates": partial(rates_table, spikes),
    }
    workers = None if spikes.n_trials >= _MANY else 1
    done = side_by_side(_make_table, steps.items(), workers, progress.note)
    found = dict(progress.track(done, "reading spikes", len(steps)))
    return {name: found[name] for name in TABLES}


def _make_table(name: str, make: Callable[[], pd.DataFrame]) -> tuple[str, pd.DataFrame]:
    return name, make()


def rates_table(spikes: Spikes) -> pd.DataFrame:
    """Return the mean rate of each class by texture and speed, and the share of silent units.

    Of what was recorded: where none of a class was, there is no row.
    """
    rates, rows = spikes.rates(), []
    for name in spikes.units["class"].unique():
        of_class = (spikes.units["class"] == name).to_numpy()
        for (texture, speed_mm_s), trials in spikes.trials.groupby(["texture", "speed_mm_s"]):
            some = rates[np.ix_(trials.index, of_class)]
            if len(some := some[~np.isnan(some)]):
                row = {"class": name, "texture": texture, "speed_mm_s": speed_mm_s}
                rows.append({**row, "spikes_per_s": some.mean(), "silent": np.mean(some == 0)})
    return pd.DataFrame(rows)


def _choose_shown(spikes: Spikes, seed: int) -> Spikes:
    """Return some units of each class, in the same half second of three trials of one speed."""
    speeds = np.unique(spikes.trials["speed_mm_s"])
    at = spikes.trials["speed_mm_s"] == speeds[len(speeds) // 2]
    trials = np.flatnonzero(at)
    trials = trials[np.linspace(0, len(trials) - 1, min(3, len(trials))).astype(int)]
    shown = matching.some_of_each(
        spikes, dict.fromkeys(spikes.units["class"].unique(), RASTER_UNITS), seed
    )
    length_s = min(RASTER_S, float(spikes.trials["duration_s"].min()))
    return shown.select(trials=trials).window(0, length_s)
