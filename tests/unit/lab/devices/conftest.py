"""Stand-ins for devices: a V4L2 driver to preload, and motors behind pseudo-terminals."""

import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

HERE = Path(__file__).parent
sys.path.append(str(HERE))  # for `dialects` and `simulated_drum`
CAMERA = """
import json, sys
from afferents.errors import AfferentsError
from afferents.lab.devices import CAMERAS, make_device, is_torn

def run(path, n=30, keep=(), **options):
    table = {"kind": "v4l2", "device": path, "fps_hz": 90.0, **options}
    found = {"frames": []}
    try:
        with make_device(CAMERAS, table, "[camera]") as camera:
            found["settings"] = vars(camera.settings)
            for frame in camera.frames():
                torn = is_torn(frame.data, camera.settings)
                about = [frame.sequence, frame.time_s, frame.damaged, len(frame.data), torn]
                found["frames"].append(about)
                if len(found["frames"]) == n:
                    camera.end()
    except AfferentsError as error:
        found["error"], found["kind"] = str(error), type(error).__name__
    return found
"""


@pytest.fixture(scope="session")
def compiler():
    """Compile C or C++; skips where there is no compiler."""

    def build(source, out, *options):
        program = shutil.which("g++" if source.suffix == ".cpp" else "gcc")
        if program is None:
            pytest.skip("no compiler (gcc, g++) to build the stand-in with")
        subprocess.run([program, "-O1", "-Wall", *options, "-o", out, source], check=True)
        return out

    return build


@pytest.fixture(scope="session")
def fake_v4l2(compiler, tmp_path_factory):
    """The library that answers as a driver of V4L2 does."""
    if sys.platform != "linux":
        pytest.skip("V4L2 is Linux's")
    if not Path("/usr/include/linux/videodev2.h").exists():
        pytest.skip("no kernel headers (linux/videodev2.h) to build the stand-in with")
    out = tmp_path_factory.mktemp("v4l2") / "fake_v4l2.so"
    return compiler(HERE / "fake_v4l2.c", out, "-shared", "-fPIC", "-ldl")


@pytest.fixture(scope="session")
def with_driver(fake_v4l2):
    """Run a program with the driver; returns what it prints, as JSON."""

    path = os.pathsep.join(filter(None, (os.environ.get("PYTHONPATH"), str(HERE))))

    def run(program):
        done = subprocess.run(
            [sys.executable, "-c", CAMERA + program],
            env={**os.environ, "LD_PRELOAD": str(fake_v4l2), "PYTHONPATH": path},
            capture_output=True, text=True, timeout=60,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.fixture(scope="session")
def jpegs(tmp_path_factory):
    """A film of four grey pictures, as the driver reads it: length and JPEG in turn."""
    out = tmp_path_factory.mktemp("film") / "four"
    pictures = [np.full((480, 640), grey, np.uint8) for grey in (20, 40, 60, 80)]
    coded = [bytes(cv2.imencode(".jpg", picture)[1]) for picture in pictures]
    out.write_bytes(b"".join(struct.pack("I", len(data)) + data for data in coded))
    return out


@pytest.fixture(autouse=True)
def patient_guard(monkeypatch):
    """On a busy machine a test may be put off for longer than a drum may turn unheard."""
    monkeypatch.setattr("afferents.lab.devices.drives.guard.PATIENCE_S", 30)


@pytest.fixture
def rng():
    return np.random.default_rng(0)
