"""Content that is wrong: refused, or kept and marked with --accept; copies, which are warned of."""

import json
import shutil

import numpy as np
import pytest
import soundfile
import xarray as xr

from afferents.channels import CHANNELS
from afferents.encodings.spectra import SpectralEncoding
from afferents.errors import InputError
from afferents.evaluation.data import Source, encode, join_recordings, open_data
from afferents.extraction.copies import NAMED, warn, warn_of_copies
from afferents.inspection.inspect import inspect
from afferents.markers.quality import find_hidden_markers
from afferents.progress import Progress
from afferents.store.fingerprint import Copy
from afferents.store.zarr_store import open_responses, write_responses

RATE_HZ, FPS = 8000, 90
ALONE = ("--workers", "1", "--quiet")
FROZEN = "found the same one from 0.89 s to the end"


@pytest.fixture(scope="module")
def frozen(tmp_path_factory, make_video):
    """One recording whose picture stands still from 0.9 s on, with sound of its length."""
    root = tmp_path_factory.mktemp("sessions") / "frozen"
    folder = root / "1" / "20"
    folder.mkdir(parents=True)
    frame = np.arange(230)
    shift = np.where(frame > 10, 3 * np.sin(frame / 3), 0)
    shift[80:] = shift[80]
    # A faster encoder mends what stands still for longer: the freeze is then found later.
    make_video(folder / "video.mp4", shift, preset="medium")
    sound = np.random.default_rng(0).normal(0, 0.05, (round(230 / FPS * RATE_HZ), 2))
    soundfile.write(folder / "audio.wav", sound, RATE_HZ)
    declared = {"sample_rate_hz": RATE_HZ, "steady_s": [0.3, 2.5]}
    (root / "session.json").write_text(json.dumps(declared))
    return root


def loud(root, value):
    """Give one recording a float wav with one sample of this value."""
    samples, rate = soundfile.read(root / "2/30/audio.wav")
    samples[12000, 1] = value
    soundfile.write(root / "2/30/audio.wav", samples, rate, subtype="FLOAT")


@pytest.fixture
def noisy(sounds, tmp_path):
    return shutil.copytree(sounds, tmp_path / "session")


def look(source, tmp_path):
    return inspect(str(source), tmp_path / "pictures", quiet=True)


def test_a_frozen_picture_is_refused(run, fails, frozen, tmp_path):
    said = fails("extract", frozen, tmp_path / "z", *ALONE, "--accept", "loud")
    assert (
        f"1/20/video.mp4: expected a picture that changes while the drum slides, {FROZEN}" in said
    )
    assert "--accept frozen" in said
    assert not (tmp_path / "z/1/20").exists()
    command = ("extract", frozen, tmp_path / "z", "--workers", "1", "--json", "--keep-going")
    code, out, _ = run(*command)
    assert code == 3
    assert FROZEN in json.loads(out)["skipped"]["1/20"]
    said = fails("extract", frozen, tmp_path / "z", "--accept", "ice")
    assert "--accept: expected one of length, dark, frozen, repeated, loud, found 'ice'" in said


def test_accepted_it_is_kept_and_known_for_what_it_is(run, frozen, tmp_path):
    store = tmp_path / "z"
    command = ("extract", frozen, store, "--workers", "1", "--json", "--accept", "frozen")
    code, out, err = run(*command, "--accept", "dark")
    assert code == 0
    (said,) = json.loads(out)["issues"]["1/20"]
    assert FROZEN in said
    assert "Frozen: 1/20: expected" in err
    (responses,) = open_responses(store)
    assert json.loads(responses.attrs["issues"]) == [said]
    assert json.loads(responses.attrs["conditions"])["issues"] == "frozen"
    # It stays known when nothing is left to do, and to who looks at the store.
    assert "1/20" in json.loads(run(*command)[1])["issues"]
    assert any(FROZEN in line for line in look(store, tmp_path).sentences)


def test_inspect_says_it_of_the_session_and_of_the_video(frozen, tmp_path):
    (problem,) = look(frozen, tmp_path).problems
    assert FROZEN in problem
    found = look(frozen / "1/20/video.mp4", tmp_path)
    assert "frozen" in found.facts["issues"]
    assert any(line.startswith("Frozen: expected a picture that") for line in found.sentences)
    assert found.problems == []


