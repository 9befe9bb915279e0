"""Sound files that libsndfile just wrote, and wavs that are shorter than they declare."""

import os
import struct
import sys

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.recordings.audio import WavFile
from afferents.recordings.description import Signal
from afferents.recordings.tables import read_table

PLAIN = ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE", "ULAW"]


def write(path, form="WAV", subtype="PCM_16", n=1000):
    samples = np.random.default_rng(0).uniform(-0.5, 0.5, (n, 2))
    soundfile.write(str(path), samples, 8000, subtype=subtype, format=form)
    return path


def test_reads_the_sensors_channel_alone(tmp_path):
    n = 200_000  # more than one block
    left, right = np.zeros(n, np.int16), (np.arange(n) % 32768).astype(np.int16)
    soundfile.write(str(tmp_path / "a.wav"), np.stack([left, right], 1), 44100)
    audio = WavFile(tmp_path / "a.wav").read()
    assert audio.dims == ("audio_time", "channel")
    assert audio.dtype == np.float32
    assert list(audio.channel.values) == ["sensor"]
    assert audio.attrs == {"sample_rate_hz": 44100.0, "units": "full scale"}
    np.testing.assert_array_equal(audio.values[:, 0], right / np.float32(32768))


def test_mono_is_read_on_its_only_channel(tmp_path, write_audio):
    path = write_audio(tmp_path / "a.wav", channels=1)
    assert WavFile(path, channel=0).read().sizes == {"audio_time": 8820, "channel": 1}


def endless(path):
    """Write a stream that does not say its length: 36 bits count samples, and 0 is unknown."""
    data = bytearray(write(path, "FLAC").read_bytes())
    data[21] &= 0xF0
    data[22:26] = bytes(4)
    path.write_bytes(data)


REFUSED = {
    "nothing": (lambda p: p.write_bytes(b""), r"audio\.wav: expected a readable sound file"),
    "a word": (lambda p: p.write_bytes(b"RIFF"), "expected a readable sound file"),
    "no chunk": (lambda p: p.write_bytes(b"RIFF\0\0\0\0WAVE"), "expected a readable sound file"),
    "no end": (lambda p: p.write_bytes(b"RIFF\0\0\0\0WAVEfmt "), "a readable sound file"),
    "no sound": (lambda p: p.write_bytes(b"no sound" * 200), "expected a readable sound file"),
    "no length": (endless, "a sound file that says how long it is, found a stream"),
    "two": (
        lambda p: p.write_bytes(2 * write(p).read_bytes()),
        r"none that libsndfile reads \([^:]*RIFF[^:.]*\); .* 'ffmpeg -i audio\.wav OUT\.wav'$",
    ),
    "no samples": (lambda p: write(p, n=0), "with samples, found none"),
    "no file": (lambda p: None, "no such file"),
    "one channel": (
        lambda p: soundfile.write(str(p), np.zeros(9), 8000),
        "expected the sensor on channel 2, found 1 channel",
    ),
}


@pytest.mark.parametrize(("harm", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_is_no_sound_of_the_sensor_is_refused(tmp_path, harm, sentence):
    path = tmp_path / "audio.wav"
    harm(path)
    with pytest.raises(InputError, match=sentence):
        WavFile(path).read()


@pytest.mark.skipif(sys.platform != "linux", reason="names are text there")
def test_a_name_need_not_be_text(tmp_path):
    path = tmp_path / os.fsdecode(b"\xff.wav")
    soundfile.write(os.fsencode(path), np.full((100, 1), 0.5), 8000)
    assert WavFile(path, channel=0).read().shape == (100, 1)
    assert read_table(path, Signal()).values.tolist() == [[0.5]] * 100


@pytest.mark.parametrize("subtype", PLAIN)
@pytest.mark.parametrize("form", ["WAV", "WAVEX", "RF64"])
def test_a_wav_that_was_cut_off_is_not_a_shorter_one(tmp_path, form, subtype):
    path = write(tmp_path / "a.wav", form, subtype)
    whole = WavFile(path)
    assert (whole.n_samples, whole.n_channels) == (1000, 2)
    path.write_bytes(path.read_bytes()[: int(0.9 * path.stat().st_size)])
    for file in (whole, WavFile(path)):  # also where its header was read before
        with pytest.raises(InputError, match=r"1000 samples as it declares, found [89]\d\d;"):
            file.read()


def resized(path, length):
    content = bytearray(path.read_bytes())
    assert content[36:40] == b"data"
    content[4:8] = struct.pack("<I", min(length + 36, 0xFFFFFFFF))
    content[40:44] = struct.pack("<I", length)
    path.write_bytes(content)


def test_a_wav_that_says_that_its_end_is_unknown_is_what_is_in_it(tmp_path):
    path = write(tmp_path / "a.wav")
    resized(path, 0xFFFFFFFF)
    assert WavFile(path).n_samples == 1000


@pytest.mark.parametrize("silent", [False, True])
@pytest.mark.parametrize("declared", [0, 5000])
def test_a_wav_that_declares_less_than_there_is_is_refused(tmp_path, declared, silent):
    """Its header was never closed, or lies."""
    path = write(tmp_path / "a.wav", n=10_000)
    if silent:
        path.write_bytes(path.read_bytes()[:44] + bytes(40_000))
    resized(path, 4 * declared)
    found = rf"\d+ bytes after the {declared} samples that it declares; .* -ignore_length 1"
    with pytest.raises(InputError, match=found):
        WavFile(path).read()
    with pytest.raises(InputError, match=found):
        read_table(path, Signal())


@pytest.mark.parametrize(
    "end", [b"\1", bytes(30), b"LIST" + struct.pack("<I", 4) + b"INFO", b"TAG" + b"x" * 125]
)
def test_a_little_after_the_samples_is_passed_over(tmp_path, end):
    path = write(tmp_path / "a.wav")
    path.write_bytes(path.read_bytes() + end)
    assert WavFile(path).read().sizes["audio_time"] == 1000


def test_chunks_before_the_data_are_passed_over(tmp_path):
    content = write(tmp_path / "a.wav").read_bytes()
    odd = b"note" + struct.pack("<I", 3) + b"abc\0"  # three bytes and one to be even
    path = tmp_path / "b.wav"
    path.write_bytes(content[:12] + odd + content[12:])
    assert WavFile(path).n_samples == 1000
    path.write_bytes(path.read_bytes()[:-400])
    with pytest.raises(InputError, match="1000 samples as it declares, found 900"):
        WavFile(path).read()


@pytest.mark.parametrize(
    ("form", "subtype"),
    [("WAV", "IMA_ADPCM"), ("FLAC", "PCM_16"), ("OGG", "VORBIS"), ("W64", "PCM_16")],
)
def test_what_is_no_plain_wav_is_read(tmp_path, form, subtype):
    path = write(tmp_path / "a.wav", form, subtype)
    assert WavFile(path).read().sizes["audio_time"] >= 1000
