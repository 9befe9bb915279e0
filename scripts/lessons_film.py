"""Film docs/images/teach.webp: the live page in Chromium, taught two drums of the rig.

    python scripts/lessons_film.py docs/images/teach.webp

Two drums are taught at 40 mm/s; then both turn faster, and a third that nobody taught. Runs are
recorded first and played slowly, so that a machine that has other work to do drops no frame; the
film runs in the rig's time.
"""

import io
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

from afferents.lab.live import Begin, Event, LivePipeline, Pace, ReplayedVideo, run
from afferents.lab.live.events import Channel
from afferents.lab.live.web.server import serve
from afferents.markers.sensor import load_sensor
from afferents.recordings.video import open_video
from afferents.rig.config import Rig
from afferents.rig.record import VIDEO, record
from afferents.rig.surface import bumped_surface

TURNS = [
    ("1", 40.0, "fine"),
    ("5", 40.0, "coarse"),
    ("1", 60.0, None),
    ("5", 80.0, None),
    ("3", 60.0, None),
]
"""Drums, their speeds, mm/s, and by which name they are taught."""
SECONDS, SEED = 4.0, 5
SPEED = 0.15
"""Seconds of the rig in a second."""
SIZE, SHOWN = {"width": 1180, "height": 700}, (944, 560)
EVERY_S = 0.25
"""Between two pictures of the film, s."""
LAST_S = 2.0
_SAID = "document.querySelector('#teach [role=status]').textContent"


class Turns:
    """The rig's camera; a run begins when it is let go."""

    channel: Channel = "video"
    rate_hz, speed = 90.0, SPEED

    def __init__(self, folder: Path) -> None:
        """Record all runs."""
        self.go, self.n_over = threading.Semaphore(0), 0
        rig = Rig().printed(SEED)
        self._clips = [folder / f"{i}" for i in range(len(TURNS))]
        for clip, (drum, speed_mm_s, _) in zip(self._clips, TURNS, strict=True):
            surface = bumped_surface(float(drum), rig.drum)
            record(rig, clip, drum, surface, speed_mm_s, SECONDS, SEED)

    def events(self) -> Iterator[Event]:
        """Yield run after run."""
        for i, (drum, speed_mm_s, _) in enumerate(TURNS):
            self.go.acquire()
            begin_s = i * 2 * SECONDS
            yield Begin("video", begin_s, f"{drum} mm at {speed_mm_s:g} mm/s")
            yield from ReplayedVideo(
                open_video(self._clips[i] / VIDEO), Pace(SPEED), begin_s
            ).events()
            self.n_over += 1

    def close(self) -> None:
        """Leave it to the end of the program."""


def film(page: Page, turns: Turns) -> list[tuple[Image.Image, float]]:
    """Teach and ask; return pictures, and for how long each is shown, s."""
    shots: list[tuple[Image.Image, float]] = []
    for i, (_, speed_mm_s, name) in enumerate(TURNS):
        if name is not None:
            page.fill("#teach [name=name]", name)
            page.fill("#teach [name=speed]", f"{speed_mm_s:g}")
            page.click("#teach button")
            page.wait_for_function(f"{_SAID}.includes('waiting')")
        turns.go.release()
        while turns.n_over <= i:
            begun_s = time.monotonic()
            shot = Image.open(io.BytesIO(page.screenshot()))
            shots.append((shot.convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS), EVERY_S))
            if name is not None and page.evaluate(f"/touched for 3/.test({_SAID})"):
                page.click("#teach button")
                page.wait_for_function(f"{_SAID}.includes('was learnt')")
            page.wait_for_timeout(max(0, 1000 * (EVERY_S / SPEED - (time.monotonic() - begun_s))))
        shots[-1] = shots[-1][0], LAST_S
    return shots


def main() -> None:
    """Write the film."""
    path = Path(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        turns = Turns(Path(folder))
        pipeline = LivePipeline.without_models([turns], load_sensor("tip_b"))
        pipeline.learn(Path(folder) / "lessons", simulated=True)
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        shown = (run([turns], pipeline), pipeline, "127.0.0.1", port, None)
        threading.Thread(target=serve, args=shown, daemon=True).start()
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        page = browser.new_page(viewport=SIZE)
        page.set_default_timeout(120_000)
        page.goto(f"http://127.0.0.1:{port}")
        page.wait_for_selector("#teach:not([hidden])")
        shots = film(page, turns)
        browser.close()
    (first, _), *others = shots
    times_ms = [round(1000 * shown_s) for _, shown_s in shots]
    first.save(
        path, save_all=True, append_images=[shot for shot, _ in others], duration=times_ms,
        loop=0, quality=35, method=6,
    )  # fmt: skip
    print(path, f"{path.stat().st_size / 1e6:.2f} MB, {len(shots)} pictures")


if __name__ == "__main__":
    main()
