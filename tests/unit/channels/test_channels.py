"""The three channels, by hand and by their invariants."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from afferents.channels import hold, marker_speed, ra1, ra2, sa1
from afferents.errors import InputError

NAN = np.nan


def _position(values: object, time_s: object = None) -> xr.DataArray:
    values = np.asarray(values, dtype=np.float64)
    time_s = np.arange(len(values)) if time_s is None else time_s
    return xr.DataArray(
        values,
        dims=("time", "marker", "space"),
        coords={"time": time_s, "space": ["x", "y"]},
    )


def _rest(values: object) -> xr.DataArray:
    return xr.DataArray(
        np.asarray(values, dtype=np.float64),
        dims=("marker", "space"),
        coords={"space": ["x", "y"]},
    )


@pytest.fixture
def rest() -> xr.DataArray:
    return _rest([[0, 0], [10, 0], [20, 5]])


@pytest.fixture
def position() -> xr.DataArray:
    """Three markers in five frames, at 0, 0.1, 0.2, 0.4 and 0.5 s (one step is twice as long).

    ======  =========  =========  =========
    frame   marker 0   marker 1   marker 2
    ======  =========  =========  =========
    0       (0, 0)     (10, 0)    (20, 5)
    1       (3, 4)     (13, 4)    (20, 6)
    2       (6, 8)     lost       (20, 7)
    3       (6, 8)     (10, 3)    (22, 5)
    4       (0, 0)     (14, 0)    (18, 5)
    ======  =========  =========  =========
    """
    return _position(
        [
            [[0, 0], [10, 0], [20, 5]],
            [[3, 4], [13, 4], [20, 6]],
            [[6, 8], [NAN, NAN], [20, 7]],
            [[6, 8], [10, 3], [22, 5]],
            [[0, 0], [14, 0], [18, 5]],
        ],
        time_s=[0, 0.1, 0.2, 0.4, 0.5],
    )


def test_by_hand(position: xr.DataArray, rest: xr.DataArray) -> None:
    """The distances are 3-4-5 triangles and whole numbers.

    ======  =================  =====================  =========================
    frame   SA-I, px           RA-I, px/frame         speed, px/s
    ======  =================  =====================  =========================
    0       0,   0,    0       none before            none before
    1       5,   5,    1       5,    5,    1          50,   50,   10
    2       10,  lost, 2       5,    lost, 1          50,   lost, 10
    3       10,  3,    2       0,    lost, 0          0,    lost, sqrt(8) / 0.2
    4       0,   4,    2       10,   1,    0          100,  50,   40
    ======  =================  =====================  =========================

    Marker 2 shows why RA-I is not the speed: from frame 3 to 4 it crosses its place at rest
    and goes 4 px, while its SA-I stays 2 px.
    """
    response = sa1(position, rest)
    expected_sa1 = [[0, 0, 0], [5, 5, 1], [10, NAN, 2], [10, 3, 2], [0, 4, 2]]
    expected_ra1 = [[NAN] * 3, [5, 5, 1], [5, NAN, 1], [0, NAN, 0], [10, 1, 0]]
    expected_speed = [
        [NAN] * 3,
        [50, 50, 10],
        [50, NAN, 10],
        [0, NAN, np.sqrt(8) / 0.2],
        [100, 50, 40],
    ]
    np.testing.assert_allclose(response, expected_sa1)
    np.testing.assert_allclose(ra1(response), expected_ra1)
    np.testing.assert_allclose(marker_speed(position), expected_speed)


def test_holding_by_hand(position: xr.DataArray, rest: xr.DataArray) -> None:
    response = sa1(position, rest)
    np.testing.assert_allclose(
        hold(response), [[0, 0, 0], [5, 5, 1], [10, 5, 2], [10, 3, 2], [0, 4, 2]]
    )
    np.testing.assert_allclose(
        hold(ra1(response)), [[0, 0, 0], [5, 5, 1], [5, 5, 1], [0, 5, 0], [10, 1, 0]]
    )
    assert np.isnan(response.values[2, 1])  # the input is left as it was
    assert hold(response).attrs == response.attrs


def test_holding_before_first_seen_and_never_seen() -> None:
    response = xr.DataArray([[NAN, NAN], [2, NAN], [NAN, NAN]], dims=("time", "marker"), name="sa1")
    np.testing.assert_array_equal(hold(response), [[0, 0], [2, 0], [2, 0]])


def test_labels(position: xr.DataArray, rest: xr.DataArray) -> None:
    response = sa1(position, rest)
    for array, name, units in (
        (response, "sa1", "px"),
        (ra1(response), "ra1", "px/frame"),
        (marker_speed(position), "marker_speed", "px/s"),
    ):
        assert array.name == name
        assert array.dims == ("time", "marker")
        assert array.attrs["units"] == units
        np.testing.assert_array_equal(array["time"], position["time"])


def test_float32_stays_float32(position: xr.DataArray, rest: xr.DataArray) -> None:
    response = sa1(position.astype(np.float32), rest.astype(np.float32))
    assert response.dtype == ra1(response).dtype == hold(response).dtype == np.float32


def test_order_of_dims_is_free(position: xr.DataArray, rest: xr.DataArray) -> None:
    turned = sa1(position.transpose("space", "marker", "time"), rest.transpose())
    xr.testing.assert_identical(turned, sa1(position, rest))


def test_missing_dims_are_named(position: xr.DataArray, rest: xr.DataArray) -> None:
    with pytest.raises(InputError, match=r"position: .*\(marker missing\)"):
        sa1(position.isel(marker=0), rest)
    with pytest.raises(InputError, match=r"rest_position: .*\(space missing\)"):
        sa1(position, rest.isel(space=0))
    with pytest.raises(InputError, match=r"sa1: .*\(too many\)"):
        ra1(position)
    with pytest.raises(InputError, match=r"audio: .*\(audio_time missing\)"):
        ra2(xr.DataArray(np.zeros((2, 1)), dims=("time", "channel")))


def test_other_markers_are_refused(position: xr.DataArray, rest: xr.DataArray) -> None:
    with pytest.raises(InputError, match="expected 3 markers as in position, found 2"):
        sa1(position, rest.isel(marker=[0, 1]))
    with pytest.raises(InputError, match="the marker labels of position"):
        sa1(position.assign_coords(marker=[0, 1, 2]), rest.assign_coords(marker=[2, 1, 0]))


def test_speed_needs_times_that_rise(position: xr.DataArray) -> None:
    with pytest.raises(InputError, match="'time'"):
        marker_speed(position.drop_vars("time"))
    with pytest.raises(InputError, match=r"found 0\.1 s at frame 2 after 0\.1 s"):
        marker_speed(position.assign_coords(time=[0, 0.1, 0.1, 0.2, 0.3]))


def test_ra2_is_the_vibration() -> None:
    audio = xr.DataArray(
        np.array([[0.5], [NAN], [-1.0]]),
        dims=("audio_time", "channel"),
        coords={"channel": ["sensor"]},
        attrs={"sample_rate_hz": 44100.0, "units": "full scale"},
    )
    response = ra2(audio)
    assert response.name == "ra2"
    assert response.dtype == np.float32
    assert response.attrs == audio.attrs
    np.testing.assert_array_equal(response, audio)
    with pytest.raises(InputError, match="'sample_rate_hz'"):
        ra2(audio.drop_attrs())


UNTIMED = settings(deadline=None, max_examples=50)
PIXELS = st.floats(-1000, 1000, allow_subnormal=False)
TRACKS = st.tuples(st.integers(1, 6), st.integers(1, 4)).flatmap(
    lambda n: hnp.arrays(np.float64, (*n, 2), elements=PIXELS | st.just(NAN))
)


def _at_rest(track: np.ndarray) -> np.ndarray:
    return np.nan_to_num(track[0], nan=7.0)


@UNTIMED
@given(track=TRACKS, shift=st.tuples(PIXELS, PIXELS))
def test_sa1_does_not_see_where_the_image_begins(
    track: np.ndarray, shift: tuple[float, float]
) -> None:
    rest = _at_rest(track)
    here = sa1(_position(track), _rest(rest))
    there = sa1(_position(track + shift), _rest(rest + np.asarray(shift)))
    np.testing.assert_allclose(here, there, atol=1e-8)


@UNTIMED
@given(track=TRACKS)
def test_ra1_is_positive_and_below_the_markers_step(track: np.ndarray) -> None:
    response = ra1(sa1(_position(track), _rest(_at_rest(track)))).values
    step = marker_speed(_position(track)).values  # one frame a second: px/s is px/frame
    np.testing.assert_array_equal(np.isnan(response), np.isnan(step))
    seen = ~np.isnan(response)
    assert (response[seen] >= 0).all()
    assert (response[seen] <= step[seen] + 1e-8).all()


@UNTIMED
@given(track=TRACKS)
def test_lost_stays_lost_until_held(track: np.ndarray) -> None:
    response = sa1(_position(track), _rest(_at_rest(track)))
    lost = np.isnan(track).any(axis=-1)
    np.testing.assert_array_equal(np.isnan(response), lost)
    held = hold(response)
    assert not np.isnan(held).any()
    np.testing.assert_array_equal(held.values[~lost], response.values[~lost])
