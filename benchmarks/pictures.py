"""How fast folders of 1920x1080 PNGs are read, beside OpenCV alone and the same clip as MJPEG.

    python benchmarks/pictures.py [--frames 60] [--rounds 5]

Medians. What is read ahead in threads shows only where a second core is free; frames a second of
processor time don't depend on that. Prints markdown.
"""

import argparse
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np

from afferents.recordings.pictures import ImageFolder
from afferents.recordings.video import VideoFile

WIDTH, HEIGHT, FPS = 1920, 1080, 120


def draw(n: int) -> np.ndarray:
    """Return a coloured picture of 331 pins with the noise of a camera, (height, width, 3)."""
    rng, image = np.random.default_rng(n), np.full((HEIGHT, WIDTH, 3), 30, np.uint8)
    for row in range(19):
        for column in range(19):
            centre = (420 + 60 * column + n % 5, 40 + 55 * row)
            cv2.circle(image, centre, 14, (200, 210, 190), -1, cv2.LINE_AA)
    return np.clip(image + rng.normal(0, 2, image.shape), 0, 255).astype(np.uint8)


def write(folder: Path, n_frames: int) -> tuple[list[Path], Path]:
    """Write the pictures as PNG and as MJPEG; return the paths."""
    paths, film = [folder / "png" / f"{n:04}.png" for n in range(n_frames)], folder / "clip.avi"
    (folder / "png").mkdir()
    with av.open(str(film), "w") as container:
        stream = container.add_stream("mjpeg", rate=FPS, options={"qmin": "2", "qmax": "2"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuvj420p"
        for n, path in enumerate(paths):
            image = draw(n)
            cv2.imwrite(str(path), image)
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = n, Fraction(1, FPS)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return paths, film


def main() -> None:
    """Print medians of frames a second, each way measured in turn."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as name:
        paths, film = write(Path(name), given.frames)

        def alone() -> Iterator[object]:
            return (cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in paths)

        ways: dict[str, Callable[[], Iterator[object]]] = {
            "cv2.imread alone": alone,
            "folder of PNGs": ImageFolder(Path(name) / "png", FPS).frames,
            "the same as MJPEG": VideoFile(film).frames,
        }
        rates: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
        for _ in range(given.rounds):
            for way, frames in ways.items():
                began, used = time.perf_counter(), time.process_time()
                n = sum(1 for _ in frames())
                took_s = (time.perf_counter() - began, time.process_time() - used)
                rates[way].append((n / took_s[0], n / took_s[1]))
    print("| way | frames/s | times the first | frames a second of processor |\n|---|---|---|---|")
    usual = statistics.median(rate for rate, _ in rates["cv2.imread alone"])
    for way, found in rates.items():
        rate, by_processor = (statistics.median(one) for one in zip(*found, strict=True))
        print(f"| {way} | {rate:.1f} | {rate / usual:.2f} | {by_processor:.1f} |")


if __name__ == "__main__":
    main()
