"""The three channels, by hand and by their invariants."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from afferents.channels import CHANNELS, marker_speed, ra1, ra2, sa1
from afferents.errors import InputError
from afferents.filling import hold

NAN = np.nan
AUDIO = xr.DataArray(
    [[0.5], [NAN], [-1.0]], dims=("audio_time", "channel"), attrs={"sample_rate_hz": 44100.0}
)


def _position(values, time_s=None):
    values = np.asarray(values, dtype=np.float64)
    time_s = np.arange(len(values)) if time_s is None else time_s
    return xr.DataArray(
        values, dims=("time", "marker", "space"), coords={"time": time_s, "space": ["x", "y"]}
    )


def _rest(values):
    return xr.DataArray(
        np.asarray(values, dtype=np.float64), dims=("marker", "space"), coords={"space": ["x", "y"]}
    )


@pytest.fixture
def rest():
    return _rest([[0, 0], [10, 0], [20, 5]])


@pytest.fixture
def position():
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


def test_by_hand(position, rest):
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


def test_holding_by_hand(position, rest):
    response = sa1(position, rest)
    np.testing.assert_allclose(
        hold(response), [[0, 0, 0], [5, 5, 1], [10, 5, 2], [10, 3, 2], [0, 4, 2]]
    )
    np.testing.assert_allclose(
        hold(ra1(response)), [[0, 0, 0], [5, 5, 1], [5, 5, 1], [0, 5, 0], [10, 1, 0]]
    )
    assert np.isnan(response.values[2, 1])  # the input is left as it was
    late = xr.DataArray([[NAN, NAN], [2, NAN], [NAN, NAN]], dims=("time", "marker"), name="sa1")
    np.testing.assert_array_equal(hold(late), [[0, 0], [2, 0], [2, 0]])


def test_ra2_is_the_vibration():
    assert ra2(AUDIO).dtype == np.float32
    assert ra2(AUDIO).attrs == AUDIO.attrs
    np.testing.assert_array_equal(ra2(AUDIO), AUDIO)


def test_float32_stays_float32(position, rest):
    response = sa1(position.astype(np.float32), rest.astype(np.float32))
    assert response.dtype == ra1(response).dtype == hold(response).dtype == np.float32


def test_order_of_dims_is_free(position, rest):
    turned = sa1(position.transpose("space", "marker", "time"), rest.transpose())
    xr.testing.assert_identical(turned, sa1(position, rest))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (lambda p, r: sa1(p.isel(marker=0), r), r"position: .*\(marker missing\)"),
        (lambda p, r: sa1(p, r.isel(space=0)), r"rest_position: .*\(space missing\)"),
        (lambda p, r: ra1(p), r"sa1: .*\(too many\)"),
        (lambda p, r: ra2(r), r"audio: .*\(.*audio_time"),
        (lambda p, r: ra2(AUDIO.drop_attrs()), "'sample_rate_hz'"),
        (lambda p, r: sa1(p, r.isel(marker=[0, 1])), "expected 3 markers as in position, found 2"),
        (
            lambda p, r: sa1(p.assign_coords(marker=[0, 1, 2]), r.assign_coords(marker=[2, 1, 0])),
            "the marker labels of position",
        ),
        (lambda p, r: marker_speed(p.drop_vars("time")), "'time'"),
        (
            lambda p, r: marker_speed(p.assign_coords(time=[0, 0.1, 0.1, 0.2, 0.3])),
            r"found 0\.1 s at frame 2 after 0\.1 s",
        ),
    ],
)
def test_what_does_not_go_together_is_refused(position, rest, asked, said):
    with pytest.raises(InputError, match=said):
        asked(position, rest)


PIXELS = st.floats(-1000, 1000, allow_subnormal=False)
TRACKS = st.tuples(st.integers(1, 6), st.integers(1, 4)).flatmap(
    lambda n: hnp.arrays(np.float64, (*n, 2), elements=PIXELS | st.just(NAN))
)


@given(track=TRACKS)
def test_ra1_is_positive_and_below_the_markers_step(track):
    response = ra1(sa1(_position(track), _rest(np.nan_to_num(track[0], nan=7.0)))).values
    step = marker_speed(_position(track)).values  # one frame a second: px/s is px/frame
    np.testing.assert_array_equal(np.isnan(response), np.isnan(step))
    seen = ~np.isnan(response)
    assert (response[seen] >= 0).all()
    assert (response[seen] <= step[seen] + 1e-8).all()


def recording(position, rest):
    """What channels are worked out of, as a store holds it."""
    slow = sa1(position, rest)
    return xr.Dataset({"position": position, "rest_position": rest, "sa1": slow})


def path(places):
    values = np.asarray(places, dtype=np.float64)[:, None, :]
    return xr.DataArray(values, dims=("time", "marker", "space"), coords={"space": ["x", "y"]})


REST = xr.DataArray([[0.0, 0.0]], dims=("marker", "space"), coords={"space": ["x", "y"]})


@given(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=2, max_size=6))
def test_their_lengths_are_sa1_and_ra1(places):
    position = path(places)
    found = recording(position, REST)
    length = (CHANNELS["sa1_vector"].response(found) ** 2).sum("space") ** 0.5
    np.testing.assert_allclose(length, sa1(position, REST), atol=1e-12)


def test_a_circle_is_a_step_that_ra1_misses():
    angle = np.arange(5) * 0.1
    circle = path(np.stack([3 * np.cos(angle), 3 * np.sin(angle)], axis=1))
    step = (CHANNELS["ra1_vector"].response(recording(circle, REST)) ** 2).sum("space") ** 0.5
    np.testing.assert_allclose(ra1(sa1(circle, REST))[1:], 0, atol=1e-12)
    np.testing.assert_allclose(step[1:], 2 * 3 * np.sin(0.05))
