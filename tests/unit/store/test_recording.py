"""Recordings and sets of them, in order, known by their files."""

import os
from types import SimpleNamespace

import pytest

from afferents.errors import InputError
from afferents.store.recording import Recording, RecordingSet, natural_order, require_utf8


def test_textures_are_in_order_of_their_value_then_words(tmp_path):
    names = ["wool", "10", "2", "0.5", "felt"]
    assert sorted(names, key=natural_order) == ["0.5", "2", "10", "felt", "wool"]
    recordings = tuple(
        Recording(f"{t}/{v}", t, v, tmp_path) for t in ("10", "2") for v in (20.0, 10.0)
    )
    session = RecordingSet(tmp_path, recordings)
    assert session.textures == ("2", "10")
    assert session.speeds_mm_s == (10.0, 20.0)


def test_a_recordings_checksum_is_of_its_files(tmp_path):
    path = tmp_path / "audio.wav"
    sound = SimpleNamespace(path=path, sample_rate_hz=44100.0, n_samples=10)
    recording = Recording("3/50", "3", 50.0, tmp_path, audio=sound)
    assert (recording.fps_hz, recording.sample_rate_hz) == (None, 44100.0)
    path.write_bytes(b"one")
    before = recording.checksum
    path.write_bytes(b"two")
    assert recording.checksum != before
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(InputError, match="expected a file, found a pipe"):
        recording.checksum  # noqa: B018


@pytest.mark.parametrize(
    ("name", "do"),
    [(b"caf\xe9", "rename it"), (b"caf\xc3\xa9", "set PYTHONUTF8=1, since the system")],
)
def test_a_name_that_the_system_reads_wrongly_need_not_be_changed(name, do):
    """As under LC_ALL=C where Python may not choose UTF-8."""
    with pytest.raises(InputError, match=f"a name in UTF-8, found other bytes; {do}"):
        require_utf8(name.decode("ascii", "surrogateescape"))
