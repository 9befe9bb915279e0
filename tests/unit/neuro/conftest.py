"""Files as laboratories have them: of MATLAB in two versions, NWB of others and ours."""

from datetime import UTC, datetime
from itertools import count

import h5py
import numpy as np
import pytest
import scipy.io

import afferents

TEXTURES = ["denim", "silk", "corduroy"]
SPEEDS = [40.0, 80.0, 120.0]
CLASSES = ["SA1", "SA1", "RA", "PC"]
DURATION_S = 1.0
_NUMBERS = count()


@pytest.fixture(scope="session")
def trains():
    """Spike times, s, by fibre, texture, speed and repetition; one silent, one with gaps."""
    rng = np.random.default_rng(0)
    found = np.empty((len(CLASSES), len(TEXTURES), len(SPEEDS), 2), object)
    for at in np.ndindex(found.shape):
        n = 0 if at[0] == 1 else 1 + rng.poisson(5)
        found[at] = np.sort(rng.uniform(0, DURATION_S, n))
    for repetition in range(2):
        found[3, 2, 1, repetition] = None
    return found


def cell(values):
    """A MATLAB cell array of a list, as a row."""
    row = np.empty((1, len(values)), object)
    row[0] = values
    return row


def write_v5(path, variables):
    scipy.io.savemat(path, {name: _struct_array(value) for name, value in variables.items()})
    return path


def _struct_array(value):
    """An array of structs of a list of dicts, as MATLAB has it."""
    if not isinstance(value, list):
        return value
    structs = np.empty((1, len(value)), [(field, object) for field in value[0]])
    for number, one in enumerate(value):
        structs[0, number] = tuple(one.values())
    return structs


def write_v73(path, variables):
    """Write variables as MATLAB's save -v7.3 does: turned round, cells as references."""
    with h5py.File(path, "w", userblock_size=512) as file:
        refs = file.create_group("#refs#")
        for name, value in variables.items():
            _write(file, refs, name, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return path


def _write(parent, refs, name, value):
    if isinstance(value, dict):
        group = parent.create_group(name)
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for field, one in value.items():
            _write(group, refs, field, one)
        return group
    if isinstance(value, list) and value and isinstance(value[0], dict):  # an array of structs
        group = parent.create_group(name)
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for field in value[0]:
            _references(group, refs, field, cell([one[field] for one in value]))
        return group
    if isinstance(value, str):
        codes = np.array([[ord(letter)] for letter in value], np.uint16)
        return _marked(parent.create_dataset(name, data=codes), "char")
    array = np.asarray(value)
    if array.dtype.kind == "O":
        return _marked(_references(parent, refs, name, array), "cell")
    array = np.atleast_2d(array).astype(float)
    if not array.size:
        empty = parent.create_dataset(name, data=np.array(array.shape, np.uint64))
        empty.attrs["MATLAB_empty"] = np.uint8(1)
        return _marked(empty, "double")
    return _marked(parent.create_dataset(name, data=array.T), "double")


def _marked(dataset, kind):
    dataset.attrs["MATLAB_class"] = np.bytes_(kind)
    return dataset


def _references(parent, refs, name, array):
    flat = np.empty(array.size, h5py.ref_dtype)
    for number, one in enumerate(array.ravel()):
        flat[number] = _write(refs, refs, f"r{next(_NUMBERS)}", one).ref
    return parent.create_dataset(name, data=flat.reshape(array.shape).T, dtype=h5py.ref_dtype)


WRITERS = {"v5": write_v5, "v7.3": write_v73}


@pytest.fixture(params=WRITERS)
def write_mat(request):
    """Write a MATLAB file, of each version."""
    return WRITERS[request.param]


@pytest.fixture(scope="session")
def as_cell():
    return cell


FINGERTIP = {40.0: 2.0, 80.0: 1.0, 120.0: 0.8}
"""Speeds, mm/s, and how long recordings last, s."""
_EMPTY = [(0, 0), (0, 1), (1, 0)]


@pytest.fixture
def write_fingertip():
    """Write fibres as the public file of the monkey's fingertip has them."""

    def write(path, trains, recorded, classes):
        """Trains by speed, texture, fibre and repetition; empty cells of each shape in turn."""
        spikes, rates = np.empty((1, 3), object), np.empty((1, 3), object)
        shapes = count()
        for v, seconds in enumerate(FINGERTIP.values()):
            cells = np.empty(trains.shape[1:], object)
            rate = np.full(cells.shape, np.nan)
            for at in np.ndindex(cells.shape):
                times = trains[v][at] if recorded[v][at] else []
                cells[at] = np.reshape(times, (-1, 1)) if len(times) else None
                if not len(times):
                    cells[at] = np.empty(_EMPTY[next(shapes) % 3])
                if recorded[v][at]:
                    rate[at] = len(times) / seconds
            spikes[0, v], rates[0, v] = cells, rate
        types = np.empty((len(classes), 1), object)
        types[:, 0] = classes
        scipy.io.savemat(path, {"spikes": spikes, "rates": rates, "neuron_types": types})
        return path

    return write


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
