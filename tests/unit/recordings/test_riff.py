"""What a wav's header declares, of every format that writes sample by sample."""

import struct

import numpy as np
import pytest
import soundfile

from afferents.errors import InputError
from afferents.recordings.audio import WavFile, declared_samples

PLAIN = ["PCM_U8", "PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE", "ULAW"]


def write(path, form="WAV", subtype="PCM_16", n=1000):
    samples = np.random.default_rng(0).uniform(-0.5, 0.5, (n, 2))
    soundfile.write(str(path), samples, 8000, subtype=subtype, format=form)
    return path


@pytest.mark.parametrize("subtype", PLAIN)
@pytest.mark.parametrize("form", ["WAV", "WAVEX", "RF64"])
def test_samples_are_counted_by_the_header(tmp_path, form, subtype):
    path = write(tmp_path / "a.wav", form, subtype)
    assert declared_samples(path) == 1000
    assert WavFile(path).n_samples == 1000


@pytest.mark.parametrize("subtype", PLAIN)
@pytest.mark.parametrize("form", ["WAV", "WAVEX", "RF64"])
def test_a_file_cut_short_is_refused(tmp_path, form, subtype):
    path = write(tmp_path / "a.wav", form, subtype)
    path.write_bytes(path.read_bytes()[: int(0.9 * path.stat().st_size)])
    with pytest.raises(InputError, match=r"expected 1000 samples as it declares, found [89]\d\d;"):
        WavFile(path).read()


def test_chunks_before_the_data_are_passed_over(tmp_path):
    content = write(tmp_path / "a.wav").read_bytes()
    odd = b"note" + struct.pack("<I", 3) + b"abc\0"  # three bytes and one to be even
    path = tmp_path / "b.wav"
    path.write_bytes(content[:12] + odd + content[12:])
    assert declared_samples(path) == 1000


@pytest.mark.parametrize("length", [0, 0xFFFFFFFF])
def test_a_length_left_open_is_unknown(tmp_path, length):
    path = write(tmp_path / "a.wav")
    content = bytearray(path.read_bytes())
    content[40:44] = struct.pack("<I", length)
    path.write_bytes(content)
    assert declared_samples(path) is None


@pytest.mark.parametrize(
    ("form", "subtype"),
    [("WAV", "IMA_ADPCM"), ("FLAC", "PCM_16"), ("OGG", "VORBIS"), ("W64", "PCM_16")],
)
def test_what_is_no_plain_wav_declares_nothing(tmp_path, form, subtype):
    assert declared_samples(write(tmp_path / "a.wav", form, subtype)) is None


@pytest.mark.parametrize("content", [b"", b"RIFF", b"RIFF\0\0\0\0WAVE", b"RIFF\0\0\0\0WAVEfmt "])
def test_a_header_that_breaks_off_declares_nothing(tmp_path, content):
    (tmp_path / "a.wav").write_bytes(content)
    assert declared_samples(tmp_path / "a.wav") is None
