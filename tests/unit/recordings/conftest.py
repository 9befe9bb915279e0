"""Real files, encoded on the spot."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile

WriteVideo = Callable[..., Path]
WriteSession = Callable[..., Path]


def _encode(
    path,
    codec="libx264",
    pixels="yuv420p",
    size=(64, 48),
    n_frames=12,
    rate=90,
    ticks_ms=None,
    colour=False,
    noise=False,
    options=None,
    container_options=None,
):
    """Encode a grey (or coloured) ramp, or noise, that shifts by 2 px a frame."""
    path.parent.mkdir(parents=True, exist_ok=True)
    width, height = size
    ramp = np.tile(np.linspace(0, 255, width).astype(np.uint8), (height, 1))
    if noise:
        ramp = np.random.default_rng(0).integers(0, 256, (height, width), dtype=np.uint8)
    with av.open(str(path), "w", options=container_options or {}) as container:
        stream = container.add_stream(codec, rate=rate, options=options or {})
        stream.width, stream.height, stream.pix_fmt = width, height, pixels
        if ticks_ms is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for n in range(n_frames):
            grey = np.roll(ramp, 2 * n, axis=1)
            other = grey // 2 + 60 if colour else grey
            frame = av.VideoFrame.from_ndarray(np.stack([grey, other, grey], -1), format="rgb24")
            if ticks_ms is not None:
                frame.pts, frame.time_base = ticks_ms[n], Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


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
