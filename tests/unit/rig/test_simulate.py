"""A session of the rig: the same from the same seed, resumed after a stop, refused when wrong."""

import json
import os
import signal
import time

import numpy as np
import pytest

import afferents
from afferents.errors import InputError
from afferents.progress import Progress
from afferents.recordings.data_sets import read_session
from afferents.recordings.session_file import read_session_file
from afferents.rig import HARD, NUISANCES
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import make_simulation

from ...kept import contents
from ...limits import files_no_larger_than

TEXTURES, SPEEDS, SECONDS = ("g",), (50.0, 100.0), 1.6


def simulate(folder, workers=1, **changed):
    words = {"textures": TEXTURES, "speeds_mm_s": SPEEDS, "seconds": SECONDS, **changed}
    simulation = make_simulation(folder, "quick", **words)
    with Progress(quiet=True) as progress:
        return simulate_session(simulation, workers, progress)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return simulate(tmp_path_factory.mktemp("simulated") / "one")


def test_it_is_read_as_any_session_and_says_all_of_itself(session):
    read = read_session(session)
    assert [r.name for r in read.recordings] == ["3/50", "3/100"]
    assert all(r.video is not None and r.audio is not None for r in read.recordings)
    assert read.reference is not None
    assert read_session_file(session).simulated
    content = json.loads((session / "session.json").read_text())
    assert content["seed"] == 0
    assert content["rig"]["skin"]["friction"] == 0.68
    assert set(content["runs"]) == set(content["checksums"]) == {"3/50", "3/100"}
    assert set(content["versions"]) == {"afferents", "av", "numba", "numpy", "scipy"}
    assert content["runs"]["3/50"]["indentation_mm"] == content["runs"]["3/100"]["indentation_mm"]


def test_the_same_seed_gives_the_same_whatever_the_workers(session, tmp_path):
    again = simulate(tmp_path / "two", workers=2)
    sounds = contents(session, "*.wav")
    assert len(sounds) == 2
    assert contents(again, "*.wav") == sounds
    for name in sounds:
        ours, theirs = (np.load((root / name).parent / "truth.npz") for root in (session, again))
        for key in ours:  # threads sum in another order; what is kept is rounded to 1/1024
            np.testing.assert_allclose(theirs[key], ours[key], rtol=0, atol=1.01 / 1024)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_recording_depends_on_the_seed_and_on_no_other(session, tmp_path, seed):
    alone = simulate(tmp_path / "alone", seed=seed, textures=("g",), speeds_mm_s=(100.0,))
    sound, same = (contents(one, "*.wav")["3/100/audio.wav"] for one in (alone, session))
    assert (sound == same) == (seed == 0)


def test_a_finished_session_is_left_as_it_is(session):
    before = {
        path: path.stat().st_mtime_ns for path in session.rglob("*.*") if path.parent != session
    }
    simulate(session)
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.parametrize("name", ["drive.csv", "throw_away.mp4"])
def test_a_run_that_lost_a_file_is_recorded_again(session, name):
    lost = session / "3" / "50" / name
    before = lost.read_bytes()
    lost.unlink()
    simulate(session)
    assert lost.read_bytes() == before


@pytest.mark.system
def test_a_killed_session_goes_on_where_it_was(launch, session, tmp_path):
    folder = tmp_path / "killed"
    command = ["simulate", folder, "--quiet", "--workers", 1]
    command += ["--textures", "g", "--speeds", "50,100", "--seconds", "1.6"]
    run = launch(command, imports=["afferents.rig.simulate"], session=True)
    while not (folder / "3" / "50" / "truth.npz").is_file():
        assert run.poll() is None
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    kept = (folder / "3" / "50" / "truth.npz").stat().st_mtime_ns
    simulate(folder)
    assert (folder / "3" / "50" / "truth.npz").stat().st_mtime_ns == kept
    assert contents(folder, "*.wav", "truth.npz") == contents(session, "*.wav", "truth.npz")
    assert not list(folder.rglob(".partial*"))


def test_a_full_disk_leaves_nothing_half_written(fails, tmp_path):
    asked = ("--textures", "g", "--speeds", "50", "--seconds", "1.6", "--workers", "1", "--quiet")
    with files_no_larger_than(20_000):
        assert "File too large" in fails("simulate", tmp_path / "new", *asked)
    left = {path.suffix for path in (tmp_path / "new").rglob("*") if path.is_file()}
    assert left <= {".json"}


def test_nuisances_are_chosen_by_name_and_strength():
    rig = make_simulation("s", "quick", nuisances="mains,tilt=0.05").rig
    assert rig.mounting.tilt_rad == 0.05
    assert rig.microphone.mains > 0
    assert rig.camera.noise_grey == 0
    stronger = make_simulation("s", "quick", nuisances="all,tilt=0.05").rig
    assert stronger.mounting.tilt_rad == 0.05
    assert stronger.camera.noise_grey > 0
    assert set(NUISANCES) > {"mains", "tilt"}
    for text in ("tilt=0.05,all", "tilt=0.05,hard"):
        assert make_simulation("s", "quick", nuisances=text).rig.mounting.tilt_rad == 0.05


def test_a_hard_rig_has_every_nuisance_no_weaker_than_its_own():
    own, hard = (
        make_simulation("s", "quick").rig,
        make_simulation("s", "quick", nuisances="hard").rig,
    )
    for name, (section, field) in NUISANCES.items():
        weak, strong = (getattr(getattr(rig, section), field) for rig in (own, hard))
        assert strong > weak if name in HARD else strong == weak
    assert make_simulation("s", "quick", nuisances="hard,motor=0").rig.microphone.motor == 0


