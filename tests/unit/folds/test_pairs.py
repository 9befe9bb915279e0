"""Two conditions held out at once: what is tested shares neither with what is learnt."""

import numpy as np
import pytest
import soundfile

import afferents
from afferents.errors import AfferentsError, InputError, LeakageError
from afferents.folds.held_out import split_named
from afferents.folds.protocol import PROTOCOLS
from afferents.folds.splits import LeaveOneGroupOut, find_leaks, refuse_leaks

from .conftest import SoundFiles

PAIR = split_named("speed,force")
SPEEDS, FORCES, TEXTURES = (10, 20, 30, 40), (1, 2, 3, 4), "abc"
RATE_HZ = 2000


class Pressed(SoundFiles):
    """Sounds ``{texture}_{speed}_{force}.wav``, a second each."""

    name, title = "pressed", "pressed"
    encodings = {  # noqa: RUF012
        "spectral": {"window_s": 0.25, "stride_s": 0.25},
        "orders": {"window_s": 0.5, "stride_s": 0.25, "lowest_hz": 10.0},
    }

    def told(self, speed, force):
        return float(speed), {"force": force}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A texture sounds at any speed alike, but at each force in a way of its own."""
    root, rng = tmp_path_factory.mktemp("pressed"), np.random.default_rng(1)
    time_s = np.arange(RATE_HZ) / RATE_HZ
    for texture in TEXTURES:
        for force in FORCES:
            line_hz = rng.uniform(30, 180)
            for speed in SPEEDS:
                sound = np.sin(2 * np.pi * line_hz * time_s) + 0.1 * rng.normal(size=RATE_HZ)
                soundfile.write(root / f"{texture}_{speed}_{force}.wav", 0.1 * sound, RATE_HZ)
    return root


def accuracy(folder, out, split, **more):
    return afferents.evaluate(
        Pressed(folder), out, "ridge-te", quiet=True, split=split, workers=1, **more
    )


def test_what_is_known_of_a_force_is_no_use_where_the_force_is_held_out_too(folder, tmp_path):
    by_speed = accuracy(folder, tmp_path / "speed", "speed").summary["models"]["ridge-te"]
    results = accuracy(folder, tmp_path / "pair", "speed,force")
    by_pair = results.summary["models"]["ridge-te"]["nested"]
    assert by_speed["nested"]["mean_accuracy"] > 0.9
    assert by_pair["mean_accuracy"] < 0.7
    assert len(by_pair["by"]) == len(SPEEDS) * len(FORCES)
    assert not any(by_pair["leaks"].values())
    page = afferents.report(results.root, quiet=True)
    assert "pairs of speed and force" in page.read_text()


def test_a_cell_is_held_out_with_its_row_and_its_column(samples):
    data = samples(SPEEDS).assign_coords(group=("sample", _cells(samples(SPEEDS))))
    groups = PAIR.of(data)
    for fold in LeaveOneGroupOut(PROTOCOLS["nested"], what=PAIR).folds(data):
        assert set(groups[fold.test]) == {fold.held_out}
        assert set(groups[fold.validation]) == {fold.validated_by}
        row, column = fold.held_out.split("/")
        learnt = np.array([group.split("/") for group in groups[[*fold.train, *fold.validation]]])
        assert row not in learnt[:, 0]
        assert column not in learnt[:, 1]
        nothing = fold.train[:0]
        refuse_leaks(find_leaks(data, fold, nothing), fold)
        beside = np.flatnonzero((groups != fold.held_out) & PAIR.sharing(groups, fold.held_out))
        with pytest.raises(LeakageError, match="speed 10 mm/s and force 0"):
            refuse_leaks(find_leaks(data, fold, beside), fold)
        break


def _cells(data):
    force = np.arange(len(data)) % 3
    speeds = data["speed_mm_s"].values
    return [f"{speed:g}/{n}" for speed, n in zip(speeds, force, strict=True)]


def test_too_few_to_leave_one_out_within_is_said(folder, tmp_path):
    with pytest.raises(AfferentsError, match="pairs of speed and force that share neither"):
        accuracy(folder, tmp_path / "r", "speed,force", speeds=(10, 20))


@pytest.mark.parametrize("name", ["speed,speed", "speed,angle", "speed,texture", "a,b,c"])
def test_only_two_whole_and_different_ones_are_a_pair(name):
    with pytest.raises(InputError, match="--split: expected"):
        split_named(name)


def test_one_cell_is_asked_for_by_its_name(folder, tmp_path):
    found = accuracy(folder, tmp_path / "r", "speed,force", held_out="20/3").summary
    assert found["groups"] == ["20/3"]
    with pytest.raises(InputError, match=r"--held-out: expected some of 10/1, .*, found 20/9"):
        accuracy(folder, tmp_path / "q", "speed,force", held_out="20/9")
