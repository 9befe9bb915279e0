"""Nuisances: each has its switch and its strength; all off, nothing is disturbed."""

from pathlib import Path

import numpy as np
import pytest

from afferents.rig import NUISANCES, Rig, bumped_surface, draw, mapped_surface
from afferents.rig.run import Drawn

from .conftest import changed


@pytest.mark.parametrize("name", sorted(NUISANCES))
def test_one_nuisance_alone_leaves_all_others_off(name):
    assert Rig().with_nuisances({"tilt": 0.05}).mounting.tilt_rad == 0.05
    rig = Rig().with_nuisances({name: None})
    on = [n for n, (section, field) in NUISANCES.items() if getattr(getattr(rig, section), field)]
    assert on == [name]
    section, field = NUISANCES[name]
    assert getattr(getattr(Rig(), section), field), "by itself it is on"


LEVELS = {
    "indentation_mm": "session",
    "tilt_rad": "session",
    "lateral_mm": "session",
    "friction": "run",
    "run_out_mm": "drum",
    "start_rad": "run",
    "clock_offset_s": "run",
}
"""At which level each drawn quantity is drawn anew."""
_MOUNTED = ("indentation_mm", "tilt_rad", "lateral_mm")
_SETTINGS = [(seed, texture, v) for seed in (0, 1) for texture in ("3", "6") for v in (50, 60)]


def level_of(rig, name):
    """Return at which level a quantity is drawn, as its values in two sessions say."""
    values = {key: getattr(draw(rig, key[1], key[2], key[0]), name) for key in _SETTINGS}
    n = len(set(values.values()))
    assert values[0, "3", 50] != values[1, "3", 50]
    return {2: "session", 4: "drum", 8: "run"}[n]


@pytest.mark.parametrize("remount", ["session", "drum", "run"])
def test_the_fingertip_is_mounted_when_asked_and_nothing_else_changes(remount):
    """By itself it is mounted once a session."""
    assert set(LEVELS) == set(Drawn._fields)
    rig = changed(Rig(), "mounting", remount=remount)
    found = {name: level_of(rig, name) for name in LEVELS}
    assert found == LEVELS | dict.fromkeys(_MOUNTED, remount)
    for name in set(LEVELS) - set(_MOUNTED):
        assert getattr(draw(rig, "3", 50, 0), name) == getattr(draw(Rig(), "3", 50, 0), name)


def test_what_is_run_again_is_mounted_as_before_and_only_the_run_is_another():
    first, again = (draw(Rig(), "3", 50, 0, n) for n in (0, 1))
    same = {name for name in Drawn._fields if getattr(first, name) == getattr(again, name)}
    assert same == {"indentation_mm", "tilt_rad", "lateral_mm", "run_out_mm"}


def test_the_material_has_one_friction_and_runs_change_it_a_little():
    def logs(**strengths):
        rig = Rig().with_nuisances(strengths)
        return np.log([draw(rig, "3", v, seed).friction for seed in range(100) for v in (50, 60)])

    assert logs(friction=0.2)[::2] == pytest.approx(logs(friction=0.2)[1::2])
    assert logs(friction=0.2).std() == pytest.approx(0.2, rel=0.25)
    assert logs(**{"friction-change": 0.1}).std() == pytest.approx(0.1, rel=0.25)


def test_a_map_of_heights_rubs_by_the_share_that_it_carries_on():
    ridges = np.zeros((100, 100), np.float32)
    ridges[:25] = 0.4
    assert mapped_surface(ridges, 10.0).friction_factor == pytest.approx(0.25 ** (1 / 9), rel=0.02)
    assert mapped_surface(np.zeros((9, 9), np.float32), 10.0).friction_factor == 1
    rising = np.tile(np.arange(64.0), (8, 1)) / 64  # of which the drum is too narrow for the most
    assert 0.8 < mapped_surface(rising, 12.0).friction_factor < 1


def test_the_page_of_the_rig_names_every_nuisance_and_says_how_drums_with_bumps_rub():
    page = (Path(__file__).parents[3] / "docs" / "rig.md").read_text(encoding="utf-8")
    assert [name for name in NUISANCES if f"`{name}`" not in page] == []
    surfaces = [bumped_surface(spacing_mm, Rig().drum) for spacing_mm in (0.0, 3.0, 6.0)]
    rub = [f"{surface.friction_factor:.2f}" for surface in surfaces]
    assert rub == ["1.00", "0.78", "0.78"]
    assert "0.78 of that on the smooth one" in " ".join(page.split())