def test_beyond_full_scale_is_refused_or_accepted(run, fails, noisy, tmp_path):
    loud(noisy, 3.0)
    command = ("extract", noisy, tmp_path / "z", *ALONE)
    said = fails(*command)
    assert "2/30/audio.wav: expected samples within full scale" in said
    assert "up to 3, first at sample 12000 (1.500 s)" in said
    code, _, err = run(*command, "--accept", "loud")
    assert code == 0
    assert "Loud: 2/30: expected samples within full scale" in err


def test_no_number_is_never_accepted(fails, noisy, tmp_path):
    loud(noisy, np.nan)
    said = fails("extract", noisy, tmp_path / "z", *ALONE, "--accept", "loud")
    assert "2/30/audio.wav: expected samples that are numbers, found nan at sample 12000" in said
    found = look(noisy / "2/30/audio.wav", tmp_path)
    assert any("found nan at sample 12000 (1.500 s)" in problem for problem in found.problems)
    assert any(line.startswith("Peak 0.2") for line in found.sentences)


@pytest.mark.parametrize(
    ("value", "model"), [(np.nan, "vib-te"), (np.inf, "ridge-te"), (1e30, "vib-te")]
)
def test_evaluate_names_a_stored_recording_without_numbers(fails, stores, tmp_path, value, model):
    store = shutil.copytree(stores["audio"], tmp_path / "z")
    (spoilt,) = (r.load() for r in open_responses(store) if r.attrs["name"] == "2/30")
    spoilt["ra2"][12000] = value
    write_responses(store, spoilt)  # sealed anew: as an older version might have written it
    command = ("evaluate", store, "--out", tmp_path / "r", "--models", model, "--window-s", "0.5")
    sentence = f"ra2 of 2/30: expected samples that are numbers, found {value:g} at sample 12000"
    assert sentence in fails(*command, "--quiet")
    (stored,) = (r for r in open_responses(store) if r.attrs["name"] == "2/30")
    with pytest.raises(InputError, match="ra2 of 2/30: expected samples that are numbers"):
        encode(stored, Source(CHANNELS["ra2"], SpectralEncoding()), "all")


def test_covered_markers_are_a_doubt():
    seen = np.ones((400, 20), bool)
    seen[:10] = False  # before the rest frame nothing is tracked
    seen[:, :3] = False  # pins that are broken

    def doubts():
        tracks = xr.Dataset({"detected": (("time", "marker"), seen)}, attrs={"rest_frame": 10})
        return find_hidden_markers(tracks.assign_coords(time=np.arange(400) / FPS), "v.mp4", None)

    assert doubts() == []
    seen[200:, :12] = False
    (doubt,) = doubts()
    assert doubt.kind == "dark"
    assert "the 17 markers of the rest frame" in str(doubt)
    assert "less than half of them from 2.22 s to the end" in str(doubt)


def test_a_copy_that_was_encoded_again_is_warned_of(run, noisy, tmp_path):
    rng = np.random.default_rng(3)
    for path in sorted(noisy.glob("*/*/audio.wav")):
        soundfile.write(path, rng.normal(0, 0.1, (6 * RATE_HZ, 2)), RATE_HZ)
    again = 0.3 * soundfile.read(noisy / "2/30/audio.wav")[0]
    soundfile.write(noisy / "3/60/audio.wav", again, RATE_HZ, subtype="PCM_U8")
    store = tmp_path / "z"
    code, out, err = run("extract", noisy, store, "--workers", "1", "--json")
    assert code == 0
    assert err.count("warning: these seem to be copies") == 1
    (copy,) = json.loads(out)["copies"]
    assert (copy["one"], copy["other"], copy["kind"]) == ("2/30", "3/60", "sound")

    class Notes(Progress):
        def note(self, text):
            said.append(text)

    said = []
    warn(join_recordings(open_data([str(store)])), Notes(quiet=True))
    assert "2/30 and 3/60 (by sound, " in said[0]


def test_many_copies_make_one_short_warning():
    copies = [Copy(f"1/{n}", f"2/{n}", "sound", 0.99) for n in range(50)]
    (warning,) = warn_of_copies(copies)
    assert "1/2 and 2/2 (by sound, 0.99 alike), and 47 more pairs" in warning
    assert len(warn_of_copies(copies[:NAMED])[0].splitlines()) == 1
