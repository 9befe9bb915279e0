"""Fingertips that are no TacTip: found, followed and kept in order with nothing set by hand."""

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.spatial import cKDTree

from afferents import dims
from afferents.errors import InputError
from afferents.markers.calibrate import calibrate_from_clips, sensor_toml
from afferents.markers.detect import spacing_px, upright_tracks
from afferents.markers.sensor import Picture, load_sensor
from afferents.markers.track import track_markers
from afferents.recordings.video import open_clip

from ...unit.markers.conftest import MemoryVideo

CLIPS = Path(__file__).resolve().parents[3] / "../shared/datasets/other_sensors"
N_FRAMES, AT_REST = 30, 10
NOISE, QUALITY = 2.0, 85
"""Grey levels, and of JPEG: as cheap cameras give them."""


@dataclass
class Look:
    """How a made fingertip looks: px and grey levels; `spot` is the radius of a highlight."""

    shape: tuple[int, int]
    rows: int
    columns: int
    spacing: float
    radius: float
    skin: int = 150
    dot: int = 40
    spot: float = 0.0
    n_specks: int = 0
    moves: float = 0.25
    """Of a spacing, at most."""


LOOKS = {
    "plain": Look((240, 320), 6, 8, 34, 8),
    "highlights": Look((240, 320), 6, 8, 34, 9, spot=3),
    "small highlights": Look((300, 400), 5, 6, 56, 14, spot=1.0),
    "bright with dark middles": Look((240, 320), 6, 8, 34, 9, skin=60, dot=200, spot=3),
    "few and big": Look((450, 600), 3, 4, 140, 40, moves=0.15),
    "bright among scratches": Look((480, 640), 8, 8, 54, 8, skin=130, dot=215, n_specks=300),
    "128 px": Look((128, 128), 11, 11, 10, 2.5),
    "128 px, dense": Look((128, 128), 18, 18, 6, 1.6, skin=30, dot=220),
}


def places(look: Look) -> np.ndarray:
    """Return the dots' middles at rest, by row, each a fraction of a pixel off, (n, 2)."""
    y, x = np.mgrid[: look.rows, : look.columns].reshape(2, -1)
    place = np.stack([x - x.mean(), y - y.mean()], axis=1) * look.spacing
    fraction = np.random.default_rng(1).uniform(-0.5, 0.5, place.shape)
    return place + fraction + np.array(look.shape[::-1]) / 2


def at_rest(look: Look) -> np.ndarray:
    """Draw the skin at rest, float, (height, width)."""
    rng = np.random.default_rng(2)
    y, x = np.mgrid[: look.shape[0], : look.shape[1]].astype(np.float64)
    picture = look.skin * (0.8 + 0.4 * x / look.shape[1])  # lit from one side
    for left, top in rng.uniform(0, 1, (look.n_specks, 2)) * look.shape[::-1]:
        picture[int(top) : int(top) + 4, int(left) : int(left) + 5] -= 35
    contrast = look.dot - look.skin
    for middle in places(look):
        away = np.hypot(x - middle[0], y - middle[1])
        share = np.clip(look.radius + 0.5 - away, 0, 1)
        picture += share * (look.skin + contrast - picture)
        if look.spot:
            picture -= contrast * np.clip(
                look.spot + 0.5 - np.hypot(x - middle[0], y - middle[1]), 0, 1
            )
    return cv2.GaussianBlur(picture, (0, 0), 0.6)


def way(look: Look, point: np.ndarray, time: float) -> np.ndarray:
    """Return how far the skin's point that is now at `point` (..., 2) has come, px."""
    middle = np.array(look.shape[::-1]) / 2
    near = np.exp(-((np.hypot(*np.moveaxis(point - middle, -1, 0)) / (0.4 * look.shape[0])) ** 2))
    pressed = 0.5 * np.sin(time) * near[..., None] * (point - middle) / look.shape[0] * 2
    sheared = np.array([np.sin(time), np.cos(2 * time) - 1]) / 3 * (0.4 + 0.6 * near[..., None])
    return look.moves * look.spacing * (pressed + sheared)


def made(look: Look) -> tuple[MemoryVideo, np.ndarray]:
    """Return a clip that begins at rest, and its dots' true places, (frame, dot, 2), px."""
    rng, skin, rest = np.random.default_rng(3), at_rest(look), places(look)
    grid = np.stack(np.meshgrid(np.arange(look.shape[1]), np.arange(look.shape[0])), axis=-1)
    images, truth = [], []
    for index in range(N_FRAMES):
        time = max(0, index - AT_REST) / (N_FRAMES - AT_REST) * 2 * np.pi
        came = grid - way(look, grid.astype(float), time)
        image = cv2.remap(
            skin, came.astype(np.float32), None, cv2.INTER_CUBIC, None, cv2.BORDER_REPLICATE
        )
        lit = np.exp(-(((grid - (80 + 5 * index, 100)) / 80.0) ** 2).sum(axis=-1))
        image = image * (1 + 0.25 * np.sin(time / 2) * lit) + rng.normal(0, NOISE, look.shape)
        _, coded = cv2.imencode(
            ".jpg", np.clip(image, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, QUALITY]
        )
        images.append(cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE))
        place = rest
        for _ in range(20):
            place = rest + way(look, place, time)
        truth.append(place)
    return MemoryVideo(images), np.array(truth)


