"""The operator: nothing happens on a square grid; elsewhere what is known comes out again."""

import numpy as np
import pytest

from afferents.encodings.images import MarkersEncoding
from afferents.errors import InputError
from afferents.markers.places import covered, image_places, make_images
from afferents.markers.sensor import load_sensor

from .conftest import respond

LAYOUTS = ("hex127", "hex331", "radial127")


@pytest.fixture(params=LAYOUTS)
def places(request):
    return image_places(np.array(load_sensor(request.param).markers))


def test_on_a_square_grid_every_marker_is_its_pixel_bit_for_bit():
    """With integer places nothing is computed: they are put where they belong, as ever."""
    rng = np.random.default_rng(0)
    row, column = np.divmod(rng.permutation(19 * 19), 19)
    values = rng.normal(0, 1, (7, 361))
    expected = np.zeros((7, 19, 19), np.float32)
    expected[:, row, column] = values
    assert make_images(values, row, column).tobytes() == expected.tobytes()


def test_what_grows_evenly_over_the_skin_grows_evenly_over_the_image(places):
    values = (0.5 * places[0] - 2 * places[1] + 3)[None]
    image, there = make_images(values, *places)[0], covered(*places)
    row, column = np.indices(image.shape)
    np.testing.assert_allclose(image[there], (0.5 * row - 2 * column + 3)[there], atol=1e-4)
    assert not image[~there].any()


def test_a_frame_alone_gives_what_it_gives_among_others(places):
    values = np.random.default_rng(0).normal(0, 3, (5, len(places[0])))
    together = make_images(values, *places)
    for image, one in zip(together, values, strict=True):
        np.testing.assert_allclose(make_images(one[None], *places)[0], image, rtol=0, atol=1e-6)


@pytest.mark.parametrize("markers", [[(0, 0), (1, 0), (0, 1)], [(i, i) for i in range(9)]])
def test_markers_that_make_no_image_are_refused(markers):
    with pytest.raises(InputError, match="expected 4 markers or more, not in a line"):
        image_places(np.array(markers, float))


def test_of_single_markers_samples_hold_what_each_shows_in_the_layouts_order(places):
    encoding = MarkersEncoding()
    values = np.random.default_rng(0).normal(0, 1, (6, len(places[0]), 2))
    vector, lengths = respond(values, *places), respond(values[..., 0], *places)
    samples = encoding.samples(vector, slice(2, 6), lookback=1)
    assert samples.dims == ("sample", "component", "marker")
    np.testing.assert_allclose(samples.values[:, 1], vector.values[2:, :, 1], rtol=1e-6)
    assert samples["start_s"].values[0] == pytest.approx(1 / 90)
    one = encoding.samples(lengths, slice(0, 6), lookback=0)
    assert one.shape == (6, 1, len(places[0]))
    with pytest.raises(InputError, match="lost markers filled"):
        encoding.samples(lengths.where(lambda x: x < 1), slice(0, 6), 0)
