"""What `track` returns, refuses and says of itself."""

from dataclasses import dataclass

import numpy as np
import pytest

from afferents import dims
from afferents.channels import sa1
from afferents.errors import InputError
from afferents.filling import fill
from afferents.markers.quality import describe, measure_quality
from afferents.markers.track import Tracker, rest_positions, track_markers
from afferents.store.recording import Frame

from .conftest import MemoryVideo, lay_grid


def grid_3x4(shift=(0.0, 0.0)):
    """Return 3 rows of 4 markers in row-major order, shape (12, 2)."""
    return lay_grid(3, 4, 30, (100, 80)) + shift


def test_frames_keep_their_numbers_and_those_before_rest_are_not_tracked(draw, video, square):
    tracks = track_markers(video([draw(grid_3x4((0.5 * t, 0))) for t in range(6)]), square)
    np.testing.assert_allclose(tracks[dims.TIME], 0.5 + np.arange(6) / 90)
    assert np.isnan(tracks[dims.POSITION][:2]).all()
    assert not tracks[dims.DETECTED][:2].any()
    assert tracks[dims.DETECTED][2:].all()
    np.testing.assert_array_equal(tracks[dims.POSITION][2], tracks[dims.REST_POSITION])
    np.testing.assert_allclose(tracks[dims.POSITION][5], grid_3x4((2.5, 0)), atol=0.1)


def test_a_free_layout_follows_the_reference_one_to_one(draw, video, free):
    reference = rest_positions(video([draw(grid_3x4())]), free)
    tracks = track_markers(video([draw(grid_3x4((12, 0)))]), free, reference=reference)
    np.testing.assert_allclose(tracks[dims.REST_POSITION], reference + np.array([12, 0]), atol=0.1)
    assert dims.ROW not in tracks.coords
    with pytest.raises(InputError, match="the 12 markers of the reference video, found 11"):
        track_markers(video([draw(grid_3x4()[1:])]), free, reference=reference)


@pytest.mark.parametrize("method", ["windowed", "one-to-one", "published"])
def test_a_tracker_finds_the_markers_in_its_first_frame(draw, video, square, method):
    images = [draw(grid_3x4((1.5 * t, 0.5 * t))) for t in range(4)]
    tracker = Tracker(square, method=method)
    stepped = [tracker.step(image) for image in images]
    tracks = track_markers(video(images), square.model_copy(update={"rest_frame": 0}), method)
    np.testing.assert_array_equal(
        np.stack([found.position for found in stepped]), tracks[dims.POSITION]
    )
    assert all(found.detected.all() for found in stepped)
    with pytest.raises(InputError, match=r"the first frame: expected 12 markers .* found 0"):
        Tracker(square, method=method).step(draw([]))


def test_the_published_tracker_keeps_a_lost_marker_where_it_was(draw, video, square):
    """So nothing is left to be filled from its neighbours, as in the published code."""
    images = [draw(grid_3x4((max(0, t - 2), 0))) for t in range(5)]
    images.append(draw(np.delete(grid_3x4((3, 0)), 5, axis=0)))
    published, ours = (
        track_markers(video(images), square, how) for how in ("published", "windowed")
    )
    (lost,) = np.flatnonzero(~published[dims.DETECTED].values[5])
    felt = sa1(published[dims.POSITION], published[dims.REST_POSITION])
    assert felt.values[5, lost] == felt.values[4, lost] == pytest.approx(2, abs=0.1)
    np.testing.assert_array_equal(fill(felt)[5], felt[5])
    filled = fill(sa1(ours[dims.POSITION], ours[dims.REST_POSITION]))
    assert filled.values[5, 5] == pytest.approx(3, abs=0.1)


def test_a_single_marker_is_tracked(draw, video, free):
    images = [draw([[100 + t, 100]]) for t in range(3)] + [draw([]), draw([[103, 100]])]
    tracks = track_markers(video(images), free)
    assert tracks[dims.DETECTED].values.ravel().tolist() == [True, True, True, False, True]


@pytest.mark.parametrize(
    ("shown", "complaint"),
    [
        ([grid_3x4()] * 2, "at least 3 frames .*found 2"),
        ([], "at least 3 frames .*found 0"),
        ([grid_3x4(), grid_3x4(), []], "12 markers of sensor 'drawn' in frame 2, found 0"),
        ([grid_3x4()[3:]] * 3, "12 markers .* found 9; a run must begin with the skin at rest"),
        ([np.vstack([grid_3x4(), [250, 200]])] * 3, "12 markers .* found 13"),
    ],
    ids=["short", "empty", "dark", "another sensor", "too many"],
)
def test_bad_videos_are_refused_in_one_sentence(draw, video, square, shown, complaint):
    with pytest.raises(InputError, match=rf"drawn\.mp4: expected {complaint}"):
        track_markers(video([draw(each) for each in shown]), square)


def test_a_video_of_another_size_is_refused(draw, video, square):
    sensor = square.model_copy(update={"width": 640, "height": 480})
    for read in (track_markers, rest_positions):
        with pytest.raises(InputError, match=r"640 x 480 px, .* found 320 x 240 px"):
            read(video([draw(grid_3x4())] * 3), sensor)


