"""Folders of numbered images as videos."""

import cv2
import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.files import checksum, size_of
from afferents.recordings.media import ImageFolder


@pytest.fixture
def folder(tmp_path):
    """Images numbered 8, 9, 10, 12, each of the grey level of its number."""
    for n in (8, 9, 10, 12):
        cv2.imwrite(str(tmp_path / f"frame{n}.png"), np.full((4, 6), n, np.uint8))
    return tmp_path


def test_frames_keep_the_times_of_their_numbers(folder):
    images = ImageFolder(folder, 10.0)
    frames = list(images.frames())
    assert [frame.image[0, 0] for frame in frames] == [8, 9, 10, 12]
    assert [frame.time_s for frame in frames] == pytest.approx([0, 0.1, 0.2, 0.4])
    assert (images.width, images.height, images.n_frames) == (6, 4, 4)
    assert images.duration_s == pytest.approx(0.5)


def test_numbers_may_count_in_steps(tmp_path):
    for n in (0, 10, 20):
        cv2.imwrite(str(tmp_path / f"{n:03}.bmp"), np.zeros((4, 6), np.uint8))
    times = [frame.time_s for frame in ImageFolder(tmp_path, 10.0).frames()]
    assert times == pytest.approx([0, 0.1, 0.2])
    cv2.imwrite(str(tmp_path / "035.bmp"), np.zeros((4, 6), np.uint8))  # a time stamp
    with pytest.raises(InputError, match=r"steps of 10 .* a step of 15; number the im"):
        next(ImageFolder(tmp_path, 10.0).frames())


@pytest.mark.parametrize(
    ("ending", "bits"), [("png", 8), ("png", 10), ("tif", 12), ("png", 14), ("png", 16)]
)
def test_the_bits_of_16_bit_images_are_found_over_the_whole_folder(ending, bits, tmp_path):
    levels = [10, 20, 255]  # only the last one uses the highest bit
    for n, level in enumerate(levels):
        image = np.full((4, 6), (level << (bits - 8)) + (bits > 8), np.uint16)
        cv2.imwrite(str(tmp_path / f"{n}.{ending}"), image)
    images = ImageFolder(tmp_path, 10.0)
    assert [frame.image[0, 0] for frame in images.frames()] == levels
    assert {frame.bits for frame in images.frames()} == {bits}


def test_dark_images_are_not_brightened_to_a_depth_that_no_camera_has(tmp_path):
    cv2.imwrite(str(tmp_path / "1.png"), np.full((4, 6), 0x7FF, np.uint16))
    (frame,) = ImageFolder(tmp_path, 10.0).frames()
    assert (frame.bits, frame.image[0, 0]) == (12, 127)


def test_images_of_other_types_than_the_first_are_refused(tmp_path):
    cv2.imwrite(str(tmp_path / "1.png"), np.zeros((4, 6), np.uint16))
    cv2.imwrite(str(tmp_path / "2.png"), np.zeros((4, 6), np.uint8))
    with pytest.raises(InputError, match=r"6x4 px in 16 bits, found 6x4 px in 8 bits"):
        list(ImageFolder(tmp_path, 10.0).frames())
    (tmp_path / "1.png").unlink()
    cv2.imwrite(str(tmp_path / "1.tif"), np.zeros((4, 6), np.float32))
    with pytest.raises(InputError, match=r"1\.tif: .* of 8 or 16 bits, found float32; write it"):
        list(ImageFolder(tmp_path, 10.0).frames())


def test_what_is_no_series_of_images_is_refused(folder, tmp_path_factory):
    with pytest.raises(InputError, match="numbered images, found none in it"):
        next(ImageFolder(tmp_path_factory.mktemp("empty"), 10.0).frames())
    (folder / "frame9.png").write_bytes(b"no image")
    with pytest.raises(InputError, match=r"frame9\.png: expected a readable image"):
        list(ImageFolder(folder, 10.0).frames())
    cv2.imwrite(str(folder / "frame9.png"), np.zeros((5, 6), np.uint8))
    with pytest.raises(InputError, match=r"an image of 6x4 px in 8 bits, found 6x5 px in 8 bits"):
        list(ImageFolder(folder, 10.0).frames())
    cv2.imwrite(str(folder / "other9.png"), np.zeros((4, 6), np.uint8))
    with pytest.raises(InputError, match=r"a number each, found frame9\.png and other9\.png"):
        list(ImageFolder(folder, 10.0).frames())


def test_their_rate_must_be_said(folder):
    root = folder.parent
    toml = f'[[recordings]]\nvideo = "{folder.name}"\ntexture = "felt"\n'
    (root / "session.toml").write_text(toml)
    with pytest.raises(InputError, match=r"rate at which the images were taken.* session\.toml"):
        afferents.read_session(root)
    (root / "session.toml").write_text(toml + "fps_hz = 25\n")
    (recording,) = afferents.read_session(root).recordings
    assert recording.fps_hz == 25
    (root / "session.toml").write_text(f'pattern = "{folder.name[:3]}{{texture}}/"\nfps_hz = 20\n')
    assert afferents.read_session(root).recordings[0].fps_hz == 20


def test_a_folder_is_told_from_others_by_all_its_images(folder):
    before = checksum(folder)
    size = size_of(folder)
    assert size == sum(path.stat().st_size for path in folder.iterdir())
    cv2.imwrite(str(folder / "frame12.png"), np.full((4, 6), 13, np.uint8))
    changed = checksum(folder)
    assert changed != before
    (folder / ".DS_Store").write_bytes(b"view")
    assert checksum(folder) == changed
    (folder / "frame12.png").rename(folder / "frame13.png")  # taken later
    assert checksum(folder) != changed
