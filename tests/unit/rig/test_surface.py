"""The drums: how often they repeat, how much of them is raised, and what a nodule feels."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.testing import assert_allclose

from afferents.errors import InputError
from afferents.rig import Drum, bumped_surface, mapped_surface, read_height_map, soft_maximum

NOMINAL = Drum(print_sd_mm=0, patch_sd_mm=0)


def test_bumps_repeat_as_often_as_the_published_spectra_say():
    spacings = np.arange(0.5, 6.5, 0.5)
    expected = [360, 180, 120, 90, 72, 60, 51, 45, 40, 36, 33, 30]
    assert [Drum().periods(x) for x in spacings] == expected


def test_a_drum_passes_at_its_own_rate():
    """Along the slide the pattern repeats each sqrt(2) x, not each x: 7.16 Hz, and not 10."""
    assert Drum().rate_hz(4.0, 40.0) == pytest.approx(7.16, abs=0.005)
    published = [0.716 * v / x for x in (0.5, 3.0, 6.0) for v in (10, 100)]
    assert [Drum().rate_hz(x, v) for x in (0.5, 3.0, 6.0) for v in (10, 100)] == pytest.approx(
        published, rel=0.003
    )


@pytest.mark.parametrize("spacing", [0.5, 1.0, 3.0, 5.5])
def test_the_surface_repeats_that_often_round_the_drum(spacing):
    height = bumped_surface(spacing, NOMINAL).height_mm
    lines = np.abs(np.fft.rfft(height, axis=0)).mean(axis=1)
    n = Drum().periods(spacing)
    assert np.argmax(lines[1:]) + 1 in (n, 2 * n)
    assert lines[1:n].max() < 0.05 * lines[n]


@pytest.mark.parametrize("spacing", [0.5, 1.5, 3.0, 6.0])
def test_bumps_cover_the_same_share_of_every_drum(spacing):
    assert not bumped_surface(0.0).height_mm.any()
    surface = bumped_surface(spacing, NOMINAL)
    covered = surface.height_mm.mean() / NOMINAL.bump_height_mm
    assert covered == pytest.approx(2 * math.pi / 4 * NOMINAL.bump_ratio**2 / 2, rel=0.03)
    assert surface.height_mm.max() == pytest.approx(NOMINAL.bump_height_mm, rel=1e-5)


def test_another_set_of_drums_has_other_bumps_of_the_same_pattern():
    first, again, other = (bumped_surface(3.0, Drum(prints=n)) for n in (0, 0, 1))
    np.testing.assert_array_equal(first.height_mm, again.height_mm)
    bumps = (first.height_mm > 0.05) & (other.height_mm > 0.05)
    # Bumps have slanted edges: a higher one is a little wider.
    assert ((first.height_mm > 0.05) != (other.height_mm > 0.05)).mean() < 0.005
    difference = (first.height_mm - other.height_mm)[bumps]
    expected = math.sqrt(2) * math.hypot(Drum().print_sd_mm, Drum().patch_sd_mm)
    assert difference.std() == pytest.approx(expected, rel=0.25)


def test_bumps_that_touch_err_together_on_every_side():
    """A print that warps over 6.3 mm: heights 6 mm apart correlate by exp(-(6 / 12.6)^2) = 0.8."""
    warped = [bumped_surface(6.0, Drum(print_sd_mm=0, prints=n)) for n in range(20)]
    period = warped[0].length_mm / NOMINAL.periods(6.0)
    rows, columns = np.meshgrid(np.arange(1, 29), np.arange(1, 4), indexing="ij")

    def tops(shift: float, row: int = 0, column: int = 0) -> np.ndarray:
        """Heights in the middles of bumps of a lattice, those some bumps further round."""
        along, across = (rows + row + shift) * period, (columns + column + shift) * period
        at = tuple(
            (mm / pitch).astype(int)
            for mm, pitch in zip((along, across), warped[0].pitch_mm, strict=True)
        )
        return np.concatenate([surface.height_mm[at].ravel() for surface in warped])

    for row, column in ((0, 0), (1, 0), (0, 1), (1, 1)):
        likeness = np.corrcoef(tops(0.5), tops(0, row, column))[0, 1]
        assert likeness == pytest.approx(math.exp(-((6 / 12.6) ** 2)), abs=0.1)


def test_bumps_are_finished_in_patches_and_the_smooth_drum_has_none():
    """Log friction 5 mm apart correlates by exp(-(5 / 10.8)^2) = 0.81, on every side."""
    drums = [bumped_surface(3.0, Drum(prints=n)) for n in range(10)]
    logs = np.log([drum.grip for drum in drums])
    assert logs.std() == pytest.approx(Drum().grip_sd, rel=0.05)
    along, across = (round(5 / pitch) for pitch in drums[0].pitch_mm)
    round_ = np.corrcoef(logs.ravel(), np.roll(logs, along, axis=1).ravel())[0, 1]
    beside = np.corrcoef(logs[..., across:].ravel(), logs[..., :-across].ravel())[0, 1]
    assert [round_, beside] == pytest.approx([math.exp(-((5 / 10.8) ** 2))] * 2, abs=0.1)
    assert bumped_surface(0.0).grip == 1.0


@given(mean=st.floats(0, 1), bridging=st.floats(0.5, 20), texture=st.sampled_from([1.0, 3.0, 6.0]))
@settings(max_examples=10, deadline=None)
def test_what_is_felt_lies_between_the_mean_and_the_highest_point(mean, bridging, texture):
    surface = bumped_surface(texture, NOMINAL)
    lifted = type(surface)(surface.height_mm + np.float32(mean), surface.length_mm)
    envelope = soft_maximum(lifted, 2.0, bridging).height_mm
    assert envelope.max() <= lifted.height_mm.max() + 1e-4
    assert envelope.mean() >= lifted.height_mm.mean() - 1e-4


def test_a_height_map_is_wrapped_a_whole_number_of_times():
    wave = 0.3 * np.sin(2 * np.pi * np.arange(100) / 100)[:, None] * np.ones((100, 50))
    surface = mapped_surface(wave, 10.0)
    assert surface.height_mm.min() >= 0
    assert np.ptp(surface.height_mm) == pytest.approx(0.6, rel=0.01)
    lines = np.abs(np.fft.rfft(surface.height_mm[:, 0] - surface.height_mm[:, 0].mean()))
    assert np.argmax(lines) == round(surface.length_mm / 10)


def test_an_image_is_a_height_map_with_bright_as_high_and_an_array_one_in_mm(tmp_path):
    image = np.zeros((40, 40), np.uint8)
    image[:20] = 255
    cv2.imwrite(str(tmp_path / "stripes.png"), image)
    surface = read_height_map(tmp_path / "stripes.png", 8.0, 0.4)
    assert_allclose([surface.height_mm.min(), surface.height_mm.max()], [0, 0.4], atol=1e-6)
    assert surface.height_mm.mean() == pytest.approx(0.2, rel=0.03)
    np.save(tmp_path / "map.npy", np.random.default_rng(0).random((30, 30)))
    assert read_height_map(tmp_path / "map.npy", 5.0, 1.0).top_mm == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda _: bumped_surface(-1.0), r"bump spacing of 0 or of 0.3 to 20 mm, found -1"),
        (lambda _: mapped_surface(np.zeros(5), 3.0), r"finite heights of shape"),
        (lambda _: mapped_surface(np.full((5, 5), np.nan), 3.0), r"finite heights of shape"),
        (lambda _: mapped_surface(np.zeros((5, 5), "f4,f4"), 3.0), r"expected numbers, found"),
        (lambda _: mapped_surface(np.zeros((5, 5)), 900.0), r"a length of 0 to 251 mm"),
        (lambda _: mapped_surface(np.zeros((5, 5)), 300.0), r"a length of 0 to 251 mm"),
        (lambda _: mapped_surface(np.zeros((2, 40000)), 3.0), r"32766 rows and columns at most"),
        (lambda tmp: read_height_map(tmp / "none.png", 3.0, 1.0), r"none.png: .* neither"),
        (lambda tmp: read_height_map(tmp / "none.npy", 3.0, 1.0), r"none.npy: .*No such file"),
    ],
)
def test_surfaces_that_can_not_be_made_are_refused(make, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        make(tmp_path)
