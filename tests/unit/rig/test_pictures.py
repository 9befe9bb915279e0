"""Optics, drawing and film: a point goes where it should, and comes back from the mp4."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from afferents.rig import RigCamera, project
from afferents.rig.camera import Renderer

PLAIN = RigCamera(roll_deg=0, barrel=0, noise_grey=0, blur_px=0, falloff=0)


def test_the_axis_is_in_the_middle_and_x_to_the_right():
    np.testing.assert_allclose(project(np.zeros(2), PLAIN), [319.5, 239.5])
    np.testing.assert_allclose(project(np.array([1.0, 0]), PLAIN), [319.5 + 18.3, 239.5])
    np.testing.assert_allclose(project(np.array([0, 1.0]), PLAIN), [319.5, 239.5 + 18.3])
    turned = project(np.array([1.0, 0]), PLAIN.model_copy(update={"roll_deg": 90.0}))
    np.testing.assert_allclose(turned, [319.5, 239.5 + 18.3])


@given(st.floats(0.1, 14), st.floats(0, 2 * np.pi))
def test_a_barrel_draws_in_the_more_the_farther(radius, angle):
    point = radius * np.array([np.cos(angle), np.sin(angle)])
    plain, drawn_in = (
        project(point, PLAIN),
        project(point, PLAIN.model_copy(update={"barrel": 0.1})),
    )
    centre = PLAIN.centre_px
    share = np.linalg.norm(drawn_in - centre) / np.linalg.norm(plain - centre)
    assert share == pytest.approx(1 - 0.1 * (radius * 18.3 / 280) ** 2, abs=1e-9)


def test_a_disc_has_its_area_place_and_grey():
    centre = np.array([[300.3, 200.7]])
    image = Renderer(PLAIN, 0).draw(centre).astype(float)
    assert image[0, 0] == pytest.approx(25, abs=1)
    assert image[201, 300] == pytest.approx(210, abs=1)
    above = image - 25
    y, x = np.indices(image.shape)
    found = (x * above).sum() / above.sum(), (y * above).sum() / above.sum()
    np.testing.assert_allclose(found, centre[0], atol=0.01)
    assert above.sum() / 185 == pytest.approx(np.pi * (0.35 * 18.3) ** 2, rel=0.01)
