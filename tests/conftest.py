import json
import multiprocessing
import os
import signal
import sys
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache, partial
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
import soundfile
from hypothesis import HealthCheck, settings

from afferents import cli

from .extras import pytest_make_collect_report, pytest_runtest_makereport, skip_if_lacking  # noqa: F401
from .kept import kept
from .launched import Launched, Server

# Lab Streaming Layer announces nothing beyond this machine.
os.environ.setdefault("LSLAPICFG", str(Path(__file__).with_name("lsl_api.cfg")))

# Who runs the tests in the background, or under nohup, lets them ignore these; the commands that
# they start would then ignore them too, as they should.
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
signal.signal(signal.SIGINT, signal.default_int_handler)

# Where a test asks for no number of processes, one is enough: each further one imports all anew.
os.environ["LOKY_MAX_CPU_COUNT"] = "1"

# A busy machine makes no property false.
settings.register_profile("patient", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("patient")

RATE_HZ, FPS, SECONDS = 8000, 90, 0.5
STEADY_S = 0.17
PITCH_PX, RADIUS_PX = 22.0, 6.5
MAKES_STORES = ("afferents.extraction.extract",)


A_TEST_S = 60
"""How long a test that stays in its process may take where kernels are compiled already."""


def pytest_collection_modifyitems(items):
    """Let a test that hangs fail soon; what a session makes once for many is not counted.

    A machine that has more to do than processors is given as much more time.
    """
    load = max(os.getloadavg()) / os.cpu_count() if hasattr(os, "getloadavg") else 1
    how = {"method": "signal"} if hasattr(signal, "SIGALRM") else {}  # the others go on
    more = max(2, load)  # a fresh clone compiles kernels, and processors differ
    limit = pytest.mark.timeout(A_TEST_S * more, func_only=True, **how)
    for item in items:
        if not any(item.get_closest_marker(name) for name in ("system", "slow", "timeout")):
            item.add_marker(limit)


@lru_cache(maxsize=64)
def draw(shift_px, covered=()):
    """A 640 x 480 frame of 19 x 19 white discs, all shifted right, without the `covered`."""
    image = np.zeros((480, 640), dtype=np.uint8)
    places = (np.arange(19) - 9) * PITCH_PX
    for number, (x, y) in enumerate((x, y) for x in places + 320 + shift_px for y in places + 240):
        if number not in covered:
            centre = (round(x * 256), round(y * 256))
            cv2.circle(image, centre, round(RADIUS_PX * 256), 235, -1, cv2.LINE_AA, 8)
    image.flags.writeable = False  # others are given it too
    return image


def write_video(path, shifts_px, covered=(), preset="superfast"):
    """One frame a shift; `covered` are the discs that each leaves out."""
    with av.open(str(path), "w") as container:
        options = {"preset": preset, "crf": "18"}
        stream = container.add_stream("libx264", rate=FPS, options=options)
        stream.width, stream.height, stream.pix_fmt = 640, 480, "yuv420p"
        stream.time_base = Fraction(1, FPS)
        for i, shift in enumerate(shifts_px):
            image = draw(shift, tuple(covered[i]) if len(covered) else ())
            frame = av.VideoFrame.from_ndarray(image, format="gray")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def write_condition(folder, texture, speed, seconds, video, repetition=0):
    """A texture pulls and shakes the skin, and sounds at texture * speed / 10 Hz."""
    folder.mkdir(parents=True)
    time = np.arange(round(RATE_HZ * seconds)) / RATE_HZ
    rng = np.random.default_rng([texture, speed, repetition] if repetition else [texture, speed])
    sound = 0.1 * texture * np.sin(2 * np.pi * texture * speed / 10 * time)
    sound += 0.01 * rng.normal(size=len(time))
    soundfile.write(folder / "audio.wav", np.stack([0 * sound, sound], axis=1), RATE_HZ)
    if video:
        write_video(folder / "video.mp4", shift_px(texture, speed, round(FPS * seconds)))


def shift_px(texture, speed, n_frames):
    """Rest for 11 frames, then a pull of 4 px a texture within 4 frames, with a shake on it."""
    frame = np.arange(n_frames)
    return 4 * texture * np.clip((frame - 10) / 4, 0, 1) + np.where(
        frame > 10, np.sin(frame * speed / 50), 0
    )


def write_session(
    root, textures=(1, 2, 3), speeds=(20, 40, 60), seconds=SECONDS, video=True, repetition=0
):
    for texture in textures:
        for speed in speeds:
            folder = root / str(texture) / str(speed)
            write_condition(folder, texture, speed, seconds, video, repetition)
    declared = {"sample_rate_hz": RATE_HZ, "steady_s": [STEADY_S, seconds], "simulated": True}
    (root / "session.json").write_text(json.dumps(declared))
    return root


@pytest.fixture(scope="session")
def launch():
    """Run a command line in a process of its own."""
    server = Server()
    yield partial(Launched, server)
    server.close()


@contextmanager
def few_epochs():
    """Let the `quick` preset train networks for two epochs, where nothing is asked of accuracy."""
    from afferents.models import config

    with pytest.MonkeyPatch.context() as patch:
        for recipe in ("cnn-lstm", "vibration-net"):
            brief = config._QUICK[recipe].model_copy(update={"max_epochs": 2})
            patch.setitem(config._QUICK, recipe, brief)
        yield


@pytest.fixture
def run(monkeypatch, capsys):
    """Run a command line; return its exit code and what it printed, on stdout and stderr.

    `evaluate` trains as little as shows that it runs, unless a preset is given.
    """

    def command(*arguments):
        if arguments[:1] == ("evaluate",) and "--preset" not in arguments:
            arguments = (*arguments, "--preset", "quick")
        monkeypatch.setattr(sys, "argv", ["afferents", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        printed = capsys.readouterr()
        skip_if_lacking(printed.err)
        return stop.value.code or 0, printed.out, printed.err

    return command


@pytest.fixture
def does(run):
    """Run a command line that must go through; return what it printed on stdout."""

    def command(*arguments):
        code, out, err = run(*arguments)
        assert code == 0, err
        return out

    return command


@pytest.fixture(scope="session")
def small_session():
    """Three textures at three speeds, half a second of video and audio each."""
    with kept("small_session", write_session) as root:
        yield root


@pytest.fixture(scope="session")
def session(small_session):
    """The same, where a module has no other session of its own."""
    return small_session


@pytest.fixture(scope="session")
def sounds():
    """Three textures at four speeds, three seconds of audio each, no video."""

    def write(root):
        write_session(root, speeds=(20, 30, 40, 60), seconds=3.0, video=False)

    with kept("sounds", write) as root:
        yield root


@pytest.fixture(scope="session")
def stores(small_session, sounds):
    """Extracted responses: of videos, and of sound alone. Who changes them copies them first."""

    from afferents.extraction.extract import extract

    def extract_both(root):
        for kind, recordings in (("video", small_session), ("audio", sounds)):
            extract(recordings, root / f"{kind}.zarr", workers=1, quiet=True)

    with kept("stores", extract_both, MAKES_STORES) as root:
        yield {kind: root / f"{kind}.zarr" for kind in ("video", "audio")}


@pytest.fixture(scope="session")
def forked_workers():
    """Let Dask fork its workers from a process that has imported, once, what their jobs need."""
    import dask
    from distributed.utils import get_mp_context

    with dask.config.set({"distributed.worker.multiprocessing-method": "forkserver"}):
        get_mp_context()  # names what Dask needs itself; the next line's list takes its place
        needed = ["distributed", "pytest", "afferents.cli", "afferents.evaluation.run"]
        needed += ["afferents.extraction.extract", "afferents.rig.simulate"]
        multiprocessing.get_context("forkserver").set_forkserver_preload(needed)
        yield


@pytest.fixture(scope="module")
def cluster(forked_workers):
    """Two processes of one thread, spoken to over TCP."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, protocol="tcp", dashboard_address=":0"
    ) as running:
        yield running


@pytest.fixture(scope="session")
def make_video():
    return write_video


@pytest.fixture(scope="session")
def make_session():
    return write_session


@pytest.fixture(scope="session")
def add_reference_video():
    def add(folder):
        write_video(folder / "throw_away.mp4", np.zeros(15))

    return add


@pytest.fixture
def fails(monkeypatch, capsys):
    """Run a command line that must fail; return its sentence."""

    def command(*arguments, code=2):
        monkeypatch.setattr(sys, "argv", ["afferents", *map(str, arguments)])
        with pytest.raises(SystemExit) as stop:
            cli.main()
        printed = capsys.readouterr().err
        skip_if_lacking(printed)
        assert stop.value.code == code, printed
        assert "Traceback" not in printed
        sentences = [line for line in printed.splitlines() if line.startswith("afferents: ")]
        assert len(sentences) == 1, printed
        return sentences[0]

    return command
