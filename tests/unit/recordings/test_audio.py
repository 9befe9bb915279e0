"""Sound files that libsndfile just wrote."""

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.recordings.audio import WavFile


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


def test_header(tmp_path, write_audio):
    audio = WavFile(write_audio(tmp_path / "a.wav", duration_s=0.1, sample_rate_hz=8000))
    assert (audio.sample_rate_hz, audio.n_samples, audio.n_channels) == (8000, 800, 2)


def test_mono_is_read_on_its_only_channel(tmp_path, write_audio):
    path = write_audio(tmp_path / "a.wav", channels=1)
    assert WavFile(path, channel=0).read().sizes == {"audio_time": 8820, "channel": 1}
    with pytest.raises(InputError, match="expected the sensor on channel 2, found 1 channel"):
        WavFile(path).read()


@pytest.mark.parametrize("content", [b"", b"RIFF", b"this is not sound" * 50])
def test_unreadable(tmp_path, content):
    path = tmp_path / "audio.wav"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"audio\.wav: expected a readable sound file"):
        WavFile(path).read()


def test_empty_and_missing(tmp_path, write_audio):
    with pytest.raises(InputError, match="with samples, found none"):
        WavFile(write_audio(tmp_path / "empty.wav", duration_s=0)).read()
    with pytest.raises(InputError, match="no such file"):
        WavFile(tmp_path / "absent.wav").read()


def test_shorter_than_its_header_was_when_read(tmp_path, write_audio):
    audio = WavFile(write_audio(tmp_path / "a.wav"))
    assert audio.n_samples == 8820
    audio.path.write_bytes(audio.path.read_bytes()[:4044])
    with pytest.raises(InputError, match="8820 samples as it declares, found 1000"):
        audio.read()


def test_a_wav_that_was_cut_off_is_not_a_shorter_one(tmp_path, write_audio):
    path = write_audio(tmp_path / "a.wav")
    path.write_bytes(path.read_bytes()[:4044])
    with pytest.raises(InputError, match=r"8820 samples as it declares, found 1000; copy"):
        _ = WavFile(path).n_samples


def test_a_wav_of_unknown_length_is_what_is_in_it(tmp_path, write_audio):
    path = write_audio(tmp_path / "a.wav")
    content = path.read_bytes()
    assert content[36:40] == b"data"
    path.write_bytes(content[:40] + b"\xff\xff\xff\xff" + content[44:])
    assert WavFile(path).n_samples == 8820


@pytest.mark.parametrize(("name", "subtype"), [("a.wav", "FLOAT"), ("a.flac", "PCM_16")])
def test_what_is_not_pcm_in_a_wav_is_read(tmp_path, name, subtype):
    soundfile.write(str(tmp_path / name), np.zeros((100, 2)), 8000, subtype=subtype)
    assert WavFile(tmp_path / name).read().sizes["audio_time"] == 100
