"""Lost markers are filled from their neighbours, in their own frame, and nearer to the truth."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings, strategies as st

from afferents import dims
from afferents.channels import ra1, sa1
from afferents.filling import fill, fill_frames, hold
from afferents.markers.places import image_places
from afferents.markers.sensor import load_sensor
from afferents.rig import Rig, bumped_surface
from afferents.rig.camera import project
from afferents.rig.run import simulate_run

GRID = np.stack(np.divmod(np.arange(361), 19), axis=1)


def make_response(values, places=GRID):
    coords = {dims.ROW: (dims.MARKER, places[:, 0]), dims.COLUMN: (dims.MARKER, places[:, 1])}
    return xr.DataArray(values, dims=(dims.TIME, dims.MARKER), coords=coords, name=dims.SA1)


def test_a_lost_marker_takes_the_mean_of_its_neighbours_by_squared_distance():
    values = np.arange(361.0)[None].repeat(2, axis=0)
    values[1, 180] = np.nan
    values[1, 180 - 1] = 1000.0
    filled = fill(make_response(values)).values
    around = 180 + np.array([1, -19, 19, -20, -18, 18, 20])
    expected = (1000 + values[1, around[:3]].sum() + values[1, around[3:]].sum() / 2) / 6
    assert filled[1, 180] == pytest.approx(expected)
    kept = np.delete(np.arange(361), 180)
    np.testing.assert_array_equal(filled[:, kept], values[:, kept])


def test_holes_are_filled_from_the_edge_inwards_and_by_the_last_value_where_nothing_is_seen():
    values = np.full((3, 361), 7.0)
    values[1, (abs(GRID - 9) <= 2).all(axis=1)] = np.nan
    values[2] = np.nan
    filled = fill(make_response(values)).values
    np.testing.assert_allclose(filled, 7)
    assert (fill(make_response(values[2:])).values == 0).all()
    placeless = make_response(values).drop_vars([dims.ROW, dims.COLUMN])
    np.testing.assert_array_equal(fill(placeless), hold(placeless))


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 999),
    layout=st.sampled_from(["tip_b", "hex127", "radial127"]),
    share=st.floats(0, 1),
    sizes=st.lists(st.integers(1, 7), min_size=1, max_size=5),
)
def test_frames_are_filled_alike_one_by_one_and_whatever_comes_later(seed, layout, share, sizes):
    rng = np.random.default_rng(seed)
    markers = load_sensor(layout).markers
    places = GRID if markers is None else np.stack(image_places(np.array(markers)), axis=1)
    values = rng.normal(size=(12, len(places), 2)).astype(np.float32)
    values[rng.random(values.shape[:2]) < share] = np.nan
    whole = fill_frames(values, places)
    start = 0
    while start < len(values):
        stop = start + sizes[start % len(sizes)]
        part = fill_frames(values[start:stop], places)
        np.testing.assert_array_equal(part, whole[start:stop])
        start = stop
    seen = ~np.isnan(values)
    np.testing.assert_array_equal(whole[seen], values[seen])


def errors(true, hidden, places=GRID):
    """Return how far filled and held values are from the truth, median and p90."""
    response = make_response(np.where(hidden, np.nan, true), places)
    off = [np.abs(one(response).values - true)[hidden] for one in (fill, hold)]
    return [np.nanquantile(one, [0.5, 0.9]) for one in off]


@pytest.fixture(scope="module")
def felt():
    """SA-I and RA-I of the rig's truth, four seconds of drum g at 50 mm/s, px."""
    rig = Rig()
    run = simulate_run(rig, "3", bumped_surface(3.0, rig.drum), 50.0, 4.0, 0)
    position = project(run.position_mm, rig.camera)
    coords = {dims.TIME: run.time_s}
    tracks = xr.DataArray(position, dims=(dims.TIME, dims.MARKER, dims.SPACE), coords=coords)
    slow = sa1(tracks, tracks[10].drop_vars(dims.TIME))
    return slow.values[135:], ra1(slow).values[135:]


@pytest.mark.parametrize("holes", ["single", "3 x 3"])
def test_filled_markers_are_nearer_to_the_rig_s_truth_than_held_ones(felt, holes):
    rng = np.random.default_rng(0)
    hidden = np.zeros(felt[0].shape, bool)
    if holes == "single":
        hidden[20:, rng.choice(361, 18, replace=False)] = True
    else:
        for middle in ((4, 4), (9, 9), (14, 3)):
            hidden[20:, (abs(GRID - middle) <= 1).all(axis=1)] = True
    for true in felt:
        filled, held = errors(true, hidden)
        assert (filled < 0.8 * held).all()
