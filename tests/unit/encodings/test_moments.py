"""Means and spreads of runs, by hand; of a stream as of a recording."""

import numpy as np

from afferents.encodings.images import MomentEncoding

from .conftest import respond

HOW = MomentEncoding(frames=2)
SHEAR = ("time", "shear")


def test_of_runs_the_mean_and_the_logarithm_of_the_spread():
    samples = HOW.samples(
        respond([[1, 0], [3, 0], [5, 1], [5, 3], [9, 9]], dims=SHEAR), slice(0, 5), 0
    )
    assert samples.dims == ("sample", "moment", "feature")
    still = np.log(1e-3)
    np.testing.assert_allclose(samples[0], [[2, 0], [0, still]], atol=1e-6)
    np.testing.assert_allclose(samples[1], [[5, 2], [still, 0]], atol=1e-6)
    np.testing.assert_allclose(samples["stop_s"], [2 / 90, 4 / 90])


def test_of_a_vector_every_component_of_every_marker():
    values = np.arange(24).reshape(4, 3, 2)
    samples = HOW.samples(respond(values), slice(0, 4), 0)
    expected = values[:2].mean(axis=0).T.ravel()  # x of all markers, then y
    np.testing.assert_allclose(samples.sel(moment="mean")[0], expected)


def test_a_stream_gives_the_same():
    values = np.random.default_rng(0).normal(size=(6, 1, 5)).astype(np.float32)
    stream = HOW.stream(0)
    fed = [stream.feed(frame) for frame in values]
    assert fed[0] is None
    offline = HOW.samples(respond(values[:, 0], dims=SHEAR), slice(0, 6), 0)
    np.testing.assert_array_equal(np.stack(fed[1::2]), offline)
    stream.skip()
    assert stream.feed(values[0]) is None
