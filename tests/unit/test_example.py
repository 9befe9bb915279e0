"""The recording for newcomers is made once, whole, and made again where it is broken."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import afferents
from afferents import examples as module
from afferents.errors import InputError

pytestmark = pytest.mark.system


@pytest.fixture
def another(example_cache, tmp_path, monkeypatch):
    """A copy of the example that a test may break, and how often it was made again."""
    shutil.copytree(example_cache, tmp_path / "cache")
    made = []

    def make(kept, quiet):
        made.append(kept)
        shutil.rmtree(kept)
        shutil.copytree(example_cache / "example" / "recording", kept)

    monkeypatch.setattr(module, "_make", make)
    return tmp_path / "cache", made


def recording_in(folder):
    return folder / "example" / "recording"


def test_two_processes_that_ask_at_once_get_the_same_one(example_asked_twice):
    folder, found = example_asked_twice
    assert found[0] == found[1] != ""
    assert sorted(path.name for path in (folder / "example").iterdir()) == ["lock", "recording"]


def test_it_holds_the_three_responses_and_names_the_files(example_cache):
    responses = afferents.example(quiet=True)
    rests, slides = (responses.sel(time=slice(*s)) for s in ((0.1, 0.2), (2, 4)))
    assert float(slides.sa1.mean()) > 5 * float(rests.sa1.mean())
    assert bool(slides.detected.all())
    assert Path(responses.video).is_file()
    audio = afferents.read_session(responses.session).recordings[0].audio.read()
    np.testing.assert_allclose(audio, responses.ra2)
    images = afferents.samples(responses.store, "sa1", "spatial", quiet=True)
    assert images.sizes["row"] == images.sizes["column"] == 19


HARM = {
    "none": lambda root, about: None,
    "cut": lambda root, about: cut(next(root.rglob("video.mp4"))),
    "gone": lambda root, about: shutil.rmtree(root / "responses.zarr"),
    "another version": lambda root, about: about.write_text(
        json.dumps({**json.loads(about.read_text()), "afferents": "0.0.1"})
    ),
    "no card": lambda root, about: about.unlink(),
    "card cut": lambda root, about: about.write_text(about.read_text()[:20]),
}


def cut(path):
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize("harm", HARM)
def test_one_that_is_broken_or_of_another_version_is_made_again(another, harm):
    folder, made = another
    root = recording_in(folder)
    HARM[harm](root, root / "example.json")
    responses = afferents.example(folder, quiet=True)
    assert made == ([] if harm == "none" else [root])
    assert Path(responses.video).is_file()


def test_one_that_fails_leaves_nothing(tmp_path, monkeypatch):
    def fail(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "extract_session", fail)
    monkeypatch.setattr(module, "simulate_session", fail)
    with pytest.raises(KeyboardInterrupt):
        afferents.example(tmp_path, quiet=True)
    assert [path.name for path in (tmp_path / "example").iterdir()] == ["lock"]


def test_what_is_somebody_s_stays(tmp_path):
    own = recording_in(tmp_path) / "thesis.tex"
    own.parent.mkdir(parents=True)
    own.write_text("years of work")
    with pytest.raises(InputError, match="a folder that holds something else"):
        afferents.example(tmp_path, quiet=True)
    assert own.read_text() == "years of work"
    with pytest.raises(InputError, match="room and permission to write it"):
        afferents.example(own, quiet=True)