def test_markers_beyond_the_radius_are_left_out(draw, video, free):
    sensor = free.model_copy(update={"radius_px": 80.0})
    tracks = track_markers(video([draw([*grid_3x4(), [300, 220]])]), sensor)
    assert tracks.sizes[dims.MARKER] == 12


def test_quality_counts_what_was_drawn(draw, video, free):
    lost_in_one = grid_3x4((3, 0))
    lost_in_one[0] = np.nan
    images = [draw(p) for p in (grid_3x4(), grid_3x4((3, 0)), lost_in_one, grid_3x4((3, 0)))]
    tracks = track_markers(video([*images, draw(grid_3x4())]), free)
    quality = measure_quality(tracks)
    assert (quality.n_markers, quality.n_frames, quality.n_shared) == (12, 5, 0)
    assert quality.share_lost == pytest.approx(1 / 60)
    assert quality.n_repeated == 2
    assert quality.largest_step_px == pytest.approx(3, abs=0.1)
    assert quality.at_end[:3] == (12, 0, 0)


def test_the_description_names_only_what_occurred(draw, video, free, square):
    still = describe(track_markers(video([draw(grid_3x4())] * 3), square))
    assert still[0].startswith("12 markers, lost for 0.0% of the time; at the end 12 are back")
    assert any("grid of 3 x 4" in s for s in still)
    assert not any("repeat" in s or "claimed" in s or "not move" in s for s in still)
    lost = track_markers(video([draw(grid_3x4()), *[draw(np.zeros((0, 2)))] * 6]), free)
    assert np.isnan(lost[dims.POSITION][1:]).all()
    dark = describe(lost)
    for said in ("No sensor file says", "more than half of the time: 12", "at the end none"):
        assert any(said in s for s in dark)
    assert not any("nan" in s for s in dark)


@dataclass
class Limited(MemoryVideo):
    """The same as decoded: limited range squeezes grey levels to 16..235."""

    def frames(self):
        levels = np.clip(np.round((np.arange(256) - 16) * 255 / 219), 0, 255).astype(np.uint8)
        for time_s, image in (frame[:2] for frame in super().frames()):
            yield Frame(time_s, np.round(image * (219 / 255) + 16).astype(np.uint8), levels)


def test_frames_as_decoded_are_tracked_as_grey_ones(draw, video, free):
    images = [draw(grid_3x4((1.5 * t, 0.7 * t))) for t in range(5)]
    images.insert(3, draw([]))  # all lost, and found again in the whole picture
    grey, decoded = track_markers(video(images), free), track_markers(Limited(images), free)
    np.testing.assert_array_equal(grey[dims.DETECTED], decoded[dims.DETECTED])
    np.testing.assert_allclose(grey[dims.POSITION], decoded[dims.POSITION], atol=0.05)


@pytest.mark.parametrize("radius", [4, 12, 14, 22])
def test_markers_of_any_size_are_tracked(draw, video, free, radius):
    """Windows of large markers hold more than sums of 16 bits do."""
    rest = lay_grid(3, 3, 65, 60)
    places = [rest + np.array([1.5 * t, 0.6 * t]) for t in range(6)]
    limits = {"min_area_px2": 20.0, "max_area_px2": 3000.0}
    sensor = free.model_copy(update={"detector": free.detector.model_copy(update=limits)})
    found = track_markers(video([draw(place, radius=radius) for place in places]), sensor)
    assert found[dims.DETECTED].all()
    np.testing.assert_allclose(found[dims.POSITION], places, atol=0.1)


@pytest.mark.parametrize(("pitch_px", "radius_px"), [(11, 3.2), (11, 3.5), (10, 3.2), (14, 5.2)])
def test_the_row_below_is_not_weighed_in(video, free, pitch_px, radius_px):
    """Discs so near each other that four rows more of a window would reach the next."""
    rest = lay_grid(8, 8, pitch_px, 60)
    places = [rest + 0.13 * t for t in range(9)]
    limits = {"min_area_px2": 10.0, "max_area_px2": 200.0, "min_distance_px": 5.0}
    sensor = free.model_copy(update={"detector": free.detector.model_copy(update=limits)})
    found = track_markers(video([discs(place, radius_px) for place in places]), sensor)
    assert found[dims.DETECTED].all()
    off = found[dims.POSITION].values - places
    assert np.sqrt((off[1:] ** 2).mean(axis=(0, 1))).max() < 0.03  # the first is that of blobs


def discs(places, radius_px):
    """Draw bright discs with edges as fine as grey levels are."""
    fine = (np.arange(200 * 8) + 0.5) / 8 - 0.5
    mask = np.zeros((len(fine), len(fine)), bool)
    for x, y in places:
        x0, y0 = (round(8 * (one - radius_px - 2)) for one in (x, y))
        window = slice(y0, y0 + 120), slice(x0, x0 + 120)
        mask[window] |= (fine[window[1]] - x) ** 2 + (fine[window[0], None] - y) ** 2 < radius_px**2
    share = mask.reshape(200, 8, 200, 8).mean(axis=(1, 3))
    return np.ascontiguousarray((30 + 190 * share).round().astype(np.uint8))


def test_a_colour_frame_is_one_sentence(draw, square):
    with pytest.raises(InputError, match=r"image: expected a grey one"):
        Tracker(square).step(np.stack(3 * [draw(grid_3x4())], axis=-1))
