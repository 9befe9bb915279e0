"""Real files, encoded on the spot."""

from types import SimpleNamespace

import numpy as np
import pytest
import soundfile

from ..films import write_film
from .served_files import serving


def _encode(path, size=(64, 48), n_frames=12, ticks_ms=None, colour=False, noise=False, **how):
    """Encode a grey (or coloured) ramp, or noise, that shifts by 2 px a frame."""
    width, height = size
    ramp = np.tile(np.linspace(0, 255, width).astype(np.uint8), (height, 1))
    if noise:
        ramp = np.random.default_rng(0).integers(0, 256, (height, width), dtype=np.uint8)
    greys = [np.roll(ramp, 2 * n, axis=1) for n in range(n_frames)]
    images = [np.stack([grey, grey // 2 + 60 if colour else grey, grey], -1) for grey in greys]
    return write_film(path, images, at_ms=ticks_ms, form="rgb24", **how)


@pytest.fixture(scope="session")
def write_video():
    return _encode


def _write_audio(path, duration_s=0.2, sample_rate_hz=44100, channels=2):
    """Write 16-bit noise, another in each channel."""
    path.parent.mkdir(parents=True, exist_ok=True)
    n = round(duration_s * sample_rate_hz)
    samples = np.random.default_rng(1).integers(-20000, 20000, (n, channels), dtype=np.int16)
    soundfile.write(str(path), samples, sample_rate_hz, subtype="PCM_16")
    return path


@pytest.fixture(scope="session")
def write_audio():
    return _write_audio


@pytest.fixture
def write_session(tmp_path):
    """Write a session folder of empty files: reading the grid must not open them."""

    def write(*conditions):
        root = tmp_path / "session"
        for condition in conditions:
            folder = root / condition
            folder.mkdir(parents=True)
            (folder / "video.mp4").touch()
            (folder / "audio.wav").touch()
        return root

    return write


@pytest.fixture
def site(monkeypatch):
    """A web server."""
    pytest.importorskip("pooch")
    monkeypatch.setattr("pooch.core.time", SimpleNamespace(sleep=lambda _: None))
    with serving() as found:
        found.moved = {"/old": "/datasets/mine/"}
        yield found
