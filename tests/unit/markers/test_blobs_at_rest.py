"""A rest frame that shows a blob too many or too few, or a skin that was shifted since."""

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from scipy.spatial import cKDTree

from afferents import dims
from afferents.channels import sa1
from afferents.markers.estimate import recognise_sensor
from afferents.markers.quality import describe
from afferents.markers.rest import rest_sentences
from afferents.markers.sensor import load_sensor
from afferents.markers.suspects import without_false_markers
from afferents.markers.track import track_markers

from .test_grid import lattice

TIP = load_sensor("tip_b")
SHAPE = (480, 640)
SPECK = (70.0, 240.0)
SWAY = np.array([[3.0 * np.sin(t), 0.0] for t in np.arange(12) / 2])
"""Where the skin is from the rest frame on, px from rest."""


def pins():
    """Return the fingertip's pins at rest, by row, shape (361, 2), px."""
    return lattice(19, 19, roll_deg=6.2)[0]


@pytest.fixture
def clip(draw, video):
    """Return what makes a clip: still up to the rest frame, then swaying."""

    def make(at_rest, sway=SWAY):
        return video([draw(at_rest, SHAPE)] * 10 + [draw(at_rest + s, SHAPE) for s in sway])

    return make


@pytest.fixture(scope="module")
def reference():
    """Return the pins in the published order, by x, of a reference clip."""
    position = pins()
    return position[np.argsort(position[:, 0], kind="stable")]


def followed(at_rest, reference, sway):
    """Return what the published code makes of blobs: rest positions, and positions over time.

    Written from its description: every marker takes the nearest blob to where it was, and stays
    there if that is farther than 10 px; before its rest frame, it was where the reference is.
    """
    before, positions = reference, []
    for blobs in (at_rest + step for step in sway):
        distance, nearest = cKDTree(blobs).query(before)
        before = np.where(distance[:, None] > 10, before, blobs[nearest])
        positions.append(before)
    return positions[0], np.array(positions)


@pytest.mark.parametrize("n", [362, 360])
def test_published_goes_on_by_nearest_neighbour(clip, reference, n):
    blobs = np.vstack([pins(), SPECK]) if n == 362 else np.delete(pins(), 100, axis=0)
    tracks = track_markers(clip(blobs), TIP, "published", reference)
    rest, position = followed(blobs, reference, SWAY)
    np.testing.assert_allclose(tracks[dims.REST_POSITION], rest, atol=0.2)
    np.testing.assert_allclose(tracks[dims.POSITION][10:], position, atol=0.2)
    assert tracks.attrs["rest_blobs"] == n
    assert tracks.attrs["rest_replaced"] == (1 if n == 360 else 0)
    assert f"3/50 ({n} blobs)" in " ".join(rest_sentences({"3/50": tracks.attrs}))


@pytest.mark.parametrize("method", ["windowed", "one-to-one"])
@pytest.mark.parametrize("n", [362, 360])
def test_the_others_take_the_361_of_the_layout(clip, method, n):
    blobs = np.vstack([SPECK, pins()]) if n == 362 else np.delete(pins(), 100, axis=0)
    tracks = track_markers(clip(blobs), TIP, method)
    truth = pins() + SWAY[:, None]
    there = np.arange(361) != 100 if n == 360 else np.ones(361, bool)
    np.testing.assert_allclose(tracks[dims.REST_POSITION].values[there], pins()[there], atol=0.2)
    np.testing.assert_allclose(
        tracks[dims.POSITION][10:].values[:, there], truth[:, there], atol=0.3
    )
    assert tracks[dims.DETECTED][10:].values[:, there].all()
    said = " ".join(rest_sentences({"3/50": tracks.attrs}))
    assert ("3/50 (362 for 361): the rest frame shows blobs" in said) == (n == 362)
    assert ("3/50 (1 of 361): the rest frame lacks markers" in said) == (n == 360)
    assert any("missing in the rest frame: 1 " in line for line in describe(tracks)) == (n == 360)


@pytest.mark.parametrize("n", [360, 361, 362])
def test_a_video_of_the_published_sensor_is_recognised(clip, n):
    blobs = np.vstack([pins(), SPECK])[:n]
    sensor, why = recognise_sensor(clip(blobs))
    assert sensor == TIP
    assert ("they form its grid" in why) == (n != 361)


def test_rest_positions_beyond_10_px_are_the_references_under_published(clip, reference):
    """A fingertip that was mounted 12 px off counts from where it never was, as in their code."""
    shift = np.array([8.5, 8.5])  # at rest no neighbour lies within 10 px either
    sway = np.vstack([[0, 0], [-4, 0], 0.2 * SWAY])  # a jerk, and they are caught
    shifted = clip(pins() + shift, sway)
    tracks = track_markers(shifted, TIP, "published", reference)
    rest, position = followed(pins() + shift, reference, sway)
    np.testing.assert_array_equal(rest, reference)
    np.testing.assert_allclose(tracks[dims.REST_POSITION], reference, atol=1e-9)
    np.testing.assert_allclose(tracks[dims.POSITION][10:], position, atol=0.2)
    assert not tracks[dims.DETECTED][10].any()
    assert tracks.attrs["rest_replaced"] == 361
    assert "3/50 (361 of 361)" in rest_sentences({"3/50": tracks.attrs})[0]

    def mean_sa1(found):
        return float(sa1(found[dims.POSITION], found[dims.REST_POSITION])[10:].mean())

    theirs = np.linalg.norm(position - reference, axis=-1).mean()
    ours = np.linalg.norm(sway, axis=-1).mean()
    assert theirs > 10 > 10 * ours
    assert mean_sa1(tracks) == pytest.approx(theirs, abs=0.1)
    assert mean_sa1(track_markers(shifted, TIP)) == pytest.approx(ours, abs=0.1)


@settings(max_examples=25, deadline=None)
@example(roll_deg=0.0, barrel=0.03125, jitter=1.0, seed=5043, n_false=2)
@given(
    roll_deg=st.floats(-30, 30),
    barrel=st.floats(0, 0.08),
    jitter=st.floats(0, 1.5),
    seed=st.integers(0, 2**16),
    n_false=st.integers(1, 3),
)
def test_what_has_no_place_in_the_grid_is_left_out(roll_deg, barrel, jitter, seed, n_false):
    position = lattice(19, 19, roll_deg, barrel, jitter, seed)[0]
    rng = np.random.default_rng(seed)
    low, high = position.min(axis=0) - 60, position.max(axis=0) + 60
    false = rng.uniform(low, high, (n_false, 2))
    # A detector takes blobs that lie nearer together for one.
    assume((cKDTree(position).query(false)[0] >= 10).all())
    order = rng.permutation(361 + n_false)
    both = np.vstack([position, false])[order]
    found = without_false_markers(both, 19, 19)
    np.testing.assert_array_equal(found, both[order < 361])