@pytest.mark.parametrize("name", LOOKS)
def test_dots_of_any_look_are_found_followed_and_kept_in_order(name, tmp_path):
    video, truth = made(LOOKS[name])
    (tmp_path / "made.toml").write_text(sensor_toml(calibrate_from_clips(video, "made").sensor))
    sensor = load_sensor(tmp_path / "made.toml")
    assert (sensor.layout, sensor.rows, sensor.columns) == (
        "square",
        LOOKS[name].rows,
        LOOKS[name].columns,
    )
    tracks = track_markers(video, sensor)
    off = np.hypot(*np.moveaxis(tracks[dims.POSITION].values - truth, -1, 0))
    assert tracks[dims.DETECTED].all()
    assert off.max() < LOOKS[name].spacing / 2
    assert np.sqrt((off**2).mean()) < 0.3


def test_two_fields_of_dots_in_one_picture_are_two_sensors():
    """As of two mirrors: each moves by itself, and more than half a spacing from the other."""
    look = LOOKS["plain"]
    near, near_truth = made(replace(look, rows=6, columns=6, moves=0.6))
    far, far_truth = made(replace(look, rows=6, columns=6, moves=-0.6))
    both = MemoryVideo([np.hstack(pair) for pair in zip(near.images, far.images, strict=True)])
    for left, truth in ((0, near_truth), (look.shape[1], far_truth)):
        keep = Picture(keep=(left + look.shape[1] / 2, look.shape[0] / 2, 150))
        sensor = calibrate_from_clips(both, "mirror", picture=keep).sensor
        tracks = track_markers(both, sensor)
        off = np.hypot(*np.moveaxis(tracks[dims.POSITION].values - truth - (left, 0), -1, 0))
        assert off.max() < 1
        assert np.sqrt((off**2).mean()) < 0.3


def test_lamps_and_screws_are_hidden_from_calibration_and_tracking():
    look = LOOKS["plain"]
    video, truth = made(look)
    rest = places(look)
    lamps = [rest[n] + look.spacing / 2 for n in (9, 21)]
    for image in video.images:
        for x, y in lamps:
            cv2.circle(image, (round(x), round(y)), 7, 30, -1, cv2.LINE_AA)
    hide = tuple((float(x), float(y), 8.0) for x, y in lamps)
    sensor = calibrate_from_clips(video, "made", picture=Picture(hide=hide)).sensor
    assert (sensor.rows, sensor.columns) == (look.rows, look.columns)
    off = np.hypot(*np.moveaxis(track_markers(video, sensor)[dims.POSITION].values - truth, -1, 0))
    assert np.sqrt((off**2).mean()) < 0.3


@pytest.mark.parametrize("turn", [90, 180, 270])
def test_a_camera_on_its_side_gives_the_upright_rows_columns_and_directions(turn):
    look = replace(LOOKS["plain"], columns=5)
    video, truth = made(look)
    lying = MemoryVideo([np.ascontiguousarray(np.rot90(one, turn // 90)) for one in video.images])
    sensor = calibrate_from_clips(lying, "made", picture=Picture(turn=turn)).sensor
    assert (sensor.rows, sensor.columns) == (look.rows, look.columns)
    tracks = track_markers(lying, sensor)
    np.testing.assert_array_equal(tracks[dims.ROW], np.repeat(range(6), 5))
    upright = upright_tracks(tracks, sensor)
    off = np.hypot(*np.moveaxis(upright[dims.POSITION].values - truth, -1, 0))
    assert np.sqrt((off**2).mean()) < 0.3


@pytest.mark.skipif(not CLIPS.is_dir(), reason="no clips at ../shared/datasets/other_sensors")
@pytest.mark.parametrize(
    ("name", "n", "most_px"),
    [("mini_plain", 63, 0.3), ("mini_shiny", 63, 0.3), ("chengj", 64, 0.3), ("big", 12, 0.35)],
)
def test_warped_pictures_of_real_gels_are_followed(name, n, most_px):
    """Displacements, since what is the middle of a real dot is a matter of taste by 0.5 px."""
    clip = open_clip(CLIPS / f"{name}.avi", 25.0)
    sensor = calibrate_from_clips(clip, name).sensor
    assert (sensor.layout, sensor.n_markers) == ("square", n)
    tracks = track_markers(clip, sensor)
    assert tracks[dims.DETECTED].all()
    truth = np.load(CLIPS / f"{name}_truth.npz")["position"]
    own = cKDTree(truth[0]).query(tracks[dims.REST_POSITION])[1]
    assert len(set(own)) == n
    way = (tracks[dims.POSITION] - tracks[dims.REST_POSITION]).values
    off = np.hypot(*np.moveaxis(way - (truth - truth[0])[: len(way), own], -1, 0))
    assert np.median(off) < most_px
    assert off.max() < spacing_px(truth[0]) / 2


@pytest.mark.skipif(not CLIPS.is_dir(), reason="no clips at ../shared/datasets/other_sensors")
def test_a_real_gel_is_found_whole_and_one_without_dots_is_refused():
    found = calibrate_from_clips(open_clip(CLIPS / "gelsight_mini_real.avi", 25.0), "mini")
    assert (found.sensor.rows, found.sensor.columns, found.n_again) == (7, 10, 70)
    with pytest.raises(InputError, match=r"expected at least 6 bright or dark blobs"):
        calibrate_from_clips(open_clip(CLIPS / "mini_without_markers.mp4", 25.0), "plain")


@pytest.mark.parametrize("name", ["highlights", "bright with dark middles"])
def test_light_is_measured_beside_highlights(name):
    look = LOOKS[name]
    quality = calibrate_from_clips(made(look)[0], "made").picture
    assert quality.disc_grey == pytest.approx(look.dot, abs=25)
    assert quality.skin_grey == pytest.approx(look.skin, abs=25)
