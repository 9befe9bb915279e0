"""A session of the rig: the same from the same seed, resumed after a stop, refused when wrong."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from afferents.errors import InputError
from afferents.progress import Progress
from afferents.recordings.session import read_session
from afferents.recordings.session_file import session_file
from afferents.rig import HARD, NUISANCES
from afferents.rig.simulate import simulate_session
from afferents.rig.simulation import simulation_of

TEXTURES, SPEEDS, SECONDS = ("a", "g"), (50.0, 100.0), 1.6


def simulate(folder, workers=1, **changed):
    words = {"textures": TEXTURES, "speeds_mm_s": SPEEDS, "seconds": SECONDS, **changed}
    simulation = simulation_of(folder, "quick", **words)
    with Progress(quiet=True) as progress:
        return simulate_session(simulation, workers, progress)


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return simulate(tmp_path_factory.mktemp("simulated") / "one")


def contents(session, *names):
    return {
        str(path.relative_to(session)): path.read_bytes()
        for name in names
        for path in session.rglob(name)
    }


def test_it_is_read_as_any_session(session):
    recordings = read_session(session).recordings
    assert [r.name for r in recordings] == ["0/50", "0/100", "3/50", "3/100"]
    assert all(r.video is not None and r.audio is not None for r in recordings)
    assert read_session(session).reference is not None
    assert session_file(session).simulated


def test_session_json_holds_constants_seed_draws_versions_and_checksums(session):
    content = json.loads((session / "session.json").read_text())
    assert content["seed"] == 0
    assert content["rig"]["skin"]["static_friction"] == 0.63
    assert set(content["runs"]) == set(content["checksums"]) == {"0/50", "0/100", "3/50", "3/100"}
    assert set(content["versions"]) == {"afferents", "av", "numba", "numpy", "scipy"}
    assert content["runs"]["3/50"]["indentation_mm"] == content["runs"]["3/100"]["indentation_mm"]


def test_the_same_seed_gives_the_same_bytes_whatever_the_workers(session, tmp_path):
    again = simulate(tmp_path / "two", workers=2)
    files = contents(session, "*.wav", "truth.npz")
    assert len(files) == 8
    assert contents(again, "*.wav", "truth.npz") == files


def test_another_seed_is_another_session(session, tmp_path):
    other = simulate(tmp_path / "other", seed=1, textures=("g",), speeds_mm_s=(50.0,))
    assert (
        contents(other, "*.wav")["3/50/audio.wav"] != contents(session, "*.wav")["3/50/audio.wav"]
    )


def test_a_recording_does_not_depend_on_the_others(session, tmp_path):
    alone = simulate(tmp_path / "alone", textures=("g",), speeds_mm_s=(100.0,))
    assert (
        contents(alone, "*.wav")["3/100/audio.wav"] == contents(session, "*.wav")["3/100/audio.wav"]
    )


def test_a_finished_session_is_left_as_it_is(session):
    before = {
        path: path.stat().st_mtime_ns for path in session.rglob("*.*") if path.parent != session
    }
    simulate(session)
    assert {path: path.stat().st_mtime_ns for path in before} == before


@pytest.mark.system
def test_a_killed_session_goes_on_where_it_was(launch, session, tmp_path):
    folder = tmp_path / "killed"
    command = ["simulate", folder, "--quiet", "--workers", 1]
    command += ["--textures", "a,g", "--speeds", "50,100", "--seconds", "1.6"]
    run = launch(command, imports=["afferents.rig.simulate"], session=True)
    while not (folder / "0" / "50" / "truth.npz").is_file():
        assert run.poll() is None
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    kept = (folder / "0" / "50" / "truth.npz").stat().st_mtime_ns
    simulate(folder)
    assert (folder / "0" / "50" / "truth.npz").stat().st_mtime_ns == kept
    assert contents(folder, "*.wav", "truth.npz") == contents(session, "*.wav", "truth.npz")
    assert not list(folder.rglob(".partial*"))


@pytest.mark.system
def test_a_full_disk_is_one_sentence_and_no_broken_file(tmp_path):
    """A file-size limit stands in for the disk: the system refuses to write on, as it does then."""
    script = (
        "import resource, signal, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
        "resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000)); "
        "sys.argv = ['afferents', 'simulate', sys.argv[1], '--textures', 'g', '--speeds', '50', "
        "'--seconds', '1.6', '--workers', '1', '--quiet']; from afferents.cli import main; main()"
    )
    run = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "new")], capture_output=True, text=True
    )
    assert run.returncode == 2
    assert "File too large" in run.stderr
    assert "Traceback" not in run.stderr
    assert not list((tmp_path / "new").rglob("*.mp4"))
    assert not list((tmp_path / "new").rglob(".partial*"))


def test_a_session_without_nuisances_is_the_same_from_any_seed(tmp_path):
    words = {"nuisances": "none", "textures": ("g",), "speeds_mm_s": (50.0,)}
    one = simulate(tmp_path / "one", seed=1, **words)
    two = simulate(tmp_path / "two", seed=2, **words)
    assert contents(one, "*.wav", "truth.npz") == contents(two, "*.wav", "truth.npz")


def test_nuisances_are_chosen_by_name_and_strength():
    rig = simulation_of("s", "quick", nuisances="mains,tilt=0.05").rig
    assert rig.mounting.tilt_rad == 0.05
    assert rig.microphone.mains > 0
    assert rig.camera.noise_grey == 0
    stronger = simulation_of("s", "quick", nuisances="all,tilt=0.05").rig
    assert stronger.mounting.tilt_rad == 0.05
    assert stronger.camera.noise_grey > 0
    assert set(NUISANCES) > {"mains", "tilt"}


def test_a_hard_rig_has_every_nuisance_no_weaker_than_its_own():
    own, hard = simulation_of("s", "quick").rig, simulation_of("s", "quick", nuisances="hard").rig
    for name, (section, field) in NUISANCES.items():
        weak, strong = (getattr(getattr(rig, section), field) for rig in (own, hard))
        assert strong > weak if name in HARD else strong == weak
    assert simulation_of("s", "quick", nuisances="hard,motor=0").rig.microphone.motor == 0


def test_presets_have_what_they_promise():
    quick, paper = simulation_of("s", "quick"), simulation_of("s", "paper")
    assert len({texture for texture, _ in quick.names}) == 13
    assert {10.0, 100.0} < {speed for _, speed in quick.names}
    assert len(quick.speeds_mm_s) >= 5
    assert (len(paper.names), paper.seconds) == (130, 65.0)


def test_a_height_map_is_a_texture(tmp_path):
    np.save(tmp_path / "waves.npy", np.sin(np.linspace(0, 12, 60))[:, None] * np.ones((60, 60)))
    words = {"textures": (), "speeds_mm_s": (50.0,)}
    made = simulate(tmp_path / "s", height_maps=[f"waves={tmp_path}/waves.npy,12,0"], **words)
    assert [r.name for r in read_session(made).recordings] == ["waves/50"]


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"textures": ("z",)}, r"a texture: expected a letter from a to m.* found 'z'"),
        ({"textures": ("-3",)}, r"a texture: .* found '-3'"),
        ({"speeds_mm_s": (50.0, 0.0)}, r"--speeds: expected speeds above 0 .* found 0"),
        ({"speeds_mm_s": (-10.0,)}, r"--speeds: .* found -10"),
        ({"seconds": 1.0}, r"--seconds: expected more than 1.5 .* found 1"),
        ({"seconds": float("nan")}, r"--seconds: expected more than 1.5 .* found nan"),
        ({"seconds": float("inf")}, r"--seconds: expected more than 1.5 .* found inf"),
        ({"nuisances": "wobble"}, r"nuisances: .* found 'wobble'"),
        ({"nuisances": "tilt=much"}, r"--nuisances: expected NAME or NAME=STRENGTH.*'tilt=much'"),
        (
            {"height_maps": ["x"]},
            r"a height map: expected NAME=FILE,LENGTH_MM,HEIGHT_MM, found 'x'",
        ),
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


def test_a_folder_with_other_files_is_refused(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match=r"a new session, found a folder that holds something"):
        simulate(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_drums_are_printed_by_seed_or_by_the_set_that_is_asked_for():
    def prints(**words):
        return simulation_of("s", "quick", **words).rig.drum.prints

    assert (prints(), prints(seed=3), prints(seed=3, reprint=0)) == (0, 3, 0)
    with pytest.raises(InputError, match=r"--reprint: expected the number of a set of drums"):
        prints(reprint=-1)


def test_mounting_indentation_and_nodules_are_switched():
    own = simulation_of("s", "quick").rig
    rig = simulation_of(
        "s", "quick", remount="run", indentation_mm=0.4, nodules="off", nuisances="all"
    ).rig
    assert (own.mounting.remount, rig.mounting.remount) == ("session", "run")
    assert rig.mounting.tilt_rad == own.mounting.tilt_rad
    assert (rig.mounting.indentation_mm, rig.skin.nodular) == (0.4, False)
    with pytest.raises(InputError, match=r"--indentation: expected more than 0 and at most 2 mm"):
        simulation_of("s", "quick", indentation_mm=3.0)
