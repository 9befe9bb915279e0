"""Rows and columns of markers, found from their positions."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from afferents.errors import InputError
from afferents.markers.grid import assign_grid, fill_grid, published_grid

PITCH = 22.0


def lattice(rows, columns, roll_deg=0.0, barrel=0.0, jitter=0.0, seed=0, centre=(320, 240)):
    """Return positions in row-major order, shape (rows * columns, 2).

    `barrel` is the share by which the corner is drawn inwards, `jitter` px uniform either way.
    """
    rng = np.random.default_rng(seed)
    row, column = np.divmod(np.arange(rows * columns), columns)
    plane = PITCH * np.stack([column - (columns - 1) / 2, row - (rows - 1) / 2], axis=1)
    radius2 = (plane**2).sum(axis=1, keepdims=True)
    plane = plane * (1 - barrel * radius2 / radius2.max())
    angle = np.radians(roll_deg)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return plane @ turn + centre + rng.uniform(-jitter, jitter, plane.shape), row, column


@settings(max_examples=60, deadline=None)
@given(
    roll_deg=st.floats(-30, 30),
    barrel=st.floats(0, 0.1),
    jitter=st.floats(0, 3),
    seed=st.integers(0, 2**16),
    shape=st.sampled_from([(19, 19), (12, 17), (3, 4)]),
)
def test_the_grid_is_found_through_roll_lens_and_displacement(
    roll_deg, barrel, jitter, seed, shape
):
    position, row, column = lattice(*shape, roll_deg, barrel, jitter, seed)
    shuffle = np.random.default_rng(seed).permutation(len(position))
    grid = assign_grid(position[shuffle], *shape)
    np.testing.assert_array_equal(grid.row, row[shuffle])
    np.testing.assert_array_equal(grid.column, column[shuffle])
    tolerance = 0.3 if shape == (19, 19) else 8
    assert grid.roll_deg == pytest.approx(roll_deg, abs=tolerance)


@given(roll_deg=st.floats(-30, 30), n_missing=st.integers(1, 30), seed=st.integers(0, 1000))
@settings(max_examples=30, deadline=None)
def test_missing_markers_leave_their_places_empty(roll_deg, n_missing, seed):
    position, row, column = lattice(19, 19, roll_deg=roll_deg, jitter=1.5)
    place = row * 19 + column
    apart = np.flatnonzero((row + column) % 2 == 0)  # none is left without a neighbour
    gone = np.random.default_rng(seed).permutation(apart)[:n_missing]
    grid = assign_grid(np.delete(position, gone, axis=0), 19, 19)
    np.testing.assert_array_equal(grid.row, np.delete(row, gone))
    np.testing.assert_array_equal(grid.column, np.delete(column, gone))
    filled, present = fill_grid(np.delete(position, gone, axis=0), grid, 19, 19)
    assert sorted(np.flatnonzero(~present)) == sorted(place[gone])
    np.testing.assert_array_equal(
        filled[place[~np.isin(np.arange(361), gone)]], np.delete(position, gone, axis=0)
    )
    assert np.hypot(*(filled[place] - position).T).max() < 5


def moved(place):
    """A lattice of 19 x 19, one of whose markers stands elsewhere."""
    position = lattice(19, 19)[0]
    position[5] = place
    return position


def circle():
    angle = np.linspace(0, 2 * np.pi, 36, endpoint=False)
    return 200 + 150 * np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize(
    ("position", "shape", "found"),
    [
        (lattice(19, 19)[0][:280], (19, 19), r"3/50: expected 19 x 19 = 361 .*found 280 markers"),
        (np.vstack([lattice(19, 19)[0], [5.0, 5.0]]), (19, 19), "= 361 .*found 362 markers"),
        (moved((900.0, 240.0)), (19, 19), "19 x 19"),
        (moved((331.0, 251.0)), (19, 19), "19 x 19"),
        (moved((309.0, 240.0)), (19, 19), "19 x 19"),
        (lattice(3, 8)[0], (4, 6), "found 3 rows and 8 columns"),
        (circle(), (6, 6), "6 x 6"),
    ],
)
def test_what_is_no_grid_of_that_shape_is_refused(position, shape, found):
    with pytest.raises(InputError, match=found):
        assign_grid(position, *shape, "3/50")


def test_the_published_assignment_is_right_at_the_published_roll():
    position, row, column = lattice(19, 19, roll_deg=6.2, jitter=2)
    grid = published_grid(position, 19, 19)
    np.testing.assert_array_equal(grid.row, row)
    np.testing.assert_array_equal(grid.column, column)