def test_a_height_map_is_a_texture(tmp_path):
    np.save(tmp_path / "waves.npy", np.sin(np.linspace(0, 12, 60))[:, None] * np.ones((60, 60)))
    words = {"textures": (), "speeds_mm_s": (50.0,)}
    made = simulate(tmp_path / "s", height_maps=[f"waves={tmp_path}/waves.npy,12,0"], **words)
    assert [r.name for r in read_session(made).recordings] == ["waves/50"]
    with pytest.raises(InputError, match=r"height_maps.waves"):
        simulate(made, height_maps=[f"waves={tmp_path}/waves.npy,24,0"], **words)


def test_a_text_names_textures_by_letters_or_between_commas(tmp_path):
    with pytest.raises(InputError, match=r"found '77'"):
        afferents.simulate(tmp_path / "s", textures="2.5,77", speeds_mm_s=[50], seconds=2)


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"textures": ("z",)}, r"a texture: expected a letter from a to m.* found 'z'"),
        ({"textures": ("aei",)}, "found 'aei'; set several apart by commas"),
        ({"speeds_mm_s": (50.0, 0.0)}, r"--speeds: expected speeds above 0 .* found 0"),
        ({"seconds": float("nan")}, r"--seconds: expected more than 1.5 .* found nan"),
        ({"seconds": float("inf")}, r"--seconds: expected more than 1.5 .* found inf"),
        ({"nuisances": "wobble"}, r"nuisances: .* found 'wobble'"),
        ({"nuisances": "tilt=-1"}, r"tilt_rad: expected .*greater than or equal to 0, found -1"),
        ({"reprint": -1}, r"--reprint: expected 0 to 4294967295"),
        ({"seed": -1, "reprint": 0}, r"--seed: expected 0 to 4294967295"),
        ({"textures": ()}, r"--textures: expected one or more"),
        ({"speeds_mm_s": ()}, r"--speeds: expected one or more"),
        ({"nuisances": "hard=2"}, r"expected 'hard' without a strength, found 'hard=2'"),
        ({"indentation_mm": 0.1, "seed": 6}, r"--indentation: expected a fingertip that touches"),
        ({"indentation_mm": 3.0}, r"--indentation: expected more than 0 and at most 2 mm"),
        ({"nuisances": "tilt=inf"}, r"--nuisances: expected NAME or NAME=STRENGTH.*'tilt=inf'"),
        ({"nuisances": "tilt=much"}, r"--nuisances: expected NAME or NAME=STRENGTH.*'tilt=much'"),
        (
            {"height_maps": ["x"]},
            r"a height map: expected NAME=FILE,LENGTH_MM,HEIGHT_MM, found 'x'",
        ),
        ({"height_maps": ["3=x.png,12,1"]}, r"a name that is no printed drum's, found '3'"),
        ({"height_maps": ["x=nowhere.png,12,1"]}, r"nowhere.png: expected an image or an .npy"),
    ],
)
def test_what_can_not_be_simulated_is_refused_and_nothing_is_written(changed, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        simulate(tmp_path / "s", **changed)
    assert not (tmp_path / "s").exists()


def test_a_session_of_another_configuration_is_refused(session):
    before = contents(session, "*.wav")
    with pytest.raises(InputError, match=r"rig.drum.prints"):
        simulate(session, seed=3)
    assert contents(session, "*.wav") == before


def test_at_another_depth_the_mounting_is_the_same_and_the_run_another():
    usual, deep = (
        make_simulation("s", "quick", textures="d", indentation_mm=mm).config()["runs"]["1.5/20"]
        for mm in (1.0, 1.2)
    )
    assert usual == make_simulation("s", "quick", textures="d").config()["runs"]["1.5/20"]
    assert deep["tilt_rad"] == usual["tilt_rad"]
    assert deep["indentation_mm"] == pytest.approx(usual["indentation_mm"] + 0.2)
    assert deep["start_rad"] != usual["start_rad"]


@pytest.mark.parametrize(("seed", "other"), [(0, 1), (5, 0)])
def test_other_prints_are_other_drums_and_other_runs_under_the_same_mounting(seed, other):
    usual, printed = (
        make_simulation("s", "quick", textures="d", seed=seed, reprint=n).config()["runs"]["1.5/20"]
        for n in (None, other)
    )
    same = {name for name in usual if usual[name] == printed[name]}
    assert same == {"indentation_mm", "tilt_rad", "lateral_mm"}


@pytest.mark.parametrize("changed", [{"indentation_mm": 0.8}, {"reprint": 1}])
def test_a_run_that_is_mounted_anew_shares_its_mounting_with_no_run_of_another_session(changed):
    words = {"textures": "d", "remount": "run"}
    one, other = (
        make_simulation("s", "quick", **words, **more).config()["runs"]["1.5/20"]
        for more in ({}, changed)
    )
    assert one["tilt_rad"] != other["tilt_rad"]


def test_mounting_indentation_and_nodules_are_switched():
    own = make_simulation("s", "quick").rig
    rig = make_simulation(
        "s", "quick", remount="run", indentation_mm=0.4, nodules="off", nuisances="all"
    ).rig
    assert (own.mounting.remount, rig.mounting.remount) == ("session", "run")
    assert rig.mounting.tilt_rad == own.mounting.tilt_rad
    assert (rig.mounting.indentation_mm, rig.skin.nodular) == (0.4, False)
    given = make_simulation("s", "quick", indentation_mm=0.4, reprint=1)
    assert given.config()["conditions"] == {"indentation_mm": 0.4, "print": 1}
    assert "conditions" not in make_simulation("s", "quick").config()
    prints = [make_simulation("s", "quick", seed=3, reprint=n).rig.drum.prints for n in (None, 0)]
    assert prints == [3, 0]
