"""Files as laboratories have them: of MATLAB, NWB of others and ours."""

import ast
from datetime import UTC, datetime
from itertools import count
from pathlib import Path

import numpy as np
import pytest
import scipy.io

import afferents

TEXTURES = ["denim", "silk", "corduroy"]
SPEEDS = [40.0, 80.0, 120.0]
CLASSES = ["SA1", "SA1", "RA", "PC"]
DURATION_S = 1.0
ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="session")
def trains():
    """Spike times, s, by fibre, texture, speed and repetition; one silent, one with gaps."""
    rng = np.random.default_rng(0)
    found = np.empty((len(CLASSES), len(TEXTURES), len(SPEEDS), 2), object)
    for at in np.ndindex(found.shape):
        n = 0 if at[0] == 1 else 1 + rng.poisson(5)
        found[at] = np.sort(rng.uniform(0, DURATION_S - 1e-3 * n, n)) + 1e-3 * np.arange(n)
    for repetition in range(2):
        found[3, 2, 1, repetition] = None
    return found


FINGERTIP = {40.0: 2.0, 80.0: 1.0, 120.0: 0.8}
"""Speeds, mm/s, and how long recordings last, s; at the fastest, every other fibre's last less."""
SHORTER_S = 0.5
_EMPTY = [(0, 0), (0, 1), (1, 0)]


def lasting_s(speed, fibre):
    """How long a fibre was recorded at a speed."""
    return SHORTER_S if speed == 120.0 and fibre % 2 else FINGERTIP[speed]


@pytest.fixture
def write_fingertip():
    """Write fibres as the public file of the monkey's fingertip has them."""

    def write(path, trains, recorded, classes):
        """Trains by speed, texture, fibre and repetition; empty cells of each shape in turn."""
        spikes, rates = np.empty((1, 3), object), np.empty((1, 3), object)
        shapes = count()
        for v, speed in enumerate(FINGERTIP):
            cells = np.empty(trains.shape[1:], object)
            rate = np.full(cells.shape, np.nan)
            for at in np.ndindex(cells.shape):
                times = trains[v][at] if recorded[v][at] else []
                cells[at] = np.reshape(times, (-1, 1)) if len(times) else None
                if not len(times):
                    cells[at] = np.empty(_EMPTY[next(shapes) % 3])
                if recorded[v][at]:
                    rate[at] = len(times) / lasting_s(speed, at[1])
            spikes[0, v], rates[0, v] = cells, rate
        texts = {"neuron_types": classes, "neuron_id": [f"n{n}" for n in range(len(classes))]}
        cells = {name: np.array(values, object)[:, None] for name, values in texts.items()}
        scipy.io.savemat(path, {"spikes": spikes, "rates": rates, **cells})
        return path

    return write


@pytest.fixture(scope="session")
def read_fibres():
    """The function that the gallery shows."""
    page = ast.parse((ROOT / "docs/gallery/13_nerve_fibres.py").read_text("utf-8"))
    kinds = (ast.Import, ast.ImportFrom, ast.FunctionDef)
    page.body = [part for part in page.body if isinstance(part, kinds)]
    names = {}
    exec(compile(page, "13_nerve_fibres.py", "exec"), names)
    return names["read_fibres"]


TRIALS = [("denim", 4.0, 10.0, 11.0), ("silk", 4.0, 11.0, 11.5), ("denim", 4.0, 20.0, 21.0)]


def _write_nwb(path, trials=TRIALS, units=True):
    """A file with other columns than ours; trials touch, and one unit was lost after the second."""
    pynwb = pytest.importorskip("pynwb")
    file = pynwb.NWBFile("touch", "id", datetime(2026, 1, 1, tzinfo=UTC))
    for name in ("stimulus", "v", "force") if trials else ():
        file.add_trial_column(name, name)
    for texture, speed, start, stop in trials:
        file.add_trial(start_time=start, stop_time=stop, stimulus=texture, v=speed, force=0.5)
    if units:
        file.add_unit_column("cell_type", "class")
        file.add_unit_column("note", "class in other words")
        file.add_unit(
            spike_times=[9.0, 10.0, 10.5, 11.0, 11.25, 15.0, 21.0],
            obs_intervals=[[0.0, 30.0]],
            cell_type="SA-I",
            note="afferent X",
        )
        seen = [[0.0, 10.5], [10.5, 12.0]], [[9.0, 12.0]]
        file.add_unit(
            spike_times=[10.25], obs_intervals=seen[1], cell_type="RA1", note="afferent Y"
        )
        file.add_unit(spike_times=[20.5], obs_intervals=seen[0], cell_type="PC", note="afferent X")
    with pynwb.NWBHDF5IO(str(path), "w") as io:
        io.write(file)
    return path


@pytest.fixture(scope="session")
def write_nwb():
    """Write an NWB file as another laboratory would."""
    return _write_nwb


@pytest.fixture(scope="session")
def other(tmp_path_factory):
    """Such a file."""
    return _write_nwb(tmp_path_factory.mktemp("nwb") / "other.nwb")


@pytest.fixture(scope="session")
def written(stores, small_session, tmp_path_factory):
    """The small session's store as an NWB file."""
    pytest.importorskip("pynwb")
    out = tmp_path_factory.mktemp("nwb") / "session.nwb"
    start = "2026-03-31T09:30+02:00"
    afferents.export_nwb(stores["video"], out, small_session, start_time=start, quiet=True)
    return out
