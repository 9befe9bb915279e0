"""What lies in a results folder: each field is explained, and what makes no sense is named."""

import json

import pytest

from afferents.errors import InputError
from afferents.evaluation.fold_files import Epoch, FoldFacts
from afferents.evaluation.job_status import Failed, Plan, Running
from afferents.evaluation.results import texture_summaries
from afferents.evaluation.schemas import (
    Comparison,
    FirstEpoch,
    Intervals,
    Lost,
    OfTouches,
    Outcome,
    Reliability,
    RoughnessOutcome,
    RoughnessSummary,
    Summary,
    UnknownBySpeed,
    UnknownOutcome,
    UnknownSummary,
    UnknownTexture,
)

SHARES = {"mean": 0.5, "ci95": [0.4, 0.6]}
BY_SPEED = {"10": 0.4, "12.5": 0.5, "20": 0.6}
UNIT = {**SHARES, "inside": SHARES, "outside": SHARES, "by_speed": BY_SPEED}
UNITS = {"samples": UNIT, "recordings": UNIT}
AREAS = {"samples": 0.9, "recordings": 1}
ABOUT = {
    "schema": 2,
    "afferents": "0",
    "data": [
        {
            "source": "s",
            "kind": "store",
            "fingerprint": "f",
            "n_recordings": 6,
            "simulated": False,
        }
    ],
    "options": [],
    "cut": "all",
    "preset": "none",
    "textures": ["1", "2"],
    "speeds_mm_s": [10, 12.5, 20],
    "skipped": [],
}


def unknown(**changed):
    texture = {"found_samples": 0.5, "found_recordings": 1, "false_alarms": 0.01, "auroc": 0.9}
    outcome = {
        "found": UNITS,
        "false_alarms": UNITS,
        "auroc": AREAS,
        "auroc_inside": AREAS,
        "auroc_outside": AREAS,
        "auroc_by_speed": {"10": 0.9},
        "n": 6,
        "by_texture": {"1": texture, "2": texture},
        **changed,
    }
    stated = {"false_alarms_stated": 0.01, "intervals": {"replicate": "texture", "n": 2}}
    return {**ABOUT, **stated, "models": {"sa-wave": outcome}}


def roughness(**changed):
    outcome = {
        "mae_mm": 0.5,
        "mae_mm_inside": None,
        "mae_mm_recordings": 0.4,
        "by_speed": {"10": 0.5},
        "by_spacing": {"1": 0.5},
        "covered": 0.9,
        "half_interval_mm": 1,
        "n": 6,
        **changed,
    }
    return {**ABOUT, "coverage_asked": 0.9, "models": {"sa-wave": {"seen": outcome}}}


def read(folder, of_unknown, of_roughness):
    (folder / "unknown.json").write_text(json.dumps(of_unknown))
    (folder / "roughness.json").write_text(json.dumps(of_roughness))
    return texture_summaries(folder)


def test_summaries_are_as_they_stand_in_their_files(tmp_path):
    assert texture_summaries(tmp_path) == {}
    expected = {"unknown": unknown(), "roughness": roughness()}
    found = read(tmp_path, *expected.values())
    assert {name: one.content() for name, one in found.items()} == expected


@pytest.mark.parametrize(
    ("of_unknown", "of_roughness", "said"),
    [
        ({}, roughness(), "unknown.json: expected .* with the key 'schema', found none"),
        (unknown(found=5), roughness(), "models.sa-wave.found: an object, found 5"),
        (unknown(by_texture={}), roughness(), "models.sa-wave.by_texture must have 1"),
        (unknown(auroc={"samples": None, "recordings": 1}), roughness(), "auroc must be a number"),
        (unknown(), {**ABOUT}, "roughness.json: expected .* with the key 'coverage_asked'"),
        (unknown(), roughness(mae_mm=-1), "seen.mae_mm: greater than or equal to 0, found -1"),
        (unknown(), roughness(covered=5), "seen.covered: less than or equal to 1, found 5"),
        (unknown(), roughness(by_speed={"../x": 1}), r"by_speed.../x.\[key\]: "),
        (unknown(), roughness(by_spacing={}), "seen.by_spacing: "),
    ],
)
def test_summaries_that_make_no_sense_are_named(tmp_path, of_unknown, of_roughness, said):
    with pytest.raises(InputError, match=said):
        read(tmp_path, of_unknown, of_roughness)


@pytest.mark.parametrize(
    "schema",
    [
        *(Summary, Outcome, OfTouches, Reliability, FirstEpoch, Intervals, Lost, Comparison),
        *(UnknownSummary, UnknownOutcome, UnknownBySpeed, UnknownTexture),
        *(RoughnessSummary, RoughnessOutcome, FoldFacts, Epoch, Plan, Running, Failed),
    ],
)
def test_each_field_says_what_it_is(schema):
    """The tables of docs/results-format.md are made of it."""
    assert [name for name, field in schema.model_fields.items() if not field.description] == []
