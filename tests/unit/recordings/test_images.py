"""Folders of numbered images as videos."""

import pickle
import threading
import time
import zipfile

import cv2
import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.files import checksum, size_of
from afferents.recordings import pictures
from afferents.recordings.pictures import ImageFolder
from afferents.recordings.video import open_clip


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


NO_SERIES = {
    "numbered images, found none in it": {},
    r"1\.png: expected a readable image": {"0.png": np.uint8, "1.png": b"no image"},
    "6x4 px in 16 bits, found 6x4 px in 8 bits": {"0.png": np.uint16, "1.png": np.uint8},
    r"0\.tif: .* of 8 or 16 bits, found float32; write it": {"0.tif": np.float32},
    "an image of 6x4 px in 8 bits, found 6x5": {
        "0.png": np.uint8,
        "1.png": np.zeros((5, 6), np.uint8),
    },
    r"a number each, found a1\.png and b1\.png": {"a1.png": np.uint8, "b1.png": np.uint8},
}


@pytest.mark.parametrize("said", NO_SERIES)
def test_what_is_no_series_of_images_is_refused(tmp_path, said):
    for name, content in NO_SERIES[said].items():
        if isinstance(content, bytes):
            (tmp_path / name).write_bytes(content)
            continue
        image = np.zeros((4, 6), content) if isinstance(content, type) else content
        cv2.imwrite(str(tmp_path / name), image)
    with pytest.raises(InputError, match=said):
        list(ImageFolder(tmp_path, 10.0).frames())


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


def csv_of(rows, head="image,real_time"):
    return "\n".join([head, *(f"{name},{time}" for name, time in rows)]) + "\n"


ROWS = [("frame8.png", 100.0), ("frame9.png", 100.1), ("frame10.png", 100.25), ("frame12.png", 101)]


@pytest.mark.parametrize("head", ["image,real_time", "frame_id,timestamp", "file,time_s"])
@pytest.mark.parametrize("is_zip", [False, True])
def test_a_csv_says_when_images_were_taken(folder, head, is_zip):
    rows = ROWS if head[0] != "f" else [(name[5:].removesuffix(".png"), t) for name, t in ROWS]
    path, csv = folder, folder / "timestamps.csv"
    if is_zip:
        path = zipped(folder)
        csv = path.with_suffix(".csv")
    csv.write_text(csv_of(rows[::-1], head))
    clip = open_clip(path)
    assert (clip.rate_hz, clip.n_frames, clip.clock_s[0]) == (None, 4, 100)
    assert clip.fps_hz == pytest.approx(1 / 0.15)
    assert [f.time_s for f in clip.frames()] == pytest.approx([0, 0.1, 0.25, 1])
    again = pickle.loads(pickle.dumps(clip))
    assert [f.image[0, 0] for f in again.frames()] == [8, 9, 10, 12]
    assert [f.time_s for f in open_clip(path, 10.0).frames()] == pytest.approx([0, 0.1, 0.2, 0.4])


def zipped(folder):
    path = folder.parent / "clip.zip"
    with zipfile.ZipFile(path, "w") as archive:
        for one in folder.iterdir():
            archive.write(one, f"images/{one.name}")
    return path


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (csv_of(ROWS[:3]), "rows for the 4 images and .* found none for number 12; add its time"),
        (csv_of([*ROWS, ("frame13.png", 102)]), "one of them for number 13, which is not there"),
        (csv_of([*ROWS[:3], ROWS[2]]), r"in each of 4 rows, each image once, found 3"),
        (csv_of([*ROWS[:3], ("frame12.png", "")]), r"in each of 4 rows, each image once, found 3"),
        (csv_of([*ROWS[:3], ("frame12.png", 100)]), r"found 100\.0+ s for frame12\.png after 100"),
        (csv_of([*ROWS[:3], ("frame12.png", 100.25)]), r"times that rise from image to image"),
        (csv_of([]), r"rows for the 4 images"),
        (csv_of(ROWS, "image,when"), r"column of times in s .* found image, when; rename"),
        ("", "a readable CSV file"),
    ],
)
def test_a_csv_of_other_images_or_whose_times_do_not_rise_is_refused(folder, text, found):
    (folder / "timestamps.csv").write_text(text)
    with pytest.raises(InputError, match=rf"timestamps\.csv: expected .*{found}"):
        open_clip(folder)


def test_a_damaged_zip_is_refused(folder):
    path = folder.parent / "broken.zip"
    path.write_bytes(b"no zip")
    with pytest.raises(InputError, match=r"broken\.zip: expected a readable zip file"):
        open_clip(path, 10.0)


def test_images_decoded_ahead_come_in_order_and_a_stopped_reader_leaves_no_thread(tmp_path):
    rng = np.random.default_rng(0)
    for n in range(30):
        image = np.full((300, 300), n, np.uint8)
        if n % 7 == 0:  # takes longer
            image[1:] = rng.integers(0, 256, (299, 300))
        cv2.imwrite(str(tmp_path / f"{n}.png"), image)
    images, before = ImageFolder(tmp_path, 10.0), threading.active_count()
    assert [frame.image[0, 0] for frame in images.frames()] == list(range(30))
    frames = images.frames()
    next(frames)
    frames.close()
    deadline = time.monotonic() + 10
    while threading.active_count() > before and time.monotonic() < deadline:
        time.sleep(0.01)
    assert threading.active_count() == before


def test_a_session_names_the_csv_of_times(folder):
    root = folder.parent
    (root / "when.csv").write_text(csv_of(ROWS))
    toml = f'[[recordings]]\nvideo = "{folder.name}"\ntexture = "felt"\ntimes = "when.csv"\n'
    (root / "session.toml").write_text(toml)
    (recording,) = afferents.read_session(root).recordings
    assert [f.time_s for f in recording.video.frames()] == pytest.approx([0, 0.1, 0.25, 1])
    (root / "session.toml").write_text(toml + "fps_hz = 25\n")  # the CSV's clock is wrong
    assert afferents.read_session(root).recordings[0].video.duration_s == pytest.approx(5 / 25)


def test_two_images_are_decoded_at_once_where_there_are_two_cores(folder, monkeypatch):
    images, read, both = ImageFolder(folder, 10.0), pictures._read, threading.Barrier(2, timeout=30)
    assert images.width == 6  # the first is read alone for that

    def read_beside_another(path):
        both.wait()
        return read(path)

    monkeypatch.setattr(pictures, "_read", read_beside_another)
    monkeypatch.setattr("joblib.cpu_count", lambda: 2)
    assert len(list(images.frames())) == 4
