"""Points through a lens and back."""

import cv2
import numpy as np
import pytest
import xarray as xr
from pydantic import ValidationError

from afferents import dims
from afferents.markers.detect import undistort, upright_tracks
from afferents.markers.sensor import Lens
from afferents.markers.track import track_markers

from .conftest import lay_grid

PINHOLE = Lens(
    focal_px=(420.0, 425.0), centre_px=(321.0, 238.0), distortion=(-0.28, 0.07, 1e-3, -5e-4, 0.0)
)
FISH_EYE = Lens(
    focal_px=(300.0, 300.0),
    centre_px=(320.0, 240.0),
    distortion=(0.02, -0.01, 0.004, -0.001),
    fish_eye=True,
)


@pytest.mark.parametrize("lens", [PINHOLE, FISH_EYE])
def test_what_a_lens_bends_is_straightened(lens):
    rng = np.random.default_rng(0)
    straight = rng.uniform((0, 0), (640, 480), (7, 50, 2))
    rays = (straight - lens.centre_px) / lens.focal_px
    points = np.concatenate([rays, np.ones((7, 50, 1))], axis=-1).reshape(-1, 1, 3)
    camera = np.diag([*lens.focal_px, 1.0])
    camera[:2, 2] = lens.centre_px
    project = cv2.fisheye.projectPoints if lens.fish_eye else cv2.projectPoints
    none = np.zeros(3)
    bent = project(points, none, none, camera, np.array(lens.distortion))[0].reshape(7, 50, 2)
    bent[3, 10] = np.nan
    assert np.nanmax(np.abs(bent - straight)) > 2
    found = undistort(bent, lens)
    assert np.isnan(found[3, 10]).all()
    np.testing.assert_allclose(np.delete(found[3], 10, 0), np.delete(straight[3], 10, 0), atol=1e-5)
    np.testing.assert_allclose(found[0], straight[0], atol=1e-5)


def test_tracks_are_straightened_after_tracking(draw, video, free):
    places = lay_grid(3, 3, 40, 60)
    tracks = track_markers(video([draw(places), draw(places + 1)]), free)
    lens = PINHOLE.model_copy(update={"centre_px": (100.0, 100.0)})
    straight = upright_tracks(tracks, free.model_copy(update={"lens": lens}))
    np.testing.assert_array_equal(straight[dims.DETECTED], tracks[dims.DETECTED])
    assert not np.allclose(straight[dims.POSITION], tracks[dims.POSITION], atol=0.1)
    np.testing.assert_allclose(
        straight[dims.REST_POSITION], undistort(tracks[dims.REST_POSITION].values, lens)
    )
    xr.testing.assert_identical(upright_tracks(tracks, free), tracks)


def test_a_lens_without_its_coefficients_is_refused():
    with pytest.raises(ValidationError, match="distortion must have 4 coefficients"):
        Lens(focal_px=(1, 1), centre_px=(0, 0), distortion=(0.1,), fish_eye=True)
