"""Trains of made fibres, and files as laboratories have them: NWB of others and ours."""

from datetime import UTC, datetime

import numpy as np
import pytest

import afferents

TEXTURES = ["denim", "silk", "corduroy"]
SPEEDS = [40.0, 80.0, 120.0]
CLASSES = ["SA1", "SA1", "RA", "PC"]
DURATION_S = 1.0


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
