from pathlib import Path

from afferents.store.recording import Recording, RecordingSet, natural_order


class Sound:
    path = Path("audio.wav")
    sample_rate_hz = 44100.0
    n_samples = 10


def test_rates_are_those_of_the_sources_and_none_without():
    heard = Recording("3/50", "3", 50.0, Path("3/50"), audio=Sound())
    assert (heard.fps_hz, heard.sample_rate_hz) == (None, 44100.0)


def test_textures_are_in_order_of_their_value_then_words():
    names = ["wool", "10", "2", "0.5", "felt"]
    assert sorted(names, key=natural_order) == ["0.5", "2", "10", "felt", "wool"]


def test_a_session_lists_textures_and_speeds(tmp_path):
    recordings = tuple(
        Recording(f"{t}/{v}", t, v, tmp_path) for t in ("10", "2") for v in (20.0, 10.0)
    )
    session = RecordingSet(tmp_path, recordings)
    assert session.textures == ("2", "10")
    assert session.speeds_mm_s == (10.0, 20.0)


def test_a_recordings_checksum_is_of_its_files(tmp_path):
    Sound.path = tmp_path / "audio.wav"
    Sound.path.write_bytes(b"one")
    recording = Recording("3/50", "3", 50.0, tmp_path, audio=Sound())
    before = recording.checksum
    Sound.path.write_bytes(b"two")
    assert recording.checksum != before
